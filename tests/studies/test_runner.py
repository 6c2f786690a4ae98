import hashlib
import json
import os

import pytest
import work

from kinverse.errors import InputError, KinverseError
from kinverse.studies.runner import run, run_studies


def go(study, out, **settings):
    settings = {"quick": False, **settings}
    [made] = run_studies([(study, study.tables)], out=out, **settings)
    return made


def calls(log):
    return sorted(int(n) for n in log.read_text().split()) if log.exists() else []


@pytest.fixture
def log(tmp_path):
    return tmp_path / "log.txt"


def test_rows_of_all_cells_arrive_and_a_second_run_computes_nothing(tmp_path, log):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    first = go(study, tmp_path)
    second = go(study, tmp_path)
    assert [row["square"] for row in first.tables["t"].rows] == [0, 1, 4, 9, 16]
    assert second.tables["t"].rows == first.tables["t"].rows
    assert (first.computed, second.computed) == (5, 0)
    assert calls(log) == [0, 1, 2, 3, 4]


def test_equal_cells_run_once_whatever_table_study_or_name_they_have(tmp_path, log):
    cells = work.cells(work.squares, log)
    others = [type(c)(f"other-{c.name}", c.function, c.arguments) for c in cells]
    a = work.study_of(work.table_of("t", cells), work.table_of("u", cells[:3]), name="a")
    b = work.study_of(work.table_of("t", others), name="b")
    one, two = run_studies([(a, a.tables), (b, b.tables)], quick=False, out=tmp_path)
    assert calls(log) == [0, 1, 2, 3, 4]
    assert one.tables["t"].rows == two.tables["t"].rows
    assert len(one.tables["u"].rows) == 3
    assert go(b, tmp_path).computed == 0


def again(text, **changed):
    """A record with other values whose checksum is right."""
    record = {**json.loads(text), **changed}
    whole = {name: record[name] for name in ("rows", "seconds", "machine", "date")}
    record["checksum"] = hashlib.sha256(json.dumps(whole).encode()).hexdigest()
    return json.dumps(record)


def test_a_right_checksum_is_trusted(tmp_path, log):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    go(study, tmp_path)
    file = tmp_path / "toy" / "cells" / "squares-2.json"
    file.write_text(again(file.read_text(), seconds=7.5))
    made = go(study, tmp_path)
    assert made.computed == 0 and made.cells["squares-2"][1].seconds == 7.5


@pytest.mark.parametrize(
    "name", ["cells/squares-2.json", "t.csv", "index.html", "cells-work.squares.csv", "cells"]
)
def test_what_is_no_file_in_place_of_one_is_told_before_any_work(tmp_path, log, name):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    place = tmp_path / "toy" / name
    place.parent.mkdir(parents=True, exist_ok=True)
    if name == "cells":
        place.write_text("")
    else:
        place.mkdir()
    with pytest.raises(InputError, match=f"{place}"):
        go(study, tmp_path)
    assert calls(log) == []


def test_a_pipe_in_place_of_a_cell_is_told_and_not_waited_for(tmp_path, log):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    (tmp_path / "toy" / "cells").mkdir(parents=True)
    os.mkfifo(tmp_path / "toy" / "cells" / "squares-2.json")
    with pytest.raises(InputError, match="has to be a file and is none: remove it"):
        go(study, tmp_path)


@pytest.mark.parametrize(
    "harm",
    [
        lambda text: text[: len(text) // 2],
        lambda text: "",
        lambda text: text.replace('"square": 4', '"square": 5'),
        lambda text: "[1, 2]",
        lambda text: text.replace('"checksum"', '"sum"'),
        lambda text: "[" * 100_000 + "]" * 100_000,
        lambda text: '{"rows": ' * 100_000 + "1" + "}" * 100_000,
        lambda text: again(text, seconds=float("nan")),
        lambda text: again(text, seconds=-1.0),
        lambda text: again(text, seconds=10**400),
        lambda text: again(text, seconds="1"),
        lambda text: again(text, machine=None),
        lambda text: again(text, machine={"processor": 1}),
        lambda text: again(text, date="once"),
        lambda text: again(text, rows=[{"square": float("inf")}]),
        lambda text: text.replace('"seconds": ', '"seconds": 1'),
    ],
)
def test_a_damaged_file_is_computed_again(tmp_path, log, harm):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    first = go(study, tmp_path)
    file = tmp_path / "toy" / "cells" / "squares-2.json"
    file.write_text(harm(file.read_text()))
    again = go(study, tmp_path)
    assert again.computed == 1
    assert again.tables["t"].rows == first.tables["t"].rows
    assert json.loads(file.read_text())["rows"][0]["square"] == 4


def test_other_arguments_or_another_function_are_other_work(tmp_path, log):
    cells = work.cells(work.squares, log)
    go(work.study_of(work.table_of("t", cells)), tmp_path)
    cells[1] = type(cells[1])(cells[1].name, work.squares, {"n": 7, "log": str(log)})
    cells[2] = type(cells[2])(cells[2].name, work.slow, cells[2].arguments)
    made = go(work.study_of(work.table_of("t", cells)), tmp_path)
    assert made.computed == 2
    assert sorted(row["n"] for row in made.tables["t"].rows) == [0, 2, 3, 4, 7]


def test_other_code_is_other_work(tmp_path, log, monkeypatch):
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    go(study, tmp_path)
    monkeypatch.setattr("kinverse.studies.runner.source_hash", lambda module: "changed")
    assert go(study, tmp_path).computed == 5


def test_a_failing_cell_is_named_and_the_rest_goes_on(tmp_path, log):
    bad = work.table_of("bad", work.cells(work.squares_but_three, log))
    good = work.table_of("good", work.cells(work.squares_but_three, log, count=3))
    made = go(work.study_of(bad, good), tmp_path)
    assert list(made.tables) == ["good"] and not made.ok
    cell, table = made.failures
    assert cell.what == "cell squares_but_three-3"
    assert cell.error == "ArithmeticError: three is refused"
    assert "in squares_but_three" in cell.trace
    assert table.what == "table bad" and "squares_but_three-3" in table.error
    assert calls(log) == [0, 1, 2, 4]
    assert calls(log) == [0, 1, 2, 4]
    assert not go(work.study_of(bad, good), tmp_path).ok  # what failed is tried again


def test_a_table_that_cannot_be_built_is_named(tmp_path, log):
    spec = work.table_of("t", work.cells(work.squares, log))
    broken = type(spec)("broken", "", spec.cells, lambda rows: rows["nothing"])
    made = go(work.study_of(broken, spec), tmp_path)
    assert [f.what for f in made.failures] == ["table broken"]
    assert list(made.tables) == ["t"]


@pytest.mark.parametrize("function", [work.returns_nan, work.returns_an_array])
def test_rows_that_no_file_can_hold_are_failures(tmp_path, log, function):
    made = go(work.study_of(work.table_of("t", work.cells(function, log, count=1))), tmp_path)
    assert "'value'" in made.failures[0].error


def test_ctrl_c_keeps_what_is_finished_and_a_second_run_goes_on(tmp_path, log):
    study = work.study_of(work.table_of("t", work.cells(work.interrupted_at_two, log)))
    with pytest.raises(KeyboardInterrupt):
        go(study, tmp_path)
    before = calls(log)
    assert before == [0, 1]
    log.with_suffix(".again").touch()
    made = go(study, tmp_path)
    assert made.computed == 3 and calls(log) == [0, 1, 2, 3, 4]
    assert not list(tmp_path.rglob("*.part"))


def test_rows_do_not_depend_on_the_order_of_the_cells(tmp_path, log):
    cells = work.cells(work.slow, log)
    one = go(work.study_of(work.table_of("t", cells)), tmp_path / "one", jobs=2)
    two = go(work.study_of(work.table_of("t", cells[::-1])), tmp_path / "two")
    assert one.tables["t"].rows == two.tables["t"].rows


def test_workers_have_one_thread(tmp_path, log):
    study = work.study_of(work.table_of("t", work.cells(work.threads, log, count=2)))
    for jobs in (None, 2):
        made = go(study, tmp_path / str(jobs), jobs=jobs)
        assert [row["threads"] for row in made.tables["t"].rows] == [1, 1]


def test_a_worker_that_dies_is_told_and_finished_cells_are_kept(tmp_path, log):
    good = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    go(good, tmp_path)
    cells = [*work.cells(work.squares, log), *work.cells(work.ends_its_process, log, count=1)]
    with pytest.raises(KinverseError, match="worker process .* run again"):
        go(work.study_of(work.table_of("t", cells)), tmp_path, jobs=2)
    assert go(good, tmp_path).computed == 0


def test_quick_cells_do_not_overwrite_those_of_the_full_run(tmp_path, log):
    spec = work.table_of("t", [])
    depth = type(spec)("t", "", lambda quick: work.cells(work.squares, log)[quick:], spec.build)
    study = work.study_of(depth)
    assert go(study, tmp_path).computed == 5
    assert go(study, tmp_path, quick=True).computed == 4
    assert go(study, tmp_path).computed == 0


def test_progress_ends_at_one_and_never_falls(tmp_path, log):
    seen = []
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    go(study, tmp_path, progress=lambda text, share: seen.append((text, share)))
    shares = [share for _, share in seen]
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(seen) == 6
    assert seen[-1][0].startswith("squares-")


def test_two_cells_of_one_name_are_refused(tmp_path, log):
    a, b = work.cells(work.squares, log)[:2]
    twin = type(b)(a.name, b.function, b.arguments)
    with pytest.raises(InputError, match="two cells are named 'squares-0'"):
        go(work.study_of(work.table_of("t", [a, twin])), tmp_path)


def test_a_cell_name_that_leaves_the_folder_is_refused(tmp_path, log):
    [cell] = work.cells(work.squares, log, count=1)
    bad = type(cell)("../x", cell.function, cell.arguments)
    with pytest.raises(InputError, match="cell name"):
        go(work.study_of(work.table_of("t", [bad])), tmp_path)


def test_a_folder_that_cannot_be_written_is_told_before_any_work(tmp_path, log):
    (tmp_path / "file").write_text("")
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    with pytest.raises(InputError, match="cannot write in .*file"):
        go(study, tmp_path / "file")
    assert calls(log) == []


def test_unknown_names_are_told_with_the_known_ones(tmp_path):
    with pytest.raises(InputError, match="no study 'nobody1999'; there are .*jha2015"):
        run("nobody1999", out=tmp_path)
    with pytest.raises(InputError, match="no table '9.9'; it has .*7.7"):
        run("jha2015", "9.9", out=tmp_path)
    with pytest.raises(InputError, match="of which study"):
        run("all", "7.7", out=tmp_path)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # the cluster's own
def test_a_dask_cluster_takes_cells(tmp_path, log):
    distributed = pytest.importorskip("distributed")
    joblib = pytest.importorskip("joblib")
    study = work.study_of(work.table_of("t", work.cells(work.squares, log)))
    here = go(study, tmp_path / "here")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    )
    with cluster, distributed.Client(cluster), joblib.parallel_config(backend="dask"):
        there = go(study, tmp_path / "there")
    assert there.computed == 5
    assert there.tables["t"].rows == here.tables["t"].rows

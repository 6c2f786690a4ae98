"""``kinverse study``: what it prints, writes and returns."""

import pytest
import work

from kinverse.cli import main


def said(capsys, *words):
    code = main(["study", *map(str, words)])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """The only study there is."""
    cells = work.cells(work.squares, tmp_path / "log")
    study = work.study_of(work.table_of("a", cells), work.table_of("b", cells[:2]))

    def use(study):
        for module in ("runner", "registry"):
            monkeypatch.setattr(f"kinverse.studies.{module}.load_study", lambda name: study)
            monkeypatch.setattr(f"kinverse.studies.{module}.study_names", lambda: ["toy"])
        monkeypatch.setattr("kinverse.cli._study.load_study", lambda name: study)
        monkeypatch.setattr("kinverse.cli._study.study_names", lambda: ["toy"])

    use(study)
    return use


def test_without_a_name_the_studies_are_listed(capsys):
    code, out, _ = said(capsys)
    assert code == 0 and "jha2015" in out and "tables" in out


def test_tables_are_printed_and_written(capsys, tmp_path, toy):
    code, out, _ = said(capsys, "toy", "--out", tmp_path, "--jobs", 1)
    assert code == 0
    assert "ours, nothing printed: 0 mm at most" in out
    assert "2 tables from 5 cells, 5 computed now" in out
    assert (tmp_path / "toy" / "index.html").is_file()
    assert len((tmp_path / "toy" / "a.csv").read_text().splitlines()) == 6
    assert "0 computed now" in said(capsys, "all", "--out", tmp_path, "--jobs", 1)[1]


def test_one_table(capsys, tmp_path, toy):
    code, out, _ = said(capsys, "toy", "--table", "b", "--out", tmp_path, "--quick", "--jobs", 1)
    assert code == 0 and "table b" in out and "table a" not in out
    assert "ours, nothing printed (quick run, not for conclusions): 0 mm at most" in out


def test_wide_and_long_tables_are_cut_and_say_where_the_rest_is(capsys, tmp_path, toy):
    from kinverse.studies.cell import Cell

    cell = Cell("wide", wide, {})
    toy(work.study_of(work.table_of("w", [cell])))
    code, out, _ = said(capsys, "toy", "--out", tmp_path, "--jobs", 1)
    assert code == 0 and "8 more rows and" in out and "more columns in" in out
    assert "w.csv" in "".join(out.split())
    assert max(map(len, out.splitlines())) <= 80


def wide():
    return [{f"column {k}": k * row for k in range(30)} for row in range(20)]


def test_a_failing_cell_is_told_and_the_status_is_one(capsys, tmp_path, toy):
    bad = work.cells(work.squares_but_three, tmp_path / "log")
    toy(work.study_of(work.table_of("a", bad), work.table_of("b", bad[:2])))
    code, out, err = said(capsys, "toy", "--out", tmp_path, "--jobs", 1)
    assert code == 1 and "table b" in out
    assert "failed: toy: cell squares_but_three-3: ArithmeticError: three is refused" in err


def test_ctrl_c_says_that_nothing_is_lost(capsys, tmp_path, toy):
    cells = work.cells(work.interrupted_at_two, tmp_path / "log")
    toy(work.study_of(work.table_of("a", cells)))
    code, _, err = said(capsys, "toy", "--out", tmp_path, "--jobs", 1)
    assert code == 130 and "finished cells are kept" in err and "interrupted" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nobody"], "there is no study 'nobody'; there are"),
        (["jha2015", "--table", "9.9"], "jha2015 has no table '9.9'; it has fig-7.1, 7.1, 7.2"),
        (["all", "--table", "7.7"], "of which study"),
        (["--table", "7.7"], "--table needs a study"),
        (["jha2015", "--jobs", "0"], "--jobs"),
        (["jha2015", "--out", "/proc/nothing"], "cannot write in /proc/nothing"),
    ],
)
def test_bad_input_is_told_in_one_line(capsys, words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = said(capsys, *words)
    assert code == 2 and told in err and err.count("\n") == 1 and not out
    assert not list(tmp_path.rglob("*.json"))


def test_tables_are_listed_with_what_they_cover(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    code, out, _ = said(capsys, "jha2015", "--list")
    assert code == 0 and "7.29 7.32" in out and "Regression of the perceptron" in out
    code, out, _ = said(capsys, "all", "--list")
    assert code == 0 and "fig-8" in out and "figs-17-20" in out


def test_all_prints_a_line_for_each_table(capsys, tmp_path, toy):
    code, out, _ = said(capsys, "all", "--out", tmp_path, "--jobs", 1)
    assert code == 0 and "a: ours, nothing printed: 0 mm at most" in out and "table a" not in out

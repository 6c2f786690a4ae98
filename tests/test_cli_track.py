"""``kinverse track``: what it writes, refuses and returns."""

import csv
import json

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.cli import main
from kinverse.paths import named_samples

HEAD = ["x", "y", "z", "qw", "qx", "qy", "qz"]


def run(capsys, *argv):
    code = main(list(map(str, argv)))
    said = capsys.readouterr()
    return code, said.out, said.err


def written(path, T):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(HEAD)
        for one in T:
            quat = kv.se3.quat_from_rotation(one[:3, :3])
            writer.writerow([repr(float(v)) for v in (*one[:3, 3], *quat)])
    return path


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def arm():
    return kv.load("kr16")


@pytest.fixture(scope="module")
def whole(arm, tmp_path_factory):
    return written(tmp_path_factory.mktemp("whole") / "path.csv", arm.fk(cases.path(arm, 30)))


@pytest.fixture(scope="module")
def broken(arm, tmp_path_factory):
    T = arm.fk(cases.path(arm, 30))
    T[10:13, 0, 3] += 9.0
    return written(tmp_path_factory.mktemp("broken") / "path.csv", T)


def test_a_whole_path_is_written(capsys, arm, whole, tmp_path):
    out, picture = tmp_path / "joints.csv", tmp_path / "joints.png"
    code, said, err = run(
        capsys, "track", "kr16", whole, "--out", out, "--plot", picture, "--degrees"
    )
    assert code == 0 and "30 of 30 poses tracked in 1 runs" in said and "drawn" in err
    rows = rows_of(out)
    assert [row["row"] for row in rows] == [str(k) for k in range(1, 31)]
    q = np.radians([[float(row[f"joint{j}_deg"]) for j in range(1, 7)] for row in rows])
    assert np.allclose(arm.fk(q), arm.fk(cases.path(arm, 30)), atol=1e-6)
    assert {row["status"] for row in rows} == {"TRACKED"} and rows[0]["label"]
    assert picture.stat().st_size > 1000


def test_gaps_are_told(capsys, broken, tmp_path):
    out = tmp_path / "joints.csv"
    code, said, _ = run(capsys, "track", "kr16", broken, "--out", out)
    assert code == 1
    assert "rows 11 to 13: OUT_OF_REACH" in said
    rows = rows_of(out)
    assert [row["status"] for row in rows[9:14]] == [
        *("TRACKED", "OUT_OF_REACH", "OUT_OF_REACH", "OUT_OF_REACH", "TRACKED")
    ]
    assert rows[9]["run"] == "1" and rows[13]["run"] == "2" and rows[10]["joint1_rad"] == ""
    code, said, _ = run(capsys, "track", "kr16", broken, "--json")
    told = json.loads(said)
    assert code == 1 and told["runs"] == [[1, 10], [14, 30]]
    assert told["gaps"][0]["reason"] == "OUT_OF_REACH" and told["rows"][11]["q"] is None


def test_options_reach_the_search(capsys, arm, whole, tmp_path):
    q = cases.path(arm, 30)[0]
    other = kv.solve(arm, arm.fk(q)).q[-1]
    out = tmp_path / "joints.json"
    values = [f"{v:.9f}" for v in np.degrees(other)]
    code, _, _ = run(
        capsys, "track", "kr16", whole, "--degrees", "--out", out, "--q-start", *values
    )
    first = json.loads(out.read_text())["rows"][0]["q"]
    assert np.allclose(first, np.degrees(other), atol=1e-4)
    small = run(capsys, "track", "kr16", whole, "--degrees", "--max-step", 0.001)
    assert small[0] == 1 and "STEP" in small[1]
    assert run(capsys, "track", "kr16", whole, "--metric", "l2", "--solver", "analytic")[0] == 0


@pytest.mark.parametrize(
    "options, said",
    [
        (["--metric", "mean"], "metric"),
        (["--out", "joints.txt"], ".csv or .json"),
        (["--out", "nowhere/joints.csv"], "no folder"),
        (["--plot", "joints.gif"], "--plot must end"),
        (["--max-step", "0"], "max_step"),
        (["--q-start", "1", "2"], "--q-start needs 6"),
        (["--solver", "magic"], "unknown solver"),
    ],
)
def test_bad_options_are_refused(capsys, whole, options, said):
    code, out, err = run(capsys, "track", "kr16", whole, *options)
    assert code == 2 and out == "" and said in err and err.count("\n") == 1


def test_paths_of_the_documents_have_names(capsys, tmp_path):
    code, said, _ = run(capsys, "track", "kr16", "masajedi_straight")
    assert code == 0 and "21 of 21 poses tracked" in said
    np.savez(tmp_path / "path.npz", T=named_samples("masajedi_straight").T)
    assert run(capsys, "track", "kr16", tmp_path / "path.npz")[1] == said
    code, out, err = run(capsys, "track", "kr16", "masajedi")
    assert code == 2 and out == "" and "unknown path 'masajedi'" in err and "habibkhah_4" in err


def test_bad_files_are_refused(capsys, arm, tmp_path):
    one = written(tmp_path / "one.csv", arm.fk(np.zeros((1, 6))))
    assert "two poses" in run(capsys, "track", "kr16", one)[2]
    nan = tmp_path / "nan.csv"
    nan.write_text(",".join(HEAD) + "\n1,0,1,1,0,0,0\n1,0,nan,1,0,0,0\n")
    code, _, err = run(capsys, "track", "kr16", nan)
    assert code == 2 and "row 2" in err
    code, _, err = run(capsys, "track", "kr16", tmp_path / "missing.csv")
    assert code == 2 and "no such file" in err

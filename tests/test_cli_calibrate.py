"""``kinverse calibrate``: what it prints, what it saves and what it refuses."""

import csv
import json

import numpy as np
import pytest

import kinverse as kv
from kinverse import calibration
from kinverse.bench.real_arm import TARGET_POINT, real_arm
from kinverse.cli import main

ROBOT = kv.load("kr16")


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    """A hundred measurements of a KR16's flange, and the model they were made with."""
    rng = np.random.default_rng(1)
    arm = real_arm(rng)
    q = ROBOT.random(100, rng)
    T = arm.pose(q)
    # the flange: the reflector's place is taken off again
    points = T[:, :3, 3] - T[:, :3, :3] @ TARGET_POINT + rng.normal(0, 2e-5, (100, 3))
    path = tmp_path_factory.mktemp("cli") / "measured.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        head = [f"{name} [deg]" for name in ROBOT.joint_names]
        writer.writerow(["time", *head, "x [mm]", "y [mm]", "z [mm]"])
        for row in np.hstack([np.degrees(q), 1e3 * points]):
            writer.writerow(["now", *map(repr, row.tolist())])
    return path


def run(capsys, *argv):
    code = main(["calibrate", *map(str, argv)])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_models_are_compared_and_the_best_is_saved(capsys, sheet, tmp_path):
    out = tmp_path / "model.npz"
    code, said, notes = run(
        capsys, "kr16", sheet, "--model", "fourier:1", "--model", "geometric", "--out", out
    )
    assert code == 0
    names = [line.split()[0] for line in said.splitlines() if line.strip()]
    assert names.index("geometric") < names.index("fourier:1") < names.index("none")
    assert "chosen: geometric, " in said and "mm before" in said and f"saved to {out}" in said
    assert "columns that were not read: time" in notes
    measured = calibration.read_measurements(sheet, ROBOT)
    model = calibration.load(out)
    expected = calibration.make_model("geometric", ROBOT).fit(measured.q, measured.error)
    assert np.array_equal(model.predict(measured.q), expected.predict(measured.q))
    # and what was saved corrects the arm
    solver = calibration.Compensated(kv.Analytic(), model).fit(ROBOT)
    assert solver.solve(ROBOT.fk(measured.q[:5])).ok.all()


def test_json_holds_every_figure_in_metres(capsys, sheet):
    code, said, _ = run(capsys, "kr16", sheet, "--json", "--folds", 3)
    told = json.loads(said)
    assert code == 0 and told["robot"] == "kr16" and told["measurements"] == 100
    table = {row["name"]: row["rms"] for row in told["table"]}
    assert len(table) == 10 and told["chosen"] == min(table, key=table.get)
    measured = calibration.read_measurements(sheet, ROBOT)
    assert table["none"] == pytest.approx(np.sqrt((measured.error**2).sum(axis=1).mean()))
    assert table[told["chosen"]] < 0.2 * table["none"]
    assert run(capsys, "kr16", sheet, "--json", "--folds", 3)[1] == said
    assert run(capsys, "kr16", sheet, "--json", "--folds", 3, "--rng", 1)[1] != said


def test_too_few_measurements_are_remarked_and_nothing_better_is_status_one(
    capsys, sheet, tmp_path
):
    few = tmp_path / "few.csv"
    few.write_text("\n".join(sheet.read_text().splitlines()[:21]) + "\n")
    code, said, notes = run(capsys, "kr16", few, "--model", "polynomial:12")
    assert "16 measurements for 73 parameters" in notes and notes.count("73 parameters") == 1
    assert code == 1 and "chosen: none" in said


def test_a_choice_that_rests_on_few_measurements_is_remarked_last(capsys, sheet, tmp_path):
    rows = sheet.read_text().splitlines()
    few = tmp_path / "few.csv"
    few.write_text("\n".join(rows[:9]) + "\n")
    code, said, notes = run(capsys, "kr16", few)
    assert code == 0 and "chosen: fourier:1" in said
    # 13 parameters of each coordinate
    last = notes.splitlines()[-1]
    assert "8 postures are few for fourier:1: 0.62 measured numbers for each" in last
    assert "measure 26 or more" in last
    assert "are few" not in run(capsys, "kr16", sheet, "--model", "geometric")[2]


def test_repeats_and_large_errors_are_remarked(capsys, sheet, tmp_path):
    head, *rows = sheet.read_text().splitlines()
    again = tmp_path / "again.csv"
    again.write_text("\n".join([head, *rows[:30], *rows[:30]]) + "\n")
    model = ("--model", "geometric")
    code, said, notes = run(capsys, "kr16", again, *model, "--json")
    assert code == 0 and "30 different postures: repeats of one are held back together" in notes
    assert json.loads(said)["measurements"] == 60 and json.loads(said)["postures"] == 30
    # z from another floor: a base frame that is not the robot's, and no error of the arm
    high = tmp_path / "high.csv"
    cells = [row.rsplit(",", 1) for row in rows]
    high.write_text("\n".join([head, *(f"{a},{float(z) + 100.0!r}" for a, z in cells)]) + "\n")
    code, _, notes = run(capsys, "kr16", high, *model)
    assert code == 0 and "m in the base frame" in notes and "postures" not in notes


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--model", "wavelet:2"], "unknown error model 'wavelet:2'"),
        (["--folds", "1"], "folds"),
        (["--folds", "101"], "100 measurements make no 101 folds"),
        (["--rng", "-1"], "--rng"),
        (["--out", "model.pkl"], "--out must be an .npz"),
        (["--out", "/nowhere/at/all/model.npz"], "--out must be an .npz"),
        (["--base", "link"], "base"),
    ],
)
def test_bad_options_are_refused_in_one_line(capsys, sheet, more, said):
    code, out, err = run(capsys, "kr16", sheet, *more)
    assert code == 2 and out == "" and err.count("\n") == 1
    assert err.startswith("kinverse: error: ") and said in err


def test_bad_files_are_refused_in_one_line(capsys, sheet, tmp_path):
    text = sheet.read_text()
    for name, altered, said in (
        ("unit", text.replace("x [mm]", "x"), "column 'x' has no unit"),
        ("order", text.replace("x [mm],y [mm]", "y [mm],x [mm]"), "read as y, x, z"),
        ("empty", "", "empty"),
    ):
        (tmp_path / f"{name}.csv").write_text(altered)
        code, out, err = run(capsys, "kr16", tmp_path / f"{name}.csv")
        assert code == 2 and out == "" and said in err and err.count("\n") == 1
    assert run(capsys, "kr16", tmp_path / "nowhere.csv")[0] == 2
    assert run(capsys, "no such robot", sheet)[0] == 2

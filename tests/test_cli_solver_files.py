"""``--solver FILE``, ``--error-model FILE`` and ``--tool``: whose answers they give."""

import csv
import json

import numpy as np
import pytest

import kinverse as kv
from kinverse import calibration
from kinverse.cli import main
from kinverse.paths import track

TOOL = ["--tool", 0.05, 0.02, 0.1]
ROBOT = kv.load("kr16").with_tool(kv.pose([0.05, 0.02, 0.1]))
# what the arm really is: its base is not quite where it is said to be
REAL = ROBOT.with_base(kv.pose([0.003, -0.002, 0.001], rpy=[0.001, 0.0, -0.002]))


def run(capsys, *argv):
    code = main(list(map(str, argv)))
    said = capsys.readouterr()
    return code, said.out, said.err


def sheet(path, q, points):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*(f"joint{j} [rad]" for j in range(1, 7)), "x [m]", "y [m]", "z [m]"])
        for row in np.hstack([q, points]).tolist():
            writer.writerow(map(repr, row))
    return path


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Where a point beside the flange was measured, in sixty postures."""
    q = ROBOT.random(60, 1)
    points = REAL.fk(q)[:, :3, 3] + np.random.default_rng(2).normal(0, 1e-5, (60, 3))
    return sheet(tmp_path_factory.mktemp("calibrate") / "measured.csv", q, points)


@pytest.fixture
def model(capsys, measured, tmp_path):
    """The error model of these, by the command line."""
    out = tmp_path / "model.npz"
    command = ["calibrate", "kr16", measured, *TOOL, "--model", "geometric", "--out", out]
    code, said, err = run(capsys, *command)
    assert code == 0 and err == "" and "chosen: geometric, 4." in said
    return out


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A small solver of a SCARA arm."""
    out = tmp_path_factory.mktemp("train") / "scara.npz"
    small = ["--network", "mlp", "--set", "hidden=10", "--set", "max_iter=10", "--samples", "400"]
    assert main(["train", "adept_one", *small, "--out", str(out)]) == 0
    return out


# ---------------------------------------------------------------------------- error models
def test_solve_answers_for_the_real_tool(capsys, model, tmp_path):
    T = ROBOT.fk([[0.3, -1.2, 1.3, 0.3, 0.8, 0.1], [-0.4, -1.5, 1.1, -0.6, 0.9, 1.0]])
    np.save(tmp_path / "poses.npy", T)
    command = ["solve", "kr16", "--matrix", tmp_path / "poses.npy", *TOOL, "--json"]
    for options, most in (([], 1e-6), (["--error-model", model], 5e-5)):
        code, said, _ = run(capsys, *command, *options)
        assert code == 0
        real = REAL if options else ROBOT
        for target, pose in zip(T, json.loads(said)["poses"], strict=True):
            assert len(pose["solutions"]) >= 4
            for solution in pose["solutions"]:
                off = real.fk(solution["q"])[:3, 3] - target[:3, 3]
                assert np.linalg.norm(off) < most


@pytest.mark.parametrize("solver", ["auto", "numerical"])
def test_track_follows_with_the_real_tool(capsys, model, tmp_path, solver):
    q = np.linspace([0.3, -1.2, 1.3, 0.3, 0.8, 0.1], [0.5, -1.1, 1.2, 0.4, 0.7, 0.2], 12)
    T = ROBOT.fk(q)
    np.save(tmp_path / "poses.npy", T)
    command = ["track", "kr16", tmp_path / "poses.npy", *TOOL, "--solver", solver, "--json"]
    code, said, _ = run(capsys, *command, "--error-model", model)
    rows = np.array([row["q"] for row in json.loads(said)["rows"]])
    assert code == 0
    assert np.linalg.norm((REAL.fk(rows) - T)[:, :3, 3], axis=1).max() < 5e-5
    assert np.linalg.norm((ROBOT.fk(rows) - T)[:, :3, 3], axis=1).min() > 1e-3


def test_an_error_model_is_for_its_own_tool(capsys, model, measured, tmp_path):
    pose = ["--pose", 0.9, 0.1, 1.2, 0.2, 1.5, 0.3]
    for options in ([], ["--tool", 0.05, 0.02, 0.2]):
        code, out, err = run(capsys, "solve", "kr16", *pose, "--error-model", model, *options)
        assert code == 2 and out == "" and "give the --tool it was calibrated with" in err
    # polynomials know no robot of their own: the file does
    by_joints = tmp_path / "fourier.npz"
    command = ["calibrate", "kr16", measured, *TOOL, "--model", "fourier:1", "--out", by_joints]
    assert run(capsys, *command)[0] == 0
    code, _, err = run(capsys, "solve", "kr16", *pose, "--error-model", by_joints)
    assert code == 2 and "measured on 'kr16'" in err
    assert run(capsys, "solve", "kr16", *pose, *TOOL, "--error-model", by_joints)[0] == 0
    # written without its robot it says nothing of it
    calibration.save(calibration.load(by_joints), by_joints)
    assert calibration.measured_robot(by_joints) is None
    assert run(capsys, "solve", "kr16", *pose, "--error-model", by_joints)[0] == 0


# ---------------------------------------------------------------------------- trained solvers
def test_track_takes_a_trained_solver(capsys, trained, tmp_path):
    robot = kv.load("adept_one")
    q = np.linspace([0.2, 0.9, 0.05, 0.3], [0.4, 1.1, 0.1, 0.6], 15)
    np.save(tmp_path / "poses.npy", robot.fk(q))
    command = ["track", "adept_one", tmp_path / "poses.npy", "--json", "--q-start", *q[0]]
    code, said, _ = run(capsys, *command, "--solver", trained)
    rows = np.array([row["q"] for row in json.loads(said)["rows"]])
    assert code == 0
    np.testing.assert_allclose(rows, q, atol=1e-5)
    told = run(capsys, "simulate", "adept_one", command[2], "--solver", trained, "--json")
    assert told[0] == 0 and json.loads(told[1])["ok"]


def test_files_that_do_not_suit_are_refused_in_one_line(capsys, trained, model, tmp_path):
    pose = ["--pose", 0.9, 0.1, 1.2, 0.2, 1.5, 0.3]
    path = ["track", "kr16", "masajedi_straight"]
    for command, said in (
        ([*path, "--solver", trained], "trained for the robot 'adept_one', not for 'kr16'"),
        ([*path, "--solver", model], "holds a error model, not a trained solver"),
        ([*path, "--solver", tmp_path / "no.npz"], "no such file"),
        ([*path, "--error-model", trained], "holds a trained solver, not a error model"),
        ([*path, "--error-model", tmp_path / "no.npz"], "no such file"),
        ([*path, "--error-model", model, "--solver", trained], "not with a trained file"),
        (
            [*path, *TOOL, "--error-model", model, "--max-velocity", 1, "--max-acceleration", 4],
            "--error-model does not go with --max-acceleration",
        ),
        (["solve", "kr16", *pose, "--error-model", model, "--solver", "magic"], "unknown solver"),
        (["solve", "kr16", *pose, "--tool", 1, 2], "--tool needs 3 numbers (x y z) or 6"),
        ([*path, "--solver", trained, "--task", "position"], "adept_one"),
    ):
        code, out, err = run(capsys, *command)
        assert code == 2 and out == "" and said in err and err.count("\n") == 1


# ---------------------------------------------------------------------------- tools
def test_a_tool_is_added_behind_the_flange(capsys):
    q = [0.3, -1.2, 1.3, 0.3, 0.8, 0.1]
    command = ["fk", "kr16", "--q", *np.degrees(q), "--degrees", "--json"]
    turned = kv.load("kr16").with_tool(kv.pose([0.05, 0.02, 0.1], rpy=np.radians([10, 20, 30])))
    for tool, robot in ((TOOL, ROBOT), ([*TOOL, 10, 20, 30], turned)):
        told = json.loads(run(capsys, *command, *tool)[1])
        np.testing.assert_allclose(told["matrix"], robot.fk(q), atol=1e-12)


def test_a_solver_object_may_come_with_its_own_task_only():
    robot = kv.load("planar3r")
    T = robot.fk(np.linspace([0.2, 0.5, 0.4], [0.4, 0.7, 0.6], 10))
    solver = kv.Analytic(task="planar")
    assert track(robot, T, solver=solver, task="planar").is_whole
    with pytest.raises(kv.InputError, match="task belongs to the solver object"):
        track(robot, T, solver=solver, task="position")

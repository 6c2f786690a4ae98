"""``kinverse simulate``: what it prints, writes, keeps and refuses."""

import csv
import json
import sys
from itertools import pairwise

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.cli import main
from kinverse.paths import named_path, named_samples
from kinverse.paths.simulate import Effort

PATH = "masajedi_straight"


def run(capsys, *argv):
    code = main(["simulate", *map(str, argv)])
    said = capsys.readouterr()
    return code, said.out, said.err


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def columns(rows, *names):
    return np.array([[float(row[name]) for name in names] for row in rows])


@pytest.fixture(scope="module")
def arm():
    return kv.load("kr16")


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """The document's path as a file of 21 poses."""
    path = tmp_path_factory.mktemp("simulate") / "straight.npz"
    np.savez(path, T=named_samples(PATH).T)
    return path


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """Twelve poses, three out of reach, six."""
    T = named_samples(PATH).T.copy()
    T[12:15, 0, 3] += 9.0
    path = tmp_path_factory.mktemp("simulate") / "broken.npy"
    np.save(path, T)
    return path


def test_a_path_is_run_written_and_drawn(capsys, arm, tmp_path):
    out, picture = tmp_path / "run.csv", tmp_path / "run.png"
    code, said, err = run(
        capsys, "kr16", PATH, "--out", out, "--plot", picture, "--duration", 0.5, "--degrees",
        "--mass-error", 0.1, "--friction", 5,
    )  # fmt: skip
    assert code == 0 and "drawn" in err and picture.stat().st_size > 1000
    assert "rows 1 to 21 in 0.5 s, joints driven by computed_torque" in said
    rows = rows_of(out)
    assert len(rows) == 1001 and float(rows[-1]["t_s"]) == pytest.approx(0.5)
    measured, wanted = (
        np.radians(columns(rows, *(f"joint{j}{word}_deg" for j in range(1, 7))))
        for word in ("", "_wanted")
    )
    tool = columns(rows, "x_m", "y_m", "z_m")
    assert np.allclose(arm.fk(measured)[:, :3, 3], tool, atol=1e-9)
    # from end to end of the path, and along it
    T = named_path(PATH)(np.array([0.0, named_path(PATH).length]))
    assert np.allclose(arm.fk(wanted[[0, -1]]), T, atol=1e-6)
    error = columns(rows, "position_error_m")[:, 0]
    assert np.allclose(np.linalg.norm(tool - arm.fk(wanted)[:, :3, 3], axis=1), error, atol=1e-9)
    told = f"rms {1e3 * np.sqrt(np.mean(error**2)):.4g} mm, peak {1e3 * error.max():.4g} mm"
    assert 0.0 < error.max() and told in said
    effort = Effort.of(columns(rows, *(f"joint{j}_Nm" for j in range(1, 7))))
    lines = {line.split()[0]: line.split() for line in said.splitlines() if line.strip()}
    for j, figures in enumerate(zip(effort.peak, effort.rms, effort.uniformity, strict=True)):
        assert np.allclose([float(v) for v in lines[f"joint{j + 1}"][1:4]], figures, rtol=2e-3)


def test_limits_set_the_time_and_are_kept(capsys, tmp_path):
    out = tmp_path / "run.csv"
    limits = ["--velocity", 20, "--acceleration", *[80] * 6]
    assert run(capsys, "kr16", PATH, "--degrees", *limits, "--out", out)[0] == 0
    rows = rows_of(out)
    t = columns(rows, "t_s")[:, 0]
    q = columns(rows, *(f"joint{j}_wanted_deg" for j in range(1, 7)))
    speed = np.diff(q, axis=0) / np.diff(t)[:, None]
    assert 19.0 < np.abs(speed).max() < 20.2
    told = json.loads(run(capsys, "kr16", PATH, "--degrees", "--velocity", 40, "--json")[1])
    assert told["duration"] < 0.6 * t[-1]


def test_files_and_names_give_the_same(capsys, straight):
    options = ["--duration", 0.3, "--json", "--control", "servo"]
    named = json.loads(run(capsys, "kr16", PATH, *options)[1])
    read = json.loads(run(capsys, "kr16", straight, *options)[1])
    assert named["deviation"] < 1e-6 and read["deviation"] < 1e-3
    assert read["rms_position_error"] == pytest.approx(named["rms_position_error"], rel=0.1)
    # straight from pose to pose is this path again
    finer = json.loads(run(capsys, "kr16", straight, *options, "--samples", 50)[1])
    assert finer["rows"] == [1, 50] and finer["deviation"] < 1e-3


def test_a_driven_tool_tells_what_holds_it(capsys, tmp_path):
    out = tmp_path / "run.csv"
    code, said, _ = run(
        capsys, "kr16", PATH, "--drive", "tool", "--duration", 0.5, "--out", out,
        "--gravity", 0, 0, "-1.62",
    )  # fmt: skip
    assert code == 0 and "tool driven" in said and "joint values of inverse kinematics" in said
    force = columns(rows_of(out), "force_z_N")[:, 0]
    lines = {line.split()[0]: line.split() for line in said.splitlines() if line.strip()}
    assert float(lines["force_z"][1]) == pytest.approx(np.abs(force).max(), rel=1e-3)


def test_what_the_controller_believes_matters(capsys):
    options = ["kr16", PATH, "--duration", 1, "--json"]
    errors = [
        json.loads(run(capsys, *options, *more)[1])["rms_position_error"]
        for more in ([], ["--mass-error", 0.2], ["--mass-error", 0.2, "--bandwidth", 100])
    ]
    assert errors[0] < errors[1] < errors[2]


def test_of_a_broken_path_the_longest_run_is_simulated(capsys, broken):
    code, said, _ = run(capsys, "kr16", broken, "--duration", 0.3)
    assert code == 1 and "rows 13 to 15: OUT_OF_REACH" in said and "rows 1 to 12 in" in said
    code, said, _ = run(capsys, "kr16", broken, "--duration", 0.3, "--json")
    told = json.loads(said)
    assert code == 1 and told["rows"] == [1, 12] and told["ok"]
    assert told["gaps"][0]["where"] == "rows 13 to 15"


def swung(joint1):
    """Joint values that differ in joint 1."""
    q = np.tile([0.0, -1.5, 1.5, 0.3, 0.8, 0.2], (len(joint1), 1))
    q[:, 0] = joint1
    return q


UNEVEN = [0.0, 0.2, 0.4, 0.6, 0.8, 0.802, 0.8, 0.6, 0.4, 0.2, 0.0]


def off_the_lines(places, corners):
    """(N,) distance of places (N, 3) from straight lines through corners (K, 3)."""
    away = []
    for a, b in pairwise(corners):
        share = np.clip((places - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away.append(np.linalg.norm(a + share[:, None] * (b - a) - places, axis=1))
    return np.min(away, axis=0)


@pytest.mark.parametrize("shift", [0.0, 2.4])
def test_unevenly_spaced_poses_do_not_run_away(capsys, arm, tmp_path, shift):
    q = swung(np.array(UNEVEN) + shift)
    T = np.array([oracle.robot_fk(arm, row) for row in q])
    np.save(tmp_path / "p.npy", T)
    base = ["kr16", tmp_path / "p.npy", "--q-start", *q[0], "--out", tmp_path / "run.csv"]
    for options, most in (([], 0.1 * 0.25), (["--tolerance", 1e-4], 1e-4)):
        code, said, err = run(capsys, *base, *options, "--json")
        told = json.loads(said)
        assert code == 0 and err == "" and told["samples_added"] > 5
        wanted = columns(
            rows_of(tmp_path / "run.csv"), *(f"joint{j}_wanted_rad" for j in range(1, 7))
        )
        assert wanted[:, 0].min() > shift - 1e-3 and wanted[:, 0].max() < shift + 0.803
        # no place is farther from the lines than is told, and none than may be
        tools = np.array([oracle.robot_fk(arm, row)[:3, 3] for row in wanted[::20]])
        far = off_the_lines(tools, T[:, :3, 3]).max()
        assert far < 1.01 * told["deviation"] + 1e-6 and told["deviation"] <= most
        # and it comes by every pose
        near = np.linalg.norm(arm.fk(wanted)[:, None, :3, 3] - T[:, :3, 3], axis=2).min(axis=0)
        assert near.max() < 1e-3
    said = run(capsys, *base)[1]
    assert "from straight lines between the poses" in " ".join(said.split())
    assert "samples added" in " ".join(said.split())


def test_joints_on_a_limit_stay_inside_between_the_poses(capsys, arm, tmp_path):
    top = arm.limits[0, 1]
    for j in (top - np.abs(np.array(UNEVEN) - 0.802), top - 0.4 * np.linspace(-1, 1, 9) ** 2):
        q = swung(j)
        np.save(tmp_path / "p.npy", arm.fk(q))
        options = ["--q-start", *q[0], "--out", tmp_path / "run.csv", "--json"]
        code, said, _ = run(capsys, "kr16", tmp_path / "p.npy", *options)
        assert code == 0 and json.loads(said)["beyond_limits"] == 0.0
        wanted = columns(rows_of(tmp_path / "run.csv"), "joint1_wanted_rad")
        assert wanted.max() < top + 1e-6


def test_limits_left_between_the_samples_are_said(capsys, arm, tmp_path, monkeypatch):
    q = swung(np.array(UNEVEN) + arm.limits[0, 1] - 0.81)
    np.save(tmp_path / "p.npy", arm.fk(q))
    command = ["kr16", tmp_path / "p.npy", "--q-start", *q[0], "--duration", 0.3]
    monkeypatch.setattr("kinverse.cli._joint_curve.ROUNDS", 0)  # as it were without more samples
    code, out, err = run(capsys, *command)
    assert code == 1 and out == "" and "not simulated: between the samples joint1" in err
    monkeypatch.setattr("kinverse.paths.wanted.BEYOND", 9.0)
    code, out, err = run(capsys, *command)
    assert code == 1 and "between the samples joint1 is asked for" in " ".join(out.split())
    told = json.loads(run(capsys, *command, "--json")[1])
    assert told["beyond_limits"] > 0.01 and told["deviation"] > 0.01


def test_few_poses_and_turns_on_the_spot(capsys, arm, tmp_path):
    T = arm.fk(swung([0.0, 0.2, 0.35]))
    np.save(tmp_path / "few.npy", T[:2])
    told = json.loads(run(capsys, "kr16", tmp_path / "few.npy", "--json")[1])
    assert told["rows"] == [1, 2] and told["deviation"] < 0.1 * np.linalg.norm(T[1] - T[0])
    spun = np.concatenate([T, [T[2] @ oracle.homogeneous(oracle.rot_z(0.3)), T[2]]])
    np.save(tmp_path / "spun.npy", spun)
    code, said, _ = run(capsys, "kr16", tmp_path / "spun.npy", "--json")
    told = json.loads(said)
    assert code == 0 and told["rows"] == [1, 5] and told["rotation_deviation"] < 0.1 * 0.3


def test_straight_lines_that_the_arm_cannot_follow_are_said(capsys, arm, tmp_path):
    # joint 3 on its limit: nearer to the base, where chords of a circle lead, it cannot go
    q = swung(np.linspace(-1.0, 1.0, 8))
    q[:, 2] = arm.limits[2, 0]
    np.save(tmp_path / "p.npy", arm.fk(q))
    command = ["kr16", tmp_path / "p.npy", "--q-start", *q[0], "--duration", 1]
    code, said, _ = run(capsys, *command)
    assert code == 0 and "not found" not in said
    code, said, _ = run(capsys, *command, "--tolerance", 1e-3)
    assert code == 1 and "7 not found: the arm cannot follow" in " ".join(said.split())


def test_evenly_spaced_poses_of_a_line_are_run_through_smoothly(capsys, tmp_path):
    # out to the arm's reach, where the joints turn ever faster for the same way
    T = np.tile(kv.pose([0.3, 0.2, 0.4], rpy=[0.2, 1.7, 0.3]), (12, 1, 1))
    T[:, :3, 3] += np.linspace(0.0, 0.42, 12)[:, None] * [1.0, 0.6, -0.3]
    np.save(tmp_path / "line.npy", T)
    out = tmp_path / "run.csv"
    code, said, _ = run(capsys, "ur5", tmp_path / "line.npy", "--duration", 2, "--out", out,
                        "--control", "prescribed", "--json")  # fmt: skip
    assert code == 0
    rows = rows_of(out)
    tool = columns(rows, "x_m", "y_m", "z_m")
    x = np.linspace(0.0, 1.0, len(rows))[:, None]
    even = T[0, :3, 3] + x**3 * (10 - 15 * x + 6 * x**2) * (T[-1, :3, 3] - T[0, :3, 3])
    # the tool itself goes the way in the time that --duration says: no kinks at the poses
    assert np.abs(tool - even).max() < 2e-4
    assert json.loads(said)["deviation"] < 2e-4


def test_speeds_are_told_and_absurd_ones_remarked_on(capsys):
    said = run(capsys, "kr16", PATH, "--duration", 2, "--degrees")[1]
    assert "peak joint speeds: joint1 " in said and "deg/s" in said and "faster" not in said
    told = json.loads(run(capsys, "kr16", PATH, "--duration", 2, "--json")[1])
    first = told["peak_joint_speeds"][0]
    assert f"joint1 {np.degrees(first):.4g} deg/s" in said
    said = " ".join(run(capsys, "kr16", PATH, "--duration", 0.04, "--drive", "tool")[1].split())
    assert "peak joint speeds: joint1 " in said and "faster than the drives of arms" in said


@pytest.mark.parametrize("bandwidth", [5e3, 1e8])
def test_an_unstable_run_says_when_and_keeps_what_it_has(capsys, tmp_path, monkeypatch, bandwidth):
    monkeypatch.chdir(tmp_path)
    code, said, err = run(capsys, "kr16", PATH, "--bandwidth", bandwidth, "--out", "run.csv")
    assert code == 1 and "unstable at t = " in said and err == ""
    assert 0 < len(rows_of(tmp_path / "run.csv")) < 200
    # and the simulator leaves no log of its own behind
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


def test_repeated_poses_are_remarked(capsys, tmp_path):
    T = named_samples(PATH).T
    np.save(tmp_path / "twice.npy", T[[0, 1, 1, *range(2, 21), 20]])
    code, _, err = run(capsys, "kr16", tmp_path / "twice.npy", "--duration", 0.3)
    assert code == 0 and "2 poses repeat the one before" in err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--drive", "wheels"], "'joints' or 'tool'"),
        (["--control", "magic"], "computed_torque, servo, prescribed"),
        (["--drive", "tool", "--control", "servo"], "control is of driven joints"),
        (["--drive", "tool", "--bandwidth", "9"], "bandwidth is of driven joints"),
        (["--control", "prescribed", "--bandwidth", "9"], "bandwidth is of a feedback"),
        (["--tolerance", "0"], "--tolerance must be positive"),
        (["--duration", "0"], "--duration must be positive"),
        (["--duration", "1", "--velocity", "1"], "either --duration or"),
        (["--velocity", "1", "2"], "--velocity needs 1 number or 6, got 2"),
        (["--acceleration", "0"], "--acceleration must be positive"),
        (["--velocity", "fast,1"], "--velocity: 'fast' is not a number"),
        (["--gravity", "0", "0"], "--gravity needs 3"),
        (["--mass-error", "-1"], "mass_error must be above -1"),
        (["--friction", "nan"], "friction must be finite"),
        (["--step", "0"], "step must be positive"),
        (["--duration", "1e7"], "a larger step"),
        (["--samples", "1"], "count must lie in"),
        (["--q-start", "1", "2"], "--q-start needs 6"),
        (["--solver", "magic"], "unknown solver"),
        (["--out", "run.json"], "--out must be a .csv"),
        (["--out", "nowhere/run.csv"], "--out must be a .csv"),
        (["--plot", "run.gif"], "--plot must end"),
    ],
)
def test_bad_options_are_refused_in_one_line(capsys, options, said):
    code, out, err = run(capsys, "kr16", PATH, *options)
    assert code == 2 and out == "" and said in err and err.count("\n") == 1


def test_paths_that_cannot_be_simulated_are_refused(capsys, tmp_path):
    code, out, err = run(capsys, "kr16", "no_such_path")
    assert code == 2 and out == "" and "masajedi_curved" in err
    assert "no such file" in run(capsys, "kr16", tmp_path / "missing.csv")[2]
    np.save(tmp_path / "still.npy", np.repeat(named_samples(PATH).T[:1], 6, axis=0))
    assert "1 different poses" in run(capsys, "kr16", tmp_path / "still.npy")[2]
    code, out, err = run(capsys, "kr16", PATH, "--samples", 2)
    assert code == 2 and "STEP" in out and "--samples 100" in err
    far = named_samples(PATH).T + np.array([[0, 0, 0, 9], *np.zeros((3, 4))])
    np.save(tmp_path / "far.npy", far)
    code, out, err = run(capsys, "kr16", tmp_path / "far.npy")
    assert code == 2 and "OUT_OF_REACH" in out and "no pose of" in err
    code, _, err = run(capsys, "ir361", PATH)
    assert code == 2 and err.count("\n") == 1


def test_a_missing_extra_names_the_command(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    code, out, err = run(capsys, "kr16", PATH)
    assert code == 2 and out == "" and 'pip install "kinverse[sim]"' in err


def test_the_default_speed_is_the_same_with_degrees(capsys):
    words = " ".join(run(capsys, "--help")[1].replace("│", " ").split())
    assert "with --degrees [deg/s]. Left out, with --degrees too: 1 rad/s (57.3 deg/s)" in words
    argv = ["kr16", "masajedi_straight", "--json"]
    plain, degrees = (json.loads(run(capsys, *argv, *more)[1]) for more in ([], ["--degrees"]))
    told = run(capsys, *argv, "--degrees", "--velocity", np.degrees(1.0))[1]
    assert plain["duration"] == degrees["duration"]
    assert json.loads(told)["duration"] == pytest.approx(plain["duration"])

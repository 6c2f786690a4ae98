"""The command line: what it prints, what it refuses, and its exit status."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.cli import main

POSE = ["--pose", "0.9", "0.3", "1.1", "0.2", "1.7", "0.3"]
FAR = ["--pose", "9", "0", "0", "0", "0", "0"]


def run(capsys, *argv):
    code = main(list(map(str, argv)))
    said = capsys.readouterr()
    return code, said.out, said.err


def refused(capsys, *argv):
    """What one line a bad call says; nothing on standard output."""
    code, out, err = run(capsys, *argv)
    assert code == 2 and out == ""
    assert err.startswith("kinverse: error: ") and err.count("\n") == 1
    return err


@pytest.fixture
def poses(tmp_path):
    """Five reachable poses of the KR16, the third row broken and the fourth out of reach."""
    robot = kv.load("kr16")
    T = robot.fk(robot.random(5, np.random.default_rng(11)))
    T[3, 0, 3] += 9.0
    lines = ["tag,qw,qx,qy,qz,x,y,z"]
    for k, one in enumerate(T):
        cells = [*kv.se3.quat_from_rotation(one[:3, :3]), *one[:3, 3]]
        lines.append(f"t{k}," + ",".join(repr(float(v)) for v in cells))
    lines[3] = lines[3].rsplit(",", 1)[0] + ",here"
    path = tmp_path / "poses.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


# ---------------------------------------------------------------------------- robots
def test_robots_lists_the_catalogue(capsys):
    code, out, _ = run(capsys, "robots")
    assert code == 0
    for name in ("kr16", "ur5", "panda", "adept_one"):
        assert f"{name} " in out
    assert max(map(len, out.splitlines())) <= 80
    code, out, _ = run(capsys, "robots", "--json")
    rows = {row["name"]: row for row in json.loads(out)}
    assert rows["adept_one"]["joints"] == "RRPR"
    assert rows["kr16"]["closed_form"] == "spherical wrist" and rows["panda"]["closed_form"] is None
    assert run(capsys, "info", "KR16")[1] == run(capsys, "info", "kr16")[1]


def test_info_shows_limits_in_the_unit_asked_for(capsys):
    code, out, _ = run(capsys, "info", "adept_one", "--json", "--degrees")
    told = json.loads(out)
    robot = kv.load("adept_one")
    assert code == 0 and told["angle"] == "deg"
    assert np.allclose(told["limits"][0], np.degrees(robot.limits[0]))
    assert np.allclose(told["limits"][2], robot.limits[2])  # a slide stays in metres
    code, out, _ = run(capsys, "info", "panda")
    assert code == 0 and "closed form: yes, at a value of panda_joint7" in out and "source:" in out


def test_fk_is_the_robots_own(capsys):
    q = [10, -60, 70, 20, -30, 40]
    code, out, _ = run(capsys, "fk", "kr16", "--q", *q, "--degrees", "--json")
    told = json.loads(out)
    T = kv.load("kr16").fk(np.radians(q))
    assert code == 0
    assert np.allclose(told["matrix"], T, atol=1e-12)
    back = kv.pose(told["xyz"], rpy=np.radians(told["rpy"]))
    assert np.allclose(back, T, atol=1e-12)
    assert np.allclose(kv.pose(told["xyz"], quat=told["quat_wxyz"]), T, atol=1e-12)
    code, out, _ = run(capsys, "fk", "kr16", "--q", "0,0,0,0,0,0")
    assert code == 0 and "quaternion" in out


# ---------------------------------------------------------------------------- solve
def test_solve_prints_verified_solutions(capsys):
    code, out, _ = run(capsys, "solve", "kr16", *POSE, "--json")
    told = json.loads(out)
    robot = kv.load("kr16")
    target = kv.pose([0.9, 0.3, 1.1], rpy=[0.2, 1.7, 0.3])
    assert code == 0 and told["poses"][0]["status"] == "SOLVED"
    found = told["poses"][0]["solutions"]
    assert len(found) == len(kv.solve(robot, target).q) > 0
    for solution in found:
        assert np.allclose(oracle.robot_fk(robot, np.array(solution["q"])), target, atol=1e-8)


def test_solve_takes_negative_numbers_and_degrees(capsys):
    robot = kv.load("kr16")
    q = np.radians([-20, -80, 60, -30, -40, 50])
    T = robot.fk(q)
    rpy = np.degrees(kv.se3.rpy_from_rotation(T[:3, :3]))
    numbers = [repr(float(v)) for v in (*T[:3, 3], *rpy)]
    seed = [repr(float(v)) for v in np.degrees(q)]
    call = ["solve", "kr16", "--pose", *numbers, "--q-seed", *seed, "--degrees"]
    code, out, _ = run(capsys, *call, "--json")
    first = json.loads(out)["poses"][0]["solutions"][0]
    assert code == 0
    assert np.allclose(first["q"], np.degrees(q), atol=1e-5)
    code, out, _ = run(capsys, *call)
    assert code == 0 and "SOLVED" in out
    assert max(map(len, out.splitlines())) <= 80


def test_an_unreachable_pose_has_a_reason_and_status_1(capsys):
    code, out, _ = run(capsys, "solve", "kr16", *FAR)
    said = " ".join(out.split())  # the terminal's width breaks lines anywhere
    assert code == 1 and "UNREACHABLE" in said and kv.Status.UNREACHABLE.text in said
    code, out, _ = run(capsys, "solve", "kr16", *FAR, "--json")
    told = json.loads(out)["poses"][0]
    assert code == 1 and told["status"] == "UNREACHABLE" and told["solutions"] == []


def test_a_broken_row_stops_or_is_skipped(capsys, poses, tmp_path):
    err = refused(capsys, "solve", "kr16", "--poses", poses)
    assert "poses.csv: row 3 (line 4): column z: 'here'" in err
    out_file = tmp_path / "out.csv"
    code, out, err = run(
        capsys, "solve", "kr16", "--poses", poses, "--on-error", "skip", "--out", out_file
    )
    assert code == 1 and "row 3 (line 4): column z" in err and "columns not read: tag" in err
    assert "SOLVED 3 of 4" in out and "UNREACHABLE 1 of 4" in out and "skipped 1" in out
    with out_file.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["row"] for row in rows} == {"1", "2", "4", "5"}
    robot = kv.load("kr16")
    for row in rows:
        if row["row"] == "4":
            assert row["status"] == "UNREACHABLE" and row["joint1_rad"] == ""
            continue
        q = np.array([float(row[f"{name}_rad"]) for name in robot.joint_names])
        assert float(row["position_error_m"]) <= 1e-6
        assert (q >= robot.limits[:, 0] - 1e-9).all() and (q <= robot.limits[:, 1] + 1e-9).all()


def test_out_json_and_batches_match_single_calls(capsys, poses, tmp_path, monkeypatch):
    from kinverse.cli import _answers

    call = ["solve", "kr16", "--poses", poses, "--on-error", "skip"]
    code, whole, _ = run(capsys, *call, "--json", "--out", tmp_path / "out.json")
    assert code == 1
    assert json.loads((tmp_path / "out.json").read_text(encoding="utf-8")) == json.loads(whole)
    monkeypatch.setattr(_answers, "CHUNK", 2)
    code, parts, _ = run(capsys, *call, "--json")
    assert json.loads(parts) == json.loads(whole)


def test_ctrl_c_keeps_what_is_done(capsys, poses, monkeypatch):
    from kinverse.cli import _answers, _solver

    class Interrupted:
        def __init__(self, solver):
            self.solver, self.settings_, self.calls = solver, solver.settings_, 0

        def solve(self, *given):
            self.calls += 1
            if self.calls > 1:
                raise KeyboardInterrupt
            return self.solver.solve(*given)

    fitted = _solver.fitted
    monkeypatch.setattr(_answers, "CHUNK", 2)
    monkeypatch.setattr(_solver, "fitted", lambda *given: Interrupted(fitted(*given)))
    code, out, err = run(capsys, "solve", "kr16", "--poses", poses, "--on-error", "skip", "--json")
    told = json.loads(out)
    assert code == 1 and "interrupted: 2 poses of 4 done" in err
    assert [pose["row"] for pose in told["poses"]] == [1, 2] and told["not_tried"] == 2


def test_no_pose_is_no_error(capsys, tmp_path):
    path = tmp_path / "none.csv"
    path.write_text("x,y,z,roll,pitch,yaw\n", encoding="utf-8")
    code, out, err = run(capsys, "solve", "kr16", "--poses", path, "--json")
    assert code == 0 and json.loads(out)["poses"] == []
    assert f"0 poses in {path}" in err


# ---------------------------------------------------------------------------- remarks
def test_degrees_that_are_read_as_radians_are_remarked_on(capsys, tmp_path):
    says = "angles are read as radians; 20 is more than a turn: --degrees?"
    pose = ["--pose", "0.4", "0.3", "1.9", "10", "0", "20"]
    assert says in run(capsys, "solve", "kr16", *pose)[2]
    assert run(capsys, "solve", "kr16", *pose, "--degrees")[2] == ""
    assert says in run(capsys, "solve", "kr16", *POSE, "--q-seed", *"01", "20", *"000")[2]
    assert says in run(capsys, "fk", "kr16", "--q", *"01", "20", *"000")[2]
    path = tmp_path / "poses.csv"
    path.write_text("x,y,z,roll,pitch,yaw\n0.4,0.3,1.9,10,0,20\n", encoding="utf-8")
    assert says in run(capsys, "solve", "kr16", "--poses", path)[2]
    # metres are no angles
    assert run(capsys, "fk", "adept_one", "--q", "0", "0", "7", "0", "--json")[2].count("note") == 1


def test_fk_remarks_on_joints_outside_their_limits(capsys):
    code, _, err = run(capsys, "fk", "kr16", "--q", *"0000", "131", "0", "--degrees")
    assert code == 0 and err == (
        "kinverse: note: joint5 at 131 deg is outside its limits -130 to 130\n"
    )
    assert run(capsys, "fk", "kr16", "--q", *"000000")[2] == ""


def test_millimetres_are_remarked_on(capsys):
    pose = ["--pose", "400", "300", "1900", "0", "0", "0"]
    assert "positions are metres" in run(capsys, "solve", "kr16", *pose)[2]
    assert "metres" not in run(capsys, "solve", "kr16", *FAR)[2]


def test_out_of_limits_names_the_joints(capsys):
    robot = kv.load("kr16")
    T = robot.fk(np.radians([0, 60, -20, 0, 20, 0]))
    rpy = kv.se3.rpy_from_rotation(T[:3, :3])
    call = ["solve", "kr16", "--pose", *(repr(float(v)) for v in (*T[:3, 3], *rpy))]
    code, out, _ = run(capsys, *call)
    said = " ".join(out.split())
    assert code == 1 and "OUT_OF_LIMITS" in said and "is outside its limits" in said
    best = json.loads(run(capsys, *call, "--json")[1])["poses"][0]["best"]
    low, high = robot.limits.T
    q = np.array(best["q"])
    wrong = [n for n, bad in zip(robot.joint_names, (q < low) | (q > high), strict=True) if bad]
    assert [line.split()[0] for line in best["outside_limits"]] == wrong != []
    assert np.allclose(robot.fk(q), T, atol=1e-6)


def test_three_numbers_do_for_the_task_position(capsys):
    call = ["solve", "kr16", "--pose", "0.9", "0.3", "1.1", "--json"]
    code, out, _ = run(capsys, *call, "--task", "position")
    found = json.loads(out)["poses"][0]["solutions"][0]
    assert code == 0
    assert np.allclose(kv.load("kr16").fk(found["q"])[:3, 3], [0.9, 0.3, 1.1], atol=2e-6)
    assert "--task position" in refused(capsys, *call)


def test_a_narrow_terminal_cuts_no_digits(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    wide = run(capsys, "solve", "kr16", *POSE)[1]
    assert "\u2026" not in wide and "shoulder+ elbow+ wrist+" in wide
    numbers = [
        w for w in wide.split("SOLVED")[0].split() if w.lstrip("-").replace(".", "").isdigit()
    ]
    assert len(numbers) % 6 == 0 and all(len(w.split(".")[1]) == 4 for w in numbers)
    for call in (["compare", "kr16", "--poses", "5"], ["fk", "kr16", "--q", *"000000"]):
        assert "\u2026" not in run(capsys, *call)[1]
    assert "in a batch us" in run(capsys, "compare", "kr16", "--poses", "5")[1]


def test_a_batch_shows_branch_labels_and_why_a_pose_failed(capsys, poses):
    out = run(capsys, "solve", "kr16", "--poses", poses, "--on-error", "skip")[1]
    assert "shoulder+" in out and any(
        line.split()[-2:] == ["-", "UNREACHABLE"] for line in out.splitlines()
    )


def test_columns_of_a_file_say_their_unit(capsys, tmp_path):
    path = tmp_path / "out.csv"
    pose = ["--pose", "0.4", "0.3", "0.6", "0", "0", "0", "--task", "position"]
    run(capsys, "solve", "adept_one", *pose, "--out", path, "--degrees")
    head = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    names = kv.load("adept_one").joint_names
    assert head[2:6] == [f"{n}_{u}" for n, u in zip(names, ("deg", "deg", "m", "deg"), strict=True)]


# ---------------------------------------------------------------------------- compare
def test_compare_takes_the_polish_away(capsys):
    given = ["compare", "puma560", "--poses", 5, "--solvers", "swarm:pso", "--json"]
    assert run(capsys, *given)[0] == 0
    code, out, _ = run(capsys, *given, "--alone")
    assert code == 1 and json.loads(out)["rows"][0]["solved"] == 0.0


def test_compare_prints_a_row_for_each_solver(capsys):
    code, out, _ = run(capsys, "compare", "kr16", "--poses", 20)
    assert code == 0 and "analytic" in out and "numerical" in out
    assert max(map(len, out.splitlines())) <= 80
    code, out, _ = run(capsys, "compare", "ir361", "--poses", 20, "--json")
    rows = {row["solver"]: row for row in json.loads(out)["rows"]}
    assert code == 0
    assert rows["analytic"]["note"] == "NoClosedForm" and rows["numerical"]["solved"] == 100.0


# ---------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["solve", "kr16"], "--pose, --matrix and --poses"),
        (["solve", "kr16", *POSE, "--poses", "x.csv"], "--pose, --matrix and --poses"),
        (["solve", "kr16", "--pose", "1", "2"], "--pose needs 6 numbers"),
        (["solve", "kr16", "--pose", "nan", *"00000"], "--pose must be finite"),
        (["solve", "kr17", *POSE], "kr16"),
        (["solve", "kr16", *POSE, "--solver", "magic"], "analytic"),
        (["solve", "kr16", *POSE, "--task", "half"], "position_axis"),
        (["solve", "ir361", *POSE, "--solver", "analytic"], "ir361"),
        (["solve", "kr16", *POSE, "--q-seed", "1"], "--q-seed needs 6"),
        (["solve", "kr16", *POSE, "--out", "x.txt"], ".csv or .json"),
        (["solve", "kr16", *POSE, "--out", "no/such/x.csv"], "no folder"),
        (["solve", "kr16", "--poses", "nosuch.csv"], "error: no such file: nosuch.csv"),
        (["solve", "kr16", "--poses", "x.csv", "--on-error", "x"], "on-error': 'x' is not one of"),
        (
            ["fk", "kr16", "--q", "a", "b"],
            "(a b); --tool, --pose, --q, --q-seed, --q-start, --region, --velocity, --acceleration,"
            " --gravity, --max-velocity, --max-acceleration take numbers",
        ),
        (["fk", "kr16", "--q", "0", "O", "0"], "--q: 'O' is not a number"),
        (["solve", "kr16", *POSE, "--tip", "a"], "--base and --tip choose"),
        (["solve", "kr16", "--matrix", "nosuch.npy"], "nosuch.npy"),
        (["solve", "kr16", *POSE, "--base", "a"], "kr16"),
        (["solve", "kr16", *POSE, "--rng", "x"], "rng"),
        (["solve", "kr16", *POSE, "--frobnicate"], "--frobnicate"),
        (["fk", "kr16", "--q", "1"], "--q needs 6 numbers"),
        (["fk", "kr16"], "--q"),
        (["compare", "kr16", "--poses", "0"], "at least 1"),
        (["compare", "kr16", "--solvers", "magic"], "analytic"),
        (["nosuch"], "nosuch"),
    ],
)
def test_bad_input_is_one_line_and_status_2(capsys, argv, says):
    assert says in refused(capsys, *argv)


def test_a_chain_is_chosen_by_options(capsys, tmp_path):
    path = tmp_path / "fork.urdf"
    joints = "".join(
        f'<joint name="to_{tip}" type="revolute"><parent link="a"/><child link="{tip}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint><link name="{tip}"/>'.replace(
            "{tip}", tip
        )
        for tip in "bc"
    )
    path.write_text(f'<robot name="fork"><link name="a"/>{joints}</robot>', encoding="utf-8")
    assert "choose one with --tip" in refused(capsys, "info", path)
    assert run(capsys, "info", path, "--tip", "b")[0] == 0


def test_no_arguments_show_the_help(capsys):
    code, out, _ = run(capsys)
    assert code == 0 and "compare" in out


def test_the_module_runs_as_a_program():
    done = subprocess.run(
        [sys.executable, "-m", "kinverse.cli", "fk", "kr16", "--q", "0"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and "needs 6" in done.stderr and "Traceback" not in done.stderr


def test_the_help_loads_nothing_heavy():
    code = "import sys, kinverse.cli; kinverse.cli.main(['--help']); print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"

"""``kinverse track``: what it writes, refuses and returns."""

import csv
import dataclasses
import json
import re

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.bench import cases
from kinverse.cli import _joint_path, main
from kinverse.cli._joint_curve import Joined
from kinverse.cli._motion import TimedPath
from kinverse.paths import Path, named_samples

ARM = """kind = "dh"
name = "flat"
convention = "standard"
units = { length = "m", angle = "deg" }
rows = [
  { joint = "R", theta = 0, d = 0, a = 0.5, alpha = 0, limits = [-180, 180] },
  { joint = "R", theta = 0, d = 0, a = 0.4, alpha = 0, limits = [-180, 180] },
  { joint = "R", theta = 0, d = 0, a = 0.2, alpha = 0, limits = [-180, 180] },
]
"""
CELL = """<mujoco><worldbody>
  <geom type="box" size="0.02 0.02 0.02" pos="{x} {y} 0"/>
  <body><joint name="joint1"/><geom type="capsule" size="0.03" fromto="0 0 0 0.5 0 0"/>
    <body pos="0.5 0 0"><joint name="joint2"/><geom type="box" size="0.2 0.02 0.02" pos="0.2 0 0"/>
      <body pos="0.4 0 0"><joint name="joint3"/><geom type="sphere" size="0.02" pos="0.1 0 0"/>
</body></body></body></worldbody></mujoco>"""
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
    assert (
        code == 0
        and "30 of 30 poses tracked in 1 run, largest joint step" in said
        and "drawn" in err
    )
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


def test_samples_are_added_to_a_tolerance(capsys, arm, whole, tmp_path):
    out = tmp_path / "joints.csv"
    code, said, _ = run(capsys, "track", "kr16", whole, "--tolerance", 1e-6, "--out", out)
    rows = rows_of(out)
    assert code == 0 and len(rows) > 60 and f"{len(rows)} of {len(rows)} poses" in said
    assert "the tool is at most" in said and "mm from the path" in said
    s = np.array([float(row["s_m"]) for row in rows])
    q = np.array([[float(row[f"joint{j}_rad"]) for j in range(1, 7)] for row in rows])
    path = Path.from_poses(arm.fk(cases.path(arm, 30)))
    # the file's poses are among the samples, and the tool stays near between them
    assert np.abs(s[:, None] - path.breaks).min(axis=0).max() < 1e-6
    middle = [oracle.robot_fk(arm, row)[:3, 3] for row in 0.5 * (q[1:] + q[:-1])]
    away = np.linalg.norm(middle - path(0.5 * (s[1:] + s[:-1]))[:, :3, 3], axis=1)
    assert away.max() < 1.01e-6
    code, said, _ = run(capsys, "track", "kr16", whole, "--samples", 50, "--json")
    told = json.loads(said)
    assert code == 0 and len(told["rows"]) == 50 and told["rows"][-1]["s"] > told["rows"][0]["s"]
    assert told["deviation"] is None and told["closure"] is None


def test_the_summary_has_units(capsys, whole, tmp_path):
    code, said, _ = run(capsys, "track", "kr16", whole, "--metric", "time", "--max-velocity", 2)
    slow = run(capsys, "track", "kr16", whole, "--metric", "time", "--max-velocity", *[1] * 6)[1]
    assert code == 0 and "in 1 run, largest joint step" in said and " rad, cost" in said
    seconds = [float(re.search(r"cost (\S+) s$", text.strip())[1]) for text in (said, slow)]
    assert seconds[1] == pytest.approx(2.0 * seconds[0], rel=1e-3)
    assert re.search(
        r"step \S+ deg, cost \S+ deg", run(capsys, "track", "kr16", whole, "--degrees")[1]
    )
    # a slide's steps are metres, and what is added up of both says so
    scara = kv.load("adept_one")
    middle = scara.limits.mean(axis=1) + [0.1, 0.1, 0.0, 0.1]
    path = written(tmp_path / "path.csv", scara.fk(np.linspace(middle, middle + 0.02, 9)))
    told = run(capsys, "track", "adept_one", path, "--task", "schoenflies")[1]
    assert re.search(r"step \S+ rad and \S+ m, cost \S+ \(rad and m added up\)", told)


def test_obstacles_are_kept_clear_of(capsys, arm, whole, tmp_path):
    tool = arm.fk(cases.path(arm, 30))[12, :3, 3]
    balls = tmp_path / "balls.csv"
    cells = ",".join(repr(float(v)) for v in 1e3 * tool)
    balls.write_text(f"x [mm],y [mm],z [mm],radius\n{cells},0.01\n")
    code, said, _ = run(capsys, "track", "kr16", whole, "--radius", 0.01, "--spheres", balls)
    assert code == 1 and "COLLISION" in said
    assert run(capsys, "track", "kr16", whole, "--radius", 0.01, "--floor", -9)[0] == 0
    code, said, _ = run(capsys, "track", "kr16", whole, "--radius", 0.01, "--floor", 9)
    assert code == 1 and "0 of 30 poses tracked" in said and "run" not in said.splitlines()[0]
    wide = ["--margin", 9, "--radius", 0.01, "--spheres", balls]
    assert "0 of 30 poses" in run(capsys, "track", "kr16", whole, *wide)[1]


def test_a_model_of_the_cell_is_kept_clear_of(capsys, tmp_path):
    pytest.importorskip("mujoco")
    robot = tmp_path / "arm.toml"
    robot.write_text(ARM)
    arm = kv.load(robot)
    path = written(tmp_path / "path.csv", arm.fk([[0.7 + 0.01 * k, -0.8, 0.5] for k in range(9)]))
    argv = ["track", robot, path, "--task", "planar", "--json"]
    free = np.array([row["q"] for row in json.loads(run(capsys, *argv)[1])["rows"]])
    model = tmp_path / "cell.xml"
    x, y = 0.5 * np.cos(free[4, 0]), 0.5 * np.sin(free[4, 0])
    model.write_text(CELL.format(x=x, y=y))
    code, said, _ = run(capsys, *argv, "--model", model, "--margin", 0.001)
    told = json.loads(said)
    assert code == 0 and np.sign(told["rows"][4]["q"][1]) == -np.sign(free[4, 1])
    # capsules that no elbow keeps clear of the floor, and the model: both count
    both = ["--model", model, "--radius", 0.01, "--floor", 0.1]
    assert json.loads(run(capsys, *argv, *both)[1])["gaps"][0]["reason"] == "COLLISION"


def test_a_start_out_of_reach_is_told(capsys, arm, whole):
    far = np.clip(cases.path(arm, 30)[0] + 1.5, *arm.limits.T)
    code, said, _ = run(capsys, "track", "kr16", whole, "--q-start", *far)
    assert code == 1 and "before row 1: STEP: from q_start" in said
    code, said, _ = run(capsys, "track", "kr16", whole, "--q-start", *far, "--json")
    assert json.loads(said)["gaps"][0]["where"] == "before row 1"


@pytest.mark.parametrize(
    "options, said",
    [
        (["--metric", "time"], "--metric time needs --max-velocity"),
        (["--max-acceleration", "4"], "--max-acceleration goes with --max-velocity"),
        (["--max-velocity", "1", "--max-acceleration", "0"], "--max-acceleration must be positive"),
        (["--rate", "100"], "--rate goes with --max-acceleration"),
        (
            ["--max-velocity", "1", "--max-acceleration", "4", "--rate", "0", "--out", "a.csv"],
            "rate must be positive",
        ),
        (["--max-velocity", "1", "--max-acceleration", "4", "--out", "a.json"], "end in .csv"),
        (["--max-velocity", "1"], "--max-velocity goes with --metric time"),
        (["--metric", "time", "--max-velocity", "1", "2"], "--max-velocity needs 1 number or 6"),
        (["--metric", "time", "--max-velocity", "0"], "--max-velocity must be positive"),
        (["--tolerance", "0"], "tolerance must be positive"),
        (["--samples", "1"], "count must lie in"),
        (["--floor", "0"], "need --radius"),
        (["--spheres", "missing.csv"], "need --radius"),
        (["--margin", "0.1"], "--margin needs"),
        (["--radius", "-1"], "radii"),
        (["--radius", "0.1", "--spheres", "missing.csv"], "no such file"),
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


@pytest.mark.parametrize(
    "text, said",
    [
        ("", "must name the columns"),
        ("x,y,z\n1,2,3\n", "must name the columns"),
        ("x,y,z,radius\n1,2,3\n", "row 1: 3 cells"),
        ("x,y,z,radius\n1,2,3,0.1\n1,2,a,0.1\n", "row 2"),
        ("x,y,z,radius\n1,2,nan,0.1\n", "row 1: a value is not finite"),
        ("x [in],y,z,radius\n1,2,3,0.1\n", "x [mm]"),
        ("x,y,z,radius\n1,2,3,-0.1\n", "negative"),
    ],
)
def test_bad_spheres_are_named(capsys, whole, tmp_path, text, said):
    balls = tmp_path / "balls.csv"
    balls.write_text(text)
    code, out, err = run(capsys, "track", "kr16", whole, "--radius", 0.1, "--spheres", balls)
    assert code == 2 and out == "" and said in err and err.count("\n") == 1


def test_bad_files_are_refused(capsys, arm, tmp_path):
    one = written(tmp_path / "one.csv", arm.fk(np.zeros((1, 6))))
    assert "two poses" in run(capsys, "track", "kr16", one)[2]
    nan = tmp_path / "nan.csv"
    nan.write_text(",".join(HEAD) + "\n1,0,1,1,0,0,0\n1,0,nan,1,0,0,0\n")
    code, _, err = run(capsys, "track", "kr16", nan)
    assert code == 2 and "row 2" in err
    code, _, err = run(capsys, "track", "kr16", tmp_path / "missing.csv")
    assert code == 2 and "no such file" in err


def test_degrees_are_told_everywhere(capsys, arm, whole, tmp_path):
    argv = ["track", "kr16", whole, "--json", "--max-step", 0.01]
    rad = json.loads(run(capsys, *argv)[1])
    deg = json.loads(run(capsys, *argv[:-1], np.degrees(0.01), "--degrees")[1])
    assert rad["units"] == ["rad"] * 6 and deg["units"] == ["deg"] * 6
    assert (rad["cost_unit"], deg["cost_unit"]) == ("rad", "deg")
    assert deg["cost"] == pytest.approx(np.degrees(rad["cost"]))
    assert deg["largest_step"] == pytest.approx(np.degrees(rad["largest_step"]))
    assert len(deg["gaps"]) == len(rad["gaps"]) > 0
    for told, unit in ((rad, "rad"), (deg, "deg")):
        other = {"rad": " deg", "deg": " rad"}[unit]
        texts = [gap["text"] for gap in told["gaps"]]
        assert all(f" {unit}, which" in text and other not in text for text in texts)
    # a slide stays in metres
    scara = kv.load("adept_one")
    path = written(tmp_path / "scara.csv", scara.fk(cases.path(scara, 9)))
    argv = ["track", "adept_one", path, "--task", "schoenflies", "--degrees", "--json"]
    told = json.loads(run(capsys, *argv)[1])
    assert told["units"] == ["deg", "deg", "m", "deg"]
    assert told["largest_step"] == pytest.approx(
        np.abs(np.diff([r["q"] for r in told["rows"]], axis=0)).max(axis=0)
    )
    assert told["cost_unit"] == "(rad and m added up)"


def test_a_message_counts_rows_alone(capsys, arm, whole, tmp_path):
    said = run(capsys, "track", "kr16", whole, "--max-step", 0.01)[1]
    assert re.search(r"between rows (\d+) and (\d+): STEP: from row \1 to row \2 ", said)
    assert "sample 0" not in said and "sample 1" not in said
    found = kv.paths.track(arm, arm.fk(cases.path(arm, 30)), max_step=0.01)
    assert re.match(r"from sample \d+ to sample \d+ the pose moves", found.gaps[0].text)


def test_a_file_in_millimetres_is_told(capsys, arm, tmp_path):
    T = arm.fk(cases.path(arm, 9))
    T[:, :3, 3] *= 1e3
    code, said, err = run(capsys, "track", "kr16", written(tmp_path / "mm.csv", T))
    assert code == 1 and "OUT_OF_REACH" in said
    assert "read as metres" in err and '"x [mm]"' in err
    T[:, :3, 3] /= 1e3
    T[:, 0, 3] += 100.0  # far off, and a thousandth of it is no pose of the arm's either
    T[-1, 0, 3] = 1e5
    assert "metres" not in run(capsys, "track", "kr16", written(tmp_path / "far.csv", T))[2]


def test_a_gap_out_of_reach_says_how_far(capsys, arm, whole, tmp_path):
    T = arm.fk(cases.path(arm, 30))
    T[10:13, :3, 3] *= 3.0 / np.linalg.norm(T[10:13, :3, 3], axis=1)[:, None]
    said = run(capsys, "track", "kr16", written(tmp_path / "far.csv", T), "--degrees")[1]
    told = re.search(r"OUT_OF_REACH: out of reach; .* miss it by up to ([\d.]+) m", said)
    # the links end to end are 2.44 m
    assert told and 3.0 - 2.44 < float(told[1]) < 1.2


def test_semicolons_are_read(capsys, whole, tmp_path):
    text = whole.read_text()
    other = tmp_path / "semicolons.csv"
    other.write_text(text.replace(",", ";"))
    assert run(capsys, "track", "kr16", other) == run(capsys, "track", "kr16", whole)
    other.write_text(text.replace(",", ";").replace(".", ","))
    code, _, err = run(capsys, "track", "kr16", other)
    assert code == 2 and "row 1" in err and "decimals with a point" in err
    other.write_text(text.replace(",", ";", 2))
    code, _, err = run(capsys, "track", "kr16", other)
    assert code == 2 and "commas and semicolons" in err


def test_units_of_files_are_in_the_help(capsys):
    words = " ".join(run(capsys, "track", "--help")[1].replace("│", " ").split())
    assert "in m and rad (with --degrees deg)" in words and '"x [mm]"' in words


def test_a_path_is_closed_if_that_is_asked_for(capsys, tmp_path):
    tool = kv.pose(rpy=[3.1, 0, 0])[:3, :3]
    T = Path.circle([0.4, 0.2, 0.5], 0.15, orientation=tool).sample(60).T
    ring = written(tmp_path / "ring.csv", T)
    code, said, _ = run(capsys, "track", "panda", ring)
    assert code == 0 and re.search(r"closed, the joints end [\d.]+ rad from their start", said)
    code, said, _ = run(capsys, "track", "panda", ring, "--closed")
    assert code == 0 and "closed, and the joints end where they begin" in said
    turn = kv.load("kr16").fk(
        [[0, -1.2, 1, 0.3, 0.7, v] for v in np.linspace(-3, 2 * np.pi - 3, 60)]
    )
    code, said, _ = run(capsys, "track", "kr16", written(tmp_path / "turn.csv", turn), "--closed")
    assert code == 1 and "from the last row to the first: NOT_CLOSED: joint 'joint6' ends" in said
    code, _, err = run(capsys, "track", "panda", written(tmp_path / "arc.csv", T[:40]), "--closed")
    assert code == 2 and "closed asks for a path that ends with its first pose" in err


LIMITS = ["--max-velocity", 60, "--max-acceleration", 200, "--degrees"]


def test_a_motion_is_written_for_a_controller(capsys, arm, whole, tmp_path):
    out = tmp_path / "motion.csv"
    code, said, _ = run(capsys, "track", "kr16", whole, *LIMITS, "--rate", 100, "--out", out)
    assert code == 0 and re.search(r"in time: [\d.]+ s, along a joint spline whose tool", said)
    rows = rows_of(out)
    name = "joint{}_acceleration_deg_per_s2"
    most = max(abs(float(row[name.format(j)])) for row in rows for j in range(1, 7))
    q = np.radians([[float(row[f"joint{j}_deg"]) for j in range(1, 7)] for row in rows])
    assert 180.0 < most <= 200.0 + 1e-6 and rows[1]["t_s"] == "0.01"
    ends = arm.fk(cases.path(arm, 30)[[0, -1]])
    assert np.allclose(arm.fk(q[[0, -1]]), ends, atol=1e-6)
    told = json.loads(run(capsys, "track", "kr16", whole, *LIMITS, "--json")[1])
    assert told["motion"]["duration"] == float(rows[-1]["t_s"])
    # in radians the same motion
    limits = ["--max-velocity", np.radians(60), "--max-acceleration", np.radians(200)]
    other = json.loads(run(capsys, "track", "kr16", whole, *limits, "--json")[1])
    assert other["motion"]["duration"] == pytest.approx(told["motion"]["duration"])


def test_no_motion_is_written_of_a_path_with_gaps(capsys, broken, tmp_path):
    out = tmp_path / "motion.csv"
    code, said, err = run(capsys, "track", "kr16", broken, *LIMITS, "--out", out)
    assert code == 1 and not out.exists() and "rows 11 to 13: OUT_OF_REACH" in said
    assert "a path with gaps is no one motion" in err


def test_a_tolerance_is_kept_at_a_corner_or_told(capsys, tmp_path):
    corner = tmp_path / "corner.csv"
    ways = [(0.9, -0.2, 1.1), (0.9, 0.1, 1.1), (0.9, 0.1, 1.3)]
    lines = [f"{x},{y},{z},0.2,1.7,0.3" for x, y, z in ways]
    corner.write_text("\n".join(["x,y,z,roll,pitch,yaw", *lines]))
    argv = ["track", "kr16", corner, *LIMITS, "--tolerance", 1e-4]
    code, said, _ = run(capsys, *argv, "--json")
    assert code == 0 and 0.0 < json.loads(said)["motion"]["deviation"] <= 1e-4
    found = kv.paths.track(kv.load("kr16"), Path.from_file(corner), tolerance=1e-4, samples=20)
    strayed = dataclasses.replace(found, deviation=2e-4)
    _joint_path.Told(strayed, False).show()
    assert "warning: the tolerance of 0.1 mm is not reached" in capsys.readouterr().out
    spline = Joined(None, 5e-4, 0.0, 3, None, 0)
    timed = TimedPath(found, spline, None, 1e-4, 250.0, False)
    assert not timed.ok and dataclasses.replace(timed, tolerance=5e-4).ok

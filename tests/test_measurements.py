"""Measurement files: read as they were meant, or refused by name."""

import csv
import warnings

import numpy as np
import pytest

import kinverse as kv
from kinverse.calibration import read_measurements, tool_error
from kinverse.errors import InputError

ROBOT = kv.load("kr16")
SCARA = kv.load("adept_one")
ROWS = 12


def sheet(robot=ROBOT, seed=1, angle="deg", length="mm", rotations=False):
    """A header and cells as text, of an arm that is off by about a millimetre."""
    rng = np.random.default_rng(seed)
    q = robot.random(ROWS, rng)
    T = robot.fk(q)
    points = T[:, :3, 3] + rng.normal(0, 5e-4, (ROWS, 3))
    turns = np.array([kind == "R" for kind in robot.kinds])
    angles = {"deg": 180 / np.pi, "rad": 1.0, "mrad": 1e3}[angle]
    lengths = {"mm": 1e3, "m": 1.0, "cm": 1e2, "um": 1e6}[length]
    header = [
        f"{name} [{angle if turn else length}]"
        for name, turn in zip(robot.joint_names, turns, strict=True)
    ]
    header += [f"{name} [{length}]" for name in "xyz"]
    cells = np.hstack([q * np.where(turns, angles, lengths), points * lengths])
    if rotations:
        header += [f"{name} [{angle}]" for name in ("roll", "pitch", "yaw")]
        cells = np.hstack([cells, kv.se3.rpy_from_rotation(T[:, :3, :3]) * angles])
    return header, [[repr(float(v)) for v in row] for row in cells], q, points


def written(tmp_path, header, rows):
    path = tmp_path / "measured.csv"
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])
    return path


# ---------------------------------------------------------------------------- as they were meant
@pytest.mark.parametrize("robot", [ROBOT, SCARA], ids=["kr16", "adept_one"])
@pytest.mark.parametrize(("angle", "length"), [("deg", "mm"), ("rad", "m"), ("mrad", "um")])
def test_units_are_those_of_the_header(robot, angle, length, tmp_path):
    header, rows, q, points = sheet(robot, angle=angle, length=length)
    read = read_measurements(written(tmp_path, header, rows), robot)
    assert np.allclose(read.q, q, atol=1e-12) and np.allclose(read.measured, points, atol=1e-12)
    assert np.allclose(read.error, tool_error(robot, q, points), atol=1e-12)
    assert read.ignored == ()


@pytest.mark.parametrize("point", [".", ","])
def test_columns_may_be_parted_by_semicolons(tmp_path, point):
    header, rows, q, points = sheet()
    path = tmp_path / "measured.csv"
    lines = [";".join(header), "", *(";".join(row).replace(".", point) for row in rows)]
    path.write_text("\ufeff" + "\n".join(lines), encoding="utf-8")
    read = read_measurements(path, ROBOT)
    assert np.allclose(read.q, q, atol=1e-12) and np.allclose(read.measured, points, atol=1e-12)
    path.write_text("\n".join(lines).replace(point, point + "x", 1))
    with pytest.raises(InputError, match="row 1, column 'joint1"):
        read_measurements(path, ROBOT)


def test_columns_may_stand_in_any_order_with_others_between(tmp_path):
    header, rows, q, points = sheet()
    order = np.random.default_rng(2).permutation(len(header))
    head = ["time", *(f"  {header[k]} " for k in order), "note [deg]"]
    body = [["9:00", *(row[k] for k in order), "good"] for row in rows]
    path = written(tmp_path, head, body)
    path.write_bytes("\ufeff".encode() + path.read_bytes() + b"\r\n ,,\r\n")  # as a spreadsheet may
    read = read_measurements(path, ROBOT)
    assert np.allclose(read.q, q) and np.allclose(read.measured, points)
    assert read.ignored == ("time", "note [deg]")


def test_rotations_make_poses(tmp_path):
    header, rows, q, points = sheet(rotations=True)
    read = read_measurements(written(tmp_path, header, rows), ROBOT)
    assert read.measured.shape == (ROWS, 4, 4) and read.error.shape == (ROWS, 6)
    assert np.allclose(read.measured[:, :3, :3], ROBOT.fk(q)[:, :3, :3], atol=1e-9)
    assert np.allclose(read.measured[:, :3, 3], points)
    assert np.abs(read.error[:, 3:]).max() < 1e-8


# ---------------------------------------------------------------------------- headers
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("joint2 [deg]", "joint2", "column 'joint2' has no unit"),
        ("x [mm]", "x", "column 'x' has no unit"),
        ("x [mm]", "x []", "column 'x' has no unit"),
        ("y [mm]", "y [inch]", "column 'y' has the unit 'inch'; it must be m, cm, mm, um"),
        ("y [mm]", "y [deg]", "column 'y' has the unit 'deg'"),
        ("joint4 [deg]", "joint4 [mm]", "column 'joint4' has the unit 'mm'"),
        ("joint6 [deg]", "A6 [deg]", "no column joint6"),
        ("z [mm]", "Z [mm]", "no column z"),
        ("joint1 [deg]", "x [mm]", "column x is there more than once"),
        ("z [mm]", "z [mm", "no column z"),
    ],
)
def test_headers_that_say_too_little_are_refused_by_name(old, new, said, tmp_path):
    header, rows, *_ = sheet()
    header[header.index(old)] = new
    with pytest.raises(InputError) as caught:
        read_measurements(written(tmp_path, header, rows), ROBOT)
    assert said in str(caught.value) and "measured.csv" in str(caught.value)


def test_two_of_three_rotations_are_too_few(tmp_path):
    header, rows, *_ = sheet(rotations=True)
    header[-1] = "jaw [deg]"
    with pytest.raises(InputError, match="no column yaw"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_a_joint_called_x_cannot_be_told_from_the_tool(tmp_path):
    robot = kv.Robot.from_dh([0.3, 0.2], 0, 0, joints="RR", joint_names=["x", "turn"])
    path = written(tmp_path, ["x [deg]", "turn [deg]", "y [mm]", "z [mm]"], [["1"] * 4])
    with pytest.raises(InputError, match="joints called x"):
        read_measurements(path, robot)


# ---------------------------------------------------------------------------- rows
@pytest.mark.parametrize("cell", ["nan", "inf", "", "here", "1,5"])
def test_cells_that_are_no_numbers_are_named_by_row_and_column(cell, tmp_path):
    header, rows, *_ = sheet()
    rows[4][7] = cell
    with pytest.raises(InputError, match=r"row 5, column 'y \[mm\]'"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_every_bad_row_is_named_up_to_five(tmp_path):
    header, rows, *_ = sheet()
    for k in (1, 2, 3, 5, 8, 9, 10):
        rows[k][0] = "nan"
    with pytest.raises(InputError, match=r"row 2.*row 3.*row 4.*row 6.*row 9.* and 2 more"):
        read_measurements(written(tmp_path, header, rows), ROBOT)
    rows[1] = rows[1][:-1]
    with pytest.raises(InputError, match="row 2 has 8 cells, the first row 9"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_files_with_nothing_in_them_are_refused(tmp_path):
    header, rows, *_ = sheet()
    with pytest.raises(InputError, match="no measurements"):
        read_measurements(written(tmp_path, header, []), ROBOT)
    (tmp_path / "empty.csv").write_text("\n")
    with pytest.raises(InputError, match="empty"):
        read_measurements(tmp_path / "empty.csv", ROBOT)
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputError, match="not a CSV"):
        read_measurements(tmp_path / "picture.csv", ROBOT)
    with pytest.raises(FileNotFoundError):
        read_measurements(tmp_path / "nowhere.csv", ROBOT)


# ---------------------------------------------------------------------------- confused columns
def exchanged(names):
    def alter(header):
        one, other = (next(k for k, h in enumerate(header) if h.startswith(n)) for n in names)
        header[one], header[other] = header[other], header[one]

    return alter


def renamed(old, new):
    def alter(header):
        header[:] = [head.replace(old, new) for head in header]

    return alter


@pytest.mark.parametrize(
    ("alter", "said"),
    [
        (exchanged(["x", "y"]), "x, y, z read as y, x, z"),
        (exchanged(["x", "z"]), "x, y, z read as z, y, x"),
        (exchanged(["joint1", "joint2"]), "columns joint1 and joint2 exchanged"),
        (exchanged(["joint4", "joint6"]), "columns joint4 and joint6 exchanged"),
        (renamed("[deg]", "[rad]"), "joints in degrees"),
        (renamed("[mm]", "[m]"), "positions a thousandth as long"),
        (renamed("[mm]", "[um]"), "positions a thousand times as long"),
    ],
)
def test_confused_columns_and_units_are_found_out(alter, said, tmp_path):
    header, rows, *_ = sheet()
    alter(header)
    with pytest.raises(InputError, match=said):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_angles_in_radians_called_degrees_are_found_out(tmp_path):
    header, rows, *_ = sheet(angle="rad")
    renamed("[rad]", "[deg]")(header)
    with pytest.raises(InputError, match="joints in radians"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_a_joint_that_counts_the_other_way_is_found_out(tmp_path):
    header, rows, *_ = sheet()
    for row in rows:
        row[3] = repr(-float(row[3]))
    with pytest.raises(InputError, match="sign of joint4"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


def test_another_arm_is_refused_without_a_reason_made_up(tmp_path):
    header, rows, *_ = sheet(kv.load("ur5"), seed=3)
    header[:6] = [f"joint{k} [deg]" for k in range(1, 7)]
    with pytest.raises(InputError, match="zeros the robot's") as caught:
        read_measurements(written(tmp_path, header, rows), ROBOT)
    assert "confused" not in str(caught.value)


# ---------------------------------------------------------------------------- what says less
ROLL, PITCH, YAW = 9, 10, 11


def swapped(one, other):
    def alter(header, rows):
        for row in rows:
            row[one], row[other] = row[other], row[one]

    return alter


def scaled(columns, factor):
    def alter(header, rows):
        for row in rows:
            for at in columns:
                row[at] = repr(factor * float(row[at]))

    return alter


@pytest.mark.parametrize(
    ("alter", "said"),
    [
        (swapped(ROLL, YAW), "roll, pitch, yaw read as yaw, pitch, roll"),
        (swapped(ROLL, PITCH), "roll, pitch, yaw read as pitch, roll, yaw"),
        (scaled([ROLL, PITCH, YAW], np.pi / 180), "roll, pitch, yaw in radians"),
        (scaled([ROLL, PITCH, YAW], 180 / np.pi), "roll, pitch, yaw in degrees"),
        (scaled([YAW], np.pi / 180), "yaw alone in radians"),
        (scaled([PITCH], -1), "sign of pitch turned"),
        # the tool point is on the axis of joint6: only the rotation shows it
        (scaled([5], np.pi / 180), "joint6 alone in radians"),
        (scaled([5], -1), "sign of joint6 turned"),
    ],
)
def test_confused_rotations_are_found_out(alter, said, tmp_path):
    header, rows, *_ = sheet(rotations=True)
    alter(header, rows)
    with pytest.raises(InputError, match=said) as caught:
        read_measurements(written(tmp_path, header, rows), ROBOT)
    assert " rad (median)" in str(caught.value)


@pytest.mark.parametrize("robot", [ROBOT, SCARA], ids=["kr16", "adept_one"])
def test_one_column_in_another_unit_is_found_out(robot, tmp_path):
    for at, name in enumerate([*robot.joint_names, *"xyz"]):
        if robot is ROBOT and name == "joint6":
            continue  # the tool point is on its axis
        turns = at < robot.dof and robot.kinds[at] == "R"
        header, rows, *_ = sheet(robot)
        scaled([at], np.pi / 180 if turns else 1e-3)(header, rows)
        says = "in radians" if turns else "a thousand times as long"
        if name == robot.joint_names[-1] and robot is SCARA:
            continue  # its last joint turns the tool in its place
        with pytest.raises(InputError, match=f"with {name} alone {says}"):
            read_measurements(written(tmp_path, header, rows), robot)


def around(spread):
    """Measurements around one posture."""
    header, rows, q, points = sheet()
    rng = np.random.default_rng(6)
    q = np.array([0.2, -1.3, 1.4, 0.30, 0.34, 0.5]) + rng.uniform(-spread, spread, q.shape)
    points = ROBOT.fk(q)[:, :3, 3] + rng.normal(0, 5e-4, points.shape)
    return header, [[*map(repr, row)] for row in np.hstack([np.degrees(q), 1e3 * points]).tolist()]


def test_joints_exchanged_around_one_posture_are_found_out(tmp_path):
    # the tool is off by less than a hundredth of the arm
    header, rows = around(0.1)
    assert read_measurements(written(tmp_path, header, rows), ROBOT).error.shape == (ROWS, 3)
    swapped(3, 4)(header, rows)
    with pytest.raises(InputError, match="joint4 and joint5 exchanged") as caught:
        read_measurements(written(tmp_path, header, rows), ROBOT)
    assert 0.003 < float(str(caught.value).split("measured ")[1].split(" m ")[0]) < 0.019


@pytest.mark.parametrize("rotations", [False, True])
def test_a_shift_too_large_for_an_error_is_remarked_with_what_it_is(rotations, tmp_path):
    header, rows, q, points = sheet(rotations=rotations)
    for row in rows:
        row[8] = repr(float(row[8]) + 100.0)
    with pytest.warns(UserWarning, match=r"from there shifted by .*, 0\.1 m in the base frame"):
        read = read_measurements(written(tmp_path, header, rows), ROBOT)
    np.testing.assert_allclose(read.q, q, atol=1e-12)
    # the same of a tool that is longer than said
    long = ROBOT.with_tool(kv.pose([0, 0, 0.1]))
    header, rows, *_ = sheet(long, rotations=rotations)
    with pytest.warns(UserWarning, match=r"shifted by .*, 0\.\d+ m in the tool frame"):
        read_measurements(written(tmp_path, header, rows), ROBOT)


@pytest.mark.parametrize("name", ["kr16", "puma560", "ur5", "iiwa14", "adept_one", "planar3r"])
@pytest.mark.parametrize("rotations", [False, True])
def test_honest_measurements_are_never_refused(name, rotations, tmp_path):
    # a base frame off by less than a hundredth of the arm, and a poor calibration
    robot = kv.load(name)
    for share, seed in ((0.005, 4), (0.005, 5), (0.02, 6)):
        header, rows, q, points = sheet(robot, seed, rotations=rotations)
        off = 1e3 * share * np.abs(points).max()
        for row in rows:
            row[robot.dof] = repr(float(float(row[robot.dof]) + off))
        path = written(tmp_path, header, rows)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            assert len(read_measurements(path, robot).error) == ROWS
        assert all("much for an error" in str(warning.message) for warning in caught)
        assert share > 0.01 or not caught or name == "planar3r"  # 2 mm are much for 0.2 m

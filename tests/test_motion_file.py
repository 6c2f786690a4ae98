"""From a joint path to a motion, and from a motion to a file for a controller."""

import csv
import warnings

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.paths import Path, Trajectory, deviation, retime, track
from kinverse.paths.motion_file import motion_csv

TOOL = kv.pose(rpy=[0.2, 1.7, 0.3])[:3, :3]


@pytest.fixture(scope="module")
def arm():
    return kv.load("kr16")


@pytest.fixture(scope="module")
def line(arm):
    path = Path.line([0.9, -0.2, 1.1], [0.9, 0.1, 1.1], orientation=TOOL)
    return track(arm, path, tolerance=1e-4, samples=20)


def table(text):
    header, *rows = csv.reader(text.splitlines())
    return header, np.array(rows, float)


def test_a_joint_path_is_timed_and_saved(arm, line, tmp_path):
    pytest.importorskip("toppra")
    motion = retime(line, velocity=1.0, acceleration=4.0)
    motion.save(tmp_path / "motion.csv", arm, rate=100.0)
    header, values = table((tmp_path / "motion.csv").read_text())
    n = arm.dof
    assert header[:2] == ["t_s", "joint1_rad"]
    assert header[n + 1] == "joint1_velocity_rad_per_s"
    assert header[2 * n + 1] == "joint1_acceleration_rad_per_s2" and len(header) == 3 * n + 1
    t, q, speed, acceleration = values[:, 0], *np.split(values[:, 1:], 3, axis=1)
    assert np.allclose(np.diff(t)[:-1], 0.01) and 0.0 < np.diff(t)[-1] <= 0.01 + 1e-12
    assert t[-1] == motion.duration
    assert np.allclose(q[[0, -1]], line.q[[0, -1]], atol=1e-9)
    assert np.abs(speed[[0, -1]]).max() < 1e-9
    assert np.abs(speed).max() <= 1.0 + 1e-9 and np.abs(acceleration).max() <= 4.0 + 1e-9
    assert np.allclose(np.diff(q[:-1], axis=0), 0.005 * (speed[1:-1] + speed[:-2]), atol=1e-3)
    # the tool of every row is on the line
    assert np.abs(arm.fk(q)[:, [0, 2], 3] - [0.9, 1.1]).max() < 1e-6


def test_units_are_in_the_header_and_slides_in_metres():
    arm = kv.load("adept_one")
    q = np.array([[0.1, 0.2, 0.05, 0.3], [0.2, 0.3, 0.06, 0.1]] * 3).cumsum(axis=0) / 3
    motion = Trajectory.through(np.arange(6.0), q)
    header, rad = table(motion_csv(motion, arm, 2.0))
    assert header[1:5] == ["joint1_rad", "joint2_rad", "joint3_m", "joint4_rad"]
    assert header[7] == "joint3_velocity_m_per_s" and len(rad) == 11
    header, deg = table(motion_csv(motion, arm, 2.0, degrees=True))
    assert header[9:] == [
        *("joint1_acceleration_deg_per_s2", "joint2_acceleration_deg_per_s2"),
        *("joint3_acceleration_m_per_s2", "joint4_acceleration_deg_per_s2"),
    ]
    scale = np.tile([180 / np.pi, 180 / np.pi, 1.0, 180 / np.pi], 3)
    assert np.allclose(deg[:, 1:], scale * rad[:, 1:])


def test_a_motion_that_cannot_be_written_is_refused(arm, tmp_path):
    motion = Trajectory.through(np.arange(6.0), np.zeros((6, 6)))
    for rate in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(kv.InputError, match="rate must be positive"):
            motion.save(tmp_path / "motion.csv", arm, rate)
    with pytest.raises(kv.InputError, match="more than 5000000 rows"):
        motion.save(tmp_path / "motion.csv", arm, 1e300)
    with pytest.raises(kv.InputError, match=r"to a \.csv file, got 'motion.txt'"):
        motion.save(tmp_path / "motion.txt", arm)
    with pytest.raises(kv.InputError, match="has 6 joints, robot 'planar3r' 3"):
        motion.save(tmp_path / "motion.csv", kv.load("planar3r"))
    assert not list(tmp_path.iterdir())


def test_a_joint_path_with_gaps_is_not_timed(arm):
    T = arm.fk(cases.path(arm, 30))
    T[10:13, 0, 3] += 9.0
    with pytest.raises(kv.InputError, match="samples 10 to 12: OUT_OF_REACH"):
        retime(track(arm, T), 1.0, 4.0)


def test_poses_without_a_parameter_are_joined_by_the_way_of_the_tool(arm):
    T = arm.fk(cases.path(arm, 20))
    found = track(arm, np.repeat(T, 2, axis=0))
    curve = found.curve()
    assert len(curve.s) == 20  # poses that repeat the one before are one
    way = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    assert (np.diff(curve.s) >= way).all() and (np.diff(curve.s) < 1.2 * way).all()
    turning = arm.fk([0.1, -1.2, 1.0, 0.3, 0.8, 0.0]) @ np.array(
        [kv.pose(rpy=[0, 0, yaw]) for yaw in np.linspace(0, 1, 9)]
    )
    assert track(arm, turning).curve(degree=3).s[-1] == pytest.approx(0.1)


def test_a_spline_that_swings_at_a_corner_is_told(arm, line):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        line.curve()
    places = [[0.9, -0.2, 1.1], [0.9, 0.1, 1.1], [0.9, 0.1, 1.3]]
    path = Path.polyline(places, orientation=TOOL)
    found = track(arm, path, tolerance=1e-4, samples=20)
    with pytest.warns(UserWarning, match=r"strays by [\d.e-]+ m or more.*0.0001 m") as told:
        curve = found.curve()
    said = float(str(told[0].message).split(" by ")[1].split(" m ")[0])
    away = deviation(arm, curve, path).position
    assert 1e-4 < said <= away * 1.05 and said > 0.8 * away
    rounded = Path.polyline(places, blend=0.05, orientation=TOOL)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        track(arm, rounded, tolerance=2e-4, samples=60).curve(degree=3)

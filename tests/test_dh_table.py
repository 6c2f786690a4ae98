"""to_dh: the table of an arm is the arm."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import kinverse
import models
import oracle
from kinverse import load
from kinverse.errors import InputError
from kinverse.robot import Robot

CATALOGUE = sorted(p.stem for p in (Path(kinverse.__file__).parent / "robots").glob("*.toml"))
CONVENTIONS = ("standard", "modified")
both = pytest.mark.parametrize("convention", CONVENTIONS)


def size(robot):
    return 1.0 + np.abs(robot.frames[:, :3, 3]).sum() + np.abs(robot.limits).max()


def assert_same_arm(robot, convention, tolerance=1e-12):
    table = robot.to_dh(convention)
    again = Robot.from_dh(**table.arguments())
    q = robot.random(20, rng=1)
    np.testing.assert_allclose(again.fk(q), robot.fk(q), rtol=0, atol=tolerance * size(robot))
    assert again.kinds == robot.kinds and again.joint_names == robot.joint_names
    np.testing.assert_array_equal(again.limits, robot.limits)
    rows = np.column_stack([table.theta, table.d, table.a, table.alpha])
    slow = oracle.dh_fk(rows, table.joints, q[0], convention, table.base, table.tool)
    np.testing.assert_allclose(slow, robot.fk(q[0]), rtol=0, atol=tolerance * size(robot))
    return table


def frame(rng):
    R = oracle.about(rng.normal(size=3), rng.uniform(0, 3))
    return oracle.homogeneous(R, rng.normal(size=3))


def dh_arm(rng, twists, lengths, loose_ends):
    n = int(rng.integers(1, 9))
    joints = "".join(rng.choice(list("RRRPF"), size=n)) + "R"
    rows = {
        "alpha": rng.choice(twists, n + 1),
        "a": rng.choice(lengths, n + 1),
        "d": rng.choice(lengths, n + 1),
        "theta": rng.choice(twists, n + 1),
    }
    moving = len(joints.replace("F", ""))
    ends = {"base": frame(rng), "tool": frame(rng)} if loose_ends else {}
    convention = str(rng.choice(CONVENTIONS))
    return Robot.from_dh(
        **rows, **ends, joints=joints, convention=convention, limits=[(-2, 2)] * moving
    )


QUARTERS = np.deg2rad([0, 0, 90, -90, 180])


@both
@pytest.mark.parametrize("name", CATALOGUE)
def test_catalogue(name, convention):
    robot = load(name)
    if len(robot.kinds) != robot.dof or (robot.multiplier != 1.0).any():
        with pytest.raises(InputError, match="mimic"):
            robot.to_dh(convention)
    else:
        assert_same_arm(robot, convention)


@both
@pytest.mark.parametrize("name", ["panda", "ur5_robot", "ur10e_robot"])
def test_urdf_arms(name, convention):
    path = models.compas_urdf(name)
    tip = {"panda": "panda_link8"}.get(name, "tool0")
    assert_same_arm(load(str(path), tip=tip), convention)


@both
@given(seed=st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_random_chains(convention, seed):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 9))
    kinds = "".join(rng.choice(list("RRP"), size=m))
    frames = np.stack([frame(rng) for _ in range(m + 1)])
    assert_same_arm(Robot(frames, kinds, [(-2, 2)] * m), convention)


@both
@given(seed=st.integers(0, 10**6), loose=st.booleans())
@settings(max_examples=150, deadline=None)
def test_parallel_meeting_coincident_and_prismatic_axes(convention, seed, loose):
    rng = np.random.default_rng(seed)
    assert_same_arm(dh_arm(rng, QUARTERS, [0.0, 0.0, 0.3, -0.2], loose), convention)


# found by other draws than CI's: a normal 6 sizes off, angles that reading a table would round
@both
@given(seed=st.integers(0, 10**6), exponent=st.integers(-15, -1))
@example(seed=1048, exponent=-2)
@example(seed=4166, exponent=-12)
@example(seed=1496, exponent=-12)
@example(seed=1280, exponent=-6)
@settings(max_examples=150, deadline=None)
def test_nearly_parallel_and_nearly_meeting_axes(convention, seed, exponent):
    rng = np.random.default_rng(seed)
    little = 10.0**exponent
    twists = [*QUARTERS, little, np.pi - little, np.pi / 2 + little]
    robot = dh_arm(rng, twists, [0.0, little, 0.3], True)
    assert_same_arm(robot, convention)


@both
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_any_size(convention, scale):
    robot = load("puma560")
    frames = robot.frames.copy()
    frames[:, :3, 3] *= scale
    robot = Robot(frames, robot.kinds, robot.limits)
    again = Robot.from_dh(**robot.to_dh(convention).arguments())
    q = robot.random(20, rng=1)
    error = np.abs(again.fk(q) - robot.fk(q))
    assert error[:, :3, 3].max() < 1e-12 * scale and error[:, :3, :3].max() < 1e-12


@pytest.mark.parametrize("name", ["planar3r", "adept_one", "puma560", "irb1400", "rx160l", "irb6"])
def test_the_rows_of_the_source_come_back(name):
    """Up to the side an x axis takes where axes meet, the table is the printed one."""
    import tomllib

    text = (Path(kinverse.__file__).parent / "robots" / f"{name}.toml").read_text()
    given = tomllib.loads(text)
    unit = {"m": 1.0, "mm": 1e-3}[given["units"]["length"]]
    column = {key: np.array([row[key] for row in given["rows"]]) for key in ("a", "d", "alpha")}
    table = load(name).to_dh()
    np.testing.assert_allclose(table.a, unit * column["a"], atol=1e-12)
    np.testing.assert_allclose(np.abs(table.d), np.abs(unit * column["d"]), atol=1e-12)
    twist = np.deg2rad(column["alpha"])
    np.testing.assert_allclose(np.abs(np.sin(table.alpha)), np.abs(np.sin(twist)), atol=1e-12)
    np.testing.assert_array_equal(table.base, np.eye(4))
    np.testing.assert_array_equal(table.tool, np.eye(4))


def test_generic_rows_come_back_exactly():
    rng = np.random.default_rng(3)
    rows = {key: rng.uniform(0.2, 1.0, 6) for key in ("a", "d", "alpha", "theta")}
    for convention in CONVENTIONS:
        table = Robot.from_dh(**rows, convention=convention).to_dh(convention)
        if convention == "standard":
            # the first d and theta are the base's, which is where it was: axis 1 on its z
            np.testing.assert_array_equal(table.base, np.eye(4))
            np.testing.assert_array_equal(table.tool, np.eye(4))
        for key, values in rows.items():
            np.testing.assert_allclose(getattr(table, key), values, atol=1e-12)


def test_nearly_parallel_axes_get_a_fixed_row():
    robot = Robot.from_dh(a=0.3, d=0.1, alpha=[1e-6, 0.0, 0.0], joints="RRR")
    assert robot.to_dh().joints.count("F") == 1
    assert np.abs(robot.to_dh().d).max() < 1.0


@both
@pytest.mark.parametrize("sine", [0.9, 0.1, 1e-2, 1e-3, 1e-4, 1e-8, 1e-12])
def test_no_normal_is_so_far_off_that_digits_are_lost(convention, sine):
    """Two axes that pass at 0.3 m and cross wherever they do: rows stay near the arm."""
    rng = np.random.default_rng(4)
    for _ in range(10):
        tilt = oracle.homogeneous(oracle.about([np.cos(1), np.sin(1), 0], sine), [0.3, 0.2, 0.1])
        robot = Robot(np.stack([frame(rng), tilt, tilt, frame(rng)]), "RRR")
        table = assert_same_arm(robot, convention, 1e-13)
        assert np.abs(table.d).max() < 70 * size(robot)


@both
@pytest.mark.parametrize("off", [1e-15, 3e-14, -4e-13, 9e-13, 3e-12])
@pytest.mark.parametrize("quarter", [-90, 90, 180])
def test_angles_next_to_a_quarter_turn_are_kept(convention, off, quarter):
    """Where they are read, angles within 1e-12 of one are taken for it."""
    twist = oracle.about([1, 0, 0], np.deg2rad(quarter) + off)
    turn = oracle.about([0, 0, 1], np.deg2rad(quarter) + off)
    frames = np.stack([oracle.homogeneous(turn @ twist, [0.3, 0.1, 0.2])] * 9)
    robot = Robot(frames, "RRPRRPRR", [(-2, 2)] * 8)
    table = assert_same_arm(robot, convention, 2e-13)
    if quarter != 180:  # there the axes are nearly parallel as well
        assert ("F" in table.joints) == (1e-14 < abs(off) < 1e-12)


def test_offsets_are_folded_in_and_mimics_refused():
    straight = Robot.from_dh(a=[0.3, 0.2], d=0, alpha=[0.5, 0.0], joints="RR")
    state = dict(frames=straight.frames, kinds="RR")
    assert_same_arm(Robot(**state, offset=[0.3, -0.2]), "standard")
    for more in ({"source": [0, 0]}, {"multiplier": [1, 2]}, {"source": [1, 0]}):
        with pytest.raises(InputError, match="mimic"):
            Robot(**state, **more).to_dh()
    with pytest.raises(InputError, match="standard or modified"):
        straight.to_dh("craig")


def test_rows_are_read_only_and_small_lengths_are_kept():
    table = Robot.from_dh(a=[1e-6, 0.3], d=0, alpha=[1.0, 0.0], joints="RR").to_dh()
    assert table.a[0] == pytest.approx(1e-6, rel=1e-9)
    with pytest.raises(ValueError):
        table.a[0] = 1.0

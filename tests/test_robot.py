import copy
import pickle

import numpy as np
import pytest

import oracle
from kinverse.errors import InputError
from kinverse.robot import Robot

PUMA = dict(
    a=[0, 0.4318, 0.0203, 0, 0, 0],
    d=[0, 0, 0.15005, 0.4318, 0, 0],
    alpha=np.deg2rad([90, 0, -90, 90, -90, 0]),
)


def random_frames(count, rng):
    return np.stack(
        [
            oracle.homogeneous(
                oracle.about(rng.normal(size=3), rng.uniform(0, 3)), rng.normal(size=3)
            )
            for _ in range(count)
        ]
    )


def random_robot(seed, mimic=False):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(2, 9))
    kinds = "".join(rng.choice(["R", "R", "P"], size=m))
    more = {}
    if mimic:
        n = max(1, m // 2)
        source = np.concatenate([np.arange(n), rng.integers(0, n, m - n)])
        rng.shuffle(source)
        more = dict(source=source, multiplier=rng.uniform(-2, 2, m), offset=rng.uniform(-1, 1, m))
    n = len(set(more.get("source", range(m))))
    low = rng.uniform(-3, 0, n)
    limits = np.stack([low, low + rng.uniform(0.1, 3, n)], axis=1)
    return Robot(random_frames(m + 1, rng), kinds, limits, **more)


# ---------------------------------------------------------------------------- kinematics
@pytest.mark.parametrize("mimic", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_fk_and_jacobian_against_the_oracle(seed, mimic):
    robot = random_robot(seed, mimic)
    q = robot.random(7, rng=seed)
    T, J = robot.fk(q), robot.jacobian(q)
    for i in range(7):
        np.testing.assert_allclose(T[i], oracle.robot_fk(robot, q[i]), atol=1e-12)
        numeric = oracle.jacobian(lambda x: oracle.robot_fk(robot, x), q[i])
        np.testing.assert_allclose(J[i], numeric, atol=1e-7)


def test_leading_shapes():
    robot = Robot.from_dh(**PUMA)
    q = robot.random((2, 3), rng=0)
    T, J = robot.fk(q), robot.jacobian(q)
    assert T.shape == (2, 3, 4, 4) and J.shape == (2, 3, 6, 6)
    np.testing.assert_array_equal(T[1, 2], robot.fk(q[1, 2]))
    np.testing.assert_array_equal(J[1, 2], robot.jacobian(q[1, 2]))
    assert robot.fk(np.empty((0, 6))).shape == (0, 4, 4)
    assert robot.fk([0] * 6).shape == (4, 4)
    for bad in (np.zeros(5), 1.0, np.full(6, np.nan)):
        with pytest.raises(InputError):
            robot.fk(bad)
    with pytest.raises(TypeError):
        robot.jacobian(np.zeros(6, dtype=complex))


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", range(5))
def test_dh_against_the_oracle(seed, convention):
    rng = np.random.default_rng(seed)
    joints = "".join(rng.choice(list("RRPF"), size=7)) + "R"
    rows = rng.uniform(-1.5, 1.5, (8, 4))
    base, tool = random_frames(2, rng)
    robot = Robot.from_dh(
        theta=rows[:, 0],
        d=rows[:, 1],
        a=rows[:, 2],
        alpha=rows[:, 3],
        joints=joints,
        convention=convention,
        limits=[(-1, 1)] * (8 - joints.count("F")),
        base=base,
        tool=tool,
    )
    assert robot.kinds == joints.replace("F", "")
    for q in robot.random(5, rng=seed):
        expected = oracle.dh_fk(rows, joints, q, convention, base, tool)
        np.testing.assert_allclose(oracle.robot_fk(robot, q), expected, atol=1e-13)
        np.testing.assert_allclose(robot.fk(q), expected, atol=1e-13)


def test_standard_and_modified_rows_of_one_arm():
    """Shifting alpha and a by one row turns one convention into the other, up to the last link."""
    rng = np.random.default_rng(4)
    a, d, alpha, theta = rng.uniform(-1, 1, (4, 6))
    standard = Robot.from_dh(a, d, alpha, theta)
    modified = Robot.from_dh(
        np.r_[0, a[:-1]],
        d,
        np.r_[0, alpha[:-1]],
        theta,
        convention="modified",
        tool=oracle.homogeneous(oracle.rot_x(alpha[-1]), (a[-1], 0, 0)),
    )
    q = standard.random(20, rng=5)
    np.testing.assert_allclose(standard.fk(q), modified.fk(q), atol=1e-14)


def test_right_angles_leave_exact_zeros():
    robot = Robot.from_dh(**PUMA)
    rotations = robot.frames[:, :3, :3]
    assert set(np.unique(rotations)) == {-1.0, 0.0, 1.0}


# ---------------------------------------------------------------------------- new robots
@pytest.mark.parametrize("mimic", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_locked_is_the_same_arm(seed, mimic):
    robot = random_robot(seed, mimic)
    q = robot.random(rng=seed)
    keep = [0] if robot.dof < 3 else [0, 2]  # a robot of one joint: nothing is locked
    values = {robot.joint_names[j] if j % 2 else j: q[j] for j in range(robot.dof) if j not in keep}
    part = robot.locked(values)
    assert part.joint_names == tuple(robot.joint_names[j] for j in keep)
    np.testing.assert_array_equal(part.limits, robot.limits[keep])
    np.testing.assert_allclose(part.fk(q[keep]), robot.fk(q), atol=1e-12)
    np.testing.assert_allclose(part.jacobian(q[keep]), robot.jacobian(q)[:, keep], atol=1e-12)


def test_locked_refuses():
    robot = Robot.from_dh(**PUMA)
    for values, words in (
        ({"nosuch": 0.0}, "joint1, joint2"),
        ({6: 0.0}, "no free joint 6"),
        ({-1: 0.0}, "no free joint"),
        ({"joint1": 4.0}, "limits are"),
        ({"joint1": np.nan}, "limits are"),
        ({"joint1": 0.0, 0: 0.0}, "twice"),
        ({j: 0.0 for j in range(6)}, "no joint left"),
    ):
        with pytest.raises(InputError, match=words):
            robot.locked(values)
    assert robot.locked({"joint1": np.pi + 5e-10}).dof == 5
    assert robot.locked({}) == robot


def test_tool_and_base_compose():
    robot = random_robot(1)
    A, B = random_frames(2, np.random.default_rng(0))
    q = robot.random(4, rng=0)
    np.testing.assert_allclose(robot.with_tool(A).fk(q), robot.fk(q) @ A, atol=1e-13)
    np.testing.assert_allclose(robot.with_base(A).fk(q), A @ robot.fk(q), atol=1e-13)
    np.testing.assert_allclose(
        robot.with_tool(A).with_tool(B).frames, robot.with_tool(A @ B).frames, atol=1e-13
    )
    np.testing.assert_allclose(
        robot.with_base(A).with_base(B).frames, robot.with_base(B @ A).frames, atol=1e-13
    )
    with pytest.raises(InputError, match="tool"):
        robot.with_tool(np.zeros((4, 4)))


def test_with_limits():
    robot = Robot.from_dh(**PUMA)
    changed = robot.with_limits({"joint2": (-1, 1), 2: (0, 0.5)})
    assert changed.limits[1].tolist() == [-1, 1] and changed.limits[2].tolist() == [0, 0.5]
    assert changed.limits[0].tolist() == robot.limits[0].tolist()
    assert robot.with_limits(np.tile([-1, 1], (6, 1))).limits.max() == 1
    with pytest.raises(InputError, match="nosuch"):
        robot.with_limits({"nosuch": (0, 1)})
    with pytest.raises(InputError, match=r"\(6, 2\)"):
        robot.with_limits([(0, 1)])


def test_random_is_inside_and_repeatable():
    robot = random_robot(3)
    q = robot.random(1000, rng=1)
    assert (q >= robot.limits[:, 0]).all() and (q <= robot.limits[:, 1]).all()
    assert np.ptp(q, axis=0) == pytest.approx(np.ptp(robot.limits, axis=1), rel=0.05)
    np.testing.assert_array_equal(q, robot.random(1000, rng=1))
    np.testing.assert_array_equal(robot.random(), robot.random())
    assert robot.random().shape == (robot.dof,)
    generator = np.random.default_rng(0)
    assert (robot.random(rng=generator) != robot.random(rng=generator)).any()


# ---------------------------------------------------------------------------- a value
def test_copies_are_equal():
    robot = random_robot(5, mimic=True)
    robot.fk(robot.random())  # with the native chain made
    for twin in (pickle.loads(pickle.dumps(robot)), copy.deepcopy(robot), copy.copy(robot)):
        assert twin == robot and hash(twin) == hash(robot)
        np.testing.assert_array_equal(twin.fk(robot.random()), robot.fk(robot.random()))
    assert robot != robot.with_tool(oracle.homogeneous(p=(0, 0, 1)))
    assert robot != "robot"


def test_frozen():
    robot = Robot.from_dh(**PUMA)
    with pytest.raises(AttributeError):
        robot.name = "other"
    for array in (robot.frames, robot.limits, robot.source, robot.multiplier, robot.offset):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    frames = np.tile(np.eye(4), (2, 1, 1))
    made = Robot(frames, "R")
    frames[0, 0, 3] = 9.0
    assert made.frames[0, 0, 3] == 0.0
    assert "RRRRRR" in repr(robot) and "dof=6" in repr(robot)


def test_rounded_rotations_are_made_true():
    T = oracle.homogeneous(np.round(oracle.about([1, 2, 3], 0.7), 6))
    robot = Robot(np.stack([T, np.eye(4)]), "R")
    R = robot.frames[0, :3, :3]
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(R, T[:3, :3], atol=2e-6)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(joints="", a=0, d=0, alpha=0), "at least one moving row"),
        (dict(joints="FFFFFF"), "at least one moving row"),
        (dict(joints="RRRRRX"), "R .revolute"),
        (dict(convention="khalil"), "standard or modified"),
        (dict(a=[0, 1]), "a must be one number or 6"),
        (dict(d=np.nan), "d must be finite"),
        (dict(limits=[(0, 1)]), r"\(6, 2\)"),
        (dict(limits=[(1, 0)] * 6), "upside down"),
        (dict(limits=[(0, np.inf)] * 6), "finite"),
        (dict(limits=[(0, 1, 2)] * 6), "two finite numbers"),
        (dict(joints="RRRRRP"), "prismatic joint 'joint6' needs limits"),
        (dict(joint_names=["a"]), "6 names"),
        (dict(joint_names=["a"] * 6), "differ"),
        (dict(base=np.zeros((4, 4))), "base"),
        (dict(tool=np.zeros((3, 3))), "tool"),
    ],
)
def test_from_dh_refuses(arguments, words):
    with pytest.raises(InputError, match=words):
        Robot.from_dh(**{**PUMA, **arguments})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(kinds=""), "no moving joint"),
        (dict(kinds="RX"), "R .revolute"),
        (dict(frames=np.tile(np.eye(4), (4, 1, 1))), "3 frames"),
        (dict(source=[0, 2]), "without gaps"),
        (dict(source=[0.5, 0]), "without gaps"),
        (dict(source=[0]), "2 finite numbers"),
        (dict(multiplier=[1, np.nan]), "2 finite numbers"),
    ],
)
def test_robot_refuses(arguments, words):
    with pytest.raises(InputError, match=words):
        Robot(**{**dict(frames=np.tile(np.eye(4), (3, 1, 1)), kinds="RR"), **arguments})


def test_types_are_told_apart_from_values():
    with pytest.raises(TypeError):
        Robot.from_dh(a=["x"] * 6, d=0, alpha=0)
    with pytest.raises(TypeError):
        Robot.from_dh(a=1j, d=0, alpha=0)
    with pytest.raises(TypeError):
        Robot.from_dh(a=0, d=0, alpha=0, unknown=1)


def test_none_rows_of_limits_are_a_full_turn():
    robot = Robot.from_dh(a=1, d=0, alpha=0, joints="RR", limits=[None, (0, 1)])
    assert robot.limits.tolist() == [[-np.pi, np.pi], [0, 1]]


def test_as_many_joints_as_the_native_core_holds():
    most = Robot.from_dh(a=0.1, d=0, alpha=0, joints="R" * 32)
    assert most.fk(np.zeros(32)).shape == (4, 4)
    with pytest.raises(InputError, match="33 moving joints, more than 32"):
        Robot.from_dh(a=0.1, d=0, alpha=0, joints="R" * 33)


@pytest.mark.parametrize("pair", [(-1e308, 1e308), (0, 1.1e9), (-2e9, 0)])
def test_limits_that_are_no_limits_are_refused(pair):
    with pytest.raises(InputError, match="limits of joint 'joint2' must lie within"):
        Robot.from_dh(a=1, d=0, alpha=0, joints="RR", limits=[None, pair])
    wide = Robot.from_dh(a=1, d=0, alpha=0, joints="R", limits=[(-1e9, 1e9)])
    assert np.isfinite(wide.random(10)).all()


def test_frames_are_rigid_to_rounding_and_zeros_stay():
    rng = np.random.default_rng(0)
    for error in (1e-13, 9e-13, 1e-9):
        turn = oracle.about([0, 0, 1], 0.7) + np.diag([error, -error, error])
        frames = np.stack([oracle.homogeneous(turn, rng.normal(size=3))] * 4)
        R = Robot(frames, "RRR").frames[:, :3, :3]
        assert np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)).max() < 1e-15
        assert np.abs(R - turn).max() < 2 * error
        if error < 1e-12 / 2:
            assert (R[:, 2, :2] == 0).all() and (R[:, :2, 2] == 0).all()

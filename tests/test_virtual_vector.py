"""Virtual vectors: what completes the task of a redundant arm, and what does not."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.learning import VirtualVector
from kinverse.robot import Robot
from kinverse.solvers.closed_form.redundant import arm_angle, redundant_form


@pytest.fixture(scope="module")
def arm003():
    return kv.load("planar3r_003")


@pytest.fixture(scope="module")
def iiwa():
    return kv.load("iiwa14")


# Planar arms ------------------------------------------------------------------------------------


def test_the_sum_is_the_tools_direction(arm003):
    q = arm003.random(200, rng=1)
    T = arm003.fk(q)
    total = VirtualVector("angle_sum").of_joints(arm003, q)
    assert total.shape == (200, 1)
    assert np.abs(total[:, 0] - q.sum(axis=1)).max() < 1e-14
    both = VirtualVector("cos_sin").of_joints(arm003, q)
    assert np.abs(both - T[:, :2, 0]).max() < 1e-14
    assert (VirtualVector("cos").of_joints(arm003, q) == both[:, :1]).all()


@pytest.mark.parametrize("name", ["planar3r", "planar3r_003", "adept_one"])
@pytest.mark.parametrize("kind", ["cos", "cos_sin"])
def test_the_pose_tells_what_the_joints_tell(name, kind):
    robot = kv.load(name)
    q = robot.random(200, rng=2)
    virtual = VirtualVector(kind)
    assert np.abs(virtual.of_pose(robot, robot.fk(q)) - virtual.of_joints(robot, q)).max() < 1e-12


def test_the_pose_tells_a_sum_that_stays_within_a_turn(arm003):
    narrow = arm003.with_limits([[2.0, 3.1], [1.0, 2.0], [1.0, 2.5]])  # 4.0 to 7.6, around pi
    q = narrow.random(500, rng=3)
    virtual = VirtualVector("angle_sum")
    told = virtual.of_pose(narrow, narrow.fk(q))
    assert np.abs(told - virtual.of_joints(narrow, q)).max() < 1e-12
    assert told.max() > 2 * np.pi  # not the pose's own reading of an angle


def test_a_wide_sum_is_known_but_for_whole_turns(arm003):
    q = arm003.random(500, rng=4)
    virtual = VirtualVector("angle_sum")
    away = virtual.of_pose(arm003, arm003.fk(q)) - virtual.of_joints(arm003, q)
    turns = np.rint(away / (2 * np.pi))
    assert np.abs(away - 2 * np.pi * turns).max() < 1e-12
    assert set(np.unique(turns)) == {-1.0, 0.0, 1.0}


def test_signs_go_by_the_axes():
    flipped = Robot.from_dh(a=[0.3, 0.2, 0.1], d=0, alpha=[np.pi, 0, 0], joints="RRR")
    q = np.array([[0.3, 0.5, -0.2]])
    virtual = VirtualVector("angle_sum")
    assert np.abs(virtual.of_joints(flipped, q) - (0.3 - 0.5 + 0.2)).max() < 1e-15
    assert np.abs(virtual.of_pose(flipped, flipped.fk(q)) - 0.0).max() < 1e-12
    scara = kv.load("adept_one")
    value = VirtualVector("angle_sum").of_joints(scara, [0.5, 0.4, 0.1, 0.3])
    assert value == pytest.approx(0.5 + 0.4 - 0.3)


def test_mimic_joints_turn_the_tool_too():
    frames = np.tile(np.eye(4), (4, 1, 1))
    frames[1:, 0, 3] = 0.2
    robot = Robot(frames, "RRR", source=[0, 1, 1], multiplier=[1, 1, -2], offset=[0, 0.1, 0])
    q = robot.random(50, rng=5)
    virtual = VirtualVector("cos_sin")
    both = virtual.of_joints(robot, q)
    assert np.abs(both - robot.fk(q)[:, :2, 0]).max() < 1e-14
    assert np.abs(both - virtual.of_pose(robot, robot.fk(q))).max() < 1e-12


def test_the_axis_may_point_anywhere(arm003):
    tilted = arm003.with_base(kv.pose([1.0, 2.0, 3.0], rpy=[1.0, 0.5, -2.0]))
    tilted = tilted.with_tool(kv.pose([0.1, 0.0, 0.2], rpy=[0.2, 0.7, 0.1]))
    q = tilted.random(50, rng=6)
    virtual = VirtualVector("cos_sin")
    assert np.abs(virtual.of_joints(tilted, q) - virtual.of_joints(arm003, q)).max() < 1e-12
    assert (
        np.abs(virtual.of_pose(tilted, tilted.fk(q)) - virtual.of_joints(tilted, q)).max() < 1e-12
    )


def elbow_down(x, y, direction):
    """The joints of document 003's arm, elbow as in its ranges; None out of reach."""
    a, b, c = 10.0, 7.0, 5.0
    wx, wy = x - c * np.cos(direction), y - c * np.sin(direction)
    cosine = (wx * wx + wy * wy - a * a - b * b) / (2 * a * b)
    if abs(cosine) > 1.0:
        return None
    second = -np.arccos(cosine)
    first = np.arctan2(wy, wx) - np.arctan2(b * np.sin(second), a + b * np.cos(second))
    return np.array([first, second, direction - first - second])


def test_the_cosine_alone_does_not_determine_the_joints(arm003):
    q = arm003.random(2000, rng=7)
    low, high = arm003.limits.T
    doubles = []
    for row, T in zip(q, arm003.fk(q), strict=True):
        other = elbow_down(T[0, 3], T[1, 3], -row.sum())
        if other is not None and ((other >= low) & (other <= high)).all():
            doubles.append((row, other))
    doubles = [(a, b) for a, b in doubles if np.abs(a - b).max() > 0.5]
    assert len(doubles) > 100  # not rare: inside the document's own ranges
    one, other = (np.array(side) for side in zip(*doubles, strict=True))
    assert np.abs(arm003.fk(one)[:, :2, 3] - arm003.fk(other)[:, :2, 3]).max() < 1e-9
    cos, both = VirtualVector("cos"), VirtualVector("cos_sin")
    assert np.abs(cos.of_joints(arm003, one) - cos.of_joints(arm003, other)).max() < 1e-12
    apart = np.abs(both.of_joints(arm003, one) - both.of_joints(arm003, other)).max(axis=1)
    assert apart.min() > 1e-3


def test_the_cosine_determines_the_joints_where_the_sum_keeps_its_sign(arm003):
    q = arm003.random(2000, rng=8)
    for total, sign in ((np.sin(q.sum(axis=1)) > 0, 1.0), (np.sin(q.sum(axis=1)) < 0, -1.0)):
        assert total.sum() > 100
        for row, T in zip(q[total], arm003.fk(q[total]), strict=True):
            cosine = VirtualVector("cos").of_joints(arm003, row).item()
            again = elbow_down(T[0, 3], T[1, 3], sign * np.arccos(cosine))
            away = again - row  # the sum's own whole turns go into joint 3
            assert np.abs(away - 2 * np.pi * np.rint(away / (2 * np.pi))).max() < 1e-5


@pytest.mark.parametrize("kind", ["angle_sum", "cos", "cos_sin"])
def test_arms_that_are_not_planar_are_refused(kind):
    robot = kv.load("kr16")
    for call in (lambda v: v.of_joints(robot, np.zeros(6)), lambda v: v.of_pose(robot, np.eye(4))):
        with pytest.raises(kv.InputError, match="all parallel.*joint 2 is not parallel to joint 1"):
            call(VirtualVector(kind))
    slides = Robot(np.tile(np.eye(4), (3, 1, 1)), "PP", limits=[(0, 1), (0, 1)])
    with pytest.raises(kv.InputError, match="no turning joint"):
        VirtualVector(kind).of_joints(slides, np.zeros(2))


# Arm angle --------------------------------------------------------------------------------------


def by_hand(robot, q):
    """The angle of the shoulder-elbow-wrist plane, from joint frames in plain NumPy."""
    T, origins = np.eye(4), []
    for i in range(7):
        T = T @ np.asarray(robot.frames[i]) @ oracle.joint_motion("R", q[i])
        origins.append(T[:3, 3])
    shoulder, elbow, wrist = origins[1], origins[3], origins[5]
    line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    normal = np.cross(line, elbow - shoulder)  # of the arm's plane
    reference = np.cross(line, [0.0, 0.0, 1.0])  # of the plane of axis 1 and the line
    turn = np.cross(reference, normal) @ line
    return np.arctan2(turn, reference @ normal)


def test_the_arm_angle_is_that_of_the_elbows_plane(iiwa):
    q = iiwa.random(300, rng=1)
    values = VirtualVector("arm_angle").of_joints(iiwa, q)
    angles = np.array([by_hand(iiwa, row) for row in q])
    assert np.abs(values - np.column_stack([np.cos(angles), np.sin(angles)])).max() < 1e-9


def test_it_is_the_closed_forms_free_parameter(iiwa):
    q = iiwa.random(2000, rng=2)
    angle = arm_angle(iiwa, redundant_form(iiwa, "arm_angle"), q)
    values = VirtualVector("arm_angle").of_joints(iiwa, q)
    assert np.abs(values - np.column_stack([np.cos(angle), np.sin(angle)])).max() < 1e-9


def test_it_is_the_same_in_every_branch_at_a_value(iiwa):
    solver = kv.Analytic(limits="ignore").fit(iiwa)
    T = iiwa.fk(iiwa.random(20, rng=3))
    for value in (-2.0, 0.3, 1.5):
        s = solver.solve_at(T, value)
        assert len(s.q) > 40
        values = VirtualVector("arm_angle").of_joints(iiwa, s.q)
        assert np.abs(values - [np.cos(value), np.sin(value)]).max() < 1e-6


def test_it_does_not_heed_base_and_tool(iiwa):
    q = iiwa.random(50, rng=4)
    moved = iiwa.with_base(kv.pose([1.0, 2.0, 3.0], rpy=[0.5, 1.0, 2.0]))
    moved = moved.with_tool(kv.pose([0.1, 0.2, 0.3], rpy=[0.1, 0.2, 0.3]))
    virtual = VirtualVector("arm_angle")
    assert np.abs(virtual.of_joints(moved, q) - virtual.of_joints(iiwa, q)).max() < 1e-9


def test_an_elbow_with_an_offset_has_an_arm_angle():
    half = np.pi / 2
    robot = Robot.from_dh(
        a=[0, 0, 0.08, -0.08, 0, 0, 0], d=[0.3, 0, 0.3, 0, 0.4, 0, 0.1],
        alpha=[-half, half, half, -half, -half, half, 0], joints="RRRRRRR",
    )  # fmt: skip
    q = robot.random(500, rng=5)
    angle = arm_angle(robot, redundant_form(robot, "arm_angle"), q)
    values = VirtualVector("arm_angle").of_joints(robot, q)
    assert np.abs(values - np.column_stack([np.cos(angle), np.sin(angle)])).max() < 1e-9


def test_the_stretched_arm_and_the_arm_above_its_base_have_finite_values(iiwa):
    q = np.array([np.zeros(7), [0, 0, 0, 1.0, 0, 0, 0], [0.3, 0, 0, 0, 0, 0.5, 0]])
    assert_on_the_circle(VirtualVector("arm_angle").of_joints(iiwa, q))


def test_a_folded_arm_has_finite_values():
    half = np.pi / 2
    robot = Robot.from_dh(
        a=0, d=[0.3, 0, 0.4, 0, 0.4, 0, 0.1],
        alpha=[-half, half, half, -half, -half, half, 0], joints="RRRRRRR",
    )  # fmt: skip
    q = np.array([[0.1, 0.2, 0.3, np.pi, 0.4, 0.5, 0.6]])  # the wrist in the shoulder
    assert_on_the_circle(VirtualVector("arm_angle").of_joints(robot, q))


def assert_on_the_circle(values):
    assert np.isfinite(values).all()
    assert np.abs(np.linalg.norm(values, axis=1) - 1.0).max() < 1e-12


@pytest.mark.parametrize(
    "name, why",
    [
        ("panda", r"axes 5, 6, 7 \(wrist\)"),
        ("gen3", r"axes 1, 2, 3 \(shoulder\)"),
        ("kr16", "seven turning joints"),
    ],
)
def test_arms_without_an_arm_angle_are_told_why(name, why):
    robot = kv.load(name)
    with pytest.raises(kv.InputError, match=why):
        VirtualVector("arm_angle").of_joints(robot, np.zeros(robot.dof))


def test_a_shoulder_whose_first_axes_coincide_is_no_ball():
    half = np.pi / 2
    robot = Robot.from_dh(
        a=0, d=[0.3, 0, 0.4, 0, 0.4, 0, 0.1],
        alpha=[0, half, half, -half, -half, half, 0], joints="RRRRRRR",
    )  # fmt: skip
    with pytest.raises(kv.InputError, match="shoulder"):
        VirtualVector("arm_angle").of_joints(robot, np.zeros(7))


def test_an_elbow_axis_through_the_shoulder_is_refused():
    half = np.pi / 2
    robot = Robot.from_dh(
        a=0, d=[0.3, 0, 0, 0, 0.4, 0, 0.1],
        alpha=[-half, half, half, -half, -half, half, 0], joints="RRRRRRR",
    )  # fmt: skip
    with pytest.raises(kv.InputError, match="goes through its shoulder"):
        VirtualVector("arm_angle").of_joints(robot, np.zeros(7))


# Joints and functions ---------------------------------------------------------------------------


def test_a_joint_is_its_value():
    robot = kv.load("panda")
    q = robot.random(5, rng=1)
    virtual = VirtualVector(f"joint:{robot.joint_names[2]}")
    assert (virtual.of_joints(robot, q) == q[:, 2:3]).all()
    assert virtual.of_pose(robot, robot.fk(q)) is None
    assert virtual.names(robot) == (robot.joint_names[2],)
    with pytest.raises(kv.InputError, match=f"no free joint 'elbow'.*{robot.joint_names[0]}"):
        VirtualVector("joint:elbow").of_joints(robot, q)


def test_a_function_of_the_joints_is_taken(arm003):
    q = arm003.random(6, rng=1)
    one = VirtualVector(lambda q: q[:, 0] * q[:, 1])
    assert (one.of_joints(arm003, q)[:, 0] == q[:, 0] * q[:, 1]).all()
    assert one.of_pose(arm003, arm003.fk(q)) is None
    assert one.names(arm003) == ("<lambda>",)

    def ends(q):
        return q[:, [0, 2]]

    assert VirtualVector(ends).of_joints(arm003, q[0]).shape == (1, 2)
    assert VirtualVector(ends).names(arm003) == ("ends[0]", "ends[1]")
    assert VirtualVector(ends).clone() == VirtualVector(ends)


@pytest.mark.parametrize("kind", ["angle_sum", "cos", "cos_sin"])
def test_there_is_a_name_for_each_value(arm003, kind):
    virtual = VirtualVector(kind)
    assert len(virtual.names(arm003)) == virtual.of_joints(arm003, np.zeros(3)).shape[1]


@pytest.mark.parametrize(
    "function, why",
    [
        (lambda q: q[0], r"must return \(4,\) or \(4, k\)"),
        (lambda q: q[:, 0] * np.nan, "finite"),
        (lambda q: 1.0, "must return"),
    ],
)
def test_functions_that_return_something_else_are_refused(arm003, function, why):
    with pytest.raises(kv.InputError, match=why):
        VirtualVector(function).of_joints(arm003, np.zeros((4, 3)))


@pytest.mark.parametrize("kind", ["sin", None, 3, ("joint", "joint1")])
def test_unknown_kinds_are_refused_by_name(arm003, kind):
    with pytest.raises(kv.InputError, match="angle_sum, cos, cos_sin, arm_angle, joint:NAME"):
        VirtualVector(kind).of_joints(arm003, np.zeros(3))


def test_bad_joints_and_poses_are_refused(arm003):
    virtual = VirtualVector()
    with pytest.raises(kv.InputError, match="finite"):
        virtual.of_joints(arm003, [[0.0, np.nan, 0.0]])
    with pytest.raises(kv.InputError, match="shape"):
        virtual.of_joints(arm003, np.zeros(4))
    with pytest.raises(kv.InputError, match="shape"):
        virtual.of_joints(arm003, np.zeros((2, 2, 3)))
    with pytest.raises(kv.InputError, match="rigid"):
        virtual.of_pose(arm003, np.ones((4, 4)))
    assert virtual.of_joints(arm003, np.zeros((0, 3))).shape == (0, 2)
    assert virtual.of_pose(arm003, np.zeros((0, 4, 4))).shape == (0, 2)

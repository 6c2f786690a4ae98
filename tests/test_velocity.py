import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import oracle
from kinverse import load, se3
from kinverse import velocity as vel
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.screw import screw_exp

shapes = st.tuples(st.integers(1, 6), st.integers(1, 9), st.integers(0, 10**6))


def jacobian(shape):
    m, n, seed = shape
    return np.random.default_rng(seed).normal(size=(m, n))


def rank_deficient(m, n, rank, rng):
    return rng.normal(size=(m, rank)) @ rng.normal(size=(rank, n))


# ---------------------------------------------------------------------------- measures
@given(shapes)
@settings(max_examples=60, deadline=None)
def test_manipulability_is_the_root_of_the_determinant(shape):
    J = jacobian(shape)
    gram = J @ J.T if J.shape[0] <= J.shape[1] else J.T @ J
    assert vel.manipulability(J) == pytest.approx(np.sqrt(np.linalg.det(gram)), rel=1e-6)


def test_manipulability_of_two_links_is_the_sine_of_the_elbow():
    """Yoshikawa 1985, section 4: w = l1 l2 |sin t2|."""
    arm = Robot.from_dh(a=[0.4, 0.3], d=0, alpha=0, joints="RR")
    for elbow in (0.0, 0.3, 1.57, -2.0, np.pi):
        J = arm.jacobian([0.7, elbow])[:2]
        assert vel.manipulability(J) == pytest.approx(0.12 * abs(np.sin(elbow)), abs=1e-15)


def test_condition_number():
    assert vel.condition_number(np.eye(3)) == 1.0
    assert vel.condition_number(np.diag([4.0, 2.0])) == 2.0
    assert vel.condition_number(np.diag([1.0, 0.0])) == np.inf
    assert vel.condition_number(np.zeros((2, 3))) == np.inf
    assert vel.condition_number(np.diag([1.0, 1e-14])) == pytest.approx(1e14)


@pytest.mark.parametrize("name", ["puma560", "adept_one", "iiwa14"])
def test_one_unit_makes_numbers_that_do_not_depend_on_the_units_of_length(name):
    robot = load(name)
    frames = robot.frames.copy()
    frames[:, :3, 3] *= 1000.0  # the same arm in millimetres
    slides = np.array([kind == "P" for kind in robot.kinds])
    limits = robot.limits * np.where(slides, 1000.0, 1.0)[:, None]
    large = Robot(frames, robot.kinds, limits)
    q = robot.random(5, rng=0)
    Q = q * np.where(slides, 1000.0, 1.0)
    L, M = vel.characteristic_length(robot), vel.characteristic_length(large)
    assert M == pytest.approx(1000.0 * L)
    a = vel.homogeneous(robot.jacobian(q), L, prismatic=slides)
    b = vel.homogeneous(large.jacobian(Q), M, prismatic=slides)
    np.testing.assert_allclose(a, b, atol=1e-12)


def test_the_characteristic_length_is_the_mean_lever():
    one = Robot.from_dh(a=[0.7], d=0, alpha=0, joints="R")
    assert vel.characteristic_length(one) == pytest.approx(0.7)
    slide = Robot.from_dh(a=0, d=0, alpha=0, joints="P", limits=[(0, 1)])
    assert vel.characteristic_length(slide) == 1.0


# ---------------------------------------------------------------------------- directions
@given(shapes, st.integers(1, 6))
@settings(max_examples=60, deadline=None)
def test_directions_make_up_the_jacobian(shape, rank):
    m, n, seed = shape
    rank = min(rank, m, n)
    J = rank_deficient(m, n, rank, np.random.default_rng(seed))
    d = vel.singular_directions(J)
    assert d.rank == rank
    k = len(d.values)
    np.testing.assert_allclose(d.motion[:, :k] * d.values @ d.joints[:, :k].T, J, atol=1e-12)
    np.testing.assert_allclose(d.motion[:, d.rank :].T @ J, 0, atol=1e-9)  # cannot be made
    np.testing.assert_allclose(J @ d.joints[:, d.rank :], 0, atol=1e-9)  # moves nothing
    basis, projector = vel.null_space(J), vel.null_projector(J)
    assert basis.shape == (n, n - rank)
    np.testing.assert_allclose(basis @ basis.T, projector, atol=1e-9)
    np.testing.assert_allclose(projector @ projector, projector, atol=1e-12)


def test_the_lost_direction_of_a_stretched_arm():
    puma = load("puma560")
    # the wrist straight: axes 4 and 6 in line, one rotation is lost
    d = vel.singular_directions(puma.jacobian([0.3, -0.4, 0.5, 0.6, 0.0, 0.7]))
    assert d.rank == 5
    lost = d.motion[:, 5]
    # the tool point is the wrist centre: what is lost is a turn about the axis square to 4 and 5,
    # and no motion of the point alone
    T = puma.fk([0.3, -0.4, 0.5, 0.6, 0.0, 0.7])
    assert abs(lost[3:] @ T[:3, 2]) < 1e-12
    moving = d.joints[:, 5]
    np.testing.assert_allclose(np.abs(moving[[3, 5]]), np.sqrt(0.5), atol=1e-12)


def test_self_motion_of_seven_joints_keeps_the_tool_still():
    iiwa = load("iiwa14")
    q = np.array([0.3, 0.6, -0.2, 1.1, 0.4, -0.8, 0.5])
    T = iiwa.fk(q)
    for _ in range(200):
        q = q + 1e-3 * vel.null_space(iiwa.jacobian(q))[:, 0] * np.sign(
            vel.null_space(iiwa.jacobian(q))[0, 0]
        )
    assert np.abs(iiwa.fk(q) - T).max() < 2e-3
    assert np.abs(q - [0.3, 0.6, -0.2, 1.1, 0.4, -0.8, 0.5]).max() > 0.05


# ---------------------------------------------------------------------------- steps
@given(shapes)
@settings(max_examples=60, deadline=None)
def test_steps_are_least_squares(shape):
    J = jacobian(shape)
    m, n, seed = shape
    error = np.random.default_rng(seed + 1).normal(size=m)
    np.testing.assert_allclose(
        vel.inverse_step(J, error), np.linalg.lstsq(J, error, rcond=1e-10)[0], atol=1e-8
    )
    tall = np.vstack([J, 0.3 * np.eye(n)])
    wanted = np.linalg.lstsq(tall, np.concatenate([error, np.zeros(n)]), rcond=None)[0]
    np.testing.assert_allclose(vel.damped_step(J, error, 0.3), wanted, atol=1e-12)
    longest = np.linalg.norm(error) / (2 * 0.3)
    assert np.linalg.norm(vel.damped_step(J, error, 0.3)) <= longest * (1 + 1e-12)


def test_singular_jacobians_give_finite_steps():
    for J in (np.zeros((6, 6)), np.diag([1.0, 0.0, 1.0]), np.ones((3, 7))):
        error = np.ones(J.shape[0])
        for step in (vel.inverse_step(J, error), vel.damped_step(J, error, 0.0)):
            assert np.isfinite(step).all()


def test_the_secondary_motion_does_not_disturb():
    iiwa = load("iiwa14")
    q = iiwa.random(5, rng=3)
    J = iiwa.jacobian(q)
    rng = np.random.default_rng(0)
    error, other = rng.normal(size=(5, 6)), rng.normal(size=(5, 7))
    step = vel.inverse_step(J, error, secondary=other)
    np.testing.assert_allclose(np.einsum("kij,kj->ki", J, step), error, atol=1e-9)
    assert np.abs(step - vel.inverse_step(J, error)).max() > 0.1


def test_damping_sets_in_below_the_threshold_and_is_continuous():
    arm = Robot.from_dh(a=[0.4, 0.3], d=0, alpha=0, joints="RR")
    elbows = np.linspace(-0.5, 0.5, 101)
    J = arm.jacobian(np.column_stack([np.zeros(101), elbows]))[:, :2]
    damping = vel.variable_damping(J, threshold=0.03, greatest=0.2)
    w = 0.12 * np.abs(np.sin(elbows))
    np.testing.assert_allclose(damping, 0.2 * np.maximum(0, 1 - w / 0.03), atol=1e-12)
    assert damping[50] == pytest.approx(0.2) and damping[0] == 0.0


@pytest.mark.parametrize("name", ["puma560", "iiwa14", "ur5"])
def test_newton_steps_arrive(name):
    """Quadratic convergence tells that the step is the inverse of the motion."""
    robot = load(name)
    middle = robot.limits.mean(axis=1) + 0.3
    target = robot.fk(middle)
    q = middle + 0.02 * np.random.default_rng(0).normal(size=robot.dof)
    sizes = []
    for _ in range(5):
        T = robot.fk(q)
        error = np.concatenate(
            [target[:3, 3] - T[:3, 3], se3.rotation_log(target[:3, :3] @ T[:3, :3].T)]
        )
        sizes.append(np.linalg.norm(error))
        q = q + vel.inverse_step(robot.jacobian(q), error)
    assert sizes[-1] < 1e-13 and sizes[2] < 50 * sizes[1] ** 2 + 1e-13


def test_damped_steps_pull_through_a_singular_posture():
    robot = load("puma560")
    q = np.array([0.3, -0.4, 0.5, 0.6, 1e-7, 0.7])
    J = robot.jacobian(q)
    error = np.array([0, 0, 0, 0.01, 0.01, 0.01])
    plain = vel.inverse_step(J, error)
    damped = vel.damped_step(J, error, vel.variable_damping(J, 1e-3, 0.05))
    assert np.abs(plain).max() > 1e3 and np.abs(damped).max() < 0.11


# ---------------------------------------------------------------------------- tasks, batches
@pytest.mark.parametrize("task", oracle.TASKS)
def test_task_rows(task):
    robot = load("kr16")
    q = robot.random((2, 3), rng=0)
    J = vel.task_jacobian(robot, q, task)
    assert J.shape[:2] == (2, 3) and J.shape[-1] == 6
    assert vel.manipulability(J).shape == (2, 3)
    d = vel.singular_directions(J)
    assert d.motion.shape == (2, 3, J.shape[-2], J.shape[-2]) and d.joints.shape == (2, 3, 6, 6)
    scaled = vel.homogeneous(J, 0.5, task)
    rows = {"pose": 3, "position": 3, "position_axis": 3, "planar": 2, "schoenflies": 3}[task]
    np.testing.assert_allclose(scaled[..., :rows, :], 2 * J[..., :rows, :])
    np.testing.assert_array_equal(scaled[..., rows:, :], J[..., rows:, :])


def test_batches_are_singles():
    J = np.random.default_rng(0).normal(size=(4, 3, 6, 7))
    error = np.random.default_rng(1).normal(size=(4, 3, 6))
    for one in (
        vel.manipulability,
        vel.condition_number,
        vel.null_projector,
        lambda J: vel.variable_damping(J, 1.0, 0.1),
        lambda J: vel.singular_directions(J).values,
    ):
        np.testing.assert_allclose(one(J)[2, 1], one(J[2, 1]), atol=1e-12)
    damping = vel.variable_damping(J, 30.0, 0.1)
    step = vel.damped_step(J, error, damping)
    np.testing.assert_allclose(
        step[2, 1], vel.damped_step(J[2, 1], error[2, 1], damping[2, 1]), atol=1e-12
    )
    np.testing.assert_allclose(
        vel.inverse_step(J, error)[2, 1], vel.inverse_step(J[2, 1], error[2, 1]), atol=1e-12
    )
    assert vel.inverse_step(J, error[0, 0]).shape == (4, 3, 7)  # one error for all


def test_the_jacobian_given_is_left_alone():
    J = np.random.default_rng(0).normal(size=(6, 6))
    before = J.copy()
    vel.homogeneous(J, 0.1)
    np.testing.assert_array_equal(J, before)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: vel.manipulability(np.zeros(6)),
        lambda: vel.manipulability(np.full((6, 6), np.nan)),
        lambda: vel.homogeneous(np.eye(6), 0.0),
        lambda: vel.homogeneous(np.eye(6), 1.0, "planar"),
        lambda: vel.homogeneous(np.eye(6), 1.0, "pose", [True, False]),
        lambda: vel.homogeneous(np.eye(6), 1.0, "size"),
        lambda: vel.null_space(np.zeros((2, 6, 7))),
        lambda: vel.inverse_step(np.eye(6), np.zeros(5)),
        lambda: vel.inverse_step(np.eye(6), np.zeros(6), np.zeros(7)),
        lambda: vel.damped_step(np.eye(6), np.zeros(6), -0.1),
        lambda: vel.damped_step(np.eye(6), np.zeros(6), np.nan),
        lambda: vel.variable_damping(np.eye(6), 0.0, 0.1),
        lambda: vel.variable_damping(np.eye(6), 1.0, -0.1),
    ],
)
def test_bad_input_is_named(wrong):
    with pytest.raises(InputError):
        wrong()


def test_screws_are_what_columns_of_the_jacobian_are():
    """A joint's column, moved to the origin, is the twist of its exponential."""
    robot = load("puma560")
    q = np.array([0.3, -0.4, 0.5, 0.6, 0.2, 0.7])
    T, J = robot.fk(q), robot.jacobian(q)
    for j in range(6):
        w = J[3:, j]
        twist = np.concatenate([J[:3, j] - np.cross(w, T[:3, 3]), w])
        moved = q.copy()
        moved[j] += 0.4
        np.testing.assert_allclose(screw_exp(0.4 * twist) @ T, robot.fk(moved), atol=1e-13)

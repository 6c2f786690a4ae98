"""Joint angles for which the real tool, not the computed one, reaches the target."""

import pickle

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.dummy import DummyRegressor

import kinverse as kv
import oracle
from fakes import Says
from kinverse import se3
from kinverse.bench.real_arm import GEARS, TARGET_POINT, real_arm
from kinverse.calibration import (
    Compensated,
    FourierErrorModel,
    GeometricErrorModel,
    PolynomialErrorModel,
    ZeroErrorModel,
    make_model,
    tool_error,
)
from kinverse.errors import InputError
from kinverse.status import Status

KR16 = kv.load("kr16").with_tool(kv.pose(TARGET_POINT))
CHOSEN = {"joint": "geometric:2", "tool": "geometric+fourier:2"}


def zero(robot, columns=3):
    q = robot.random(4, 0)
    return ZeroErrorModel().fit(q, np.zeros((4, columns)))


def fitted(text="geometric:2", gears="joint", seed=1, rows=300):
    """A real arm and a model of it."""
    arm, rng = real_arm(np.random.default_rng([seed, 1]), gears), np.random.default_rng([seed, 2])
    q = KR16.random(rows, rng)
    error = tool_error(KR16, q, arm.measured(q, rng))
    return arm, make_model(text, KR16).fit(q, error)


# ---------------------------------------------------------------------------- the contract
@pytest.mark.parametrize(
    ("name", "inner"),
    [
        ("kr16", kv.Analytic()),
        ("kr16", kv.FirstOf([kv.Analytic(), kv.Numerical()])),
        ("puma560", kv.Numerical(max_starts=50)),
        ("panda", kv.Numerical()),
        ("planar3r", kv.Analytic(task="planar")),
        ("adept_one", kv.Analytic(windings="all")),
        ("ur5", kv.Numerical(task="position_axis")),
        ("kr16", kv.Analytic(limits="ignore")),
    ],
    ids=repr,
)
def test_without_an_error_it_keeps_the_contract_of_a_solver(name, inner):
    robot = kv.load(name)
    kv.check_solver(Compensated(inner, zero(robot)), robot)


@pytest.mark.parametrize("columns", [3, 6])
def test_without_an_error_it_answers_as_the_solver_inside(columns):
    robot = kv.load("kr16")
    q = robot.random(200, 3)
    inner = kv.Analytic().fit(robot)
    solver = Compensated(kv.Analytic(), zero(robot, columns)).fit(robot)
    for seed in (None, q):
        one, other = inner.solve(robot.fk(q), seed), solver.solve(robot.fk(q), seed)
        assert np.array_equal(one.count, other.count) and np.array_equal(one.status, other.status)
        # near a wrist that is straight two angles are known as a sum only
        assert np.median(np.abs(one.q - other.q)) < 1e-12
        assert np.abs(one.q - other.q).max() < 1e-4
        assert np.array_equal(one.branch, other.branch)
        assert one.branch_labels == other.branch_labels


# ---------------------------------------------------------------------------- the real tool
@pytest.mark.parametrize("gears", GEARS)
def test_the_real_tool_reaches_the_target(gears):
    arm, model = fitted(CHOSEN[gears], gears)
    q = KR16.random(200, 4)
    T = KR16.fk(q)
    s = Compensated(kv.Analytic(), model).fit(KR16).solve(T, q_seed=q)
    assert s.ok.mean() > 0.95
    missed = arm.position(s.q) - T[s.pose_index, :3, 3]
    before = arm.position(q) - T[:, :3, 3]
    rms = [np.sqrt((error**2).sum(axis=1).mean()) for error in (before, missed)]
    assert rms[0] > 5e-4 and rms[1] < 1e-4
    low, high = KR16.limits.T
    assert ((low <= s.q) & (s.q <= high)).all()


@pytest.mark.parametrize("task", ["pose", "position", "position_axis", "schoenflies"])
def test_what_is_reported_is_true_of_forward_kinematics_plus_model(task):
    _, model = fitted("geometric+fourier:1")
    q = KR16.random(40, 5)
    T = KR16.fk(q)
    s = Compensated(kv.Numerical(task=task), model).fit(KR16).solve(T)
    assert s.ok.mean() > 0.8
    real = np.array([oracle.robot_fk(KR16, values) for values in s.q])
    far = np.linalg.norm(real[:, :3, 3] + model.predict(s.q) - T[s.pose_index, :3, 3], axis=1)
    assert far.max() <= 1e-6 and np.allclose(s.position_error, far, atol=1e-10)
    if task == "pose":
        turned = se3.rotation_log(real[:, :3, :3] @ np.swapaxes(T[s.pose_index][:, :3, :3], 1, 2))
        assert np.linalg.norm(turned, axis=1).max() <= 1e-6


def test_a_model_of_poses_corrects_rotations_too():
    robot = kv.load("puma560")
    rng = np.random.default_rng(6)
    off = np.array([kv.pose(*rng.normal(0, 1e-3, (1, 3)), rpy=[1e-3, 2e-3, 0]) for _ in range(7)])
    real = kv.Robot(robot.frames @ off, robot.kinds, robot.limits)
    q, unseen = robot.random(60, 7), robot.random(100, 8)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, real.fk(q)))
    solver = Compensated(kv.Analytic(), model).fit(robot)
    s = solver.solve(robot.fk(unseen))
    T = real.fk(s.q)
    goal = robot.fk(unseen)[s.pose_index]
    assert s.ok.mean() > 0.9
    assert np.abs(T - goal).max() < 2e-6
    assert np.abs(solver.real_fk(s.q) - T).max() < 1e-8


def test_every_branch_that_stays_inside_the_limits_is_kept():
    _, model = fitted()
    q = KR16.random(200, 9)
    T, inner = KR16.fk(q), kv.Analytic().fit(KR16)
    nominal, s = inner.solve(T), Compensated(kv.Analytic(), model).fit(KR16).solve(T)
    fewer = np.flatnonzero(s.count < nominal.count)
    assert len(fewer) < 10
    for i in np.flatnonzero(s.count == nominal.count):
        # branches of a pose lie far from each other, corrections are small but near singularities
        assert np.median(np.abs(s[i].q - nominal[i].q)) < 0.05


def test_a_wrist_nearly_straight_is_followed_with_the_solver_inside():
    # a correction of a millimetre turns joints 4 and 6 by a large angle here
    _, model = fitted("fourier:2")
    q = KR16.random(100, 10)
    q[:, 4] = np.linspace(-0.02, 0.02, 100)
    s = Compensated(kv.Analytic(), model).fit(KR16).solve(KR16.fk(q), q_seed=q)
    assert s.ok.mean() > 0.9 and s.position_error.max() <= 1e-6


def test_the_same_bits_alone_and_in_a_batch():
    _, model = fitted("geometric+fourier:2+polynomial:3:legendre")
    q = KR16.random(60, 11)
    T, solver = KR16.fk(q), Compensated(kv.Analytic(), model).fit(KR16)
    whole = solver.solve(T, q_seed=q)
    for i in range(60):
        one = solver.solve(T[i], q_seed=q[i])
        assert np.array_equal(one.q, whole[i].q)
        assert np.array_equal(one.position_error, whole[i].position_error)
    again = pickle.loads(pickle.dumps(solver)).solve(T, q_seed=q)
    assert np.array_equal(again.q, whole.q)


def test_a_model_that_does_not_repeat_after_a_turn_is_asked_where_the_joint_stands():
    robot = kv.load("kr16")
    q = robot.random(300, 12)
    # joint 6 turns almost twice: a ramp tells its windings apart
    error = np.column_stack([1e-3 * q[:, 5], np.zeros((300, 2))])
    model = PolynomialErrorModel(1).fit(q, error)
    unseen = robot.random(60, 13)
    T = robot.fk(unseen)
    solver = Compensated(kv.Analytic(windings="all"), model).fit(robot)
    s = solver.solve(T)
    assert (s.count > kv.Analytic().fit(robot).solve(T).count).any()
    far = robot.fk(s.q)[:, :3, 3] + model.predict(s.q) - T[s.pose_index, :3, 3]
    assert np.abs(far).max() < 1e-6


class Restless(BaseEstimator):
    """Turns the first joint back below half a turn and on above: no winding of zero stays."""

    def __init__(self, robot):
        self.robot = robot

    def fit(self, q=None, error=None):
        self.fitted_ = True
        return self

    def predict(self, q):
        p = self.robot.fk(q)[:, :3, 3]
        turn = np.where(q[:, 0] < np.pi, 0.02, -0.05)
        R = se3.rotation_from_axis(np.tile([0.0, 0.0, 1.0], (len(q), 1)), turn)
        return (R @ p[:, :, None])[:, :, 0] - p


def test_what_finds_no_rest_between_two_windings_is_no_solution():
    limits = [(0.0, 2 * np.pi + 0.01), (0.1, 3.0)]
    robot = kv.Robot.from_dh([0.3, 0.2], 0, 0, joints="RR", limits=limits)
    solver = Compensated(kv.Numerical(task="position"), Restless(robot).fit()).fit(robot)
    s = solver.solve(robot.fk([[0.005, 0.7], [1.0, 0.7]]))
    assert s.status.tolist() == [Status.NOT_FOUND, Status.SOLVED]
    assert np.allclose(s.q, [[0.98, 0.7]], atol=1e-6)


# ---------------------------------------------------------------------------- statuses
def longer(robot, far):
    """A model of an arm whose last link is longer by ``far``."""
    real = robot.with_tool(kv.pose([0, 0, far]))
    q = robot.random(60, 14)
    return real, GeometricErrorModel(robot).fit(q, tool_error(robot, q, real.fk(q)[:, :3, 3]))


def test_what_only_the_real_arm_reaches_is_found():
    arm = kv.Robot.from_dh(
        [0, 0.5, 0.4], [0.3, 0, 0], [np.pi / 2, 0, 0], joints="RRR", tool=kv.pose(rpy=[0, 1.57, 0])
    )
    real, model = longer(arm, 1e-3)
    T = real.fk([[0.3, 0.2, 0.02], [1.0, -0.4, -0.02]])
    assert (kv.Analytic(task="position").fit(arm).solve(T).status == Status.UNREACHABLE).all()
    s = Compensated(kv.Analytic(task="position"), model).fit(arm).solve(T)
    assert s.ok.all()
    assert np.allclose(real.fk(s.q)[:, :3, 3], T[s.pose_index, :3, 3], atol=2e-6)


def test_what_only_the_nominal_arm_reaches_is_not_claimed():
    arm = kv.Robot.from_dh(
        [0, 0.5, 0.4], [0.3, 0, 0], [np.pi / 2, 0, 0], joints="RRR", tool=kv.pose(rpy=[0, 1.57, 0])
    )
    real, model = longer(arm, -1e-3)
    q = np.array([[0.3, 0.2, 0.02], [1.0, -0.4, -0.02]])
    s = Compensated(kv.Analytic(task="position"), model).fit(arm).solve(arm.fk(q))
    assert (s.status == Status.NOT_FOUND).all()
    gap = np.linalg.norm(real.fk(s.stats.best_q)[:, :3, 3] - arm.fk(q)[:, :3, 3], axis=1)
    assert np.allclose(s.stats.best_position_error, gap, atol=1e-8)
    assert (gap < 1.2e-3).all() and (gap > 5e-4).all()


def test_poses_far_away_are_not_found_and_nothing_is_shown():
    _, model = fitted()
    T = KR16.fk(KR16.random(5, 15))
    T[1::2, 0, 3] += 30.0
    s = Compensated(kv.Analytic(), model).fit(KR16).solve(T)
    assert s.status.tolist() == [0, 3, 0, 3, 0]
    assert s.stats.evidence.weak.all()
    assert len(Compensated(kv.Analytic(), model).fit(KR16).solve(T[:0])) == 0
    assert not Compensated(kv.Analytic(), model).fit(KR16).solve(T[1::2]).ok.any()


def test_a_correction_that_leaves_the_limits_is_no_solution():
    robot = kv.load("planar3r")
    q = np.array([[0.4, 0.9, -0.3]])
    T = robot.fk(q)
    error = np.tile([0.0, 1e-3, 0.0], (60, 1))
    model = FourierErrorModel(1).fit(robot.random(60, 16), error)
    free = Compensated(kv.Analytic(task="planar"), model).fit(robot).solve(T, q_seed=q).q[0]
    elbow = robot.with_limits({1: (0.1, 3.1)})  # the other one cut off
    for joint in range(3):
        # a limit between the nominal and the corrected value
        between = (q[0, joint] + free[joint]) / 2
        low, high = elbow.limits[joint]
        below, above = (low, between), (between, high)
        without, only = (below, above) if free[joint] > between else (above, below)
        tight = elbow.with_limits({joint: without})
        assert kv.Analytic(task="planar").fit(tight).solve(T).ok.all()
        s = Compensated(kv.Analytic(task="planar"), model).fit(tight).solve(T)
        assert s.status.tolist() == [Status.NOT_FOUND]
        # and the other way round it is found, though the nominal arm has none
        tight = elbow.with_limits({joint: only})
        assert not kv.Analytic(task="planar").fit(tight).solve(T).ok.any()
        s = Compensated(kv.Analytic(task="planar"), model).fit(tight).solve(T)
        assert np.allclose(s.q, free, atol=1e-6)


def test_outside_the_limits_stays_so():
    robot = kv.load("planar3r").with_limits({0: (2.0, 2.1)})
    T = kv.load("planar3r").fk([[0.4, 0.9, -0.3]])
    model = FourierErrorModel(1).fit(robot.random(60, 17), np.full((60, 3), 1e-4))
    s = Compensated(kv.Analytic(task="planar"), model).fit(robot).solve(T)
    assert s.status.tolist() == [Status.OUT_OF_LIMITS]
    assert s.stats.best_position_error[0] < 1e-6


# ---------------------------------------------------------------------------- bad input
def test_models_that_cannot_serve_are_refused():
    robot = kv.load("kr16")
    q = robot.random(60, 18)
    other = kv.load("puma560")
    for model, said in (
        (FourierErrorModel(1), "not fitted"),
        (FourierErrorModel, "fitted error model"),
        ("geometric", "fitted error model"),
        (FourierErrorModel(1).fit(q[:, :5], np.zeros((60, 3))), "5 joints"),
        (FourierErrorModel(1).fit(q, np.zeros((60, 2))), "3 or 6 columns"),
        (FourierErrorModel(1).fit(q, np.zeros(60)), "3 or 6 columns"),
        (GeometricErrorModel(other).fit(q, np.zeros((60, 3))), "puma560"),
        (make_model("geometric+fourier:1", other).fit(q, np.zeros((60, 3))), "puma560"),
    ):
        solver = Compensated(kv.Analytic(), model)
        with pytest.raises(InputError, match=said):
            solver.fit(robot)
        assert not solver.is_fitted
    with pytest.raises(InputError, match="planar"):
        Compensated(kv.Numerical(task="planar"), zero(robot, 6)).fit(robot)
    with pytest.raises(InputError, match="max_joint_distance"):
        Compensated(kv.Numerical(max_joint_distance=0.5), zero(robot)).fit(robot)
    with pytest.raises(InputError, match="solver object"):
        Compensated("analytic", zero(robot)).fit(robot)
    with pytest.raises(InputError, match="not fitted"):
        Compensated(kv.Analytic(), zero(robot)).real_fk(q)


def test_any_fitted_regressor_will_do():
    robot = kv.load("kr16")
    q = robot.random(60, 19)
    model = DummyRegressor().fit(q, np.tile([1e-3, -2e-3, 5e-4], (60, 1)))
    s = Compensated(kv.Analytic(), model).fit(robot).solve(robot.fk(q))
    far = robot.fk(s.q)[:, :3, 3] + [1e-3, -2e-3, 5e-4] - robot.fk(q)[s.pose_index, :3, 3]
    assert s.ok.mean() > 0.9 and np.abs(far).max() < 1e-6


def test_a_solver_that_claims_nothing_true_gets_no_further():
    robot = kv.load("kr16")
    solver = Compensated(Says(status=Status.UNREACHABLE), zero(robot)).fit(robot)
    s = solver.solve(robot.fk(robot.random(3, 20)))
    assert (s.status == Status.NOT_FOUND).all() and np.isnan(s.stats.best_q).all()

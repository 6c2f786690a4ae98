"""The seven arms of the thesis through pairs and through matrices, and what it takes."""

import math
from dataclasses import asdict

import numpy as np
import pytest

import kinverse as kv
from kinverse.errors import InputError
from kinverse.studies.counted import Counted, Tally, atan2, cos, sin, sqrt
from kinverse.studies.forms import FORMS, Matrix, Pair
from kinverse.studies.operation_counts import count_forms, count_forward, count_inverse
from kinverse.studies.pair_kinematics import THESIS_ROBOTS, inverse
from kinverse.studies.zero_arm import forward, zero_arm

BRANCHES = dict(planar3r=2, adept_one=2, pioneer2=1, puma560=8, irb1400=8, irb6=4, rx160l=8)
robots = pytest.mark.parametrize("name", THESIS_ROBOTS)


def postures(robot, count):
    return np.random.default_rng(0).uniform(-3, 3, (count, robot.dof))


def gaps(A, B, kinds):
    """Largest joint distance of each solution of A to each of B, whole turns aside."""
    gap = A[:, None] - B[None]
    turning = np.array([kind == "R" for kind in kinds])
    gap[..., turning] = (gap[..., turning] + np.pi) % (2 * np.pi) - np.pi
    return np.abs(gap).max(axis=-1)


def farthest(A, B, kinds):
    """Largest distance from a solution of either set to the other set."""
    far = gaps(A, B, kinds)
    return max(far.min(axis=0).max(), far.min(axis=1).max())


def slope(robot, q):
    """How far joints move for a unit error of the pose: the condition of this posture."""
    return 1.0 / np.linalg.svd(robot.jacobian(q), compute_uv=False)[..., -1].min()


@robots
def test_forward_kinematics_through_each_form(name):
    robot = kv.load(name)
    arm = zero_arm(robot)
    for q in postures(robot, 20):
        T = robot.fk(q)
        for form in FORMS:
            made = forward(arm, form, tuple(q))
            np.testing.assert_allclose(made.p, T[:3, 3], atol=1e-14)
            np.testing.assert_allclose(made.act((1, 2, 3)), T[:3] @ [1, 2, 3, 1], atol=2e-14)
            back = made.inverse().act(made.p)
            np.testing.assert_allclose(back, 0, atol=1e-14)


@robots
def test_pairs_matrices_and_analytic_agree(name):
    robot = kv.load(name)
    arm = zero_arm(robot)
    solver = kv.Analytic(limits="ignore").fit(robot)
    for q in postures(robot, 60):
        T = robot.fk(q)
        through = [np.array(inverse(arm, form.of(T))) for form in (Matrix, Pair)]
        known = solver.solve(T).q
        assert len(through[0]) == len(through[1]) == len(known)
        # 1e-12 where conditioning permits: an error of the pose grows by the slope
        allowed = 1e-12 * max(1.0, slope(robot, known) / 10)
        assert farthest(through[0], through[1], robot.kinds) < allowed
        assert farthest(through[0], known, robot.kinds) < allowed
        assert farthest(through[1], known, robot.kinds) < allowed
        assert gaps(q[None], through[1], robot.kinds).min() < allowed


@robots
def test_the_greatest_number_of_branches(name):
    robot = kv.load(name)
    found = [
        [count.solutions for count in count_inverse(robot, robot.fk(q))]
        for q in postures(robot, 40)
    ]
    assert np.max(found) == BRANCHES[name]
    assert all(by_matrix == by_pair for by_matrix, by_pair in found)


def test_a_pose_off_the_arm_has_no_branch():
    robot = kv.load("pioneer2")
    T = robot.fk([0.1, 0.2, 0.3, 0.4, 0.5]) @ kv.pose(axis=([1, 0, 0], 0.3))
    assert inverse(zero_arm(robot), Pair.of(T)) == []
    puma = zero_arm(kv.load("puma560"))
    assert inverse(puma, Matrix.of(kv.pose([9, 0, 0]))) == []
    assert inverse(puma, Pair.of(kv.pose([0.01, 0, 0.3]))) == []  # inside the shoulder's offset


def test_other_arms_are_refused():
    with pytest.raises(InputError, match="seven arms"):
        inverse(zero_arm(kv.load("ur5")), Pair.of(np.eye(4)))
    with pytest.raises(InputError, match="not along"):
        zero_arm(kv.Robot.from_dh(a=1, d=0, alpha=[0.3, 0], joints="RR"))


# ---------------------------------------------------------------------------- counting
def test_the_counting_number_counts():
    tally = Tally()
    x, y = Counted(3.0, tally), Counted(4.0, tally)
    assert float(sqrt(x * x + y * y)) == 5.0
    assert float(2.0 - x / y) == 1.25
    assert float(atan2(sin(x), cos(x))) == pytest.approx(3.0)
    assert math.isclose(float(atan2(1.0, y)), math.atan2(1, 4))
    assert asdict(tally) == dict(
        additions=2, multiplications=2, divisions=1, square_roots=1, sines=2, arctangents=2
    )


def test_what_is_known_beforehand_is_not_counted():
    tally = Tally()
    x = Counted(3.0, tally)
    assert x * 0 == 0 and (0 + x) is x and (x - 0) is x and (1 * x) is x
    assert float(-1 * x) == float(-x) == float(0 - x) == -3.0
    assert tally == Tally()
    assert float(x * 1.0) == 3.0 and tally.multiplications == 1  # a float might be anything


def test_counts_of_the_forms():
    """Matrix 9 (3 + 2) and 12 (2) ...: the matrix row is the textbook's, by hand once."""
    by = {(count.form, count.what): count.operations for count in count_forms()}
    compose = by["matrix", "compose"]
    assert (compose.multiplications, compose.additions) == (27 + 9, 18 + 9)
    compose = by["pair", "compose"]
    assert (compose.multiplications, compose.additions) == (16 + 15, 12 + 15 + 3)
    compose = by["dual quaternion", "compose"]
    assert (compose.multiplications, compose.additions) == (3 * 16, 3 * 12 + 4)
    assert {count.form: count.scalars for count in count_forms()} == {
        "matrix": 12,
        "pair": 7,
        "dual quaternion": 8,
    }


@robots
def test_counts_do_not_depend_on_the_pose(name):
    robot = kv.load(name)
    q = postures(robot, 2)
    assert count_forward(robot, q[0]) == count_forward(robot, q[1])
    full = [
        counts
        for counts in (count_inverse(robot, robot.fk(q)) for q in postures(robot, 40))
        if counts[0].solutions == BRANCHES[name]
    ]
    rows = {tuple(sorted(count.row().items())) for counts in full for count in counts}
    # pioneer2: how many elbows close, of which one branch is left, does depend on it
    assert len(rows) == 2 or name == "pioneer2"

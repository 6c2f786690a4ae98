"""Quaternion pairs, dual quaternions and screws: the group laws, and one arm through each."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import oracle
from kinverse import load, se3
from kinverse.dual_quaternion import DualQuaternion
from kinverse.pairs import QuaternionPair
from kinverse.representations import fk_dual_quaternions, fk_exponentials, fk_pairs
from kinverse.robot import Robot
from kinverse.screw import screw_exp, screw_log

FORMS = [QuaternionPair, DualQuaternion]
forms = pytest.mark.parametrize("form", FORMS)
seeds = st.integers(0, 10**6)
# angles where formulas change: nothing, almost nothing, almost a half turn, a half turn
angles = st.one_of(
    st.floats(0.0, np.pi),
    st.sampled_from([0.0, 1e-300, np.pi]),
    st.integers(-16, -1).map(lambda k: 10.0**k),
    st.integers(-16, -1).map(lambda k: np.pi - 10.0**k),
)


def pose(seed, angle, reach=2.0):
    rng = np.random.default_rng(seed)
    # ten squarings leave the series 1e-13 off a rotation
    R = oracle.nearest_rotation(oracle.about(rng.normal(size=3), angle))
    return oracle.homogeneous(R, rng.uniform(-reach, reach, 3))


def same(left, right, atol=1e-14):
    np.testing.assert_allclose(left, right, rtol=0, atol=atol)


@forms
@given(a=seeds, b=seeds, c=seeds, x=angles, y=angles, z=angles)
@settings(max_examples=60, deadline=None)
def test_they_are_the_group_of_rigid_motions(form, a, b, c, x, y, z):
    Ta, Tb, Tc = pose(a, x), pose(b, y), pose(c, z)
    fa, fb, fc = map(form.from_matrix, (Ta, Tb, Tc))
    same(fa.matrix(), Ta, 1e-13)
    same((fa @ fb).matrix(), Ta @ Tb, 1e-13)
    same(((fa @ fb) @ fc).matrix(), (fa @ (fb @ fc)).matrix(), 1e-13)
    same((fa @ fa.inverse()).matrix(), np.eye(4), 1e-13)
    same((fa.inverse() @ fa).matrix(), np.eye(4), 1e-13)
    same((fa @ fb).inverse().matrix(), (fb.inverse() @ fa.inverse()).matrix(), 1e-13)
    points = np.random.default_rng(a).normal(size=(5, 3))
    same(fa.act(points), points @ Ta[:3, :3].T + Ta[:3, 3], 1e-13)
    same((fa @ fb).act(points), fa.act(fb.act(points)), 1e-13)


@forms
def test_batches_are_singles(form):
    T = np.stack([pose(k, 0.1 * k) for k in range(30)]).reshape(5, 6, 4, 4)
    both = form.from_matrix(T) @ form.from_matrix(T[::-1])
    same(both.matrix(), T @ T[::-1])
    same(form.from_matrix(T[1, 2]).matrix(), form.from_matrix(T).matrix()[1, 2], 0)
    same(form.from_matrix(T).inverse().matrix(), np.linalg.inv(T))


def test_the_order_of_the_quaternion_product():
    """Equation 4.98 as printed gives ij = -k."""
    i, j, k = np.eye(4)[1:]
    same(se3.quat_multiply(i, j), k, 0)
    same(se3.quat_multiply(j, i), -k, 0)


@given(seed=seeds, angle=angles)
@settings(max_examples=60, deadline=None)
def test_a_dual_quaternion_stays_a_unit(seed, angle):
    d = DualQuaternion.from_matrix(pose(seed, angle))
    for _ in range(20):
        d = d @ d
    assert abs(np.linalg.norm(d.real) - 1.0) < 1e-9
    assert abs(d.real @ d.dual) < 1e-8 * (1.0 + np.linalg.norm(d.dual))


# ---------------------------------------------------------------------------- exponentials
def slow_exp(twist):
    """The power series of the (4, 4) matrix, scaled and squared."""
    v, w = twist[:3], twist[3:]
    X = np.zeros((4, 4))
    X[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
    X[:3, 3] = v
    X = X / 64
    total, term = np.eye(4), np.eye(4)
    for k in range(1, 16):
        term = term @ X / k
        total = total + term
    for _ in range(6):
        total = total @ total
    return total


@given(seed=seeds, angle=st.one_of(angles, st.floats(0.0, 7.0), st.floats(0.29, 0.31)))
@settings(max_examples=150, deadline=None)
def test_the_exponential_is_its_power_series(seed, angle):
    rng = np.random.default_rng(seed)
    w = rng.normal(size=3)
    twist = np.concatenate([rng.uniform(-2, 2, 3), angle * w / np.linalg.norm(w)])
    same(screw_exp(twist), slow_exp(twist), 1e-13)
    same(screw_exp(twist) @ screw_exp(-twist), np.eye(4), 1e-13)
    same(screw_exp(0.3 * twist) @ screw_exp(0.7 * twist), screw_exp(twist), 1e-13)


@given(seed=seeds, angle=st.one_of(angles, st.floats(0.29, 0.31)))
@settings(max_examples=150, deadline=None)
def test_the_logarithm_undoes_it(seed, angle):
    T = pose(seed, angle)
    twist = screw_log(T)
    assert np.linalg.norm(twist[3:]) <= np.pi + 1e-15
    same(screw_exp(twist), T, 1e-13)
    if angle < np.pi - 1e-3:
        rng = np.random.default_rng(seed)
        w = rng.normal(size=3)
        given = np.concatenate([rng.uniform(-2, 2, 3), angle * w / np.linalg.norm(w)])
        same(screw_log(screw_exp(given)), given, 1e-11)


# ---------------------------------------------------------------------------- one arm through each
@pytest.mark.parametrize("name", ["planar3r", "adept_one", "puma560", "iiwa14", "ir361", "ur5"])
def test_forward_kinematics_of_the_catalogue(name):
    robot = load(name)
    q = robot.random((3, 4), rng=0)
    T = robot.fk(q)
    same(fk_pairs(robot, q).matrix(), T, 1e-13)
    same(fk_dual_quaternions(robot, q).matrix(), T, 1e-13)
    same(fk_exponentials(robot, q), T, 1e-13)
    same(fk_pairs(robot, q[0, 0]).matrix(), T[0, 0], 1e-13)


@given(seed=seeds)
@settings(max_examples=40, deadline=None)
def test_forward_kinematics_of_any_chain(seed):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 9))
    n = int(rng.integers(1, m + 1))
    source = np.concatenate([np.arange(n), rng.integers(0, n, m - n)])
    robot = Robot(
        np.stack([pose(seed + k, 3.0 * rng.random()) for k in range(m + 1)]),
        "".join(rng.choice(list("RP"), size=m)),
        [(-2, 2)] * n,
        source=source,
        multiplier=rng.uniform(-2, 2, m),
        offset=rng.uniform(-1, 1, m),
    )
    q = robot.random(4, rng=1)
    T = robot.fk(q)
    rounding = 1e-13 * (1.0 + np.abs(robot.frames[:, :3, 3]).sum())
    same(fk_pairs(robot, q).matrix(), T, rounding)
    same(fk_dual_quaternions(robot, q).matrix(), T, rounding)
    same(fk_exponentials(robot, q), T, rounding)

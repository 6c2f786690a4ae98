"""Fusion: document 000's loop arrives near its training poses and falls back elsewhere."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import Status
from kinverse.errors import InputError
from kinverse.networks import RBFNetwork

CENTRE = np.array([0.4, -0.8, 0.6, 0.3, 0.9, -0.2])


@pytest.fixture(scope="module")
def puma():
    return kv.load("puma560")


@pytest.fixture(scope="module")
def near(puma):
    return kv.Fusion(region=(CENTRE, 0.05), fallback=None).fit(puma)


def targets(robot, half, count=60, seed=99):
    q = CENTRE + np.random.default_rng(seed).uniform(-half, half, (count, 6))
    return q, robot.fk(q)


def test_it_arrives_by_itself_in_a_small_region(puma, near):
    _, T = targets(puma, 0.05)
    answers = near.solve(T)
    assert answers.ok.all()
    position, rotation = oracle.pose_errors(puma, answers.q, T[answers.pose_index])
    assert position.max() <= 2e-5 and rotation.max() <= 1e-3
    # the first prediction alone seldom does: forward kinematics corrects it
    error = np.linalg.norm(puma.fk(near.predict(T)[:, 0])[:, :3, 3] - T[:, :3, 3], axis=1)
    assert (error > 2e-5).mean() > 0.5
    assert answers.stats.evaluations.max() <= 51


def test_far_away_it_says_so_or_falls_back(puma):
    T = puma.fk(puma.random(60, np.random.default_rng(5)))
    lone = kv.Fusion(fallback=None).fit(puma)
    answers = lone.solve(T)
    lost = ~answers.ok
    assert lost.mean() > 0.5
    assert (answers.status[lost] == Status.NOT_FOUND).all()
    position, _ = oracle.pose_errors(puma, answers.stats.best_q[lost], T[lost])
    np.testing.assert_allclose(answers.stats.best_position_error[lost], position, atol=1e-12)
    whole = kv.Fusion().fit(puma).solve(T)
    assert whole.ok.all()
    assert (whole.stats.starts[lost] == 1).all()


def test_a_seed_that_is_the_answer_is_the_answer(puma, near):
    q, T = targets(puma, 0.04)
    answers = near.solve(T, q_seed=q)
    np.testing.assert_allclose(answers.q, q, atol=1e-12)
    assert (answers.stats.evaluations == 1).all()


def test_it_falls_back_from_the_seed(puma):
    rng = np.random.default_rng(0)
    q = puma.random(60, rng)
    near = np.clip(q + rng.normal(0.0, 1e-3, q.shape), *puma.limits.T)
    answers = kv.Fusion(n_poses=20).fit(puma).solve(puma.fk(q), q_seed=near)
    assert answers.ok.all()
    assert (np.abs(answers.q - q).max(axis=1) < 0.1).mean() > 0.9


def test_one_pose_gives_the_same_bits_as_many(puma, near):
    _, T = targets(puma, 0.05, count=20)
    many = near.solve(T)
    for k in (0, 11):
        np.testing.assert_array_equal(near.solve(T[k]).q, many[k].q)


def test_joints_stay_inside_the_limits(puma):
    T = puma.fk(puma.random(60, np.random.default_rng(6)))
    q = kv.Fusion().fit(puma).solve(T).q
    assert (q >= puma.limits[:, 0] - 1e-9).all() and (q <= puma.limits[:, 1] + 1e-9).all()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"n_poses": 1}, "n_poses must lie in 2"),
        ({"n_poses": 5000}, "n_poses must lie in 2"),
        ({"max_iterations": 0}, "max_iterations must lie in 1"),
        ({"fallback": 3}, "fallback must be"),
        ({"region": (CENTRE[:3], 0.1)}, "region"),
    ],
)
def test_settings_that_cannot_be_used(puma, settings, words):
    with pytest.raises(InputError, match=words):
        kv.Fusion(**settings).fit(puma)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["puma560", "ir361", "adept_one"])
def test_the_contract_of_solvers(name):
    kv.check_solver(kv.Fusion(RBFNetwork(20, spread=3.0), n_poses=20), kv.load(name))

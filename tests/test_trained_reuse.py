"""Training takes long: what is trained is used as it is, and another training must be asked for."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.networks import MLP
from kinverse.paths import track


@pytest.fixture(scope="module")
def trained():
    robot = kv.load("planar3r")
    return kv.Learned(MLP((10,), max_iter=5), n_samples=200, random_state=1).fit(robot)


def refuse_training(monkeypatch):
    def fit(*given):
        raise AssertionError("trained again")

    monkeypatch.setattr(kv.Learned, "_fit", fit)


def test_solve_uses_a_trained_solver_as_it_is(trained, monkeypatch):
    robot = kv.load("planar3r")
    T = robot.fk(robot.random(20, 2))
    expected = trained.solve(T)
    refuse_training(monkeypatch)
    s = kv.solve(robot, T, solver=trained)
    assert np.array_equal(s.q, expected.q)
    assert trained.is_fitted


@pytest.mark.parametrize("wrap", [lambda a, b: kv.FirstOf([a, b]), kv.Seeded])
def test_wrappers_use_a_trained_child_as_it_is(trained, monkeypatch, wrap):
    robot = kv.load("planar3r")
    T = robot.fk(robot.random(20, 2))
    refuse_training(monkeypatch)
    whole = wrap(trained, kv.Numerical())
    assert kv.solve(robot, T, solver=whole).ok.all()
    fitted = whole.fit(robot)
    assert fitted.solvers_[0] is not trained
    assert fitted.solve(T).ok.all()


def test_a_wrapper_keeps_its_child_when_the_given_one_is_trained_for_another_robot():
    robot = kv.load("planar3r")
    child = kv.Learned(MLP((5,), max_iter=3), n_samples=100).fit(robot)
    whole = kv.FirstOf([child, kv.Numerical()]).fit(robot)
    T = robot.fk(robot.random(10, 3))
    before = whole.solve(T).q
    child.fit(kv.load("planar3r_003"))
    assert np.array_equal(whole.solve(T).q, before)


def test_another_robot_is_refused_by_name(trained):
    other = kv.load("planar3r_003")
    with pytest.raises(kv.InputError, match="trained for 'planar3r', not for 'planar3r_003'"):
        kv.solve(other, other.fk(np.zeros(3)), solver=trained)
    shifted = kv.load("planar3r").with_tool(kv.pose([0.1, 0.0, 0.0]))
    with pytest.raises(kv.InputError, match="trained for 'planar3r', not for another"):
        kv.solve(shifted, shifted.fk(np.zeros(3)), solver=trained)


@pytest.mark.parametrize("name", ["learned", "fusion"])
def test_the_name_of_a_trained_solver_says_how_to_train_it(name):
    robot = kv.load("planar3r")
    with pytest.raises(kv.InputError, match=f"{name!r} is trained first: kinverse"):
        kv.solve(robot, np.eye(4), solver=name)


def test_load_names_what_is_no_robot(trained, tmp_path):
    trained.save(tmp_path / "a.npz")
    with pytest.raises(kv.InputError, match=r"robot must be a kinverse.Robot"):
        kv.Learned.load(tmp_path / "a.npz", "planar3r")


def test_training_uses_as_many_blas_threads_as_the_library():
    from threadpoolctl import threadpool_info, threadpool_limits

    seen = []

    def count(progress):
        seen.extend(each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas")

    X = np.random.default_rng(0).normal(size=(50, 2))
    with threadpool_limits(2, user_api="blas"):
        MLP((4,), max_iter=2, callback=count).fit(X, X)
        after = [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]
    assert set(seen) == {1}
    assert set(after) <= {1, 2}
    assert after


def test_track_uses_a_trained_solver_as_it_is(trained, monkeypatch):
    robot = kv.load("planar3r")
    refuse_training(monkeypatch)
    q = np.linspace([0.2, 0.9, 0.4], [0.6, 1.2, 0.1], 12)
    found = track(robot, robot.fk(q), solver=trained)
    assert found.ok.all()
    assert np.abs(oracle.robot_fk(robot, found.q[5]) - oracle.robot_fk(robot, q[5])).max() < 1e-5
    # out of reach from the middle on: what would explain the gap is searched for, not trained for
    away = robot.fk(q)
    away[6:, 0, 3] += 1.0
    assert track(robot, away, solver=trained).ok.tolist() == [True] * 6 + [False] * 6

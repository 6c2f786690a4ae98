"""Learned: predictions are starts, answers are verified, branches are the closed form's."""

import subprocess
import sys

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.neighbors import KNeighborsRegressor

import kinverse as kv
import oracle
from kinverse import Status
from kinverse.errors import InputError
from kinverse.networks import MLP


def small(**settings):
    return kv.Learned(MLP((15,), max_iter=15), n_samples=400, **settings)


@pytest.fixture(scope="module")
def puma():
    return kv.load("puma560")


@pytest.fixture(scope="module")
def learned(puma):
    return small().fit(puma)


@pytest.fixture(scope="module")
def poses(puma):
    return puma.fk(puma.random(200, np.random.default_rng(12345)))


def branch_sets(answers):
    found = np.zeros((len(answers), 8), bool)
    found[answers.pose_index, answers.branch] = True
    return found


def test_it_finds_the_branches_of_the_closed_form(puma, learned, poses):
    wanted = branch_sets(kv.Analytic().fit(puma).solve(poses))
    got = branch_sets(learned.solve(poses))
    assert (got == wanted).all(axis=1).mean() >= 0.97
    assert not (got & ~wanted).any()


def test_every_answer_reaches_its_pose(puma, learned, poses):
    answers = learned.solve(poses)
    position, rotation = oracle.pose_errors(puma, answers.q, poses[answers.pose_index])
    assert position.max() <= 1e-6 and rotation.max() <= 1e-6


def test_a_prediction_alone_is_no_answer_but_is_shown(puma, poses):
    solver = small(refine=None).fit(puma)
    answers = solver.solve(poses)
    assert (answers.status == Status.NOT_FOUND).all()
    predicted = solver.predict(poses)
    best = answers.stats.best_q
    # the best of the eight predictions, up to whole turns, with its true error
    gap = np.abs(np.exp(1j * predicted) - np.exp(1j * best[:, None])).max(axis=2).min(axis=1)
    assert gap.max() < 1e-9
    position, rotation = oracle.pose_errors(puma, best, poses)
    np.testing.assert_allclose(answers.stats.best_position_error, position, atol=1e-12)
    np.testing.assert_allclose(answers.stats.best_rotation_error, rotation, atol=1e-9)


def test_wide_tolerances_accept_predictions(puma, poses):
    solver = small(refine=None, tol_position=2.0, tol_rotation=3.2).fit(puma)
    assert solver.solve(poses).ok.all()


@pytest.mark.parametrize("refine", ["newton", "lm"])
def test_unreachable_poses_are_not_found(puma, refine):
    T = puma.fk(puma.random(5, np.random.default_rng(1)))
    T[:, :3, 3] *= 10.0
    status = small(refine=refine).fit(puma).solve(T).status
    assert (status == Status.NOT_FOUND).all()


def test_one_pose_gives_the_same_bits_as_many(learned, poses):
    many = learned.solve(poses[:40])
    for k in (0, 7, 39):
        one = learned.solve(poses[k])
        np.testing.assert_array_equal(one.q, many[k].q)


def test_no_pose_is_no_answer(learned):
    assert len(learned.solve(np.empty((0, 4, 4)))) == 0


def test_the_seed_makes_the_networks(puma, learned, poses):
    again, other = small().fit(puma), small(random_state=1).fit(puma)
    np.testing.assert_array_equal(again.predict(poses), learned.predict(poses))
    assert (other.predict(poses) != learned.predict(poses)).any()


def test_examples_heed_keep(puma):
    solver = small(keep=lambda q: q[:, 0] > 0.5).fit(puma)
    assert all((expert.neighbours.q[:, 0] > 0.5).all() for expert in solver.experts_)


def test_a_rail_of_the_virtual_vector(poses):
    # document 003: position completed by the angle sum; a pose's rotation tells it
    robot = kv.load("planar3r_003")
    T = robot.fk(robot.random(100, np.random.default_rng(3)))
    solver = small(virtual="cos_sin", features="xyz", task="position").fit(robot)
    answers = solver.solve(T)
    assert answers.ok.mean() > 0.95
    start = solver.predict(T)[:, 0]
    error = np.linalg.norm(robot.fk(start)[:, :3, 3] - T[:, :3, 3], axis=1)
    assert np.median(error) < 1.0  # the arm is 22 long


@pytest.mark.parametrize("name", ["panda", "jaco2", "adept_one"])
def test_other_arms(name):
    robot = kv.load(name)
    T = robot.fk(robot.random(100, np.random.default_rng(8)))
    solver = small(refine="lm", fallback="numerical").fit(robot)
    answers = solver.solve(T)
    assert answers.ok.all()
    assert (answers.q >= robot.limits[:, 0] - 1e-9).all()
    assert (answers.q <= robot.limits[:, 1] + 1e-9).all()


def test_the_fall_back_comes_after_everything_else(puma, poses):
    solver = small(refine="lm", neighbors=0).fit(puma)
    both = small(refine="lm", neighbors=0, fallback="numerical").fit(puma)
    few, all_ = solver.solve(poses), both.solve(poses)
    assert all_.ok.all() and not few.ok.all()
    assert (all_.stats.starts[~few.ok] > few.stats.starts[~few.ok]).all()
    same = few.ok & (few.count == all_.count)
    assert same[few.ok].all()


@pytest.mark.parametrize("network", [LinearRegression(), KNeighborsRegressor(3)], ids=repr)
def test_any_regressor_of_several_outputs_will_do(puma, poses, network):
    answers = kv.Learned(network, n_samples=400).fit(puma).solve(poses)
    assert answers.ok.mean() > 0.9


def test_an_arm_with_joints_to_spare_starts_at_the_seed():
    robot = kv.load("panda")
    q = robot.random(50, np.random.default_rng(4))
    answers = small(refine="lm").fit(robot).solve(robot.fk(q), q_seed=q)
    assert answers.ok.all()
    np.testing.assert_allclose(answers.q, q, atol=1e-6)


def test_settings_changed_after_fit_wait_for_the_next(puma, poses, tmp_path):
    solver = small().fit(puma)
    wanted = solver.solve(poses[:20])
    solver.set_params(refine=None, limits="ignore", tol_position=1e-3, keep=lambda q: q[:, 0] > 9)
    solver.save(tmp_path / "a.npz")
    got = kv.Learned.load(tmp_path / "a.npz", puma).solve(poses[:20])
    np.testing.assert_array_equal(got.q, wanted.q)
    assert len(solver.held_out(50).q)


def test_a_loaded_solver_can_be_trained_again(tmp_path):
    robot = kv.load("planar3r_003")
    solver = small(virtual="cos_sin", features="xyz", task="position").fit(robot)
    solver.save(tmp_path / "a.npz")
    again = kv.Learned.load(tmp_path / "a.npz", robot)
    assert again == solver
    T = robot.fk(robot.random(9, 3))
    np.testing.assert_array_equal(again.clone().fit(robot).predict(T), solver.predict(T))


def test_progress_rises_to_one_and_can_end_it(puma):
    told = []
    small(progress=lambda text, share: told.append((text, share))).fit(puma)
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert "shoulder+ elbow+ wrist+" in {text for text, _ in told}
    short = small(progress=lambda text, share: True).fit(puma)
    assert all(expert.network.n_iter_ == 1 for expert in short.experts_)


def test_ctrl_c_keeps_what_was_learned_and_ends_soon(puma, monkeypatch):
    from kinverse.networks.monitor import Monitor

    epoch, told = Monitor.epoch, []

    def interrupted(self, *given, **named):
        told.append(1)
        done = epoch(self, *given, **named)
        if len(told) == 20:
            raise KeyboardInterrupt
        return done

    monkeypatch.setattr(Monitor, "epoch", interrupted)
    with pytest.warns(UserWarning, match="interrupted"):
        solver = small().fit(puma)
    epochs = [expert.network.n_iter_ for expert in solver.experts_]
    assert epochs == [15, 5, *[1] * (len(epochs) - 2)]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"refine": "gauss"}, "refine must be newton, lm or None"),
        ({"n_samples": 1}, "n_samples must lie in 2"),
        ({"neighbors": -1}, "neighbors must lie in 0"),
        ({"refine": None, "fallback": "numerical"}, "fallback needs refine"),
        ({"fallback": "analytic"}, "fallback must be 'numerical' or None"),
        ({"random_state": None}, "random_state must be a whole number"),
        ({"network": 3}, "network must be a regressor"),
        ({"features": "rpy"}, "xyz\\+rpy"),
        ({"virtual": "cos_sin"}, "parallel"),
        ({"progress": 1}, "progress must be a function"),
    ],
)
def test_settings_that_cannot_be_used(puma, settings, words):
    with pytest.raises((InputError, TypeError), match=words):
        kv.Learned(**settings).fit(puma)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("planar3r_003", {}),
        ("puma560", {"refine": None}),
        ("puma560", {"refine": "lm"}),
        ("panda", {"refine": "lm", "fallback": "numerical"}),
        ("adept_one", {"task": "position"}),
    ],
)
def test_the_contract_of_solvers(name, settings):
    kv.check_solver(small(**settings), kv.load(name))


def test_without_scikit_learn_the_pip_command_is_named():
    code = (
        "import sys; sys.modules['sklearn'] = None\n"
        "import kinverse as kv\n"
        "try: kv.Learned().fit(kv.load('puma560'))\n"
        "except kv.MissingExtra as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert 'pip install "kinverse[learn]"' in done.stdout, done.stderr

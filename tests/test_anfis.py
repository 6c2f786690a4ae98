"""ANFIS: counts, least squares, hybrid learning, one model for each output."""

import time

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.networks import ANFIS
from kinverse.networks.fuzzy.hybrid import StepSize, least_squares
from kinverse.networks.fuzzy.rules import Rules

FEW = "ignore:.*by heart:UserWarning"


def smooth(rows=200, seed=3):
    X = np.random.default_rng(seed).uniform(-2, 5, (rows, 2))
    return X, np.stack([np.sin(X[:, 0]) * X[:, 1], np.cos(X[:, 1])], axis=1)


def test_the_printed_configuration():
    """Document 004, tables 7.5 and 7.9: 343 rules, 343 + 63 = 406 parameters, 734 nodes."""
    X = np.random.default_rng(0).uniform(-1, 1, (700, 3))
    net = ANFIS(7, mf="gbell", order=0, max_iter=1).fit(X, X.sum(axis=1))
    counts = net.n_rules_, net.n_linear_parameters_, net.n_nonlinear_parameters_, net.n_nodes_
    assert counts == (343, 343, 63, 734)
    assert net.weights_.size == 406


def test_the_counts_of_the_other_reading():
    rules = Rules((7, 7, 7), "gauss", 1)
    assert (rules.n_rules, rules.n_linear, rules.n_nonlinear) == (343, 1372, 42)
    # two and four inputs of two sets: 21 and 55 nodes
    assert [Rules((2,) * n, "gbell", 1).n_nodes for n in (2, 4)] == [21, 55]


@pytest.mark.parametrize("sets", [1, 2, (3, 2, 1)])
@pytest.mark.parametrize("mf", ["gbell", "gauss", "tri"])
def test_first_order_reproduces_a_linear_map(mf, sets):
    rng = np.random.default_rng(1)
    slopes, constant = rng.standard_normal((3, 2)), [5.0, -700.0]
    X = rng.uniform(-30, 200, (150, 3))
    y = X @ slopes + constant
    net = ANFIS(sets, mf=mf, order=1, ridge=0.0, max_iter=3).fit(X, y)
    spread = np.ptp(y, axis=0).max()
    np.testing.assert_allclose(net.predict(X), y, atol=1e-8 * spread)
    between = rng.uniform(-10, 180, (50, 3))
    np.testing.assert_allclose(
        net.predict(between), between @ slopes + constant, atol=1e-5 * spread
    )


def test_order_zero_is_order_one_with_flat_consequents():
    X, _ = smooth()
    zero, one = Rules((3, 4), "gbell", 0), Rules((3, 4), "gbell", 1)
    sets = zero.first(X)[0]
    constants = np.random.default_rng(2).standard_normal((12, 1))
    flat = np.hstack([np.zeros((12, 2)), constants])
    np.testing.assert_allclose(
        zero.output(sets, constants, X), one.output(sets, flat, X), rtol=1e-13
    )


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("rows", [10, 200])
def test_both_forms_of_the_least_squares_are_the_ridge_solution(rows, order):
    """Fewer rows than consequents, and more."""
    X, y = smooth(rows)
    rules = Rules((3, 4), "gauss", order)
    sets = rules.first(X)[0]
    strengths = rules.strengths(rules.shares(sets, X).parts)[-1]
    A = (strengths[:, :, None] * rules.terms(X)[:, None, :]).reshape(rows, -1)
    ridge = 1e-3
    stacked = np.vstack([A, np.sqrt(ridge) * np.eye(A.shape[1])])
    wanted = np.linalg.lstsq(stacked, np.hstack([y[:, 0], np.zeros(A.shape[1])]), rcond=None)[0]
    found = least_squares(rules, sets, X, y[:, 0], ridge)
    np.testing.assert_allclose(found.ravel(), wanted, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize("order", [0, 1])
def test_recursive_least_squares_end_at_the_same_numbers(order):
    """Jang's recursion with the covariance 1/ridge at the start is the ridge of the batch."""
    X, y = smooth(60)
    rules, ridge = Rules((2, 3), "gbell", order), 1e-4
    sets = rules.first(X)[0]
    strengths = rules.strengths(rules.shares(sets, X).parts)[-1]
    A = (strengths[:, :, None] * rules.terms(X)[:, None, :]).reshape(len(X), -1)
    theta, S = np.zeros(A.shape[1]), np.eye(A.shape[1]) / ridge
    for a, target in zip(A, y[:, 0], strict=True):
        S = S - np.outer(S @ a, a @ S) / (1.0 + a @ S @ a)
        theta = theta + S @ a * (target - a @ theta)
    found = least_squares(rules, sets, X, y[:, 0], ridge).ravel()
    np.testing.assert_allclose(found, theta, atol=1e-6 * np.abs(theta).max())


@pytest.mark.parametrize("mf", ["gbell", "gauss", "tri"])
@pytest.mark.parametrize("order", [0, 1])
def test_small_hybrid_steps_never_raise_the_error(mf, order):
    X, y = smooth()
    net = ANFIS(3, mf=mf, order=order, ridge=0.0, max_iter=15, step_size=1e-4).fit(X, y)
    assert (np.diff(net.training_mse_, axis=0) <= 0.0).all()
    assert (net.training_mse_[-1] < net.training_mse_[0]).all()


def test_hybrid_learning_earns_its_keep():
    X, y = smooth(400)
    net = ANFIS(4, order=0, max_iter=60, step_size=0.05).fit(X, y)
    assert (net.training_mse_.min(axis=0) < 0.7 * net.training_mse_[0]).all()
    fresh, wanted = smooth(300, seed=11)
    grid = ANFIS(4, order=0, max_iter=1).fit(X, y)
    errors = [np.mean((n.predict(fresh) - wanted) ** 2) for n in (net, grid)]
    assert errors[0] < errors[1]


def test_an_epoch_moves_the_sets_by_the_step():
    X, y = smooth()
    told = []
    for epochs in (1, 2):
        net = ANFIS(3, max_iter=epochs, step_size=0.02).fit(X, y)
        told.append(net.premises_)
        assert net.n_iter_ == len(net.training_mse_) == epochs
    np.testing.assert_allclose(
        np.linalg.norm((told[1] - told[0]).reshape(2, -1), axis=1), 0.02, rtol=1e-10
    )


@pytest.mark.parametrize("early", [False, True])
def test_each_output_keeps_its_best_epoch(early):
    """Steps so long that the error goes up and down."""
    X, y = smooth()
    net = ANFIS(3, max_iter=12, step_size=0.8, early_stopping=early, random_state=0).fit(X, y)
    best = net.training_mse_.argmin(axis=0)
    assert (best != net.n_iter_ - 1).any()
    if early:
        assert net.validation_mse_.shape == net.training_mse_.shape
    else:
        kept = np.mean((net.predict(X) - y) ** 2, axis=0)
        np.testing.assert_allclose(kept, net.training_mse_.min(axis=0), rtol=1e-9)


def test_an_output_is_the_same_alone_and_among_others():
    X, y = smooth()
    settings = {"n_mfs": 3, "max_iter": 12, "step_size": 0.1, "mf": "gauss"}
    among = ANFIS(**settings).fit(X, y)
    for k in range(2):
        alone = ANFIS(**settings).fit(X, y[:, k])
        np.testing.assert_array_equal(alone.predict(X), among.predict(X)[:, k])
        np.testing.assert_allclose(alone.training_mse_[:, 0], among.training_mse_[:, k], rtol=1e-12)
    # and each has fuzzy sets of its own
    assert np.abs(among.premises_[0] - among.premises_[1]).max() > 1e-3


def test_the_step_grows_after_four_reductions_and_not_again_at_once():
    step = StepSize(1.0, 1.1, 0.9)
    sizes = [step.after(error) for error in range(20, 10, -1)]
    np.testing.assert_allclose(sizes, [1] * 4 + [1.1] * 4 + [1.21] * 2)


def test_the_step_shrinks_after_two_ups_and_downs():
    step = StepSize(1.0, 1.1, 0.9)
    sizes = [step.after(error) for error in (1, 2, 1, 2, 1, 2, 1, 2, 1)]
    np.testing.assert_allclose(sizes, [1] * 4 + [0.9] * 4 + [0.81])


def test_the_step_stays_otherwise():
    step = StepSize(1.0, 1.1, 0.9)
    for error in (5, 4, 3, 2, 2, 1, 2, 3, 2, 1):
        assert step.after(error) == 1.0


def test_rows_beyond_the_triangles_are_answered():
    X, y = smooth()
    net = ANFIS(3, mf="tri", order=0).fit(X, y)
    far = np.array([[-1e6, 0.0], [1e6, 1e6], [1.0, -1e9]])
    out = net.predict(far)
    assert np.isfinite(out).all()
    # the corner's rule alone
    corner = net.consequents_[:, -1, 0]
    np.testing.assert_allclose(out[1], corner * net.output_unit_ + net.output_middle_, rtol=1e-12)


def test_membership_is_told_in_the_units_of_the_inputs():
    X = np.column_stack([np.linspace(100.0, 500.0, 60), np.linspace(-3e-3, 3e-3, 60) ** 2])
    net = ANFIS((5, 2), mf="gauss", max_iter=1).fit(X, X)
    values = net.membership(0, np.array([100.0, 150.0, 200.0]))
    assert values.shape == (5, 3)
    np.testing.assert_allclose(values[:2], [[1.0, 0.5, 2.0**-4], [2.0**-4, 0.5, 1.0]], atol=1e-12)
    assert net.membership(1, [0.0, 9e-6], output=1).shape == (2, 2)
    for bad in ({"input": 2}, {"input": -1}, {"input": 0, "output": 2}, {"input": 0, "x": np.nan}):
        with pytest.raises(InputError):
            net.membership(**({"x": [0.0]} | bad))


@pytest.mark.parametrize("order", [0, 1])
def test_a_thousand_rules_are_quick(order):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (200, 10))
    y = X[:, 0] + X[:, 3] * X[:, 4]
    start = time.process_time()
    with pytest.warns(UserWarning, match="by heart"):
        net = ANFIS(order=order).fit(X, y)
    assert net.n_rules_ == 1024
    assert net.score(X, y) > 0.9
    assert time.process_time() - start < 20.0  # a second or so; a loop over rules takes minutes


def test_too_many_rules_are_refused_with_the_numbers():
    X = np.zeros((30, 6)) + np.arange(30)[:, None]
    with pytest.raises(InputError, match=r"6 inputs with n_mfs=7 make 117,649 rules.*100,000"):
        ANFIS(7).fit(X, X[:, 0])


@pytest.mark.parametrize(
    "settings",
    [
        {"n_mfs": 0},
        {"n_mfs": 2.0},
        {"n_mfs": (2, 0)},
        {"n_mfs": (2, 2, 2)},
        {"n_mfs": "22"},
        {"mf": "bell"},
        {"order": 2},
        {"order": -1},
        {"ridge": -1.0},
        {"ridge": np.nan},
        {"step_size": "long"},
        {"step_increase": 0.9},
        {"step_decrease": 1.0},
        {"max_iter": 0},
    ],
)
def test_settings_that_cannot_be_used_are_refused(settings):
    X, y = smooth(30)
    with pytest.raises(InputError, match=next(iter(settings))):
        ANFIS(**settings).fit(X, y)


def test_warm_start_goes_on_and_forgets_another_grid():
    X, y = smooth()
    net = ANFIS(3, max_iter=20, warm_start=True).fit(X, y)
    before = net.training_mse_.min(axis=0)
    again = net.fit(X, y).training_mse_
    np.testing.assert_allclose(again[0], before, rtol=1e-9)
    # three parameters as well, but they mean something else
    other = net.set_params(mf="tri").fit(X, y)
    np.testing.assert_array_equal(
        other.predict(X), ANFIS(3, mf="tri", max_iter=20).fit(X, y).predict(X)
    )


@pytest.mark.filterwarnings(FEW)
def test_settings_changed_after_the_fit_change_no_prediction():
    X, y = smooth(40)
    net = ANFIS(3).fit(X, y)
    before = net.predict(X)
    net.set_params(mf="tri", order=0, n_mfs=2)
    np.testing.assert_array_equal(net.predict(X), before)


@pytest.mark.filterwarnings(FEW)
@pytest.mark.parametrize("mf", ["gbell", "gauss", "tri"])
def test_many_long_steps_leave_valid_sets(mf):
    X, y = smooth(60)
    net = ANFIS(4, mf=mf, max_iter=60, step_size=1.0, scaling=None).fit(X, y)
    assert np.isfinite(net.training_mse_).all()
    sets = net.premises_
    if mf == "tri":
        assert (sets[..., 0] < sets[..., 1]).all() and (sets[..., 1] < sets[..., 2]).all()
    else:
        assert (sets[..., 0] > 0.0).all()

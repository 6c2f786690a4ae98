"""Pi-sigma network: its gradient, its two rules, what it can say."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.networks import PiSigma
from kinverse.networks.activations import activation
from kinverse.networks.pi_sigma import RULES, descended


def patterns(count=12, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (count, 3)), rng.uniform(0, 1, (count, 2))


def square(weights, X, Y, output):
    sums = np.einsum("mki,ni->mkn", weights, np.hstack([X, np.ones((len(X), 1))]))
    return np.sum((activation(output).of(sums.prod(axis=1)).T - Y) ** 2)


def gradient(weights, X, Y, output):
    out = np.zeros_like(weights)
    for at in np.ndindex(weights.shape):
        h = np.zeros_like(weights)
        h[at] = 1e-6
        up, down = (square(w, X, Y, output) for w in (weights + h, weights - h))
        out[at] = (up - down) / 2e-6
    return out


@pytest.mark.parametrize("output", ["logsig", "tansig", "purelin"])
@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_the_simultaneous_step_is_the_gradient(order, output):
    X, Y = patterns()
    weights = np.random.default_rng(4).uniform(-1, 1, (2, order, 4))
    moved = descended(weights, X, Y, 1.0, output=output, rule="simultaneous")
    np.testing.assert_allclose(weights - moved, gradient(weights, X, Y, output), atol=1e-7)


@pytest.mark.parametrize("output", ["logsig", "purelin"])
def test_the_asynchronous_step_is_one_gradient_after_another(output):
    X, Y = patterns()
    weights = np.random.default_rng(4).uniform(-1, 1, (2, 3, 4))
    wanted = weights.copy()
    for k in range(3):
        wanted[:, k] -= 0.1 * gradient(wanted, X, Y, output)[:, k]
    moved = descended(weights, X, Y, 0.1, output=output, rule="asynchronous")
    np.testing.assert_allclose(moved, wanted, atol=1e-7)
    at_once = descended(weights, X, Y, 0.1, output=output, rule="simultaneous")
    assert np.abs(moved - at_once).max() > 1e-3


def test_a_unit_that_says_nothing_still_learns():
    """Its sum is 0 everywhere: a product of the others made by dividing would not exist."""
    X, Y = patterns()
    weights = np.random.default_rng(4).uniform(-1, 1, (2, 3, 4))
    weights[:, 1] = 0.0
    moved = descended(weights, X, Y, 1.0, output="logsig", rule="simultaneous")
    np.testing.assert_allclose(weights - moved, gradient(weights, X, Y, "logsig"), atol=1e-7)
    assert (np.abs(moved - weights)[:, 1] > 1e-6).all()
    assert (moved[:, [0, 2]] == weights[:, [0, 2]]).all()


@pytest.mark.parametrize("rule", RULES)
def test_a_product_of_sums_is_learned(rule):
    rng = np.random.default_rng(1)
    X = rng.uniform(-1, 1, (400, 2))
    y = (X[:, 0] + 0.5) * (X[:, 1] - X[:, 0] + 0.3)
    settings = {"output": "purelin", "rule": rule, "learning_rate": 0.01, "max_iter": 300}
    settings["scaling"] = None  # a product that is shifted is none
    net = PiSigma(order=2, random_state=0, **settings).fit(X[:300], y[:300])
    assert net.score(X[300:], y[300:]) > 0.999
    # a plane does not do
    plane = PiSigma(order=1, random_state=0, **settings).fit(X[:300], y[:300])
    assert plane.score(X[300:], y[300:]) < 0.5


@pytest.mark.parametrize("output", ["logsig", "tansig"])
def test_one_pattern_at_a_time_and_batches_learn_alike(output):
    X = np.random.default_rng(2).uniform(-1, 1, (150, 3))
    y = np.stack([4.0 + np.exp(X[:, 0] + X[:, 1]), X[:, 2]], axis=1)
    scores = [
        PiSigma(output=output, batch_size=size, max_iter=30, random_state=0).fit(X, y).score(X, y)
        for size in (1, 16)
    ]
    assert min(scores) > 0.9


def test_sigmoid_outputs_stay_within_the_targets():
    X, _ = patterns(100)
    y = 5.0 + X[:, 0]
    out = PiSigma(max_iter=20, random_state=0).fit(X, y).predict(1e3 * X)
    assert (out >= y.min() - 1e-9).all() and (out <= y.max() + 1e-9).all()


def test_a_rate_too_high_ends_with_the_weights_before_it_and_says_so():
    X, Y = patterns(60)
    with pytest.warns(UserWarning, match="try a learning_rate below 1e"):
        net = PiSigma(output="purelin", learning_rate=1e6, random_state=0).fit(X, Y)
    assert np.isfinite(net.predict(X)).all()
    assert "no longer a finite number" in net.stop_reason_


def test_warm_start_goes_on():
    X, Y = patterns(80)
    net = PiSigma(max_iter=30, warm_start=True, random_state=0).fit(X, Y)
    before = net.loss_curve_
    again = net.fit(X, Y).loss_curve_
    assert again[0] < before[0] and abs(again[0] - before[-1]) < 0.1 * before[-1]


@pytest.mark.parametrize(
    "settings",
    [
        {"order": 0},
        {"rule": "randomised"},
        {"learning_rate": -1.0},
        {"batch_size": 0},
        {"max_iter": None},
    ],
)
def test_settings_that_cannot_be_used_are_refused(settings):
    X, Y = patterns()
    with pytest.raises(InputError, match=next(iter(settings))):
        PiSigma(**settings).fit(X, Y)

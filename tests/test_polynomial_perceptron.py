"""Polynomial perceptron: the monomials, exact least squares, sigmoid outputs."""

import math

import numpy as np
import pytest
from sklearn.preprocessing import PolynomialFeatures

from kinverse.errors import InputError
from kinverse.networks import PolynomialPerceptron
from kinverse.networks.polynomial_perceptron import exponents, monomials


def rows(count=100, inputs=3, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, inputs))


@pytest.mark.parametrize("inputs", [1, 2, 3, 5])
@pytest.mark.parametrize("degree", [1, 2, 3, 6])
def test_all_monomials_once(inputs, degree):
    """Document 004, equation 5.10: C(m + r, r) of them with the constant."""
    powers = exponents(inputs, degree)
    assert len(powers) + 1 == math.comb(inputs + degree, degree)
    assert len({tuple(power) for power in powers.tolist()}) == len(powers)
    assert powers.sum(axis=1).max() == degree
    X = rows(20, inputs)
    wanted = np.prod(X[:, None, :] ** powers[None, :, :], axis=2)
    np.testing.assert_allclose(monomials(X, degree), wanted, rtol=1e-12)
    theirs = PolynomialFeatures(degree, include_bias=False).fit_transform(X)
    np.testing.assert_allclose(monomials(X, degree), theirs, rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_a_polynomial_is_found_exactly(degree):
    X = 50.0 + 20.0 * rows()
    theta = np.random.default_rng(1).standard_normal((len(exponents(3, degree)), 2))
    y = monomials((X - 50.0) / 20.0, degree) @ theta + [3.0, -1.0]
    net = PolynomialPerceptron(degree).fit(X[:80], y[:80])
    np.testing.assert_allclose(net.predict(X[80:]), y[80:], atol=1e-9)
    assert net.n_iter_ == 1
    assert net.coef_.shape == theta.shape and net.intercept_.shape == (2,)


def test_one_degree_less_does_not_do():
    X = rows()
    y = X[:, 0] * X[:, 1] * X[:, 2]
    assert PolynomialPerceptron(2).fit(X, y).score(X, y) < 0.5
    assert PolynomialPerceptron(3).fit(X, y).score(X, y) > 1.0 - 1e-12


def test_without_scaling_the_weights_are_the_coefficients():
    X = rows(inputs=2)
    y = 1.0 + 2.0 * X[:, 0] - 3.0 * X[:, 0] * X[:, 1] + 4.0 * X[:, 1] ** 2
    net = PolynomialPerceptron(2, scaling=None).fit(X, y)
    found = dict(zip(map(tuple, net.exponents_.tolist()), net.coef_[:, 0], strict=True))
    wanted = {(1, 0): 2.0, (0, 1): 0.0, (2, 0): 0.0, (1, 1): -3.0, (0, 2): 4.0}
    assert found == pytest.approx(wanted, abs=1e-12)
    assert net.intercept_ == pytest.approx([1.0])


@pytest.mark.parametrize("output", ["tansig", "logsig"])
def test_sigmoid_outputs_learn_and_are_bounded_by_the_targets(output):
    X = rows(300)
    y = np.stack([np.tanh(2 * X[:, 0] + X[:, 1] * X[:, 2]), 7.0 + X[:, 1] ** 2], axis=1)
    net = PolynomialPerceptron(2, output=output, random_state=0).fit(X, y)
    assert net.score(X, y) > 0.99
    far = net.predict(1e3 * rows(50, seed=2))
    low, high, slack = y.min(axis=0), y.max(axis=0), 1e-9
    assert (far >= low - slack).all() and (far <= high + slack).all()


def test_the_two_sigmoids_are_one_up_to_scaling():
    """2 logsig(x) - 1 = tanh(x / 2), and logsig's targets are scaled to [0, 1]."""
    X = rows(200)
    y = np.sin(2.0 * X[:, 0]) + X[:, 1]
    scores = [
        PolynomialPerceptron(2, output=output, max_iter=3000, random_state=0).fit(X, y).score(X, y)
        for output in ("tansig", "logsig")
    ]
    assert scores[0] == pytest.approx(scores[1], abs=1e-4)


def test_few_rows_give_the_smallest_weights_and_a_warning():
    X = rows(5)
    with pytest.warns(UserWarning, match="by heart"):
        net = PolynomialPerceptron(3).fit(X, X[:, 0])
    np.testing.assert_allclose(net.predict(X), X[:, 0], atol=1e-9)
    assert np.abs(net.coef_).max() < 2.0


def test_too_many_monomials_are_refused_with_the_numbers():
    with pytest.raises(InputError, match=r"20 inputs with degree=6 make 230,230 monomials"):
        PolynomialPerceptron(6).fit(rows(30, 20), np.arange(30))


@pytest.mark.parametrize("settings", [{"degree": 0}, {"degree": 2.0}, {"output": "relu"}])
def test_settings_that_cannot_be_used_are_refused(settings):
    match = "activation" if "output" in settings else "degree"
    with pytest.raises(InputError, match=match):
        PolynomialPerceptron(**settings).fit(rows(), rows()[:, 0])


def test_settings_changed_after_the_fit_change_no_prediction():
    X = rows()
    net = PolynomialPerceptron(2).fit(X, X)
    before = net.predict(X)
    np.testing.assert_array_equal(net.set_params(degree=3, output="tansig").predict(X), before)

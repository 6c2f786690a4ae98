"""The recurrent network: its gradient through time, its memory, its rows."""

import numpy as np
import pytest
from sklearn.base import clone

from kinverse import networks
from kinverse.errors import InputError
from kinverse.networks import MLP, Elman, windows
from kinverse.networks.recurrent import Recurrent


def memory_task(rows=600, seed=2):
    """A sum and a product of what was two samples ago and what is: no memory, no answer."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (rows, 2))
    late = X[np.maximum(np.arange(rows) - 2, 0)]
    return X, np.stack([X[:, 0] + late[:, 1], 4.0 * late[:, 0] * X[:, 1]], axis=1)


@pytest.mark.parametrize("name", ["logsig", "tansig", "purelin"])
@pytest.mark.parametrize("n_steps", [1, 2, 5])
def test_the_gradient_is_the_derivative(name, n_steps):
    rng = np.random.default_rng(n_steps)
    form = Recurrent(n_steps, (2, 4, 3), name)
    weights, X = 0.7 * rng.standard_normal(form.count), rng.uniform(-1, 1, (6, 2 * n_steps))
    error = rng.standard_normal((6, 3))
    gradient = form.gradient(weights, form.outputs(weights, X), error)
    for k, step in enumerate(1e-6 * np.eye(form.count)):
        ahead, behind = form.forward(weights + step, X), form.forward(weights - step, X)
        difference = np.sum(error * (ahead - behind)) / 2e-6
        assert gradient[k] == pytest.approx(difference, rel=1e-6, abs=1e-7)


def test_outputs_are_the_recursion_written_out():
    rng = np.random.default_rng(1)
    form = Recurrent(3, (2, 4, 3), "tansig")
    weights, row = rng.standard_normal(form.count), rng.standard_normal(6)
    W, U, b, V, c = form.split(weights)
    h = np.zeros(4)
    for x in (row[:2], row[2:4], row[4:]):
        h = np.tanh(W.T @ x + U.T @ h + b)
    np.testing.assert_allclose(form.forward(weights, row[None])[0], V.T @ h + c, rtol=1e-12)


def test_the_first_memory_fades():
    form = Recurrent(4, (2, 9, 1), "tansig")
    for seed in range(5):
        U = form.split(form.first_weights(np.random.default_rng(seed)))[1]
        assert np.linalg.norm(U, 2) == pytest.approx(0.5)


def test_it_remembers_what_a_network_without_memory_cannot_know():
    X, y = memory_task()
    rows = windows(X, 3)
    net = Elman((12,), n_steps=3, max_iter=600, random_state=0).fit(rows[:400], y[:400])
    blind = Elman((12,), n_steps=1, random_state=0).fit(X[:400], y[:400])
    assert net.score(rows[400:], y[400:]) > 0.9
    assert blind.score(X[400:], y[400:]) < 0.5


def test_one_step_is_a_perceptron():
    X, y = memory_task(100)
    net = Elman((6,), max_iter=40, random_state=3).fit(X, y)
    twin = MLP((6,), trainer="lbfgs", max_iter=40, random_state=3).fit(X, y)
    own = net._form(2, 2).split(net.weights_)
    # without memory the weights of the context stay as they began and change nothing
    twin.weights_ = net.weights_[: len(twin.weights_)]
    np.testing.assert_allclose(net.predict(X), twin.predict(X), rtol=1e-12)
    assert np.linalg.norm(own[1], 2) == pytest.approx(0.5)


def test_rows_do_not_know_each_other():
    X, y = memory_task(200)
    rows = windows(X, 4)
    net = Elman(n_steps=4, max_iter=30, random_state=1).fit(rows, y)
    order = np.random.default_rng(0).permutation(200)
    np.testing.assert_allclose(net.predict(rows)[order], net.predict(rows[order]), rtol=1e-12)
    np.testing.assert_allclose(net.predict(rows)[7], net.predict(rows[7:8])[0], rtol=1e-12)


def test_all_steps_are_scaled_alike():
    X, y = memory_task(100)
    rows = windows(X * 30.0 + 5.0, 3)
    rows[:, :2] *= 0.1  # the oldest samples are small ones
    net = Elman(n_steps=3, max_iter=5, random_state=1).fit(rows, y)
    for learned in (net.input_middle_, net.input_unit_):
        assert learned.shape == (6,)
        np.testing.assert_array_equal(learned.reshape(3, 2), np.tile(learned[:2], (3, 1)))


def test_a_saved_one_and_a_clone_of_several_steps(tmp_path):
    X, y = memory_task(80)
    net = Elman((4,), n_steps=2, max_iter=20, random_state=1).fit(windows(X, 2), y)
    net.save(tmp_path / "elman.npz")
    again = networks.load(tmp_path / "elman.npz")
    np.testing.assert_array_equal(again.predict(windows(X, 2)), net.predict(windows(X, 2)))
    twin = clone(net).fit(windows(X, 2), y)
    np.testing.assert_array_equal(twin.weights_, net.weights_)
    # settings changed afterwards count from the next fit on
    net.set_params(n_steps=4, hidden=(9,))
    np.testing.assert_array_equal(net.predict(windows(X, 2)), again.predict(windows(X, 2)))


def test_a_warm_start_goes_on():
    X, y = memory_task(200)
    rows = windows(X, 3)
    net = Elman((8,), n_steps=3, max_iter=30, warm_start=True, random_state=1).fit(rows, y)
    before = net.loss_curve_[-1]
    assert net.fit(rows, y).loss_curve_[0] <= before


def test_windows_of_a_series():
    rows = windows([[1, 10], [2, 20], [3, 30]], 3)
    expected = [[1, 10, 1, 10, 1, 10], [1, 10, 1, 10, 2, 20], [1, 10, 2, 20, 3, 30]]
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_array_equal(windows([[1.0], [2.0]], 1), [[1.0], [2.0]])


@pytest.mark.parametrize("bad", [[[np.nan]], [], [1.0, 2.0], [[[1.0]]]])
def test_windows_refuse_what_is_no_series(bad):
    with pytest.raises(ValueError):
        windows(bad, 2)


@pytest.mark.parametrize("steps", [0, -1, 1.5, None])
def test_steps_must_be_whole(steps):
    X, y = memory_task(20)
    for call in (lambda: windows(X, steps), lambda: Elman(n_steps=steps).fit(X, y)):
        with pytest.raises(InputError, match="n_steps"):
            call()


def test_columns_that_are_no_multiple_are_named():
    X, y = memory_task(20)
    with pytest.raises(InputError, match=r"2 columns of X .* n_steps=3"):
        Elman(n_steps=3).fit(X, y)
    with pytest.raises(InputError, match="one layer"):
        Elman(hidden=(3, 3)).fit(X, y)

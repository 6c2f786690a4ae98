"""The default trainer: its matrix is the exact Gauss-Newton matrix, its steps lower the error."""

import numpy as np
import pytest
from sklearn.datasets import make_friedman1

from kinverse.errors import InputError
from kinverse.networks import MLP
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task, find_trainer
from kinverse.networks.trainers import variable_projection as vp


def search(sizes, names, rows=40, seed=0):
    rng = np.random.default_rng(seed)
    X, Y = rng.uniform(-1, 1, (rows, sizes[0])), rng.uniform(-1, 1, (rows, sizes[-1]))
    return vp._Search(Task(Layers(sizes, names), X, Y, None, rng, 0.0, 0.0))


def residuals(found, v):
    """The ridge is part of what is minimised: its rows follow the data's."""
    state = found.at(v)
    return np.concatenate([state.R.ravel(), np.sqrt(vp.RIDGE) * state.W.ravel()])


FORMS = [
    ((3, 5, 2), ("tansig", "purelin")),
    ((2, 4, 3), ("logsig", "purelin")),
    ((2, 4, 3, 2), ("tansig", "logsig", "purelin")),
]


@pytest.mark.parametrize(("sizes", "names"), FORMS)
def test_curvature_and_gradient_are_those_of_differences(sizes, names):
    found = search(sizes, names)
    v = found.start()
    state, eps = found.at(v), 1e-6
    J = np.stack(
        [
            (residuals(found, v + eps * e) - residuals(found, v - eps * e)) / (2 * eps)
            for e in np.eye(len(v))
        ],
        axis=1,
    )
    np.testing.assert_allclose(found.curvature(state, 0), J.T @ J, rtol=2e-5, atol=2e-6)
    np.testing.assert_allclose(
        found.gradient(state), J.T @ residuals(found, v), rtol=1e-5, atol=1e-6
    )


def test_both_ways_to_the_matrix_agree():
    found = search((3, 6, 2), ("tansig", "purelin"), rows=60)
    state = found.at(found.start())
    given = (found._hidden, state, np.arange(60), 1e-3)
    np.testing.assert_allclose(vp._one_layer(*given), vp._many_layers(*given), rtol=1e-9, atol=1e-9)


def test_output_weights_are_the_best_there_are():
    found = search((3, 6, 2), ("tansig", "purelin"))
    state = found.at(found.start())
    for seed in range(5):
        W = state.W + 1e-3 * np.random.default_rng(seed).standard_normal(state.W.shape)
        R = vp._with_ones(state.outputs[-1]) @ W - found._Y
        assert 0.5 * (np.sum(R**2) + vp.RIDGE * np.sum(W**2)) > state.value


def test_every_epoch_lowers_what_is_minimised(monkeypatch):
    values = []
    told = vp._Search.told

    def spy(self, state, monitor):
        values.append(state.value)
        return told(self, state, monitor)

    monkeypatch.setattr(vp._Search, "told", spy)
    X, y = make_friedman1(1500, n_features=5, random_state=2)
    net = MLP(hidden=(25,), max_iter=40, random_state=1).fit(X, y)
    assert net.n_iter_ == len(values) == 40
    assert (np.diff(values) < 0.0).all()
    assert net.loss_curve_[-1] < 0.01 * net.loss_curve_[0]


def test_it_learns_what_one_unit_says_exactly():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (400, 2))
    y = 3.0 * np.tanh(X @ [0.7, -1.1] + 0.2) - 1.0
    held = rng.uniform(-1, 1, (100, 2))
    net = MLP(hidden=(3,), random_state=0).fit(X, y)
    wanted = 3.0 * np.tanh(held @ [0.7, -1.1] + 0.2) - 1.0
    assert np.abs(net.predict(held) - wanted).max() < 2e-3


def test_it_goes_on_from_given_weights():
    X, y = make_friedman1(600, n_features=5, random_state=2)
    net = MLP(hidden=(15,), max_iter=10, random_state=1, warm_start=True).fit(X, y)
    before = net.loss_curve_[-1]
    assert net.fit(X, y).loss_curve_[0] < 1.001 * before


def test_a_bounded_output_is_refused_with_the_trainers_that_can():
    net = MLP(output_activation="logsig")
    with pytest.raises(InputError, match="'varpro' needs output_activation 'purelin'.*lbfgs"):
        net.fit(np.zeros((5, 1)), np.zeros(5))


def test_a_solved_problem_ends_and_says_so():
    X = np.linspace(-1, 1, 50)[:, None]
    net = MLP(hidden=(2,), random_state=0).fit(X, np.zeros(50))
    assert net.n_iter_ < 200
    assert "no step" in net.stop_reason_ or "goal" in net.stop_reason_


def test_a_part_of_the_rows_is_a_fair_sample_of_the_matrix():
    found = search((2, 4, 2), ("tansig", "purelin"), rows=6000)
    state = found.at(found.start())
    parts = np.mean([found.curvature(state, 0) for _ in range(20)], axis=0)
    whole = vp._one_layer(found._hidden, state, np.arange(6000), vp.RIDGE)
    assert np.linalg.norm(parts - whole) < 0.1 * np.linalg.norm(whole)


def test_the_trainer_keeps_the_best_weights_of_those_it_told():
    found = search((2, 4, 2), ("tansig", "purelin"))
    monitor = Monitor(max_epochs=5, unit=np.ones(2))
    find_trainer("varpro").train(found._task, monitor)
    out = found._task.layers.forward(monitor.best, found._X)
    np.testing.assert_allclose(
        np.mean((out - found._Y) ** 2), monitor.training_mse.mean(axis=1).min(), rtol=1e-9
    )

"""Swarm-found Gaussian units: the objective, the record, the budget."""

import numpy as np
import pytest
from sklearn.base import clone

from kinverse.errors import InputError
from kinverse.networks import RBFNetwork, SwarmRBF
from kinverse.networks import swarm_rbf as module
from kinverse.networks.swarm_rbf import population_mse
from kinverse.optimizers import NAMES, GreyWolf, ParticleSwarm


def data(seed=0, rows=80, inputs=2, outputs=2):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (rows, inputs))
    return X, np.sin(X @ rng.normal(size=(inputs, outputs)) * 3.0)


def by_hand(centers, spreads, X, Y):
    """Mean squared error of one network with the best output weights."""
    square = ((X[:, None] - centers[None]) ** 2).sum(axis=2)
    A = np.column_stack([0.5 ** (square / spreads**2), np.ones(len(X))])
    return np.mean((A @ np.linalg.lstsq(A, Y, rcond=None)[0] - Y) ** 2)


@pytest.mark.parametrize("entries", [1, 2**20])
def test_the_objective_is_the_error_with_the_best_output_weights(monkeypatch, entries):
    monkeypatch.setattr(module, "ENTRIES", entries)  # one member at a time, and all at once
    X, Y = data()
    rng = np.random.default_rng(1)
    centers, spreads = rng.uniform(-1, 1, (7, 5, 2)), rng.uniform(0.3, 2.0, (7, 5))
    expected = [by_hand(c, s, X, Y) for c, s in zip(centers, spreads, strict=True)]
    np.testing.assert_allclose(population_mse(centers, spreads, X, Y), expected, rtol=1e-5)


def test_units_that_coincide_do_no_harm():
    X, Y = data()
    values = population_mse(np.zeros((3, 6, 2)), np.full((3, 6), 0.8), X, Y)
    one = by_hand(np.zeros((1, 2)), np.array([0.8]), X, Y)
    np.testing.assert_allclose(values, one, rtol=1e-6)


def test_the_record_is_of_the_best_network_and_never_rises():
    X, Y = data(2)
    Y = Y * [1.0, 40.0]
    net = SwarmRBF(6, max_evals=1500, random_state=0).fit(X, Y)
    error = np.mean((net.predict(X) - Y) ** 2, axis=0)
    np.testing.assert_allclose(net.training_mse_[-1], error, rtol=1e-9)
    scaled = net.training_mse_ / (0.5 * np.ptp(Y, axis=0)) ** 2
    assert (np.diff(scaled.sum(axis=1)) <= 1e-15).all()
    assert scaled[-1].sum() < 0.7 * scaled[0].sum()


def test_centres_and_spreads_are_told_in_their_units():
    X, Y = data(3)
    X = X * [5.0, 0.01] + [100.0, -1.0]
    net = SwarmRBF(4, max_evals=300, random_state=1).fit(X, Y)
    assert net.centers_.shape == (4, 2) and net.spreads_.shape == (4,)
    assert (net.centers_ >= X.min(axis=0) - 1e-9).all()
    assert (net.centers_ <= X.max(axis=0) + 1e-9).all()
    scaled = 2.0 * (X - X.min(axis=0)) / np.ptp(X, axis=0) - 1.0
    centers = 2.0 * (net.centers_ - X.min(axis=0)) / np.ptp(X, axis=0) - 1.0
    wanted = Y / (0.5 * np.ptp(Y, axis=0))
    expected = by_hand(centers, net.spreads_, scaled, wanted)
    told = net.training_mse_[-1] / (0.5 * np.ptp(Y, axis=0)) ** 2
    assert np.mean(told) == pytest.approx(expected, rel=1e-6)


def test_searched_units_are_better_than_as_many_rows_at_random():
    X, Y = data(4, rows=200)
    found = SwarmRBF(8, max_evals=3000, random_state=0).fit(X, Y).score(X, Y)
    drawn = [
        RBFNetwork(8, selection="random", random_state=k).fit(X, Y).score(X, Y) for k in range(5)
    ]
    assert found > max(drawn)


@pytest.mark.parametrize("name", NAMES)
def test_every_method_works_and_spends_its_budget(name):
    X, Y = data(5)
    seen = []
    net = SwarmRBF(4, optimizer=name, max_evals=420, callback=seen.append, random_state=0)
    net.fit(X, Y)
    assert net.evaluations_ == 420
    assert net.stop_reason_ == "the evaluations are spent"
    assert seen[-1].epoch == seen[-1].max_epochs == net.n_iter_
    assert net.score(X, Y) > 0.1


def test_a_method_with_settings_is_cloned_with_the_network():
    net = SwarmRBF(3, optimizer=GreyWolf(population=12), max_evals=60, random_state=0)
    copy = clone(net)
    assert copy.optimizer is not net.optimizer
    X, Y = data(6)
    assert copy.fit(X, Y).n_iter_ == 5
    np.testing.assert_array_equal(net.fit(X, Y).predict(X), copy.predict(X))


def test_the_goal_and_the_callback_end_the_search():
    X, Y = data(7)
    net = SwarmRBF(6, goal=10.0, random_state=0).fit(X, Y)
    assert net.n_iter_ == 1 and net.stop_reason_ == "the goal was reached"
    net = SwarmRBF(6, callback=lambda progress: progress.epoch == 2, random_state=0).fit(X, Y)
    assert net.n_iter_ == 2 and net.stop_reason_ == "the callback ended the training"


def test_an_interrupted_search_keeps_the_best_so_far():
    def interrupt(progress):
        if progress.epoch == 3:
            raise KeyboardInterrupt

    X, Y = data(8)
    with pytest.warns(UserWarning, match="interrupted after 3 epochs"):
        net = SwarmRBF(5, callback=interrupt, random_state=0).fit(X, Y)
    error = np.mean((net.predict(X) - Y) ** 2, axis=0)
    np.testing.assert_allclose(error, net.training_mse_[-1], rtol=1e-9)


def test_warm_start_goes_on_from_what_was_found():
    X, Y = data(9)
    net = SwarmRBF(5, max_evals=600, warm_start=True, random_state=0).fit(X, Y)
    before = net.training_mse_[-1] / net.output_unit_**2
    net.set_params(max_evals=100).fit(X, Y)
    after = net.training_mse_[0] / net.output_unit_**2
    assert after.sum() <= before.sum() * (1.0 + 1e-9)
    net.set_params(n_neurons=6).fit(X, Y)  # weights of another form are not used
    assert len(net.spreads_) == 6


def test_early_stopping_keeps_the_network_that_is_best_on_rows_held_back():
    X, Y = data(10, rows=60)
    Y = Y + np.random.default_rng(0).normal(size=Y.shape)
    net = SwarmRBF(8, early_stopping=True, n_iter_no_change=5, random_state=0).fit(X, Y)
    assert net.stop_reason_ == "no better validation error for 5 epochs"
    assert net.validation_mse_.mean(axis=1).argmin() == net.n_iter_ - 6


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"n_neurons": 0}, "n_neurons"),
        ({"optimizer": "nelder"}, "unknown optimizer 'nelder'"),
        ({"optimizer": 3}, "must be a name or an Optimizer"),
        ({"optimizer": ParticleSwarm(population=200), "max_evals": 100}, "one generation"),
        ({"max_evals": 0}, "max_evals"),
        ({"goal": -1.0}, "goal"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(settings, text):
    with pytest.raises(InputError, match=text):
        SwarmRBF(**settings).fit(*data())

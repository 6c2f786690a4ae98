"""Networks whose weights a swarm finds: encodings, budget, history, what ends a search."""

import tracemalloc

import numpy as np
import pytest
from sklearn.base import clone

from kinverse.errors import InputError
from kinverse.networks import SwarmMLP
from kinverse.networks.encoding import ENCODINGS, Encoding
from kinverse.networks.layers import Layers
from kinverse.networks.swarm_mlp import population_mse
from kinverse.optimizers import NAMES, GeneticAlgorithm, GreyWolf, ParticleSwarm

LAYERS = Layers((3, 5, 2), ("logsig", "purelin"))


def rows(count=90, seed=4):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (count, 3))
    return X, np.stack([np.sin(2 * X[:, 0] + X[:, 1]), 5.0 + 3.0 * X[:, 2] ** 2], axis=1)


def swarm(**settings):
    return SwarmMLP(**({"hidden": (5,), "max_evals": 1000, "random_state": 3} | settings))


# ---------------------------------------------------------------------------- encodings
@pytest.mark.parametrize("kind", ENCODINGS)
@pytest.mark.parametrize("activation", ["logsig", "tansig", "purelin"])
def test_a_population_is_evaluated_as_its_members_are(kind, activation):
    X, Y = rows()
    layers = Layers((3, 5, 2), (activation, "purelin"))
    encoding = Encoding(kind, layers, 2.0, 7)
    members = np.random.default_rng(1).uniform(*encoding.box[0], (23, len(encoding.box)))
    mse = population_mse(encoding.matrices(members), activation, X, Y)
    for weights, told in zip(encoding.weights(members), mse, strict=True):
        assert np.abs(weights).max() <= 2.0
        expected = np.mean((layers.forward(weights, X) - Y) ** 2, axis=0)
        np.testing.assert_allclose(told, expected, rtol=1e-12)


@pytest.mark.parametrize("optimizer", NAMES)
def test_matrix_and_vector_give_the_same_bits(optimizer):
    X, y = rows()
    one, two = (
        swarm(optimizer=optimizer, encoding=kind).fit(X, y) for kind in ("vector", "matrix")
    )
    assert one.weights_.tobytes() == two.weights_.tobytes()
    assert one.training_mse_.tobytes() == two.training_mse_.tobytes()


def test_bits_are_plain_binary_from_end_to_end():
    encoding = Encoding("binary", Layers((1, 1, 1), ("logsig", "purelin")), 3.0, 2)
    strings = [0, 0, 0, 1, 1, 0, 1, 1]
    np.testing.assert_allclose(encoding.weights(np.array([strings]))[0], [-3, -1, 1, 3])
    almost = np.where(np.array(strings) == 1, 0.5, np.nextafter(0.5, 0))
    np.testing.assert_allclose(encoding.weights(almost[None])[0], [-3, -1, 1, 3])


@pytest.mark.parametrize("kind", ENCODINGS)
def test_weights_survive_being_put_into_a_member(kind):
    encoding = Encoding(kind, LAYERS, 1.5, 11)
    members = np.random.default_rng(2).uniform(*encoding.box[0], (4, len(encoding.box)))
    for weights in encoding.weights(members):
        again = encoding.weights(encoding.member(weights)[None])[0]
        np.testing.assert_allclose(again, weights, atol=1e-15)
    far = encoding.weights(encoding.member(np.full(LAYERS.count, 9.0))[None])[0]
    np.testing.assert_array_equal(far, 1.5)


@pytest.mark.parametrize("kind", ENCODINGS)
@pytest.mark.parametrize("name", ["ga", "pso", GeneticAlgorithm(variant="binary", bits=4)])
def test_weights_are_on_the_grid_of_their_bits(kind, name):
    X, y = rows()
    net = swarm(optimizer=name, encoding=kind, bits=4, bound=2.0).fit(X, y)
    words = (net.weights_ / 2.0 + 1.0) / 2.0 * 15.0
    on_grid = np.abs(words - np.rint(words)).max() < 1e-9
    # words of the genetic algorithm are words in every encoding
    assert on_grid == (kind == "binary" or isinstance(name, GeneticAlgorithm))


# ---------------------------------------------------------------------------- the search
@pytest.mark.parametrize("optimizer", NAMES)
def test_every_method_spends_its_budget_and_learns(optimizer):
    X, y = rows()
    net = swarm(optimizer=optimizer, max_evals=3333).fit(X, y)
    assert net.evaluations_ == 3333
    assert net.stop_reason_ == "the evaluations are spent"
    assert net.training_mse_.shape == (net.n_iter_, 2)
    # what is minimised is the sum over the scaled targets
    curve = (net.training_mse_ / net.output_unit_**2).sum(axis=1)
    assert (np.diff(curve) <= 0.0).all()
    assert net.score(X, y) > 0.1


@pytest.mark.parametrize("early_stopping", [False, True])
def test_units_of_the_targets_do_not_matter(early_stopping):
    X, y = rows()
    one, two = (
        swarm(early_stopping=early_stopping).fit(X, y * units) for units in (1.0, [1.0, 2.0**20])
    )
    np.testing.assert_array_equal(one.weights_, two.weights_)


def test_errors_are_told_in_the_units_of_the_targets():
    X, y = rows()
    y[:, 1] *= 1000.0
    net = swarm().fit(X, y)
    expected = np.mean((net.predict(X) - y) ** 2, axis=0)
    np.testing.assert_allclose(net.training_mse_[-1], expected, rtol=1e-10)
    np.testing.assert_allclose(
        net.predict(X),
        net._outputs.inverse(
            1
            / (1 + np.exp(-(net._inputs.forward(X) @ net.coefs_[0] + net.intercepts_[0])))
            @ net.coefs_[1]
            + net.intercepts_[1]
        ),
        rtol=1e-12,
    )


@pytest.mark.parametrize("bound", [0.25, 4.0])
def test_weights_stay_in_their_bounds(bound):
    X, y = rows()
    net = swarm(bound=bound, optimizer="ga").fit(X, y)
    assert np.abs(net.weights_).max() <= bound
    assert (np.abs(net.weights_).max() > 0.25) == (bound > 0.25)


def test_goal_callback_and_early_stopping_end_the_search():
    X, y = rows()
    reached = swarm(goal=2.0, max_evals=50_000).fit(X, y)
    assert reached.stop_reason_ == "the goal was reached" and reached.evaluations_ < 50_000
    assert reached.loss_curve_[-1] <= 2.0 < reached.loss_curve_[:-1].min(initial=np.inf)

    seen = []
    ended = swarm(callback=lambda progress: seen.append(progress) or len(seen) == 4).fit(X, y)
    assert ended.n_iter_ == 4 and ended.evaluations_ == 400
    assert [(p.epoch, p.max_epochs) for p in seen] == [(1, 10), (2, 10), (3, 10), (4, 10)]

    held = swarm(early_stopping=True, n_iter_no_change=3, max_evals=50_000).fit(X, y)
    assert held.stop_reason_ == "no better validation error for 3 epochs"
    assert held.validation_mse_.shape == (held.n_iter_, 2)


def test_progress_ends_at_its_own_forecast():
    X, y = rows()
    for optimizer in ("pso", "ga", "tlbo", "bees"):
        seen = []
        swarm(optimizer=optimizer, max_evals=1050, callback=lambda p, s=seen: s.append(p)).fit(X, y)
        assert seen[-1].epoch == seen[-1].max_epochs
        assert all(p.epoch < p.max_epochs for p in seen[:-1])


def test_an_interrupt_keeps_the_best_so_far():
    X, y = rows()

    def interrupt(progress):
        if progress.epoch == 5:
            raise KeyboardInterrupt

    whole = swarm(max_evals=5000).fit(X, y)
    with pytest.warns(UserWarning, match="interrupted after 5 epochs"):
        net = swarm(max_evals=5000, callback=interrupt).fit(X, y)
    assert net.stop_reason_ == "interrupted" and net.evaluations_ == 500
    np.testing.assert_array_equal(net.training_mse_, whole.training_mse_[:5])
    expected = np.mean((net.predict(X) - y) ** 2, axis=0)
    np.testing.assert_allclose(net.training_mse_[-1], expected, rtol=1e-10)


@pytest.mark.parametrize("kind", ENCODINGS)
def test_a_warm_start_is_no_worse_than_its_start(kind):
    X, y = rows()
    net = swarm(encoding=kind, warm_start=True).fit(X, y)
    before = net.loss_curve_[-1]
    net.set_params(max_evals=100, random_state=99).fit(X, y)
    assert net.loss_curve_[0] <= before * (1 + 1e-12)
    other = net.set_params(hidden=7).fit(X, y)  # another form: begins anew
    assert other.coefs_[0].shape == (3, 7)


def test_memory_does_not_grow_with_the_population():
    X, y = rows(30_000)
    tracemalloc.start()
    swarm(max_evals=200, optimizer=ParticleSwarm(population=200)).fit(X, y)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # the hidden layers of one generation at once would be 240 MB
    assert peak < 20e6


def test_a_method_with_settings_survives_clone_and_set_params():
    net = swarm(optimizer=GreyWolf(population=20))
    twin = clone(net)
    assert twin.optimizer == net.optimizer and twin.optimizer is not net.optimizer
    twin.set_params(optimizer__population=30)
    assert (twin.optimizer.population, net.optimizer.population) == (30, 20)


# ---------------------------------------------------------------------------- bad input
@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"encoding": "gray"}, "vector, matrix, binary"),
        ({"optimizer": "adam"}, "pso, ga, gwo"),
        ({"optimizer": None}, "unknown optimizer None"),
        ({"hidden": (5, 5)}, "one layer"),
        ({"hidden": (0,)}, "hidden units"),
        ({"hidden": ()}, "one layer"),
        ({"max_evals": 50}, "at least one generation"),
        ({"max_evals": 1e3}, "max_evals"),
        ({"bound": 0.0}, "bound"),
        ({"bound": np.nan}, "bound"),
        ({"bits": 0}, "bits"),
        ({"bits": 60}, "52"),
        ({"activation": "relu"}, "logsig"),
        ({"optimizer": GreyWolf(population=1)}, "population"),
        ({"goal": -1.0}, "goal"),
    ],
)
def test_bad_settings_are_named_and_change_nothing(settings, words):
    X, y = rows()
    net = swarm().fit(X, y)
    before = net.predict(X)
    good = {name: net.get_params()[name] for name in settings}
    with pytest.raises(InputError, match=words):
        net.set_params(**settings).fit(X[:, :2], y)
    net.set_params(**good)
    np.testing.assert_array_equal(net.predict(X), before)


def test_targets_too_large_to_square_are_no_crash():
    X, y = rows()
    with np.errstate(all="ignore"):
        net = swarm(scaling=None).fit(X, y * 1e200)
    assert np.isfinite(net.predict(X)).all()
    assert net.n_iter_ == 1 and "no longer a finite number" in net.stop_reason_


def test_few_rows_for_many_weights_are_told():
    X, y = rows(10)
    with pytest.warns(UserWarning, match="10 patterns of 2 targets for 182 parameters"):
        swarm(hidden=30).fit(X, y)

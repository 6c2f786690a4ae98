"""Radial basis function network: what is chosen, when it stops, and what it answers."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.networks import RBFNetwork
from kinverse.networks.radial.gaussian_units import gaussian_units, responses


def data(seed=0, rows=60, inputs=3, outputs=2):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (rows, inputs))
    return X, np.sin(X @ rng.normal(size=(inputs, outputs)) * 2.0) + 0.1 * X[:, :1]


def answers(X, centers, spread):
    """The definition, by differences."""
    square = ((X[:, None] - centers[None]) ** 2).sum(axis=2)
    return np.exp(-square / (2.0 * (spread / np.sqrt(2.0 * np.log(2.0))) ** 2))


def refitted(X, Y, chosen, spread):
    """Errors (N, m) of a bias and the units at the rows chosen, by least squares."""
    A = np.column_stack([np.ones(len(X)), answers(X, X[list(chosen)], spread)])
    return Y - A @ np.linalg.lstsq(A, Y, rcond=None)[0]


def greedy(X, Y, count, spread):
    """The rows that lower the squared error most, each found by refitting with every row."""
    chosen = []
    for _ in range(count):
        rest = [j for j in range(len(X)) if j not in chosen]
        sse = [np.sum(refitted(X, Y, [*chosen, j], spread) ** 2) for j in rest]
        chosen.append(rest[int(np.argmin(sse))])
    return chosen


# What is chosen -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_orthogonal_least_squares_picks_what_refitting_every_candidate_would(seed):
    X, Y = data(seed)
    net = RBFNetwork(8, spread=0.9, scaling=None).fit(X, Y)
    assert net.center_indices_.tolist() == greedy(X, Y, 8, 0.9)


@pytest.mark.parametrize("seed", range(5))
def test_residual_picks_the_row_with_the_largest_error(seed):
    X, Y = data(seed)
    net = RBFNetwork(8, selection="residual", spread=0.9, scaling=None).fit(X, Y)
    for k, row in enumerate(net.center_indices_):
        error = refitted(X, Y, net.center_indices_[:k], 0.9) if k else Y - Y.mean(axis=0)
        square = (error**2).sum(axis=1)
        square[net.center_indices_[:k]] = 0.0  # a row becomes a centre once
        assert row == np.argmax(square)


def test_with_scaling_the_choice_is_that_for_scaled_rows():
    X, Y = data(1)
    X, Y = X * [1.0, 50.0, 1e-3] + 7.0, Y * [1.0, 1e4]
    scaled = [2.0 * (A - A.min(axis=0)) / np.ptp(A, axis=0) - 1.0 for A in (X, Y)]
    net = RBFNetwork(6, spread=1.2).fit(X, Y)
    assert net.center_indices_.tolist() == greedy(*scaled, 6, 1.2)
    np.testing.assert_allclose(net.centers_, X[net.center_indices_], rtol=1e-12)


@pytest.mark.parametrize("selection", ["ols", "residual"])
def test_candidates_are_the_only_rows_that_become_centres(selection):
    X, Y = data(rows=200)
    net = RBFNetwork(30, selection=selection, n_candidates=10, random_state=3).fit(X, Y)
    other = RBFNetwork(30, selection=selection, n_candidates=10, random_state=4).fit(X, Y)
    assert net.n_neurons_ == 10
    assert set(net.center_indices_) != set(other.center_indices_)


def test_a_matrix_of_candidates_that_is_too_large_is_cut_with_a_warning(monkeypatch):
    from kinverse.networks import rbf

    X, Y = data(rows=100)
    monkeypatch.setattr(rbf, "MOST_ENTRIES", 100 * 40)
    with pytest.warns(UserWarning, match="among 40 rows .* n_candidates"):
        RBFNetwork(5).fit(X, Y)
    RBFNetwork(5, n_candidates=50).fit(X, Y)
    RBFNetwork(5, selection="residual").fit(X, Y)  # it needs no such matrix


def test_random_centres_are_distinct_rows():
    X, Y = data(rows=40)
    X, Y = np.vstack([X, X]), np.vstack([Y, Y])
    net = RBFNetwork(40, selection="random", spread=1.0, random_state=0).fit(X, Y)
    assert len(np.unique(X[net.center_indices_], axis=0)) == 40


@pytest.mark.parametrize("selection", ["ols", "residual"])
def test_the_order_of_the_rows_does_not_matter(selection):
    X, Y = data(2)
    order = np.random.default_rng(9).permutation(len(X))
    one = RBFNetwork(12, selection=selection).fit(X, Y)
    two = RBFNetwork(12, selection=selection).fit(X[order], Y[order])
    np.testing.assert_array_equal(order[two.center_indices_], one.center_indices_)
    np.testing.assert_allclose(two.predict(X), one.predict(X), atol=1e-11)


# Errors and stops ---------------------------------------------------------------------------------


@pytest.mark.parametrize("selection", ["ols", "residual", "random"])
def test_the_path_holds_the_errors_of_refits_and_never_rises(selection):
    X, Y = data(4)
    Y = Y * [1.0, 30.0]
    net = RBFNetwork(20, selection=selection, spread=1.0, random_state=1).fit(X, Y)
    scaled = 2.0 * (X - X.min(axis=0)) / np.ptp(X, axis=0) - 1.0
    for k in range(1, net.n_iter_ + 1):
        error = refitted(scaled, Y, net.center_indices_[:k], net.spread_)
        np.testing.assert_allclose(net.training_mse_[k - 1], np.mean(error**2, axis=0), rtol=1e-7)
        np.testing.assert_allclose(net.sse_path_[k - 1], np.sum(error**2), rtol=1e-7)
    assert (np.diff(net.sse_path_) <= 0.0).all()
    error = net.predict(X) - Y
    np.testing.assert_allclose(np.mean(error**2, axis=0), net.training_mse_[-1], rtol=1e-7)


@pytest.mark.parametrize("selection", ["ols", "residual"])
@pytest.mark.parametrize("kind", ["mse", "sse"])
def test_it_stops_at_the_first_unit_that_meets_the_goal(selection, kind):
    X, Y = data(5)
    Y = Y * 20.0
    path = RBFNetwork(30, selection=selection).fit(X, Y)
    measure = path.sse_path_ if kind == "sse" else path.training_mse_.mean(axis=1)
    goal = 0.5 * (measure[10] + measure[11])
    net = RBFNetwork(selection=selection, goal=goal, goal_kind=kind).fit(X, Y)
    assert net.n_neurons_ == net.n_iter_ == 12
    assert net.stop_reason_ == "the goal was reached"


def test_without_a_goal_it_stops_at_a_hundred_units_or_half_the_rows():
    assert RBFNetwork().fit(*data(rows=31)).n_neurons_ == 15
    net = RBFNetwork(spread=0.3).fit(*data(rows=240))
    assert net.n_neurons_ == 100
    assert net.stop_reason_ == "as many units as allowed"


def test_the_callback_sees_each_unit_and_can_end_the_training():
    seen = []

    def callback(progress):
        seen.append((progress.epoch, progress.max_epochs))
        return progress.epoch == 3

    net = RBFNetwork(9, callback=callback).fit(*data())
    assert seen == [(1, 9), (2, 9), (3, 9)]
    assert net.n_neurons_ == 3
    assert net.stop_reason_ == "the callback ended the training"


# What a unit answers ------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6])
def test_a_unit_answers_one_at_its_centre_and_half_at_its_spread(size):
    rng = np.random.default_rng(1)
    centers = rng.uniform(-size, size, (20, 6)) + 2.0 * size
    units = gaussian_units(centers, 0.75)
    np.testing.assert_allclose(np.diag(responses(centers, units)), 1.0, rtol=0, atol=1e-12)
    away = rng.normal(size=centers.shape)
    away *= 0.75 / np.linalg.norm(away, axis=1, keepdims=True)
    half = np.diag(responses(centers + away, units))
    np.testing.assert_allclose(half, 0.5, rtol=0, atol=1e-14 * max(size, 10.0))


@pytest.mark.parametrize("size", [1.0, 1e3, 1e8])
def test_answers_are_those_of_the_definition(size):
    rng = np.random.default_rng(2)
    X = rng.uniform(-1, 1, (300, 4)) + size
    spreads = rng.uniform(0.3, 3.0, 50)
    expected = answers(X, X[:50], spreads)
    got = responses(X, gaussian_units(X[:50], spreads))
    # a rounding of a row, as far out as this, changes the answer by as much
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 + 1e-15 * size)


def test_random_centres_have_the_width_of_the_rule():
    X, Y = data(rows=80)
    net = RBFNetwork(20, selection="random", scaling=None, random_state=0).fit(X, Y)
    apart = np.linalg.norm(net.centers_[:, None] - net.centers_[None], axis=2)
    sigma = apart.max() / np.sqrt(2.0 * 20)
    assert net.spread_ == pytest.approx(1.1774100225154747 * sigma, rel=1e-14)
    phi = np.exp(-((X[:, None] - net.centers_) ** 2).sum(axis=2) / (2.0 * sigma**2))
    np.testing.assert_allclose(
        net.predict(X), phi @ net.output_weights_ + net.bias_, rtol=0, atol=1e-11
    )


def test_exact_goes_through_all_targets():
    X, Y = data(6, rows=150)
    net = RBFNetwork(selection="exact", spread=0.7).fit(X, Y)
    np.testing.assert_allclose(net.predict(X), Y, rtol=0, atol=1e-9)
    assert net.n_neurons_ == 150
    assert net.n_iter_ == 1
    assert net.sse_path_[0] < 1e-16


# Hard rows ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("selection", ["ols", "residual"])
def test_equal_rows_become_one_centre(selection):
    X, Y = data(7, rows=12)
    X, Y = np.repeat(X, 3, axis=0), np.repeat(Y, 3, axis=0)
    net = RBFNetwork(36, selection=selection, spread=0.5)
    with pytest.warns(UserWarning, match="by heart"):
        net.fit(X, Y[:, 0])
    assert len(np.unique(net.centers_, axis=0)) == net.n_neurons_ <= 12
    assert net.stop_reason_ == "no row is left that would lower the error"
    np.testing.assert_allclose(net.predict(X), Y[:, 0], atol=1e-8)


def test_exact_says_that_equal_rows_with_different_targets_are_missed():
    X, Y = data(8, rows=20)
    with pytest.warns(UserWarning, match="missed by .* 20 rows occur more than once"):
        net = RBFNetwork(selection="exact").fit(np.vstack([X, X]), np.vstack([Y, Y + 0.5]))
    assert net.n_neurons_ == 20
    np.testing.assert_allclose(net.predict(X), Y + 0.25, atol=1e-7)  # least squares: the mean


@pytest.mark.parametrize("selection", ["ols", "residual", "random"])
def test_more_units_than_rows_is_told_and_gives_at_most_the_rows(selection):
    X, Y = data(9, rows=15)
    with pytest.warns(UserWarning, match="15 patterns of 2 targets for 102 parameters"):
        net = RBFNetwork(50, selection=selection, spread=0.5, random_state=0).fit(X, Y)
    assert net.n_neurons_ <= 15
    assert net.stop_reason_ == "no row is left that would lower the error"
    np.testing.assert_allclose(net.predict(X), Y, atol=1e-7)


@pytest.mark.parametrize("selection", ["ols", "residual", "exact"])
def test_rows_that_are_all_equal_give_the_mean(selection):
    Y = np.arange(12.0).reshape(6, 2)
    net = RBFNetwork(selection=selection).set_params(spread=1.0)
    if selection == "exact":
        with pytest.warns(UserWarning, match="5 rows occur more than once"):
            net.fit(np.full((6, 3), 4.0), Y)
    else:
        net.fit(np.full((6, 3), 4.0), Y)
    assert net.n_neurons_ == 1
    np.testing.assert_allclose(net.predict([[4.0] * 3]), [Y.mean(axis=0)], rtol=1e-12)
    np.testing.assert_allclose(net.training_mse_, [Y.var(axis=0)], rtol=1e-12)


def test_the_width_rule_with_one_centre_says_what_it_does():
    X, Y = data()
    with pytest.warns(UserWarning, match="two distinct centres"):
        net = RBFNetwork(1, selection="random").fit(X, Y)
    assert net.spread_ == 1.0


def test_constant_targets_need_no_second_unit():
    X, _ = data()
    net = RBFNetwork(10).fit(X, np.full(len(X), 3.25))
    assert net.n_neurons_ == 1
    np.testing.assert_array_equal(net.predict(X), 3.25)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"selection": "kmeans"}, "ols, residual, random, exact"),
        ({"selection": None}, "ols, residual, random, exact"),
        ({"goal_kind": "rmse"}, "mse, sse"),
        ({"n_neurons": 0}, "n_neurons must be a whole number >= 1"),
        ({"n_neurons": 2.5}, "n_neurons must be a whole number"),
        ({"n_neurons": 5, "selection": "exact"}, "every distinct row"),
        ({"n_candidates": 0}, "n_candidates"),
        ({"spread": 0.0}, "spread must be a finite number"),
        ({"spread": np.nan}, "spread must be a finite number"),
        ({"spread": "dmax"}, "'random' or 'exact'"),
        ({"spread": "wide", "selection": "random"}, "'dmax'"),
        ({"goal": -1.0}, "goal"),
        ({"scaling": "zscore"}, "minmax"),
        ({"callback": 3}, "callback"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(settings, text):
    with pytest.raises(InputError, match=text):
        RBFNetwork(**settings).fit(*data())

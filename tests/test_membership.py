"""Membership functions: the first grid, the derivatives, what stays valid."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.networks.fuzzy.membership import MEMBERSHIPS, find_membership
from kinverse.networks.fuzzy.rules import Rules

KINDS = sorted(MEMBERSHIPS)


def on_grid(kind, count=5):
    centres, step = np.linspace(-1.0, 1.0, count), 2.0 / (count - 1)
    return centres, find_membership(kind).start(centres, np.full(count, step))


def shaken(kind, seed=2):
    """Sets of a grid, each moved, widened and bent a little."""
    _, sets = on_grid(kind)
    return sets + np.random.default_rng(seed).uniform(-0.1, 0.1, sets.shape)


@pytest.mark.parametrize("kind", KINDS)
def test_neighbours_cross_at_half_and_peak_at_one(kind):
    centres, sets = on_grid(kind)
    of = find_membership(kind).of
    middles = 0.5 * (centres[:-1] + centres[1:])
    values = of(np.repeat(middles[:, None], 5, axis=1), sets)
    for k in range(4):
        np.testing.assert_allclose(values[k, k : k + 2], 0.5, rtol=1e-14)
    np.testing.assert_allclose(of(centres[None, :], sets), 1.0, rtol=1e-14)


def test_the_formulas_at_points_worked_out_by_hand():
    def value(kind, x, *parameters):
        return find_membership(kind).of(np.array([[x]]), np.array([parameters]))[0, 0]

    assert value("gbell", 3.0, 2.0, 1.5, -1.0) == pytest.approx(1.0 / (1.0 + 2.0**3))
    assert value("gauss", 3.0, 2.0, -1.0) == pytest.approx(np.exp(-2.0))
    assert value("tri", 3.0, 1.0, 2.0, 6.0) == pytest.approx(0.75)
    assert value("tri", 1.25, 1.0, 2.0, 6.0) == pytest.approx(0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_slopes_are_the_differences(kind):
    mf, sets = find_membership(kind), shaken(kind)
    # off the kinks of the triangles
    x = np.random.default_rng(3).uniform(-1.2, 1.2, (40, len(sets)))
    slopes = mf.slopes(x, sets)
    for p in range(sets.shape[1]):
        h = np.zeros_like(sets)
        h[:, p] = 1e-6
        differences = (mf.of(x, sets + h) - mf.of(x, sets - h)) / 2e-6
        np.testing.assert_allclose(slopes[p], differences, atol=1e-7)
    assert np.abs(slopes).max() > 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_far_out_and_at_the_centre_all_is_finite(kind):
    mf = find_membership(kind)
    centres, sets = on_grid(kind)
    x = np.vstack([centres, np.full(5, 1e200), np.full(5, -1e9), np.full(5, 40.0)])
    values = mf.of(x, sets)
    assert (values >= 0.0).all() and (values <= 1.0).all()
    assert (values[1:] < 1e-6).all()
    assert np.isfinite(mf.slopes(x[[0, 2, 3]], sets)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_sets_that_a_step_turned_inside_out_are_mended(kind):
    mf = find_membership(kind)
    _, sets = on_grid(kind)
    least = np.full(5, 0.01)
    np.testing.assert_array_equal(mf.kept(sets, least), sets)
    spoiled = sets.copy()
    spoiled[:, 0] = 3.0 if kind == "tri" else -3.0
    kept = mf.kept(spoiled, least)
    np.testing.assert_array_equal(kept[:, mf.centre], sets[:, mf.centre])
    x = sets[:, mf.centre] + np.array([[-0.02], [0.0], [0.02]])
    values = mf.of(x, kept)
    assert (values[1] == 1.0).all()
    assert (values[[0, 2]] < 1.0).all()


def test_an_unknown_kind_is_refused_by_name():
    for name in ("trap", None, 3):
        with pytest.raises(InputError, match="gbell, gauss, tri"):
            find_membership(name)


@pytest.mark.parametrize("kind", KINDS)
def test_the_grid_spans_the_rows(kind):
    X = np.array([[0.0, 5.0], [4.0, 5.0], [1.0, 5.0]])
    rules = Rules((3, 2), kind, 0)
    sets, least = rules.first(X)
    np.testing.assert_allclose(sets[:3, rules.kind.centre], [0.0, 2.0, 4.0])
    assert (least > 0.0).all()
    # the constant input has sets too, and its rows lie between them
    shares = rules.shares(sets, X)
    np.testing.assert_allclose(shares.parts[1], 0.5)


@pytest.mark.parametrize("kind", KINDS)
def test_strengths_are_products_and_sum_to_one(kind):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (30, 3))
    rules = Rules((2, 4, 3), kind, 1)
    sets = rules.first(X)[0]
    strengths = rules.strengths(rules.shares(sets, X).parts)[-1]
    np.testing.assert_allclose(strengths.sum(axis=1), 1.0, rtol=1e-13)
    values = rules.values(sets, X)
    fired = np.array(
        [
            [v[i] * v[2 + j] * v[6 + k] for i in range(2) for j in range(4) for k in range(3)]
            for v in values
        ]
    )
    np.testing.assert_allclose(strengths, fired / fired.sum(axis=1, keepdims=True), rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("far", [1.7, 50.0, 1e12])
def test_where_no_set_fires_the_nearest_answers(kind, far):
    """Beyond the ends a triangle is 0 and a Gaussian too small for a number."""
    rules = Rules((3,), kind, 0)
    sets = rules.first(np.array([[-1.0], [1.0]]))[0]
    sets[:, 0] = {"tri": sets[:, 1] - 0.5, "gauss": 0.1, "gbell": sets[:, 0]}[kind]
    sets[:, -1] = sets[:, 1] + 0.5 if kind == "tri" else sets[:, -1]
    out = rules.output(sets, np.array([[1.0], [2.0], [3.0]]), np.array([[far], [-far]]))
    if kind == "gbell":  # it falls off so slowly that all bells count
        assert (1.0 <= out).all() and (out <= 3.0).all() and out[0] > out[1] - 1e-9
    else:
        np.testing.assert_allclose(out, [3.0, 1.0], atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [0, 1])
def test_the_gradient_is_that_of_the_squared_error(kind, order):
    rng = np.random.default_rng(7)
    X, y = rng.uniform(-1.0, 1.0, (25, 2)), rng.standard_normal(25)
    rules = Rules((3, 4), kind, order)
    sets = rules.first(X)[0] + rng.uniform(-0.05, 0.05, (7, len(rules.kind.parameters)))
    theta = rng.standard_normal((12, 1 + 2 * order))

    def half_square(sets):
        return 0.5 * np.sum((rules.output(sets, theta, X) - y) ** 2)

    found = rules.gradient(sets, theta, X, rules.output(sets, theta, X) - y)
    wanted = np.zeros_like(sets)
    for at in np.ndindex(sets.shape):
        h = np.zeros_like(sets)
        h[at] = 1e-6
        wanted[at] = (half_square(sets + h) - half_square(sets - h)) / 2e-6
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-7)
    assert np.abs(found).max() > 0.1


def test_the_gradient_holds_where_sets_do_not_fire():
    """Most triangles are 0 at most rows; one row lies where none fires at all."""
    rules = Rules((5, 2), "tri", 0)
    X = np.array([[-0.9, 0.3], [0.1, -0.2], [0.6, 0.9], [9.0, 0.4], [0.26, 0.5]])
    y = np.array([1.0, -1.0, 0.5, 3.0, 0.0])
    sets = rules.first(np.array([[-1.0, -1.0], [1.0, 1.0]]))[0]
    theta = np.random.default_rng(1).standard_normal((10, 1))
    found = rules.gradient(sets, theta, X, rules.output(sets, theta, X) - y)
    for at in np.ndindex(sets.shape):
        h = np.zeros_like(sets)
        h[at] = 1e-6
        up, down = (np.sum((rules.output(s, theta, X) - y) ** 2) for s in (sets + h, sets - h))
        assert found[at] == pytest.approx((up - down) / 4e-6, abs=1e-7)


def test_blocks_change_nothing(monkeypatch):
    rng = np.random.default_rng(5)
    X, e = rng.uniform(-1.0, 1.0, (50, 2)), rng.standard_normal(50)
    rules = Rules((3, 3), "gauss", 1)
    sets, theta = rules.first(X)[0], rng.standard_normal((9, 3))
    whole = rules.output(sets, theta, X), rules.gradient(sets, theta, X, e)
    monkeypatch.setattr("kinverse.networks.fuzzy.rules.ENTRIES", 60)
    np.testing.assert_allclose(rules.output(sets, theta, X), whole[0], rtol=1e-12)
    np.testing.assert_allclose(rules.gradient(sets, theta, X, e), whole[1], rtol=1e-10)

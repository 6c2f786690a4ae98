"""Biogeography-based optimization, beside the laws for all."""

from math import comb

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import BiogeographyBased
from optimizer_laws import BOUNDS, bowls, hold_all


@pytest.mark.parametrize("greedy", [False, True])
def test_the_laws(greedy):
    hold_all(BiogeographyBased(population=20, mutation=0.1, greedy=greedy))


def begun(method, problems):
    """A run whose members' variables are their ranks, within the box 0..size."""
    size = method.population
    run = method.start([(0, size)] * 40, max_evals=10**6, rng=2, problems=problems)
    run.ask()
    run.tell(np.arange(float(size)) + np.zeros((problems, 1)))
    run.state.x[:] = np.arange(float(size))[None, :, None]
    return run


@pytest.mark.parametrize("size", [2, 3, 10, 101])
def test_who_takes_in_and_who_sends_out(size):
    problems = 4000 // size
    run = begun(BiogeographyBased(population=size, mutation=0.0, elites=0), problems)
    x = run.ask().astype(int)
    rank = np.arange(1, size + 1)
    emigration = (size + 1 - rank) / emigration_sum(size)
    moved = (x != rank[:, None] - 1).mean(axis=(0, 2))
    immigration = rank / (size + 1)
    assert np.abs(moved - immigration * (1.0 - emigration)).max() < 0.06
    arrived = x[x != np.broadcast_to(rank[:, None] - 1, x.shape)]
    seen = np.bincount(arrived, minlength=size) / len(arrived)
    expected = emigration * (immigration.sum() - immigration)
    assert np.abs(seen - expected / expected.sum()).max() < 0.02


def emigration_sum(size):
    return size * (size + 1) / 2


def test_rates_of_mutation_are_those_of_the_number_of_species():
    size = 12
    chance = np.array([comb(size + 1, rank) for rank in range(1, size + 1)], float)
    expected = 0.2 * (1.0 - chance / chance.max())
    rates = BiogeographyBased(population=size, mutation=0.2)._mutation_rates()
    assert np.allclose(rates, expected)
    run = begun(BiogeographyBased(population=size, mutation=0.2), 500)
    x = run.ask()
    seen = (x != np.rint(x)).mean(axis=(0, 2))
    assert np.abs(seen - expected).max() < 0.015
    fresh = x[x != np.rint(x)] / size
    assert abs(fresh.mean() - 0.5) < 0.02 and fresh.max() > 0.99 and fresh.min() < 0.01


def test_a_large_population_has_rates_too():
    rates = BiogeographyBased(population=3000, mutation=0.2)._mutation_rates()
    assert np.isfinite(rates).all() and abs(rates.min()) < 1e-9 and abs(rates.max() - 0.2) < 1e-9


@pytest.mark.parametrize("elites", [0, 1, 5, 20])
def test_elites_take_the_places_of_the_worst(elites):
    method = BiogeographyBased(population=20, mutation=0.2, elites=elites)
    run = method.start(BOUNDS, max_evals=10**6, rng=1, problems=5)
    run.tell(bowls(run.ask(), np.zeros((5, 4))))
    for _ in range(10):
        was = method._members(run)[1].copy()
        f = bowls(run.ask(), np.zeros((5, 4)))
        run.tell(f)
        best = np.concatenate([was[:, :elites], np.sort(f, axis=1)[:, : 20 - elites]], axis=1)
        assert (method._members(run)[1] == np.sort(best, axis=1)).all()


def test_a_greedy_habitat_changes_only_for_the_better():
    method = BiogeographyBased(population=20, mutation=0.2, greedy=True)
    run = method.start(BOUNDS, max_evals=10**6, rng=1, problems=5)
    run.tell(bowls(run.ask(), np.zeros((5, 4))))
    for _ in range(10):
        was = method._members(run)[1].copy()
        f = bowls(run.ask(), np.zeros((5, 4)))
        run.tell(f)
        assert (method._members(run)[1] == np.sort(np.minimum(was, f), axis=1)).all()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"mutation": 1.5}, r"mutation must be a number in 0\.\.1"),
        ({"elites": 21}, "elites must not exceed the population 20"),
        ({"elites": 1.0}, "elites must be a whole number"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    with pytest.raises(InputError, match=message):
        BiogeographyBased(**{"population": 20, **settings}).start(BOUNDS, max_evals=1000)

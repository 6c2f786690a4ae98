"""The genetic algorithm in its three forms, beside the laws for all."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import GeneticAlgorithm
from optimizer_laws import BOUNDS, bowls, hold_all

VARIANTS = ("scattered", "binary", "simulated_binary")


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_laws(variant):
    hold_all(GeneticAlgorithm(population=20, variant=variant))


def begun(method, values=bowls, problems=6, bounds=BOUNDS, rng=2):
    run = method.start(bounds, max_evals=10**6, rng=rng, problems=problems)
    x = run.ask()
    run.tell(values(np.broadcast_to(x, x.shape), np.zeros((problems, x.shape[2]))))
    return run


@pytest.mark.parametrize(("elites", "kept"), [(None, 2), (0, 0), (5, 5)])
def test_elites_stay_and_are_not_evaluated_again(elites, kept):
    method = GeneticAlgorithm(population=21, elites=elites)
    run = begun(method)
    for _ in range(5):
        best = method._members(run)[0][:, :kept].copy()
        x = run.ask()
        assert x.shape[1] == 21 - kept
        run.tell(bowls(x, np.zeros((6, 4))))
        members, values = method._members(run)
        assert (np.diff(values, axis=1) >= 0).all()
        for one in range(kept):
            same = (members == best[:, one : one + 1]).all(axis=2)
            assert (same.any(axis=1) | (values[:, 0] < values[:, -1])).all()


def test_scattered_children_have_their_parents_variables():
    method = GeneticAlgorithm(population=40, crossover=1.0)
    run = begun(method)
    members, x = method._members(run)[0], run.ask()
    for variable in range(4):
        known = x[:, :, None, variable] == members[:, None, :, variable]
        assert known.any(axis=2).all()
    assert not (x[:, :, None] == members[:, None]).all(axis=3).any(axis=2).all()


def test_universal_sampling_gives_every_rank_its_share():
    """Without crossover and noise the children are the parents: a rank's count is its share,
    rounded down or up."""
    method = GeneticAlgorithm(population=50, elites=0, crossover=0.0, scale=0.0)
    run = begun(method)
    members, x = method._members(run)[0], run.ask()
    counts = (x[:, :, None] == members[:, None]).all(axis=3).sum(axis=1)
    share = 1.0 / np.sqrt(np.arange(1, 51))
    share *= 50 / share.sum()
    assert (np.abs(counts - share) < 1.0).all()


def test_noise_shrinks_to_nothing():
    method = GeneticAlgorithm(population=50, elites=0, crossover=0.0, scale=0.1)
    run = method.start(BOUNDS, max_evals=5000, rng=1)
    spread = []
    while not run.done:
        members = method._members(run)[0].copy() if run.generation else None
        x = run.ask()
        if members is not None:
            near = np.abs(x[:, :, None] - members[:, None]).max(axis=3).min(axis=2)
            spread.append(near.mean())
        run.tell(np.arange(50.0)[None] * np.ones((1, 1)) if run.generation == 0 else x[:, :, 0] + 9)
    assert spread[-1] < 0.1 * spread[0]


@pytest.mark.parametrize("bits", [1, 6, 16, 52])
def test_binary_points_lie_on_the_grid_of_their_words(bits):
    method = GeneticAlgorithm(population=20, variant="binary", bits=bits)
    run = begun(method)
    for _ in range(3):
        x = run.ask()
        words = (x - run.low) / run.span * (2.0**bits - 1)
        assert np.abs(words - np.rint(words)).max() < max(1e-6, 8 * 2.0 ** (bits - 52))
        run.tell(bowls(x, np.zeros((6, 4))))


def test_one_point_crossover_swaps_tails():
    """Two kinds of parents, all zeros and all ones: a child is zeros and then ones, or reversed."""
    method = GeneticAlgorithm(population=30, variant="binary", mutation=0.0, crossover=1.0, bits=5)
    run = begun(method, lambda x, goals: np.ones(x.shape[:2]))  # equal: all are parents
    run.state.words[:, ::2], run.state.words[:, 1::2] = 0, 31
    run.ask()
    text = run.state.children[:, :, :, None] >> np.arange(4, -1, -1) & 1
    changes = np.abs(np.diff(text.reshape(6, 30, 20), axis=2)).sum(axis=2)
    assert changes.max() == 1
    cuts = np.argmax(np.abs(np.diff(text.reshape(6, 30, 20), axis=2)), axis=2)[changes == 1]
    assert len(np.unique(cuts)) > 12


def test_bits_turn_at_their_rate():
    method = GeneticAlgorithm(population=50, variant="binary", mutation=0.1, crossover=0.0, bits=20)
    run = begun(method)
    run.state.words[:] = 0
    run.ask()
    turned = (run.state.children[..., None] >> np.arange(20) & 1).mean(axis=(0, 1))
    assert np.abs(turned - 0.1).max() < 0.07
    assert abs(turned.mean() - 0.1) < 0.01


def test_the_wheel_follows_equation_6_5():
    method = GeneticAlgorithm(population=4, variant="binary", mutation=0.0, crossover=0.0)
    run = method.start(BOUNDS, max_evals=100, rng=3, problems=2000)
    run.ask()
    run.tell(np.array([0.0, 1.0, 4.0, np.inf]) + np.zeros((2000, 1)))  # g: 4, 3, 0, 0
    run.state.words[:] = np.arange(4)[None, :, None]
    run.ask()
    share = np.bincount(run.state.children[:, :, 0].ravel(), minlength=4) / 8000
    assert np.abs(share - [4 / 7, 3 / 7, 0, 0]).max() < 0.02


def test_simulated_binary_crossover_keeps_the_middle_and_spreads_as_published():
    """The children of a pair have its middle; half the spreads are below one and
    P(spread < 1/2) = 0.5 * 0.5**(n + 1)."""
    n = 2.0
    method = GeneticAlgorithm(
        population=4, variant="simulated_binary", crossover=1.0, mutation=0.0, spread_index=(n, 20)
    )
    run = method.start([(-1e6, 1e6)] * 40, max_evals=100, rng=3, problems=500)
    run.ask()
    run.tell(np.arange(4.0) + np.zeros((500, 1)))
    run.state.x[:] = np.array([-1.0, 1.0, 7.0, 7.0])[:, None]
    x = run.ask()
    first, second = x[:, :2].ravel(), x[:, 2:].ravel()
    mixed = (first != 7) & (second != first) & (np.abs(first + second) < 1e-9)
    spread = np.abs(first[mixed] - second[mixed]) / 2
    crossed = spread[spread != 1.0]
    assert abs((spread == 1.0).mean() - 0.5) < 0.02
    assert abs((crossed < 1.0).mean() - 0.5) < 0.02
    assert abs((crossed < 0.5).mean() - 0.5 * 0.5 ** (n + 1)) < 0.01
    assert abs((crossed > 2.0).mean() - 0.5 * 0.5 ** (n + 1)) < 0.01


def test_polynomial_mutation_is_even_and_near():
    m = 5.0
    method = GeneticAlgorithm(
        population=100,
        variant="simulated_binary",
        crossover=0.0,
        mutation=0.25,
        spread_index=(2, m),
    )
    run = begun(method, problems=100)
    run.state.x[:] = BOUNDS.mean(axis=1)
    jump = (run.ask() - BOUNDS.mean(axis=1)) / run.span
    assert abs((jump != 0.0).mean() - 0.25) < 0.01
    jump = jump[jump != 0.0]
    assert abs((jump > 0.0).mean() - 0.5) < 0.02
    # |jump| < d has the probability 1 - (1 - d)**(m + 1)
    assert abs((np.abs(jump) < 0.1).mean() - (1.0 - 0.9 ** (m + 1.0))) < 0.02


def test_simulated_binary_keeps_the_best_of_both_and_one_of_twins():
    method = GeneticAlgorithm(population=20, variant="simulated_binary", mutation=0.1)
    run = begun(method)
    twins = 0
    for _ in range(10):
        was = method._members(run)[0].copy()
        x = run.ask()
        run.tell(bowls(x, np.zeros((6, 4))))
        for one in range(6):
            both = np.concatenate([was[one], x[one]])
            alone = np.unique(both, axis=0)
            twins += len(both) - len(alone)
            best = np.sort(bowls(alone[None], np.zeros((1, 4)))[0])[:20]
            assert (method._members(run)[1][one] == best).all()
    assert twins > 10


def test_twins_stay_where_there_is_nobody_else():
    method = GeneticAlgorithm(population=9, variant="simulated_binary", crossover=0, mutation=0)
    one = np.array([0.0, -2.0, 1.0, 1.0])
    run = method.start(BOUNDS, max_evals=100, problems=2, x0=np.tile(one, (9, 1)))
    for _ in range(4):
        run.tell(bowls(run.ask(), np.zeros((2, 4))))
    members, values = method._members(run)
    assert (members == one).all() and (values == 6.0).all()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"variant": "real"}, "scattered, binary, simulated_binary, got 'real'"),
        ({"elites": 20}, "below the population 20"),
        ({"elites": -1}, "elites must be a whole number of at least 0"),
        ({"crossover": 1.5}, r"crossover must be a number in 0\.\.1"),
        ({"mutation": -0.1}, r"mutation must be a number in 0\.\.1"),
        ({"shrink": np.nan}, r"shrink must be a number in 0\.\.1"),
        ({"scale": -1.0}, "scale must be a number of at least 0"),
        ({"bits": 0}, "bits must be a whole number of at least 1"),
        ({"bits": 53}, r"bits must be a number in 1\.\.52"),
        ({"spread_index": (1.0,)}, "spread_index must be a pair"),
        ({"spread_index": (1.0, -2.0)}, "spread_index must be a number of at least 0"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    with pytest.raises(InputError, match=message):
        GeneticAlgorithm(**{"population": 20, **settings}).start(BOUNDS, max_evals=1000)

"""Differential evolution: the donors, the crossover, who is drawn."""

import itertools

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import DifferentialEvolution

BOX = np.array([(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)])
FAR = np.array([(-1e3, 1e3)] * 3)
STRATEGIES = ("rand1bin", "best1bin", "currenttobest1bin", "randtobest1bin")
every_strategy = pytest.mark.parametrize("strategy", STRATEGIES)


def ripples(x):
    away = x - [1.2, -0.4, 6.0]
    return (away**2 + 1.0 - np.cos(5.0 * away)).sum(axis=-1)


def solve(optimizer, f=ripples, box=BOX, **settings):
    run = optimizer.start(box, **{"max_evals": 1200, "rng": 3} | settings)
    while not run.done:
        run.tell(f(run.ask()))
    return run


def begun(population, problems=3, **settings):
    """A run whose first population lies in the middle of a wide box."""
    x0 = np.random.default_rng(5).uniform(-1, 1, (problems, population, 3))
    method = DifferentialEvolution(population=population, **settings)
    run = method.start(FAR, max_evals=1000, problems=problems, x0=x0)
    run.tell(ripples(run.ask()))
    return run


def donor(strategy, x, g, a, b, c, scale):
    return {
        "rand1bin": a + scale * (b - c),
        "best1bin": g + scale * (a - b),
        "currenttobest1bin": x + scale * (g - x) + scale * (a - b),
        "randtobest1bin": a + scale * (g - a) + scale * (b - c),
    }[strategy]


@every_strategy
def test_a_donor_is_made_of_others(strategy):
    run = begun(6, strategy=strategy, mutation=0.7, crossover=1.0)
    trials = run.ask()
    x, f = run.members()
    for problem, i in itertools.product(range(3), range(6)):
        p, best = x[problem], x[problem, f[problem].argmin()]
        others = [j for j in range(6) if j != i]
        made = [
            donor(strategy, p[i], best, p[a], p[b], p[c], 0.7)
            for a, b, c in itertools.permutations(others, 3)
        ]
        assert np.abs(np.array(made) - trials[problem, i]).max(axis=1).min() < 1e-12


def test_every_other_is_drawn_equally_often():
    run = begun(5, problems=2000, strategy="rand1bin", mutation=1e-9, crossover=1.0)
    trials = run.ask()
    x = run.members()[0]
    base = np.abs(trials[:, :, None] - x[:, None]).max(axis=3).argmin(axis=2)
    assert (base != np.arange(5)).all()
    counts = np.bincount(base.ravel() * 5 + np.tile(np.arange(5), 2000), minlength=25)
    counts = counts.reshape(5, 5)[~np.eye(5, dtype=bool)]
    assert np.abs(counts - 500).max() < 6 * np.sqrt(500 * 0.75)


def test_crossover_is_the_share_of_the_donor():
    for crossover in (0.0, 0.3):
        run = begun(40, problems=50, strategy="rand1bin", crossover=crossover)
        trials = run.ask()
        taken = trials != run.members()[0]
        assert taken.any(axis=2).all(), "one component at least"
        share = crossover + (1.0 - crossover) / 3.0
        assert taken.mean() == pytest.approx(share, abs=0.02)
        assert np.ptp(taken.mean(axis=(0, 1))) < 0.06


def test_the_scale_is_drawn_for_each_generation():
    x0 = np.zeros((6, 3))
    x0[5] = 1.0  # every difference is 0, 1 or -1
    method = DifferentialEvolution(
        population=6, strategy="best1bin", mutation=(0.4, 0.6), crossover=1.0
    )
    run = method.start(FAR, max_evals=100, problems=200, x0=x0)
    run.tell(ripples(run.ask()))
    steps = np.abs(run.ask() - run.leader).reshape(200, -1)
    scales = steps.max(axis=1)
    assert (np.isclose(steps, scales[:, None]) | (steps == 0.0)).all()
    assert 0.4 <= scales.min() < 0.41 and 0.59 < scales.max() <= 0.6
    assert len(np.unique(scales)) == 200


def test_what_leaves_the_box_is_drawn_anew_in_it():
    method = DifferentialEvolution(population=50, strategy="rand1bin", mutation=2.0, crossover=1.0)
    run = method.start(BOX, max_evals=200, problems=40)
    run.tell(ripples(run.ask()))
    x = run.ask()
    assert (x > BOX[:, 0]).all() and (x < BOX[:, 1]).all(), "nothing sticks to an edge"


@every_strategy
@pytest.mark.parametrize("adaptive", [False, True])
def test_one_of_many_is_one_alone(strategy, adaptive):
    method = DifferentialEvolution(population=12, strategy=strategy, adaptive=adaptive)
    many = solve(method, problems=6, target=0.05)
    assert len(set(many.evaluations.tolist())) > 1
    for k in range(6):
        one = solve(method, keys=[(k,)], target=0.05)
        assert one.evaluations[0] == many.evaluations[k]
        assert np.array_equal(one.x_best[0], many.x_best[k])


def test_members_never_get_worse():
    run = DifferentialEvolution(population=9).start(BOX, max_evals=900, problems=3)
    before = np.inf
    while not run.done:
        run.tell(ripples(run.ask()))
        f = run.members()[1]
        assert (f <= before).all()
        before = f


def test_adaptive_members_keep_what_served_them():
    run = begun(20, problems=50, mutation=(0.2, 1.0), adaptive=True)
    assert (run.state.own == (0.6, 0.9)).all()
    x = run.ask()
    tried, f = run.state.tried.copy(), run.members()[1].copy()
    renewed = (tried != (0.6, 0.9)).mean(axis=(0, 1))
    assert renewed == pytest.approx([0.1, 0.1], abs=0.04)
    run.tell(ripples(x))
    better = (ripples(x) <= f)[:, :, None]
    assert np.array_equal(run.state.own, np.where(better, tried, (0.6, 0.9)))
    while not run.done:
        run.tell(ripples(run.ask()))
    assert (tried[..., 0] >= 0.2).all() and (tried < 1.0).all()


def test_adaptive_members_sort_out_many_valleys():
    def rastrigin(x):
        away = x - 0.7
        return (away**2 + 10.0 * (1.0 - np.cos(2.0 * np.pi * away))).sum(axis=-1)

    plain, adaptive = (
        solve(
            DifferentialEvolution(population=40, adaptive=adaptive),
            rastrigin,
            [(-5.0, 5.0)] * 5,
            max_evals=8000,
            problems=15,
        ).f_best
        for adaptive in (False, True)
    )
    assert np.median(adaptive) < 1e-6 < 0.1 < np.median(plain)


def test_the_strong_default_is_exact():
    run = solve(DifferentialEvolution(population=30), max_evals=6000, problems=20)
    assert np.median(run.f_best) < 1e-8


@pytest.mark.parametrize(
    "bad",
    [
        {"strategy": "best2exp"},
        {"strategy": 3},
        {"mutation": 0.0},
        {"mutation": (0.8, 0.5)},
        {"mutation": (0.5, 0.8, 1.0)},
        {"mutation": (0.5, "high")},
        {"mutation": 2.5},
        {"crossover": -0.1},
        {"crossover": 1.1},
        {"adaptive": "jde"},
        {"population": 3},
    ],
)
def test_settings_that_cannot_be_used(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        DifferentialEvolution(**bad).start(BOX, max_evals=1000)

"""The grey wolf: the published step, the leaders, the pull to the origin."""

import pickle

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import GreyWolf

BOX = np.array([(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)])
VARIANTS = [
    GreyWolf(population=9, elitist=elitist, origin=origin)
    for elitist in (False, True)
    for origin in ("zero", "middle")
]
every_variant = pytest.mark.parametrize("wolves", VARIANTS, ids=repr)


def ripples(x):
    away = x - [1.2, -0.4, 6.0]
    return (away**2 + 1.0 - np.cos(5.0 * away)).sum(axis=-1)


def solve(optimizer, f=ripples, box=BOX, **settings):
    run = optimizer.start(box, **{"max_evals": 900, "rng": 3} | settings)
    while not run.done:
        run.tell(f(run.ask()))
    return run


@every_variant
def test_a_step_is_the_published_one(wolves):
    run = wolves.start(BOX, max_evals=900, problems=2)
    for _ in range(5):
        run.tell(ripples(run.ask()))
    x, leaders = run.members()[0], run.state.leaders
    r = pickle.loads(pickle.dumps(run)).uniform(2, 3, 9, 3)
    zero = BOX.mean(axis=1) if wolves.origin == "middle" else np.zeros(3)
    a = 2.0 - 2.0 * (5 * 9 - 9) / (900 - 9)
    asked = run.ask()
    for problem in range(2):
        for i in range(9):
            ends = []
            for k in range(3):
                leader, wolf = leaders[problem, k] - zero, x[problem, i] - zero
                big_a = 2.0 * a * r[problem, 0, k, i] - a
                big_c = 2.0 * r[problem, 1, k, i]
                ends.append(leader - big_a * np.abs(big_c * leader - wolf) + zero)
            expected = np.clip(np.mean(ends, axis=0), BOX[:, 0], BOX[:, 1])
            assert np.allclose(asked[problem, i], expected, rtol=0, atol=1e-12)


def test_the_leaders_are_the_best_three_of_all_time():
    run = GreyWolf(population=9).start(BOX, max_evals=900, problems=3)
    told = []
    while not run.done:
        x = run.ask()
        told.append(ripples(x))
        whole = x.shape[1] == 9
        run.tell(told[-1])
        if whole and not run.done:
            best = np.sort(np.concatenate(told, axis=1), axis=1)[:, :3]
            assert np.array_equal(np.sort(run.state.led, axis=1), best)
            assert np.array_equal(ripples(run.state.leaders), run.state.led)


def test_an_elitist_wolf_never_gets_worse():
    run = GreyWolf(population=9, elitist=True).start(BOX, max_evals=900, problems=3)
    before = np.inf
    while not run.done:
        run.tell(ripples(run.ask()))
        f = run.members()[1]
        assert (f <= before).all()
        before = f


@every_variant
def test_one_of_many_is_one_alone(wolves):
    many = solve(wolves, problems=6, target=0.05)
    for k in range(6):
        one = solve(wolves, keys=[(k,)], target=0.05)
        assert one.evaluations[0] == many.evaluations[k]
        assert np.array_equal(one.x_best[0], many.x_best[k])


def median_at(place, **settings):
    """Median error of a sphere about ``place`` times (1, ... 1) in a box about 0."""
    wolves = GreyWolf(population=30, **settings)
    box = [(-5.0, 5.0)] * 10
    run = solve(wolves, lambda x: ((x - place) ** 2).sum(axis=-1), box, max_evals=3000, problems=15)
    return np.median(run.f_best)


def test_the_published_wolf_gains_at_the_origin():
    assert median_at(0.0) < 1e-3 * median_at(3.0)


def test_from_the_middle_the_place_of_zero_does_not_matter():
    moved = 128.0
    runs = [
        solve(
            GreyWolf(population=20, origin="middle"),
            lambda x, shift=shift: ripples(x - shift),
            BOX + shift,
            max_evals=200,
            problems=5,
        )
        for shift in (0.0, moved)
    ]
    assert np.allclose(runs[0].x_best + moved, runs[1].x_best, rtol=0, atol=1e-9)


def test_settings_that_cannot_be_used():
    for bad in ({"origin": "box"}, {"origin": 0}, {"elitist": "yes"}, {"elitist": None}):
        with pytest.raises(InputError, match=next(iter(bad))):
            GreyWolf(**bad).start(BOX, max_evals=1000)

"""Teaching and learning: the two phases, the pull of a factor of two."""

import pickle

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import TeachingLearning

BOX = np.array([(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)])


def ripples(x):
    away = x - [1.2, -0.4, 6.0]
    return (away**2 + 1.0 - np.cos(5.0 * away)).sum(axis=-1)


def solve(optimizer, f=ripples, box=BOX, **settings):
    run = optimizer.start(box, **{"max_evals": 900, "rng": 3} | settings)
    while not run.done:
        run.tell(f(run.ask()))
    return run


def test_the_phases_are_the_published_ones():
    run = TeachingLearning(population=8).start(BOX, max_evals=900, problems=2)
    run.tell(ripples(run.ask()))
    for phase in ("teacher", "learner", "teacher", "learner"):
        x, f = run.members()
        u = pickle.loads(pickle.dumps(run)).uniform(8, 4)
        asked = run.ask()
        for problem in range(2):
            mean, best = x[problem].mean(axis=0), x[problem, f[problem].argmin()]
            for i in range(8):
                me, share, draw = x[problem, i], u[problem, i, :3], u[problem, i, 3]
                if phase == "teacher":
                    step = best - (1 if draw < 0.5 else 2) * mean
                else:
                    j = [k for k in range(8) if k != i][int(draw * 7)]
                    step = me - x[problem, j]
                    if not f[problem, i] < f[problem, j]:
                        step = -step
                expected = np.clip(me + share * step, BOX[:, 0], BOX[:, 1])
                assert np.allclose(asked[problem, i], expected, rtol=0, atol=1e-12)
        run.tell(ripples(asked))
        assert (run.members()[1] <= f).all(), "a learner never gets worse"


@pytest.mark.parametrize("factors", [(1, 2), (1,), (0.5, 1.0, 1.5)])
def test_one_of_many_is_one_alone(factors):
    school = TeachingLearning(population=10, teaching_factors=factors)
    many = solve(school, problems=6, target=0.05)
    for k in range(6):
        one = solve(school, keys=[(k,)], target=0.05)
        assert one.evaluations[0] == many.evaluations[k]
        assert np.array_equal(one.x_best[0], many.x_best[k])


def last_values(shift, factors):
    return solve(
        TeachingLearning(population=20, teaching_factors=factors),
        lambda x: ripples(x - shift),
        BOX + shift,
        max_evals=200,
        problems=5,
    ).f_best


def test_a_factor_of_one_does_not_know_where_zero_lies():
    assert np.allclose(last_values(0.0, (1,)), last_values(128.0, (1,)), rtol=0, atol=1e-9)
    assert not np.allclose(last_values(0.0, (2,)), last_values(128.0, (2,)), rtol=0, atol=1e-3)


@pytest.mark.parametrize("bad", [(), 1, (np.nan,), ("one",), (1, np.inf), None])
def test_factors_that_cannot_be_used(bad):
    with pytest.raises(InputError, match="teaching_factors"):
        TeachingLearning(teaching_factors=bad).start(BOX, max_evals=1000)

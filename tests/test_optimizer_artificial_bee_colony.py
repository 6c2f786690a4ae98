"""The bee colony: what a cycle does, checked from outside, beside the laws for all."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import ArtificialBeeColony
from optimizer_laws import BOUNDS, bowls, hold_all


@pytest.mark.parametrize("limit", [None, 3])
def test_the_laws(limit):
    hold_all(ArtificialBeeColony(population=20, limit=limit))


def test_a_bee_changes_one_variable_and_its_source_only_improves():
    method = ArtificialBeeColony(population=12, limit=10_000)
    run = method.start(BOUNDS, max_evals=1200, rng=3, problems=3)
    run.tell(bowls(run.ask()))
    for step in range(20):
        stood, was = (a.copy() for a in method._members(run))
        x = run.ask()
        source = np.arange(12)[None].repeat(3, axis=0) if step % 2 == 0 else run.state.source
        changed = x != np.take_along_axis(stood, source[:, :, None], axis=1)
        assert (changed.sum(axis=2) <= 1).all()
        f = bowls(x)
        run.tell(f)
        now, worth = method._members(run)
        assert (worth <= was).all()
        assert np.allclose(bowls(now), worth)
        for problem in range(3):  # the best of a source's bees counts
            for k in range(12):
                tried = f[problem][source[problem] == k]
                assert worth[problem, k] == min([was[problem, k], *tried])


def test_onlookers_prefer_good_sources():
    method = ArtificialBeeColony(population=50, limit=10_000)
    run = method.start([(0, 1)] * 2, max_evals=5000, rng=1, problems=40)
    x = run.ask()
    f = np.where(np.arange(50) < 10, 0.0, 9.0) + np.zeros((40, 1))  # weights 1 and 0.1
    run.tell(f)
    run.tell(np.full(run.ask().shape[:2], 100.0))
    run.ask()
    share = (run.state.source < 10).mean()
    assert abs(share - 10 / 14) < 0.03, share
    assert x.shape == (40, 50, 2)


def test_a_worn_source_is_given_up_one_a_cycle():
    method = ArtificialBeeColony(population=5, limit=4)
    run = method.start(BOUNDS, max_evals=2000, rng=1, problems=2)
    run.ask()
    run.tell(np.arange(5.0) + np.zeros((2, 1)))
    given_up = 0
    for _ in range(30):  # nothing is ever better: every source wears out
        stood = method._members(run)[0].copy()
        x = run.ask()
        if run.state.employed:
            far = (x != stood).all(axis=2).sum(axis=1)
            assert (far <= 1).all()
            given_up += far.sum()
            scouted = run.state.f == np.inf
            assert (scouted.sum(axis=1) == far).all()
        run.tell(np.full(x.shape[:2], 50.0))
        assert np.isfinite(method._members(run)[1]).all()  # the scout stays, though worse
    assert given_up > 10


@pytest.mark.parametrize("limit", [0, -1, 2.5, True])
def test_a_limit_that_is_none_is_refused(limit):
    with pytest.raises(InputError, match="ArtificialBeeColony: limit must be a whole number"):
        ArtificialBeeColony(limit=limit).start(BOUNDS, max_evals=1000)

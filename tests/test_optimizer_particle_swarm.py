"""The particle swarm: its ring of neighbours."""

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.optimizers import ParticleSwarm

BOX = [(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)]


def ripples(x):
    away = x - [1.2, -0.4, 6.0]
    return (away**2 + 1.0 - np.cos(5.0 * away)).sum(axis=-1)


def solve(optimizer, f=ripples, **settings):
    run = optimizer.start(BOX, **{"max_evals": 1200, "rng": 3} | settings)
    while not run.done:
        run.tell(f(run.ask()))
    return run


@pytest.mark.parametrize("k", [1, 2, 5])
def test_a_guide_is_the_best_of_the_neighbours(k):
    swarm = ParticleSwarm(population=11, neighbours=k)
    run = swarm.start(BOX, max_evals=500, problems=4)
    for _ in range(7):
        run.tell(ripples(run.ask()))
        p, f = run.members()
        guides = np.broadcast_to(swarm._guides(run), p.shape)
        for problem in range(4):
            for i in range(11):
                ring = [(i + j) % 11 for j in range(-k, k + 1)]
                best = min(ring, key=lambda j, f=f[problem]: f[j])
                assert np.array_equal(guides[problem, i], p[problem, best])


def test_a_ring_that_holds_all_is_the_whole_swarm():
    ring, swarm = (solve(ParticleSwarm(population=9, neighbours=k)) for k in (4, None))
    assert np.array_equal(ring.x_best, swarm.x_best)


def test_one_of_many_is_one_alone_in_a_ring_too():
    swarm = ParticleSwarm(population=12, neighbours=2)
    many = solve(swarm, problems=6, target=0.05)
    assert len(set(many.evaluations.tolist())) > 1
    for k in range(6):
        one = solve(swarm, keys=[(k,)], target=0.05)
        assert one.evaluations[0] == many.evaluations[k]
        assert np.array_equal(one.x_best[0], many.x_best[k])


def test_neighbours_find_the_deep_valley_more_often():
    def deep(x):  # the wide valley is at -1, the deep one, a twentieth as wide, at 2
        wide = 1.0 + np.abs(x + 1.0).sum(axis=-1)
        return np.minimum(wide, 0.0 + 6.0 * np.abs(x - [2.0, 1.0, 2.0]).sum(axis=-1))

    found = [
        (solve(ParticleSwarm(population=30, neighbours=k), deep, problems=60).f_best < 0.5).mean()
        for k in (None, 1)
    ]
    assert found[1] > found[0]


@pytest.mark.parametrize("bad", [0, 6, 1.5, True, "two"])
def test_neighbours_that_cannot_be_used(bad):
    with pytest.raises(InputError, match="neighbours"):
        ParticleSwarm(population=12, neighbours=bad).start(BOX, max_evals=100)

"""The crabs, as read: shells, swarms, crossing, and what the literal reading gains."""

import numpy as np
import pytest

import kinverse as kv
import optimizer_laws
from kinverse.optimizers import CrabIntelligence

LAWS = (
    optimizer_laws.one_is_a_member_of_many,
    optimizer_laws.pickles_in_mid_run,
    optimizer_laws.bears_worthless_values,
)
BOX = [(-2.0, 3.0), (-1.0, 1.0), (0.0, 5.0)]
AIM = np.array([0.7, -0.3, 3.1])
VARIANTS = {
    "default": CrabIntelligence(),
    "literal": CrabIntelligence(reading="literal"),
    "synchronous": CrabIntelligence(synchronous=True, min_distance=0.1),
    "odd": CrabIntelligence(population=33, swarm_size=7, shells=3, synchronous=True),
    "one swarm": CrabIntelligence(population=7, shells=1),
}


def cost(x):
    return ((x - AIM) ** 2).sum(axis=-1)


def solve(optimizer, f=cost, box=BOX, steps=None, **settings):
    run = optimizer.start(box, **{"max_evals": 2500, "rng": 3} | settings)
    while not run.done and (steps is None or run.generation < steps):
        x = run.ask()
        assert (x >= run.low).all() and (x <= run.high).all()
        run.tell(f(x))
    return run


@pytest.fixture(params=VARIANTS, name="crabs")
def _crabs(request):
    return VARIANTS[request.param]


def test_the_budget_is_exact(crabs):
    run = solve(crabs, problems=3)
    assert (run.evaluations == 2500).all() and np.isfinite(run.f_best).all()


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_the_laws_hold(crabs, law):
    law(crabs)


def test_one_variable_and_the_fewest_crabs():
    for reading in ("leader", "literal"):
        crabs = CrabIntelligence(population=6, reading=reading)
        run = solve(crabs, lambda x: abs(x[..., 0] - 0.3), [(-1, 1)], problems=9)
        assert np.median(run.f_best) < 1e-2
    with pytest.raises(kv.InputError, match="population must be a whole number of at least 6"):
        solve(CrabIntelligence(population=5))


def test_better_than_chance():
    run = solve(CrabIntelligence(), problems=21)
    x = np.random.default_rng(0).uniform(run.low, run.high, (21, 2500, 3))
    assert np.median(run.f_best) < 0.1 * np.median(cost(x).min(axis=1))


def test_shells_lie_where_the_equations_put_them():
    box = [(-4.0, 4.0)] * 3  # wide enough that nothing is clipped
    run = CrabIntelligence(population=30).start(box, max_evals=5000, rng=1, problems=8)
    run.ask()
    run.state.x = x = np.random.default_rng(0).uniform(-1, 1, (8, 30, 3))
    run._points = x
    run.tell(cost(x))
    shells = run.ask().reshape(8, 2, 30, 3)
    swarm = np.arange(30) % 3
    for i in range(8):
        for z in range(3):
            mine = x[i, swarm == z]
            lead = mine[cost(mine).argmin()]
            L, S = mine - lead, shells[i][:, swarm == z] - lead
            R, far = np.linalg.norm(L, axis=1), np.linalg.norm(S, axis=2)
            led = R > 0
            assert led.sum() == 9
            # v = 0: along L, up to twice as far; v = 1: within R (rho1 + rho2 alpha)
            across = np.cross(L[led], S[0, led])
            assert np.allclose(across, 0, atol=1e-12) and ((S[0] * L).sum(axis=1)[led] > 0).all()
            assert (far[:, led] < 2 * R[led]).all()
            assert (far[:, ~led] < R.mean() + 1e-12).all()


def test_a_crab_takes_the_best_shell_if_it_is_better():
    crabs = CrabIntelligence(population=20)
    run = solve(crabs, problems=3, steps=1)
    for _ in range(12):  # no swarm crosses before its 15th step
        had, x = run.state.f, run.ask()
        seen = cost(x)
        run.tell(seen)
        assert np.array_equal(run.state.f, np.minimum(had, seen.reshape(3, 2, 20).min(axis=1)))
        assert np.array_equal(cost(run.state.x), run.state.f)


def test_a_stalled_swarm_crosses_but_never_the_best():
    crabs = CrabIntelligence(population=20)
    run = solve(crabs, problems=6, steps=1)
    start = run.state.f.copy()
    for _ in range(15):
        run.ask()
        run.tell(np.full((6, 40), 1e3))
    swarm = np.arange(20) % 2
    best = swarm[start.argmin(axis=1)]
    assert np.array_equal(run.state.crossing, best[:, None] != np.arange(2))
    run.ask()
    left = np.isinf(run.state.f)
    assert left.any() and not left[swarm == best[:, None]].any()
    run.tell(np.full((6, 40), 1e3))
    assert (run.state.f[left] == 1e3).all() and np.array_equal(run.state.f[~left], start[~left])
    assert not run.state.crossing.any()


def test_synchronous_crabs_keep_their_distance():
    crabs = CrabIntelligence(population=10, synchronous=True, min_distance=1.0)
    run = solve(crabs, problems=5, steps=1)
    for _ in range(10):
        had, x = run.state.x, run.ask()
        run.tell(cost(x))
        moved = (run.state.x != had).any(axis=2)
        to = np.where(moved[:, :, None], run.state.x, np.nan) / run.span
        for i in range(5):
            taken = to[i][moved[i]]
            apart = np.linalg.norm(taken[:, None] - taken[None], axis=2)
            assert (apart[~np.eye(len(taken), dtype=bool)] >= 1.0 - 1e-9).all()


def gain(crabs, f, aim):
    """Median with the minimum off the origin over that with it there, the box moved along."""
    ends = []
    for at in (aim, 0.0):
        box = [(at - 5.0, at + 5.0)] * 4
        run = solve(crabs, lambda x, at=at: f(x - at), box, problems=31, max_evals=3000)
        ends.append(np.median(run.f_best))
    return ends[0] / ends[1]


def test_only_the_literal_reading_gains_from_a_minimum_at_the_origin():
    def sphere(x):
        return (x * x).sum(axis=-1)

    assert 0.5 < gain(CrabIntelligence(), sphere, 3.7) < 2.0
    assert gain(CrabIntelligence(reading="literal"), sphere, 3.7) > 100


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"swarm_size": 5}, "swarm_size must be a whole number of at least 6"),
        ({"shells": 0}, "shells must be a whole number of at least 1"),
        ({"reading": "thesis"}, "reading must be one of leader, literal, got 'thesis'"),
        ({"min_distance": -0.1}, "min_distance must lie in 0..1"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    with pytest.raises(kv.InputError, match=message):
        CrabIntelligence(**settings).start(BOX, max_evals=1000)

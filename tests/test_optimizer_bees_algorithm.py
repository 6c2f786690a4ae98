"""The bees: patches, sites, abandonment."""

import numpy as np
import pytest

import kinverse as kv
import optimizer_laws
from kinverse.optimizers import BeesAlgorithm

LAWS = (
    optimizer_laws.one_is_a_member_of_many,
    optimizer_laws.pickles_in_mid_run,
    optimizer_laws.bears_worthless_values,
)
BOX = [(-2.0, 3.0), (-1.0, 1.0), (0.0, 5.0)]
AIM = np.array([0.7, -0.3, 3.1])
VARIANTS = {
    "default": BeesAlgorithm(),
    "pham": BeesAlgorithm.pham(),
    "no scouts": BeesAlgorithm(scouts=0, elites=2, elite_recruits=7, recruits=2),
    "all elite": BeesAlgorithm(sites=4, elites=4, shrink=0.5, pull=3.0),
    "never": BeesAlgorithm(abandon_after=None, radius=0.1, radius_unit="own"),
}


def cost(x):
    return ((x - AIM) ** 2).sum(axis=-1)


def solve(optimizer, f=cost, box=BOX, steps=None, **settings):
    run = optimizer.start(box, **{"max_evals": 1500, "rng": 3} | settings)
    while not run.done and (steps is None or run.generation < steps):
        x = run.ask()
        assert (x >= run.low).all() and (x <= run.high).all()
        run.tell(f(x))
    return run


@pytest.fixture(params=VARIANTS, name="bees")
def _bees(request):
    return VARIANTS[request.param]


def test_the_budget_is_exact_and_better_than_chance(bees):
    run = solve(bees, problems=21)
    assert (run.evaluations == 1500).all()
    x = np.random.default_rng(0).uniform(run.low, run.high, (21, 1500, 3))
    assert np.median(run.f_best) < 0.5 * np.median(cost(x).min(axis=1))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_the_laws_hold(bees, law):
    law(bees)


def test_one_variable_and_the_fewest_bees():
    bees = BeesAlgorithm(population=3)
    run = solve(bees, lambda x: abs(x[..., 0] - 0.3), [(-1, 1)], problems=9)
    assert np.median(run.f_best) < 1e-3
    with pytest.raises(kv.InputError, match="population must be a whole number of at least 3"):
        solve(BeesAlgorithm(population=2))


def test_a_step_is_recruits_and_scouts():
    assert solve(BeesAlgorithm(), steps=3).ask().shape == (1, 62, 3)
    bees = BeesAlgorithm(scouts=5, sites=4, elites=2, elite_recruits=7, recruits=3)
    assert solve(bees, steps=1).ask().shape == (1, 25, 3)
    pham = BeesAlgorithm.pham(population=20, sites=4)
    assert pham.scouts == 16 and pham.shrink == 0.8


@pytest.mark.parametrize(("unit", "edge"), [("range", [0.5, 0.2, 0.5]), ("own", [0.1] * 3)])
def test_recruits_stay_in_their_patch(unit, edge):
    bees = BeesAlgorithm(radius=0.1, radius_unit=unit, abandon_after=None)
    run = solve(bees, problems=4, steps=5)
    x = run.ask()
    for site in range(3):
        away = np.abs(x[:, 4 * site : 4 * site + 4] - run.state.x[:, site, None])
        assert (away <= np.array(edge) + 1e-12).all()


def test_sites_are_the_best_of_patches_and_scouts():
    bees = BeesAlgorithm(abandon_after=None)
    run = solve(bees, problems=4, steps=1)
    for _ in range(10):
        before, x = run.state.f, run.ask()
        f = cost(x)
        patches = np.minimum(before, f[:, :12].reshape(4, 3, 4).min(axis=2))
        run.tell(f)
        assert np.array_equal(
            run.state.f, np.sort(np.concatenate([patches, f[:, 12:]], axis=1), axis=1)[:, :3]
        )
        assert np.array_equal(run.state.f[:, 0], run.f_best)
        assert np.array_equal(cost(run.state.x), run.state.f)
        members, values = bees._members(run)
        assert members.shape == (4, 50, 3) and np.array_equal(cost(members), values)


def test_an_abandoned_site_goes_towards_the_elite_and_is_looked_at():
    bees = BeesAlgorithm(scouts=0)
    run = solve(bees, problems=20, steps=1)
    f = cost(run.ask())
    sites = run.state.x
    first = run.state.f.copy()
    for _ in range(3):  # nothing gains
        run.ask()
        run.tell(f + 100)
    assert np.array_equal(run.state.x[:, 0], sites[:, 0])  # the elite drew itself
    assert np.array_equal(run.state.f[:, 0], first[:, 0])
    assert np.isinf(run.state.f[:, 1:]).all()
    share = (run.state.x[:, 1:] - sites[:, 1:]) / (sites[:, :1] - sites[:, 1:])
    assert np.allclose(share, share[:, :, :1]) and (share > -1e-9).all() and (share < 1).all()
    x = run.ask()
    assert np.array_equal(x[:, [4, 8]], run.state.x[:, 1:])
    run.tell(cost(x))
    assert np.isfinite(run.state.f).all()


def test_pham_shrinks_what_fails_and_leaves_it_for_anywhere():
    bees = BeesAlgorithm.pham(scouts=0, abandon_after=4)
    run = solve(bees, problems=2, steps=1)
    for k in range(1, 4):
        run.ask()
        run.tell(np.full((2, 116), 1e6))
        assert np.allclose(run.state.radius, 0.5 * 0.8**k)
    sites = run.state.x
    run.ask()
    run.tell(np.full((2, 116), 1e6))
    assert (run.state.radius == 0.5).all() and np.isinf(run.state.f).all()
    assert not (run.state.x == sites).any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"sites": 51}, "sites must be at most the population, 50, got 51"),
        ({"sites": 0}, "sites must be a whole number of at least 1"),
        ({"elites": 4}, "elites must be at most sites, 3, got 4"),
        ({"recruits": 0}, "recruits must be a whole number of at least 1"),
        ({"scouts": -1}, "scouts must be a whole number of at least 0"),
        ({"abandon_after": 0}, "abandon_after must be a whole number of at least 1"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"radius": float("nan")}, "radius must be positive"),
        ({"shrink": 1.1}, "shrink must lie in 0..1"),
        ({"pull": -1.0}, "pull must be finite and not negative"),
        ({"radius_unit": "deg"}, "radius_unit must be one of range, own, got 'deg'"),
        ({"relocation": "best"}, "relocation must be one of elite, random"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    with pytest.raises(kv.InputError, match=message):
        BeesAlgorithm(**settings).start(BOX, max_evals=1000)


def test_phams_settings_must_be_numbers():
    with pytest.raises(kv.InputError, match="sites must be a whole number"):
        BeesAlgorithm.pham(sites=2.5)

"""Laws that a method is held to whatever its settings; test_optimizers.py has those of defaults."""

import pickle

import numpy as np

BOUNDS = np.array([[-1.0, 2.0], [-3.0, -1.0], [0.0, 5.0], [-2.0, 2.0]])
GOALS = np.array([[0.5, -2.0, 1.0, 0.3], [-0.3, -1.2, 4.0, -1.1], [1.7, -2.8, 2.5, 1.9]])


def bowls(x, goals=GOALS):
    """Several bowls, one for each problem."""
    steps = x - goals[:, None, : x.shape[2]]
    return sum(steps[:, :, k] ** 2 for k in range(steps.shape[2]))


def search(optimizer, *, goals=GOALS, bounds=BOUNDS, keys=None, evals=1500, rng=5, f=bowls, **more):
    """A run to its end, each step's points inside the box."""
    keys = [(k,) for k in range(len(goals))] if keys is None else keys
    run = optimizer.start(bounds, max_evals=evals, rng=rng, problems=len(goals), keys=keys, **more)
    while not run.done:
        active = run.active
        x = run.ask()
        assert np.isfinite(x).all()
        assert (x >= run.low).all() and (x <= run.high).all()
        run.tell(f(x, goals[active]))
    return run


def hold_all(optimizer):
    """Every law that follows."""
    budget_and_progress(optimizer)
    one_is_a_member_of_many(optimizer)
    pickles_in_mid_run(optimizer)
    bears_worthless_values(optimizer)
    one_variable_and_few_members(optimizer)
    moves_with_its_box(optimizer)


def budget_and_progress(optimizer):
    for evals in (optimizer.population, optimizer.population + 1, 777, 1500):
        run = search(optimizer, evals=evals)
        assert (run.evaluations == evals).all()
    again = search(optimizer)
    assert (again.x_best == run.x_best).all() and (again.f_best == run.f_best).all()
    assert (search(optimizer, rng=6).f_best != run.f_best).all()
    u = np.random.default_rng(9).random((1500, 3, 4)).transpose(1, 0, 2)
    chance = bowls(BOUNDS[:, 0] + u * (BOUNDS[:, 1] - BOUNDS[:, 0])).min(axis=1)
    assert np.median(run.f_best / chance) < 0.5


def one_is_a_member_of_many(optimizer):
    goals = np.repeat(GOALS, 3, axis=0)
    target = float(np.median(search(optimizer, goals=goals).f_best))
    many = search(optimizer, goals=goals, target=target)
    assert 0 < (many.stop == 1).sum() < len(goals)  # some end early
    for k in (0, 4, 8):
        one = search(optimizer, goals=goals[k : k + 1], keys=[(k,)], target=target)
        assert (one.x_best[0] == many.x_best[k]).all()
        assert (one.f_best[0], one.evaluations[0]) == (many.f_best[k], many.evaluations[k])


def pickles_in_mid_run(optimizer):
    run = optimizer.start(BOUNDS, max_evals=1500, rng=5, problems=3)
    for _ in range(4):
        run.tell(bowls(run.ask()))
    asked = run.ask()
    other = pickle.loads(pickle.dumps(run))
    assert (other.ask() == asked).all()
    for one in (run, other):
        while not one.done:
            one.tell(bowls(one.ask()))
    assert (run.x_best == other.x_best).all()
    members, values = optimizer._members(run) if len(run.active) else (None, None)
    assert members is None or members.shape[:2] == values.shape


def bears_worthless_values(optimizer):
    def mostly_bad(x, goals):
        f = bowls(x, goals)
        return np.where(x[:, :, 0] + x[:, :, 1] > -1.5, np.nan, f)

    run = search(optimizer, f=mostly_bad)
    assert np.isfinite(run.f_best).all() and (run.bad_values > 0).all()
    run = search(optimizer, f=lambda x, goals: np.full(x.shape[:2], np.inf), evals=700)
    assert (run.f_best == np.inf).all() and (run.evaluations == 700).all()
    search(optimizer, f=lambda x, goals: 1e308 * np.sign(bowls(x, goals) - 3.0), evals=700)


def one_variable_and_few_members(optimizer):
    run = search(optimizer, bounds=BOUNDS[:1], evals=600)
    assert (run.f_best < 1e-2).all()
    for population in (optimizer.least_population, optimizer.least_population + 1, 7):
        few = type(optimizer)(**{**optimizer.get_params(), "population": population})
        assert (search(few, evals=301).evaluations == 301).all()


def moves_with_its_box(optimizer):
    """Box and objective shifted or stretched together: the same search, but for rounding."""
    run = search(optimizer, evals=600)
    shift, scale = np.array([10.0, -7.0, 3.0, 0.5]), np.array([2.0, 0.5, 8.0, 4.0])
    moved = search(
        optimizer,
        evals=600,
        bounds=BOUNDS * scale[:, None] + shift[:, None],
        f=lambda x, goals: bowls((x - shift) / scale, goals),
    )
    assert np.allclose(moved.f_best, run.f_best, rtol=1e-3, atol=1e-9)

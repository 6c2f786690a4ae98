"""Laws that every population method keeps; each method is here as soon as its file is."""

import copy
import importlib.util
import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinverse import optimizers
from kinverse.errors import InputError
from kinverse.optimizers import History, Optimizer, make_optimizer
from kinverse.optimizers.checks import real_number
from kinverse.optimizers.registry import METHODS
from kinverse.optimizers.streams import Streams

WRITTEN = [
    name
    for name, (_, file) in METHODS.items()
    if importlib.util.find_spec(f"kinverse.optimizers.methods.{file}")
]
BOX = np.array([(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)])
CENTRE = np.array([1.2, -0.4, 6.0])

every_method = pytest.mark.parametrize("name", WRITTEN)


def small(name, population=12):
    """A method with a small population, or the least that it can work with."""
    least = optimizers.registry.make_optimizer(name).least_population
    return make_optimizer(name, population=max(population, least))


def bowl(x):
    return ((x - CENTRE[: x.shape[-1]]) ** 2).sum(axis=-1)


def ripples(x):
    """Many minima, every number with its own bits."""
    return bowl(x) + (1.0 - np.cos(5.0 * (x - CENTRE[: x.shape[-1]]))).sum(axis=-1)


def finish(run, f=ripples, each=None):
    while not run.done:
        run.tell(f(run.ask()))
        if each is not None:
            each(run)
    return run


def test_methods_are_written():
    assert "pso" in WRITTEN
    assert set(WRITTEN) <= set(optimizers.NAMES) == set(METHODS)


# The contract ----------------------------------------------------------------------------------


@every_method
def test_settings_are_stored_untouched_and_copies_are_equal(name):
    method = make_optimizer(name)
    assert isinstance(method, Optimizer) and type(method).__name__ == METHODS[name][0]
    assert getattr(optimizers, METHODS[name][0]) is type(method)
    assert method.clone() == method == pickle.loads(pickle.dumps(method))
    assert method.clone().set_params(population=33) == make_optimizer(name, population=33)
    before = copy.deepcopy(vars(method))
    finish(method.start(BOX, max_evals=2 * method.population))
    assert vars(method) == before, "a run leaves the settings alone"
    with pytest.raises(TypeError):
        make_optimizer(name, populations=33)


@every_method
def test_every_number_among_the_settings_is_checked(name):
    method = make_optimizer(name)
    for setting, value in method.get_params().items():
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        for bad, errors in ((float("nan"), InputError), ("much", (InputError, TypeError))):
            with pytest.raises(errors, match=setting if errors is InputError else None):
                method.clone().set_params(**{setting: bad}).start(BOX, max_evals=10_000)


@every_method
def test_the_population_may_not_be_below_the_least(name):
    method = make_optimizer(name)
    for bad in (method.least_population - 1, 0, -5, 2.5, True):
        with pytest.raises(InputError, match="population"):
            method.clone().set_params(population=bad).start(BOX, max_evals=10_000)
    least = method.clone().set_params(population=method.least_population)
    run = finish(least.start(BOX, max_evals=500, problems=2))
    assert (run.evaluations == 500).all() and np.isfinite(run.f_best).all()


@every_method
@pytest.mark.parametrize("extra", [0, 1, 7, 11, 13, 200])
def test_the_budget_is_exact(name, extra):
    method = small(name)
    asked = 0
    run = method.start(BOX, max_evals=method.population + extra, problems=3)
    while not run.done:
        x = run.ask()
        assert x.shape[1] > 0
        asked += x.shape[1]
        run.tell(bowl(x))
    assert asked == method.population + extra
    assert run.evaluations.tolist() == [asked] * 3
    assert (run.stop == 2).all()


@every_method
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_points_are_inside_any_box(name, data):
    dimensions = data.draw(st.integers(1, 4))
    lows = data.draw(st.lists(st.floats(-1e6, 1e6), min_size=dimensions, max_size=dimensions))
    spans = data.draw(st.lists(st.floats(1e-9, 1e9), min_size=dimensions, max_size=dimensions))
    box = np.array(
        [(a, max(a + s, np.nextafter(a, np.inf))) for a, s in zip(lows, spans, strict=True)]
    )
    slope = np.array(data.draw(st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=4, max_size=4)))
    method = small(name)
    run = method.start(box, max_evals=6 * method.population, rng=data.draw(st.integers(0, 99)))
    while not run.done:
        x = run.ask()
        assert (x >= box[:, 0]).all() and (x <= box[:, 1]).all()
        run.tell(x @ slope[:dimensions])  # the minimum is in a corner, or everywhere
    assert ((run.x_best >= box[:, 0]) & (run.x_best <= box[:, 1])).all()


# Streams and bits ------------------------------------------------------------------------------


@every_method
def test_a_problem_does_not_depend_on_its_neighbours(name):
    method = small(name, 16)
    arguments = {"max_evals": 25 * method.population, "target": 0.5, "patience": 9}
    many = finish(method.start(BOX, problems=7, rng=5, **arguments))
    assert len(set(many.evaluations.tolist())) > 1, "some end early: the cut is tested too"
    for k in range(7):
        one = finish(method.start(BOX, keys=[(k,)], rng=5, **arguments))
        assert np.array_equal(one.x_best[0], many.x_best[k])
        assert one.f_best[0] == many.f_best[k]
        assert one.evaluations[0] == many.evaluations[k] and one.stop[0] == many.stop[k]
        for own, among in zip(one.members(), many.members(), strict=True):
            assert np.array_equal(own[0], among[k])


@every_method
def test_a_seed_gives_the_same_bits_and_another_one_others(name):
    method = small(name)

    def best(**arguments):
        return finish(method.start(BOX, max_evals=400, **arguments)).x_best

    assert np.array_equal(best(), best(rng=None)) and np.array_equal(best(rng=0), best())
    assert np.array_equal(best(rng=7), best(rng=7))
    generators = [np.random.default_rng(3) for _ in range(2)]
    assert np.array_equal(*(best(rng=g) for g in generators))
    assert not np.array_equal(best(rng=generators[0]), best(rng=7))
    assert not np.array_equal(best(rng=1), best(rng=2))
    assert len(np.unique(best(problems=5)[:, 0])) == 5


@every_method
@pytest.mark.parametrize("steps", [1, 2, 9])
def test_a_run_goes_on_after_pickling(name, steps):
    method = small(name)
    run = method.start(BOX, max_evals=40 * method.population, problems=3, rng=3, target=0.3)
    for _ in range(steps):
        if not run.done:
            run.tell(ripples(run.ask()))
    if not run.done:
        run.ask()  # between ask and tell too
    twin = pickle.loads(pickle.dumps(run))
    one, two = finish(run), finish(twin)
    assert np.array_equal(one.x_best, two.x_best) and np.array_equal(one.stop, two.stop)
    assert np.array_equal(one.members()[0], two.members()[0])


# What it does with values ----------------------------------------------------------------------


@every_method
def test_worst_values_are_counted_and_do_no_harm(name):
    method = small(name)
    holes = np.array([np.nan, -np.inf, np.inf])

    def f(x):
        values = bowl(x)
        which = (np.abs(x[..., 0] * 1e3) % 1.0 * 6).astype(int)  # half of the box
        return np.where(which < 3, holes[np.minimum(which, 2)], values)

    bad = 0
    run = method.start(BOX, max_evals=60 * method.population, problems=2)
    while not run.done:
        x = run.ask()
        assert np.isfinite(x).all()
        values = f(x)
        bad += (~(values > -np.inf)).sum()
        run.tell(values)
    assert run.bad_values.sum() == bad > 0
    assert np.isfinite(run.f_best).all() and (run.f_best < 2.0).all()
    assert (f(run.x_best) == run.f_best).all()


@every_method
def test_a_method_recovers_when_all_was_worst_at_first(name):
    method = small(name)
    run = method.start(BOX, max_evals=60 * method.population, problems=2)
    for _ in range(3):
        run.tell(np.full(run.ask().shape[:2], np.nan))
    assert np.isfinite(run.leader).all() and (run.f_best == np.inf).all()
    finish(run, bowl)
    assert (run.f_best < 8.0).all()


@every_method
def test_nothing_but_worst_values_ends_too(name):
    method = small(name)
    run = finish(method.start(BOX, max_evals=300), lambda x: np.full(x.shape[:2], np.nan))
    assert run.f_best[0] == np.inf and run.bad_values[0] == 300
    assert ((run.x_best >= BOX[:, 0]) & (run.x_best <= BOX[:, 1])).all()


@every_method
@pytest.mark.parametrize("value", [0.0, 1e300, -1e300])
def test_a_flat_function_is_borne(name, value):
    method = small(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = finish(method.start(BOX, max_evals=500), lambda x: np.full(x.shape[:2], value))
    assert run.f_best[0] == value


@every_method
def test_members_are_points_with_their_values(name):
    method = small(name)
    lowest = np.full(4, np.inf)

    def look(run):
        x, f = run.members()
        assert x.shape == (4, f.shape[1], 3) and np.array_equal(ripples(x), f)
        assert ((x >= BOX[:, 0]) & (x <= BOX[:, 1])).all()
        assert (f >= run.f_best[:, None]).all()
        assert (run.f_best <= lowest).all()
        lowest[:] = run.f_best
        for key, value in vars(run.state).items():
            if isinstance(value, np.ndarray):
                assert len(value) == len(run.active), f"{key}: problems on the first axis"

    # not a multiple of any step: the last one is cut
    budget = 17 * method.population + 5
    run = method.start(BOX, max_evals=budget, problems=4, target=0.4)
    finish(run, each=look)
    assert np.array_equal(ripples(run.x_best), run.f_best)


@every_method
def test_a_search_beats_random_points(name):
    method = make_optimizer(name)
    budget, problems = 40 * method.population, 15
    run = finish(method.start(BOX, max_evals=budget, problems=problems, rng=11))
    points = np.random.default_rng(4).uniform(*BOX.T, (problems, budget, 3))
    assert np.median(run.f_best) < 0.3 * np.median(ripples(points).min(axis=1))


@every_method
def test_one_variable_is_enough(name):
    method = small(name)
    run = finish(method.start([(-3, 4)], max_evals=60 * method.population), bowl)
    assert run.x_best[0, 0] == pytest.approx(1.2, abs=0.2)


@every_method
def test_first_points_are_taken_and_kept_inside(name):
    method = small(name)
    for x0 in (CENTRE, [CENTRE, CENTRE + 100], np.tile(CENTRE, (3, 1, 1))):
        run = method.start(BOX, max_evals=300, problems=3, x0=x0)
        assert np.array_equal(run.ask()[:, 0], np.tile(CENTRE, (3, 1)))
        assert (finish(run).f_best <= ripples(CENTRE)).all()


@every_method
def test_target_and_patience_end_a_search(name):
    method = small(name)
    most = 200 * method.population
    run = finish(method.start(BOX, max_evals=most, target=50.0, problems=3))
    assert (run.stop == 1).all() and (run.f_best <= 50.0).all() and (run.evaluations < most).all()
    still = method.start(BOX, max_evals=most, patience=4)
    finish(still, lambda x: np.ones(x.shape[:2]))
    assert still.stop[0] == 3 and still.generation == 5


@every_method
def test_a_history_follows_any_method(name):
    method = small(name)
    history = History(population=True)
    run = method.start(BOX, max_evals=15 * method.population, problems=3, target=0.8)
    finish(run, each=history)
    assert len(history) == run.generation == len(history.best)
    assert np.array_equal(history.best[-1], run.f_best)
    assert np.array_equal(history.evaluations[-1], run.evaluations)
    assert np.array_equal(ripples(history.population), history.population_values)
    assert np.array_equal(np.median(history.population_values, axis=2), history.median)


# The base --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ([], "D at least 1"),
        (np.empty((0, 2)), "D at least 1"),
        ([(1, -1)], "variable 0 must rise"),
        ([(0, 1), (2, 2)], "variable 1 must rise"),
        ([(0, np.inf)], "finite"),
        ([(np.nan, 1)], "finite"),
        ([(-1.5e308, 1.5e308)], "too far apart"),
        ([(0, 1, 2)], "pairs"),
        ([0, 1], "pairs"),
        ([(0, 1), (2,)], "unequal length"),
    ],
)
def test_bounds_that_cannot_be_used(bounds, message):
    with pytest.raises(InputError, match=message):
        make_optimizer("pso").start(bounds, max_evals=1000)


@pytest.mark.parametrize("bounds", [None, [("a", "b")], [(0j, 1j)], {"x": 1}])
def test_bounds_of_the_wrong_kind(bounds):
    with pytest.raises(TypeError, match="real numbers"):
        make_optimizer("pso").start(bounds, max_evals=1000)


@pytest.mark.parametrize(
    "arguments",
    [
        {"max_evals": 99},
        {"max_evals": 0},
        {"max_evals": 1e4},
        {"max_evals": True},
        {"problems": 0},
        {"patience": 0},
        {"patience": 1.5},
        {"target": float("nan")},
        {"target": "low"},
        {"rng": -1},
        {"rng": 2**63},
        {"keys": [(0,), (1,)]},
        {"keys": [(0.5,)]},
        {"keys": [(-1,)]},
        {"keys": [(2**32,)]},
        {"problems": 2, "keys": [(1,), (1, 2)]},
        {"x0": [0.0, 0.0]},
        {"x0": np.zeros((101, 3))},
        {"x0": [np.nan, 0, 0]},
        {"x0": np.zeros((2, 1, 3))},
    ],
)
def test_arguments_that_cannot_be_used(arguments):
    with pytest.raises(InputError, match=next(k for k in reversed(arguments))[:3]):
        make_optimizer("pso").start(BOX, **{"max_evals": 1000, **arguments})


def test_arguments_of_the_wrong_type():
    for arguments in ({"rng": "seed"}, {"rng": 1.5}, {"rng": True}, {"x0": ["a", "b", "c"]}):
        with pytest.raises(TypeError):
            make_optimizer("pso").start(BOX, max_evals=1000, **arguments)


def test_ask_and_tell_in_the_wrong_way():
    run = make_optimizer("pso", population=5).start(BOX, max_evals=5)
    with pytest.raises(InputError, match="without ask"):
        run.tell(np.zeros((1, 5)))
    with pytest.raises(InputError, match="no members yet"):
        run.members()
    x = run.ask()
    assert np.array_equal(run.ask(), x), "asked again: the same points"
    with pytest.raises(ValueError, match="read-only"):
        x += 1.0
    for values in (np.zeros(5), np.zeros((1, 4)), 0.0):
        with pytest.raises(InputError, match="shape"):
            run.tell(values)
    for values in (np.zeros((1, 5), complex), np.full((1, 5), "1"), np.full((1, 5), None)):
        with pytest.raises(TypeError, match="real numbers"):
            run.tell(values)
    run.tell(np.zeros((1, 5), int))  # a wrong tell has spoilt nothing
    assert run.done
    with pytest.raises(InputError, match="done"):
        run.ask()


def test_told_values_are_not_written_to():
    values = np.full((1, 5), np.nan)
    run = make_optimizer("pso", population=5).start(BOX, max_evals=50)
    run.ask()
    run.tell(values)
    assert np.isnan(values).all()


def test_a_number_among_the_settings():
    real_number("pull", 0.5, 0.0, 1.0)
    for bad in (np.nan, np.inf, "1", None, True, 2.0):
        with pytest.raises(InputError, match="pull"):
            real_number("pull", bad, 0.0, 1.0)


def test_names_lead_to_methods():
    assert "NAMES" in dir(optimizers) and "ParticleSwarm" in dir(optimizers)
    for bad in ("swarm", None, 3):
        with pytest.raises(InputError, match="pso, ga, gwo"):
            make_optimizer(bad)
    with pytest.raises(AttributeError, match="Ant"):
        optimizers.Ant  # noqa: B018


def test_streams_are_their_own():
    both = Streams([(1, 2), (1, 3)])
    alone = Streams([(1, 3)])
    assert np.array_equal(both.uniform(4, 2)[1], alone.uniform(4, 2)[0])
    assert np.array_equal(both.normal(3)[1], alone.normal(3)[0])
    both.keep(np.array([False, True]))
    assert len(both) == 1 and np.array_equal(both.uniform(2), alone.uniform(2))


def test_a_method_without_hooks_says_so():
    class Bare(Optimizer):
        def __init__(self, population=4):
            self.population = population

    run = Bare().start(BOX, max_evals=8)
    x = run.ask()
    with pytest.raises(NotImplementedError, match="Bare has no _begin"):
        run.tell(bowl(x))


def test_optimizers_know_no_robots_and_load_nothing_heavy():
    code = (
        "import sys, kinverse; before = set(sys.modules); import kinverse.optimizers;"
        "print(*sorted(set(sys.modules) - before))"
    )
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = {name for name in out.stdout.split() if name not in sys.stdlib_module_names}
    assert loaded
    assert all(name.startswith("kinverse.optimizers") for name in loaded), loaded
    assert not any("methods" in name for name in loaded), "a method's file waits for its name"


def test_populations_that_shrink_are_kept():
    from kinverse.optimizers import BeesAlgorithm, History

    history = History(population=True)
    run = BeesAlgorithm(scouts=5).start([(-1, 1)] * 2, max_evals=300, problems=3)
    while not run.done:
        run.tell((run.ask() ** 2).sum(axis=2))
        history(run)
    x, f = history.population, history.population_values
    assert x.shape[:2] == f.shape[:2] == (len(history), 3)
    assert np.isnan(x).any() and (np.isnan(x[..., 0]) == np.isinf(f)).all()

"""minimize: SciPy's result, honest about what happened."""

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from kinverse.errors import InputError
from kinverse.optimizers import History, ParticleSwarm, make_optimizer, minimize

BOX = [(-3.0, 4.0), (-1.0, 2.0), (0.5, 9.0)]
CENTRE = np.array([1.2, -0.4, 6.0])
SWARM = ParticleSwarm(population=20)


def bowl(x):
    return ((x - CENTRE) ** 2).sum(axis=-1)


def same(one, two):
    return all(np.array_equal(one[name], two[name]) for name in one if name != "history")


def test_the_result_is_scipys():
    result = minimize(bowl, BOX, max_evals=20_000)
    assert isinstance(result, scipy.optimize.OptimizeResult)
    assert result.x == pytest.approx(CENTRE, abs=1e-4) and result.fun == bowl(result.x)
    assert result.success and result.status == 2 and result.message == "the evaluations are spent"
    assert (result.nfev, result.nit, result.bad_values) == (20_000, 200, 0)
    assert result.population.shape == (100, 3) and result.history is None
    assert np.array_equal(bowl(result.population), result.population_energies)
    assert (np.diff(result.population_energies) >= 0).all()
    theirs = scipy.optimize.differential_evolution(bowl, BOX, seed=1, maxiter=3, polish=False)
    assert set(theirs) - set(result) <= {"convergence"}
    assert "maxcv" not in result and "the evaluations are spent" in repr(result)


def test_one_point_at_a_time_or_all_together_are_the_same():
    sizes = []

    def one(x):
        assert x.shape == (3,)
        return bowl(x)

    def many(x):
        sizes.append(len(x))
        return bowl(x)

    apart = minimize(one, BOX, SWARM, max_evals=307, rng=4)
    together = minimize(many, BOX, SWARM, max_evals=307, rng=4, vectorized=True)
    assert same(apart, together)
    assert sum(sizes) == 307 == apart.nfev


@settings(max_examples=25, deadline=None)
@given(extra=st.integers(0, 90), seed=st.integers(0, 2**63 - 1), dimensions=st.integers(1, 4))
def test_the_function_is_asked_exactly_as_often_as_allowed(extra, seed, dimensions):
    seen = []

    def f(x):
        seen.append(x.copy())
        return float(np.abs(x).sum())

    box = [(-1.0, 2.0)] * dimensions
    result = minimize(f, box, SWARM, max_evals=20 + extra, rng=seed)
    points = np.array(seen)
    assert len(points) == 20 + extra == result.nfev
    assert (points >= -1.0).all() and (points <= 2.0).all()
    values = np.abs(points).sum(axis=1)
    assert result.fun == values.min() and np.array_equal(result.x, points[values.argmin()])


def test_any_optimizer_by_name_or_object():
    by_name = minimize(bowl, BOX, "pso", max_evals=500, rng=1)
    assert same(by_name, minimize(bowl, BOX, make_optimizer("pso"), max_evals=500, rng=1))
    assert same(by_name, minimize(bowl, BOX, max_evals=500, rng=1))
    for bad in (ParticleSwarm, None, 3):
        with pytest.raises(InputError, match="optimizer must be"):
            minimize(bowl, BOX, bad, max_evals=500)
    with pytest.raises(InputError, match="pso, ga"):
        minimize(bowl, BOX, "swarm", max_evals=500)


def test_scipys_bounds_are_taken():
    bounds = scipy.optimize.Bounds([-3, -1, 0.5], [4, 2, 9])
    assert same(
        minimize(bowl, bounds, max_evals=300, rng=1), minimize(bowl, BOX, max_evals=300, rng=1)
    )
    with pytest.raises(InputError, match="finite"):
        minimize(bowl, scipy.optimize.Bounds(), max_evals=300)


def test_a_function_that_writes_to_its_points_harms_nothing():
    def careless(x):
        x -= CENTRE
        x *= x
        return x.sum(axis=-1)

    plain = minimize(bowl, BOX, SWARM, max_evals=600)
    assert same(plain, minimize(careless, BOX, SWARM, max_evals=600))
    assert same(plain, minimize(careless, BOX, SWARM, max_evals=600, vectorized=True))


def test_a_start_is_taken():
    result = minimize(bowl, BOX, SWARM, max_evals=20, x0=CENTRE)
    assert result.fun == 0.0 and np.array_equal(result.x, CENTRE)


# Ends ------------------------------------------------------------------------------------------


def test_a_target_ends_it():
    result = minimize(bowl, BOX, max_evals=50_000, target=1e-2)
    assert result.success and result.status == 1 and result.fun <= 1e-2 and result.nfev < 50_000
    missed = minimize(bowl, BOX, max_evals=500, target=-1.0)
    assert not missed.success and missed.status == 2 and missed.nfev == 500


def test_patience_ends_it():
    result = minimize(lambda x: 1.0, BOX, SWARM, max_evals=5000, patience=3)
    assert result.success and result.status == 3 and result.nfev == 80


def test_a_callback_may_end_it():
    steps = []

    def stop(run):
        steps.append(run.f_best[0])
        return len(steps) == 5

    result = minimize(bowl, BOX, SWARM, max_evals=5000, callback=stop)
    assert not result.success and result.status == 4 and "callback" in result.message
    assert (result.nfev, result.nit) == (100, 5) and result.fun == steps[-1] == min(steps)

    def stop_as_scipy_does(run):
        raise StopIteration

    assert minimize(bowl, BOX, SWARM, max_evals=5000, callback=stop_as_scipy_does).nit == 1


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, ZeroDivisionError])
@pytest.mark.parametrize("calls", [1, 2, 57])
def test_an_exception_passes_and_carries_the_best_so_far(error, calls):
    seen = []

    def f(x):
        if len(seen) + 1 == calls:
            raise error("enough")
        seen.append((bowl(x), *x))
        return seen[-1][0]

    with pytest.raises(error, match="enough") as info:
        minimize(f, BOX, SWARM, max_evals=5000, history="best")
    if calls == 1:
        assert not hasattr(info.value, "result"), "there was nothing to lose"
        return
    result = info.value.result
    best = min(seen)
    assert (result.fun, *result.x) == best and result.nfev == calls - 1
    assert not result.success and result.status == 5 and "exception" in result.message
    assert len(result.history) == result.nit == (calls - 1) // 20
    assert len(result.population) == (20 if result.nit else 0)
    assert repr(float(best[0])) in info.value.__notes__[0]


def test_an_exception_of_the_callback_carries_it_too():
    def fail(run):
        raise RuntimeError("plot is closed")

    with pytest.raises(RuntimeError) as info:
        minimize(bowl, BOX, SWARM, max_evals=5000, callback=fail)
    assert info.value.result.nfev == 20


# Values ----------------------------------------------------------------------------------------


def test_bad_values_are_counted_and_told():
    def f(x):
        return np.nan if x[0] > 1.0 else -np.inf if x[0] < -2.0 else bowl(x)

    result = minimize(f, BOX, max_evals=3000)
    assert result.success and np.isfinite(result.fun) and -2.0 <= result.x[0] <= 1.0
    assert result.bad_values > 100
    assert f"{result.bad_values} of 3000 values were NaN or -inf" in result.message


@pytest.mark.parametrize("value", [np.nan, -np.inf, np.inf])
def test_nothing_but_bad_values_is_no_success(value):
    result = minimize(lambda x: value, BOX, SWARM, max_evals=400)
    assert not result.success and result.fun == np.inf
    assert result.bad_values == (0 if value == np.inf else 400)
    assert ("400 of 400" in result.message) == (value != np.inf)
    assert np.isfinite(result.x).all()


@pytest.mark.parametrize(
    "value", [1, np.float32(1), np.int8(1), np.array(1.0), np.array([1.0]), [[1.0]], True]
)
def test_numbers_of_any_kind_are_taken(value):
    assert minimize(lambda x: value, BOX, SWARM, max_evals=40).fun == 1.0


def test_one_array_returned_again_and_again_is_read_each_time():
    out = np.empty(1)

    def f(x):
        out[0] = bowl(x)
        return out

    assert same(minimize(f, BOX, SWARM, max_evals=300), minimize(bowl, BOX, SWARM, max_evals=300))


@pytest.mark.parametrize("value", [1j, "1", None, {}, np.complex128(2)])
def test_what_is_no_real_number_is_a_type_error(value):
    with pytest.raises(TypeError, match="real numbers"):
        minimize(lambda x: value, BOX, max_evals=400)
    with pytest.raises(TypeError, match="real numbers"):
        minimize(lambda x: np.full(len(x), value), BOX, max_evals=400, vectorized=True)


@pytest.mark.parametrize("value", [[], [1.0, 2.0], np.zeros((2, 1)), [[1.0], [1.0, 2.0]]])
def test_more_or_less_than_one_number_is_refused(value):
    with pytest.raises(InputError, match="of f|f must return one number"):
        minimize(lambda x: value, BOX, max_evals=400)


@pytest.mark.parametrize("shape", [(), (99,), (100, 1), (1, 100)])
def test_values_of_another_shape_are_refused(shape):
    with pytest.raises(InputError, match=r"shape \(100,\)"):
        minimize(lambda x: np.zeros(shape), BOX, max_evals=400, vectorized=True)


@pytest.mark.parametrize(
    ("message", "arguments"),
    [
        ("D at least 1", {"bounds": []}),
        ("must rise", {"bounds": [(1, 0)]}),
        ("finite", {"bounds": [(0, np.inf)]}),
        ("f must be", {"f": 3}),
        ("callback", {"callback": 3}),
        ("history", {"history": "all"}),
        ("one generation, 100 evaluations", {"max_evals": 99}),
        ("max_evals", {"max_evals": "many"}),
        ("max_evals", {"max_evals": 1e4}),
        ("target", {"target": np.nan}),
        ("target", {"target": "low"}),
        ("patience", {"patience": 0}),
        ("population", {"optimizer": ParticleSwarm(population=1)}),
        ("x0", {"x0": [1.0]}),
        ("rng", {"rng": -1}),
        ("constraint 0 must be", {"constraints": [3]}),
    ],
)
@pytest.mark.parametrize("constrained", [False, True])
def test_arguments_that_cannot_be_used(message, arguments, constrained):
    extra = {"constraints": {"type": "ineq", "fun": lambda x: 1.0}} if constrained else {}
    with pytest.raises(InputError, match=message):
        minimize(**{"f": bowl, "bounds": BOX, "max_evals": 1000, **extra, **arguments})


# History ---------------------------------------------------------------------------------------


def test_the_history_of_a_search():
    result = minimize(bowl, BOX, SWARM, max_evals=509, history="best")
    history = result.history
    assert len(history) == result.nit == 26
    assert np.array_equal(history.evaluations[:, 0], [*range(20, 501, 20), 509])
    assert (np.diff(history.best[:, 0]) <= 0).all() and history.best[-1, 0] == result.fun
    assert (history.median >= history.best).all()
    with pytest.raises(InputError, match="population=True"):
        history.population  # noqa: B018
    full = minimize(bowl, BOX, SWARM, max_evals=509, history="population").history
    assert full.population.shape == (26, 1, 20, 3)
    assert np.array_equal(full.best, history.best)


def test_a_history_is_a_callback_too():
    history = History(every=7)
    minimize(bowl, BOX, SWARM, max_evals=600, callback=history)
    assert (history.evaluations[:, 0] / 20).tolist() == [1, 8, 15, 22, 29, 30]


def test_the_last_step_is_in_the_history_however_it_ended():
    result = minimize(
        bowl, BOX, SWARM, max_evals=600, history=History(every=50),
        callback=lambda run: run.generation == 9,
    )  # fmt: skip
    assert (result.history.evaluations[:, 0] / 20).tolist() == [1, 9]


@settings(max_examples=30, deadline=None)
@given(steps=st.integers(1, 120), every=st.integers(1, 5), most=st.integers(2, 20))
def test_the_memory_of_a_history_is_bounded(steps, every, most):
    history = History(every=every, most=most, population=True)
    run = ParticleSwarm(population=3).start(BOX, max_evals=3 * steps, problems=2)
    while not run.done:
        run.tell(bowl(run.ask()))
        history(run)
        assert len(history) <= most
    written = history.evaluations[:, 0] // 3
    assert written[0] == 1 and written[-1] == steps and (np.diff(written) > 0).all()
    assert len(history.population) == len(history.median) == len(history)
    gaps = set(np.diff(written)[:-1].tolist())
    assert len(gaps) <= 1 and all(gap % every == 0 for gap in gaps)


def test_a_history_that_cannot_be():
    for bad in ({"every": 0}, {"most": 1}, {"every": 1.5}):
        with pytest.raises(InputError):
            History(**bad)
    history = History()
    minimize(bowl, BOX, SWARM, max_evals=40, history=history)
    run = SWARM.start(BOX, max_evals=40, problems=2)
    run.tell(bowl(run.ask()))
    with pytest.raises(InputError, match="1 problems, the run 2"):
        history(run)

"""Constrained problems whose answers are known on paper."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, NonlinearConstraint

from kinverse.errors import InputError
from kinverse.optimizers import AtMost, Augmented, Equal, ParticleSwarm, Penalty, minimize

FAR = np.array([1.0, -2.0, 0.5, 0.3, 2.0])
SWARM = ParticleSwarm(population=40)


def total(x):
    return x.sum(axis=-1)


def square(x):
    return (x**2).sum(axis=-1)


# f, bounds, constraints, minimum, multipliers: of F + lambda (G - a) + mu (H - b)
KNOWN = {
    "a sum on a circle": (
        total, [(-3, 3)] * 2, [Equal(square, 2.0)], -2.0, [0.5]
    ),
    "the nearest point of a half-plane": (
        square, [(-3, 4)] * 2, [AtMost(lambda x: -total(x), -1.0)], 0.5, [1.0]
    ),
    "the nearest point of a sphere": (
        lambda x: square(x - FAR), [(-3, 3.5)] * 5, [Equal(square, 1.0)],
        (np.linalg.norm(FAR) - 1) ** 2, [np.linalg.norm(FAR) - 1],
    ),
    "a constraint that does not bind": (
        square, [(-3, 4)] * 2, [AtMost(total, 1.0)], 0.0, [0.0]
    ),
    "both kinds": (
        lambda x: square(x - 1.0), [(-2, 3)] * 3,
        [Equal(total, 1.0), AtMost(lambda x: x[..., 0], 0.0)], 1.5, [1.0, 1.0],
    ),
    "two values of one function": (
        lambda x: square(x - 2.0), [(-2, 3)] * 2,
        [AtMost(lambda x: x, [1.0, 0.5])], 3.25, [2.0, 3.0],
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", KNOWN)
def test_known_minima_and_multipliers(name, seed):
    f, bounds, constraints, lowest, multipliers = KNOWN[name]
    result = minimize(
        f, bounds, max_evals=20_000, rng=seed, constraints=constraints, vectorized=True
    )
    assert result.success and result.status == 2 and result.nfev == 20_000
    assert result.fun == pytest.approx(lowest, abs=1e-5) and result.fun == f(result.x)
    assert 0.0 <= result.maxcv <= 1e-6
    assert np.concatenate(result.multipliers) == pytest.approx(multipliers, abs=1e-4)
    assert [len(part) for part in result.constr] == [len(part) for part in result.multipliers]
    assert max(part.max() for part in result.constr) == result.maxcv


def test_a_problem_with_curved_borders():
    # g06 of the CEC 2006 collection: a sickle of 1 % of the box, both constraints bind
    def f(x):
        return (x[..., 0] - 10) ** 3 + (x[..., 1] - 20) ** 3

    outside = AtMost(lambda x: -((x - 5) ** 2).sum(axis=-1), -100.0)
    inside = AtMost(lambda x: (x[..., 0] - 6) ** 2 + (x[..., 1] - 5) ** 2, 82.81)
    for seed in range(3):
        result = minimize(
            f, [(13, 100), (0, 100)], max_evals=20_000, rng=seed,
            constraints=(outside, inside), vectorized=True,
        )  # fmt: skip
        assert result.success and result.fun == pytest.approx(-6961.81388, abs=1.0)


def test_the_multiplier_is_minus_the_rate_at_which_the_minimum_changes():
    def at(radius):
        return minimize(
            lambda x: square(x - 2.0), [(-2, 3)] * 2, max_evals=20_000,
            constraints=Equal(square, radius), vectorized=True,
        )  # fmt: skip

    rate = (at(1.01).fun - at(0.99).fun) / 0.02
    assert at(1.0).multipliers[0] == pytest.approx([-rate], abs=1e-3)


def test_a_penalty_reports_by_how_much_it_misses():
    def run(weight, tolerance):
        return minimize(
            total, [(-3, 3)] * 2, max_evals=10_000, vectorized=True,
            constraints=Penalty([Equal(square, 2.0)], weight=weight, tolerance=tolerance),
        )  # fmt: skip

    loose = run(10.0, 0.05)
    # multiplier / (2 weight) = 0.025 outside
    assert loose.success and loose.fun < -2.0 and loose.maxcv <= 0.05
    assert loose.multipliers == []
    missed = minimize(
        total, [(-3, 3)] * 2, max_evals=400, vectorized=True,
        constraints=Penalty([Equal(square, 2.0)], tolerance=1e-12),
    )  # fmt: skip
    assert not missed.success and missed.maxcv > 1e-12
    assert "the constraints are not met" in missed.message
    assert missed.maxcv == pytest.approx(abs(square(missed.x) - 2.0))
    assert run(1e4, 1e-3).fun == pytest.approx(-2.0, abs=2e-3)


def test_a_constraint_that_nothing_meets_is_no_success():
    for way in (Augmented, Penalty):
        result = minimize(
            square, [(-1, 1)] * 2, SWARM, max_evals=4000, vectorized=True,
            constraints=way([AtMost(total, -3.0)]),
        )  # fmt: skip
        assert not result.success and result.maxcv == pytest.approx(1.0, abs=1e-3)
        assert result.x == pytest.approx([-1, -1], abs=1e-3) and result.nfev == 4000


# How constraints can be written ----------------------------------------------------------------


SAME = {
    "ours": [Equal(total, 1.0), AtMost(lambda x: x[..., 0], 0.25)],
    "dictionaries": [
        {"type": "eq", "fun": lambda x, a: total(x) - a, "args": (1.0,)},
        {"type": "ineq", "fun": lambda x: 0.25 - x[..., 0]},
    ],
    "SciPy's, not linear": [
        NonlinearConstraint(total, 1.0, 1.0),
        NonlinearConstraint(lambda x: x[..., 0], -np.inf, 0.25),
    ],
    "SciPy's, linear": [
        LinearConstraint([[1, 1, 1], [1, 0, 0]], [1, -np.inf], [1, 0.25]),
    ],
    "from both sides": (
        Equal(total, 1.0),
        NonlinearConstraint(lambda x: x[..., 0], -5.0, 0.25),
    ),
}


@pytest.mark.parametrize("vectorized", [True, False])
@pytest.mark.parametrize("name", SAME)
def test_constraints_of_every_form(name, vectorized):
    result = minimize(
        lambda x: square(x - 1.0), [(-2, 3)] * 3, SWARM,
        max_evals=8000, constraints=SAME[name], vectorized=vectorized, rng=2,
    )  # fmt: skip
    assert result.success and result.x == pytest.approx([0.25, 0.375, 0.375], abs=1e-3)


def test_points_apart_or_together_are_the_same_with_constraints():
    arguments = {"max_evals": 3000, "constraints": SAME["ours"], "rng": 6}
    one = minimize(square, [(-2, 3)] * 3, SWARM, **arguments)
    two = minimize(square, [(-2, 3)] * 3, SWARM, vectorized=True, **arguments)
    assert np.array_equal(one.x, two.x) and one.maxcv == two.maxcv
    assert np.array_equal(one.population, two.population)


@pytest.mark.parametrize(
    ("item", "message"),
    [
        (3, "constraint 0 must be"),
        (Equal(3), "needs a function"),
        (Equal(total, [[1.0]]), "number or"),
        (Equal(total, np.nan), "rise"),
        (Equal(total, np.inf), "no number meets"),
        (AtMost(total, -np.inf), "no number meets"),
        (Equal(total, [1.0, 2.0, 3.0]), "gives 1 values"),
        (AtMost(lambda x: np.zeros((2, 2))), "number or"),
        (NonlinearConstraint(total, 2.0, 1.0), "rise"),
        ({"type": "less", "fun": total}, '"eq" or "ineq"'),
        ({"type": "eq"}, '"eq" or "ineq"'),
        (LinearConstraint(np.eye(2), 0, 1), "2 columns for 3"),
        (Augmented([Equal(total)], weight=0.0), "weight"),
        (Augmented([Equal(total)], weight=np.nan), "weight"),
        (Augmented([Equal(total)], growth=0.5), "growth"),
        (Augmented([Equal(total)], rounds=0), "rounds"),
        (Augmented([Equal(total)], tolerance=-1.0), "tolerance"),
        (Penalty([Equal(total)], weight=-1.0), "weight"),
    ],
)
def test_constraints_that_cannot_be_used(item, message):
    constraints = item if isinstance(item, (Augmented, Penalty)) else [item]
    with pytest.raises(InputError, match=message):
        minimize(square, [(-2, 3)] * 3, SWARM, max_evals=400, constraints=constraints)


def test_constraints_that_give_no_real_numbers():
    for value in (1j, "1", None):
        with pytest.raises(TypeError, match="constraint 0"):
            minimize(square, [(-2, 3)] * 3, max_evals=400, constraints=Equal(lambda x, v=value: v))


# The budget and the ends -----------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(
    budget=st.integers(20, 2000),
    rounds=st.integers(1, 60),
    population=st.integers(2, 20),
    way=st.sampled_from([Augmented, Penalty]),
)
def test_all_rounds_together_spend_the_budget_exactly(budget, rounds, population, way):
    seen = []

    def f(x):
        seen.append(x)
        return square(x)

    constraints = way([Equal(total, 1.0)])
    if way is Augmented:
        constraints.set_params(rounds=rounds)
    result = minimize(
        f, [(-1.0, 2.0)] * 2, ParticleSwarm(population=population), max_evals=budget,
        constraints=constraints, vectorized=True, history="best",
    )  # fmt: skip
    points = np.concatenate(seen)
    assert len(points) == result.nfev == budget == result.history.evaluations[-1, 0]
    assert (points >= -1.0).all() and (points <= 2.0).all()
    assert (np.diff(result.history.evaluations[:, 0]) > 0).all()
    # what is returned was tried, and nothing that was tried is better
    violation = np.abs(total(points) - 1.0)
    met = violation <= 1e-6
    lowest = square(points[met]).min() if met.any() else None
    assert result.success == met.any()
    assert result.fun == lowest if met.any() else result.maxcv == violation.min()


def test_a_target_counts_only_where_the_constraints_are_met():
    result = minimize(
        total, [(-3, 3)] * 2, SWARM, max_evals=20_000, target=-1.9, vectorized=True,
        constraints=[Equal(square, 2.0)],
    )  # fmt: skip
    assert result.success and result.status == 1 and result.fun <= -1.9 and result.maxcv <= 1e-6
    assert result.nfev < 20_000


def test_patience_and_the_callback_end_it():
    arguments = {"constraints": [Equal(square, 2.0)], "vectorized": True}
    result = minimize(total, [(-3, 3)] * 2, SWARM, max_evals=20_000, patience=2, **arguments)
    assert result.nfev <= 20_000
    stopped = minimize(
        total, [(-3, 3)] * 2, SWARM, max_evals=20_000,
        callback=lambda run: run.generation == 3, **arguments,
    )  # fmt: skip
    assert stopped.status == 4 and stopped.nfev == 120 and not stopped.success


def test_bad_values_of_constraints_are_counted():
    def g(x):
        return np.where(x[..., 0] > 0.5, np.nan, total(x) - 1.0)

    result = minimize(
        square, [(-2, 3)] * 2, SWARM, max_evals=6000, constraints=Equal(g), vectorized=True
    )
    assert result.success and result.bad_values > 0 and "NaN" in result.message
    assert result.x == pytest.approx([0.5, 0.5], abs=1e-2)
    nothing = minimize(
        square, [(-2, 3)] * 2, SWARM, max_evals=600, constraints=Equal(lambda x: np.nan)
    )
    assert not nothing.success and nothing.maxcv == np.inf and nothing.bad_values == 600


def test_numbers_that_overflow_are_worst():
    result = minimize(
        lambda x: np.where(x[..., 0] < 0, -np.inf, square(x)), [(-2, 3)] * 2, SWARM,
        max_evals=4000, constraints=AtMost(lambda x: 1e200 * (x[..., 1] - 0.5) ** 2, 1.0),
        vectorized=True,
    )  # fmt: skip
    assert result.nfev == 4000 and result.x[0] >= 0.0


def test_an_exception_in_a_constraint_carries_the_best_so_far():
    calls = []

    def g(x):
        calls.append(0)
        if len(calls) > 500:
            raise KeyboardInterrupt
        return total(x) - 1.0

    with pytest.raises(KeyboardInterrupt) as info:
        minimize(square, [(-2, 3)] * 2, SWARM, max_evals=6000, constraints=Equal(g))
    result = info.value.result
    assert result.status == 5 and result.nfev == 480 and np.isfinite(result.fun)
    assert result.maxcv == pytest.approx(abs(total(result.x) - 1.0))


def test_settings_of_ways_are_settings():
    way = Augmented([Equal(total)], rounds=5)
    assert way.get_params()["rounds"] == 5 and way.clone().tolerance == way.tolerance
    assert "rounds=5" in repr(way)

"""One call from a function to its minimum, with SciPy's result."""

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, checked_bounds
from kinverse.optimizers.checks import not_nan, real_array, whole_number
from kinverse.optimizers.constraints import Rows
from kinverse.optimizers.history import History
from kinverse.optimizers.lagrangian import Handling, handling
from kinverse.optimizers.registry import make_optimizer
from kinverse.optimizers.run import MESSAGES, REACHED, SPENT, STAGNANT, Run
from kinverse.seeds import seed_of

if TYPE_CHECKING:
    from numpy.random import Generator
    from scipy.optimize import OptimizeResult

__all__ = ["minimize"]

Array = NDArray[np.float64]

STOPPED, INTERRUPTED = len(MESSAGES), len(MESSAGES) + 1
_TEXTS = (
    *MESSAGES,
    "the callback ended the search",
    "an exception ended the search",
)


def minimize(
    f: Callable[..., Any],
    bounds: ArrayLike,
    optimizer: str | Optimizer = "pso",
    max_evals: int = 20_000,
    rng: "int | Generator | None" = None,
    constraints: Any = (),
    *,
    x0: ArrayLike | None = None,
    target: float = -np.inf,
    patience: int | None = None,
    vectorized: bool = False,
    callback: Callable[[Run], Any] | None = None,
    history: str | History | None = None,
) -> "OptimizeResult":
    """The lowest value of a function in a box that a population method finds.

    The function is asked for exactly ``max_evals`` values unless the target, patience or the
    callback end the search before. NaN and -inf count as worst and are counted.

    If the function, a constraint or the callback raises, or Ctrl-C comes, the exception passes
    through and nothing is lost: its ``result`` is what would have been returned then (status 5),
    and a note in the traceback tells the best value.

    Args:
        f: x (D,) to a number; with ``vectorized=True`` x (K, D) to (K,). It gets copies.
        bounds: (D, 2) lower and upper bound of each variable, or SciPy's ``Bounds``.
        optimizer: a method, or the short name of one (``kinverse.optimizers.NAMES``).
        max_evals: evaluations to spend; at least the method's population.
        rng: None (a fixed seed), an int >= 0 or a Generator (one draw).
        constraints: one or a sequence of ``Equal``, ``AtMost``, SciPy's NonlinearConstraint,
            LinearConstraint or dictionaries, which ``Augmented`` deals with; or ``Augmented`` or
            ``Penalty`` themselves, with settings. Their functions take what ``f`` takes and are
            asked once for each of its values.
        x0: (D,) or (P, D) points to start from, moved into the box.
        vectorized: whether ``f`` and the constraints take many points at once.
        target: stop at a value not above this (with constraints: at a point that meets them).
        patience: stop after this many steps without a better value; with constraints: without a
            better one of what the round minimises, and the round's remainder goes to the others.
        callback: called with the ``Run`` after each step; True or StopIteration ends the search.
        history: "best", "population" or a ``History``: what the result's ``history`` holds.

    Returns:
        SciPy's OptimizeResult: ``x`` (D,), ``fun``, ``nfev``, ``nit`` (steps), ``success``,
        ``status`` (1 target reached, 2 evaluations spent, 3 patience, 4 stopped by the callback,
        5 interrupted), ``message``, ``population`` (K, D) and ``population_energies`` (K,) sorted,
        ``bad_values`` (NaN or -inf), ``history``. With constraints also ``maxcv`` (the largest
        violation at x), ``constr`` (the violations, an array for each constraint) and
        ``multipliers`` (see ``kinverse.optimizers.lagrangian`` for their signs); ``x`` is then the
        lowest of all points tried that meet them within the tolerance, or the one that violates
        them least, and ``population_energies`` are values of what was minimised in the last round.

        ``success`` means: the search ended by its own rules with a finite value, at the target if
        one was given, and the constraints are met within their tolerance. That the minimum is the
        global one nobody can promise.

    Raises:
        InputError: an argument that cannot be used, or values of the wrong shape.
        TypeError: values that are not real numbers.

    Example:
        >>> minimize(lambda x: x @ x, [(-5, 5)] * 3, "pso", max_evals=5000, rng=1).x
        >>> minimize(f, bounds, "de", max_evals=20_000, constraints=[Equal(lambda x: x @ x, 1.0)])
    """
    if not callable(f):
        raise InputError(f"f must be a function, got {type(f).__name__}")
    if callback is not None and not callable(callback):
        raise InputError(f"callback must be a function, got {type(callback).__name__}")
    method = make_optimizer(optimizer) if isinstance(optimizer, str) else optimizer
    if not isinstance(method, Optimizer):
        raise InputError(f"optimizer must be a name or an Optimizer, got {optimizer!r}")
    whole_number("max_evals", max_evals, 1)
    target = not_nan("target", target)
    low, high = getattr(bounds, "lb", None), getattr(bounds, "ub", None)
    if low is not None and high is not None:
        bounds = np.stack(np.broadcast_arrays(low, high), axis=-1)
    arguments = {"rng": seed_of(rng), "patience": patience}
    search = _Search(f, vectorized, handling(constraints), target, callback, _history(history))
    try:
        search.spend(method, checked_bounds(bounds), max_evals, x0, arguments)
    except BaseException as error:
        if search.nfev:
            with contextlib.suppress(Exception):  # the error itself matters more
                _attach(error, search)
        raise
    return search.result()


def _attach(error: BaseException, search: "_Search") -> None:
    search.status = INTERRUPTED
    result = search.result()
    vars(error)["result"] = result
    error.add_note(
        f"kinverse: the best of {result.nfev} evaluations so far is {result.fun!r};"
        " the partial result is in this exception's .result"
    )


def _history(history: str | History | None) -> History | None:
    if history is None or isinstance(history, History):
        return history
    if history not in ("best", "population"):
        raise InputError(f'history must be "best", "population" or a History, got {history!r}')
    return History(population=history == "population")


def _number(value: Any) -> float:
    """What a function returned for one point."""
    array = real_array("the value of f", value)
    if array.size != 1:
        raise InputError(
            f"f must return one number for a point x (D,), got shape {array.shape};"
            " with vectorized=True it gets (K, D)"
        )
    return float(array.reshape(()))


class _Search:
    """What ``minimize`` knows on its way."""

    def __init__(
        self,
        f: Callable[..., Any],
        vectorized: bool,
        way: Handling | None,
        target: float,
        callback: Callable[[Run], Any] | None,
        history: History | None,
    ) -> None:
        self.f, self.vectorized, self.callback, self.history = f, vectorized, callback, history
        self.tolerance = 0.0 if way is None else way.tolerance
        self.rows = None if way is None else Rows(way.constraints, vectorized)
        self.merit = None if way is None or self.rows is None else way.merit(self.rows)
        self.target = target
        self.run: Run | None = None
        self.status = 0
        self.nfev = self.nit = self.bad_values = 0
        self.x, self.fun, self.violation = np.empty(0), np.inf, np.empty(0)
        self._outside = np.inf  # violation of x if it is above the tolerance, else zero

    def spend(
        self, method: Optimizer, box: Array, max_evals: int, x0: Any, arguments: dict[str, Any]
    ) -> None:
        """Spend the evaluations: one run, or the rounds that the constraints ask for."""
        if self.merit is None:
            run = method.start(box, max_evals=max_evals, x0=x0, target=self.target, **arguments)
            self._follow(run)
            return
        following: tuple[Array, Any] | None = (box, x0)
        turn, left = 0, max_evals
        while following is not None and (turn == 0 or left >= method.population):
            near, first = following
            part = self.merit.evals(left, method.population)
            run = method.start(near, max_evals=part, x0=first, keys=[[turn]], **arguments)
            self._follow(run)
            if self.status in (REACHED, STOPPED):
                return
            following = self.merit.learn(run, box)
            turn, left = turn + 1, max_evals - self.nfev

    def result(self) -> "OptimizeResult":
        """What is known by now."""
        from scipy.optimize import OptimizeResult

        assert self.run is not None
        points, values = np.empty((0, len(self.run.low))), np.empty(0)
        if self.run.generation:
            x, f = self.run.members()
            order = np.argsort(f[0], kind="stable")
            points, values = x[0, order], f[0, order]
            if self.history is not None:
                self.history.record(self.run)
        reached = self.target == -np.inf or self.fun <= self.target
        found = bool(np.isfinite(self._outside))
        result = OptimizeResult(
            x=self.x,
            fun=self.fun,
            nfev=self.nfev,
            nit=self.nit,
            status=self.status,
            success=self.status in (REACHED, SPENT, STAGNANT) and found and reached,
            message=_TEXTS[self.status],
            population=points,
            population_energies=values,
            bad_values=self.bad_values,
            history=self.history,
        )
        if self.bad_values:
            result.message += (
                f"; {self.bad_values} of {self.nfev} values were NaN or -inf and counted as worst"
            )
        if self.rows is not None and self.merit is not None:
            worst = float(self.violation.max(initial=0.0)) if found else np.inf
            result.maxcv = worst
            result.constr = self.rows.split(self.violation)
            result.multipliers = self.merit.multipliers
            if worst > self.tolerance:
                result.success = False
                result.message += (
                    f"; the constraints are not met: violation {worst:.3g},"
                    f" tolerance {self.tolerance:g}"
                )
        return result

    def _follow(self, run: Run) -> None:
        """Ask, evaluate and tell until the run is done."""
        self.run, self.status = run, 0
        while not self.status:
            x = run.ask()[0].copy()
            f = self._values(x)
            if self.merit is None or self.rows is None:
                minimised, violation = f, np.zeros((len(x), 0))
            else:
                rows = self.rows(x)
                minimised, violation = self.merit(f, rows), self.rows.violation(rows)
            run.tell(minimised[None])
            self._note(x, f, minimised, violation)
            self.nit += 1
            if self.history is not None:
                self.history(run)
            self.status = int(run.stop[0])
            if self._stopped_by_callback(run):
                self.status = STOPPED
            if self._outside == 0.0 and self.fun <= self.target:
                self.status = REACHED

    def _values(self, x: Array) -> Array:
        """(K,) values of f."""
        if self.vectorized:
            values = real_array("the values of f", self.f(x.copy()))
            if values.shape != (len(x),):
                raise InputError(
                    f"f must return shape ({len(x)},) for points {x.shape}, got {values.shape}"
                )
            return values
        values, k = np.empty(len(x)), 0
        try:
            for point in x.copy():
                value = self.f(point)
                values[k] = value if isinstance(value, float) else _number(value)
                k += 1
        except BaseException:
            if k:  # what this step has given so far is not lost
                unknown = np.full((k, 0 if self.rows is None else 1), np.inf)
                self._note(x[:k], values[:k], values[:k], unknown)
            raise
        return values

    def _note(self, x: Array, f: Array, minimised: Array, violation: Array) -> None:
        """Count the values f (K,) at x (K, D), violations (K, m) beside them; keep the best."""
        self.nfev += len(x)
        self.bad_values += int((~(minimised > -np.inf)).sum())
        f = np.where(f > -np.inf, f, np.inf)
        worst = violation.max(axis=1, initial=0.0)
        outside = np.where(worst <= self.tolerance, 0.0, worst)
        outside[np.isnan(worst) | (f == np.inf)] = np.inf
        k = int(np.lexsort((f, outside))[0])
        if not self.x.size or (outside[k], f[k]) < (self._outside, self.fun):
            self.x, self.fun, self.violation = x[k].copy(), float(f[k]), violation[k]
            self._outside = float(outside[k])

    def _stopped_by_callback(self, run: Run) -> bool:
        try:
            return self.callback is not None and bool(self.callback(run))
        except StopIteration:
            return True

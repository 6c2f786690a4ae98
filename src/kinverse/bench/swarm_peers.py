"""The population methods of other libraries, each held to the same budget.

Their evaluations are counted here: a library that would spend more is stopped, and the best value
within the budget is its answer.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["SWARM_PEERS", "SwarmPeer"]

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]

POPULATION = 100


@dataclass(frozen=True)
class SwarmPeer:
    """One method of a library: population 100, the library's own settings otherwise."""

    library: str
    module: str
    method: str

    @property
    def label(self) -> str:
        """Library and method."""
        return f"{self.library} {self.method}"

    def best(self, f: Objective, bounds: Array, max_evals: int, seed: int) -> float:
        """Lowest value found for an objective of points (N, D) within the budget."""
        counted = _Counted(f, max_evals)
        made = getattr(import_module(self.module), self.method)
        try:
            (_mealpy if self.library == "mealpy" else _pymoo)(made, counted, bounds, seed)
        except _Spent:
            pass
        return counted.best


class _Spent(Exception):
    """The budget is spent."""


class _Counted:
    """An objective that remembers its lowest value and stops whoever asks too often."""

    def __init__(self, f: Objective, max_evals: int) -> None:
        self._f = f
        self.left = self.max_evals = max_evals
        self.best = np.inf

    def __call__(self, x: Array) -> Array:
        x = x[: self.left]
        if len(x) == 0:
            raise _Spent
        values = self._f(x)
        self.left -= len(x)
        self.best = min(self.best, float(values.min()))
        return values


def _mealpy(made: Any, f: _Counted, bounds: Array, seed: int) -> None:
    from mealpy import FloatVar

    problem = {
        "bounds": FloatVar(lb=bounds[:, 0], ub=bounds[:, 1]),
        "obj_func": lambda x: float(f(np.asarray(x)[None])[0]),
        "minmax": "min",
        "log_to": None,
    }
    made(epoch=100_000, pop_size=POPULATION).solve(problem, seed=seed)


def _pymoo(made: Any, f: _Counted, bounds: Array, seed: int) -> None:
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Counted(Problem):  # type: ignore[misc]
        def _evaluate(self, x: Array, out: dict[str, Array], *args: Any, **kwargs: Any) -> None:
            if len(x) > f.left:
                f(x)
                raise _Spent
            out["F"] = f(x)[:, None]

    problem = Counted(n_var=len(bounds), n_obj=1, xl=bounds[:, 0], xu=bounds[:, 1])
    minimize(problem, made(pop_size=POPULATION), ("n_eval", f.max_evals), seed=seed)


def _of(library: str, module: str, *methods: str) -> tuple[SwarmPeer, ...]:
    return tuple(SwarmPeer(library, module, method) for method in methods)


SWARM_PEERS: dict[str, tuple[SwarmPeer, ...]] = {
    "pso": (
        *_of("mealpy", "mealpy.swarm_based.PSO", "OriginalPSO", "LDW_PSO"),
        *_of("pymoo", "pymoo.algorithms.soo.nonconvex.pso", "PSO"),
    ),
    "ga": (
        *_of("mealpy", "mealpy.evolutionary_based.GA", "BaseGA"),
        *_of("pymoo", "pymoo.algorithms.soo.nonconvex.ga", "GA"),
    ),
    "gwo": _of("mealpy", "mealpy.swarm_based.GWO", "OriginalGWO"),
    "tlbo": _of("mealpy", "mealpy.human_based.TLO", "OriginalTLO"),
    "bees": _of("mealpy", "mealpy.swarm_based.BeesA", "OriginalBeesA", "CleverBookBeesA"),
    "abc": _of("mealpy", "mealpy.swarm_based.ABC", "OriginalABC"),
    "firefly": _of("mealpy", "mealpy.swarm_based.FFA", "OriginalFFA"),
    "bbo": _of("mealpy", "mealpy.bio_based.BBO", "OriginalBBO"),
    "de": (
        *_of("mealpy", "mealpy.evolutionary_based.DE", "OriginalDE", "JADE"),
        *_of("pymoo", "pymoo.algorithms.soo.nonconvex.de", "DE"),
    ),
}
"""By the short name of ours; nobody has crab intelligence."""

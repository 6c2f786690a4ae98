"""The population methods of other libraries, each called the same way and held to one budget.

``Peer.solve`` counts every evaluation itself, keeps the best point inside the box among the first
``max_evals`` and stops the peer once they are spent. Every peer gets its points evaluated in one
call where it can use that; a step count its schedule runs over (inertia that falls, say) is set so
that it spends the budget; what else is not its default is told in ``Peer.note``.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from tempfile import NamedTemporaryFile
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["PEERS", "Answer", "Counted", "Peer", "Spent"]

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]
"""Points (K, D), contiguous, to values (K,)."""


class Spent(Exception):
    """A peer asked for more than its evaluations."""


class Answer(NamedTuple):
    """Best point (D,) within the budget, its value, and how many evaluations were asked for."""

    x: Array
    f: float
    evaluations: int


class Counted:
    """An objective under a budget; peers that copy their problem share the count.

    Args:
        objective: points (K, D) to values (K,).
        low: (D,) lower bounds.
        high: (D,) upper bounds.
        max_evals: what may be spent.
    """

    def __init__(self, objective: Objective, low: Array, high: Array, max_evals: int) -> None:
        self._objective = objective
        self.low, self.high, self.max_evals = low, high, max_evals
        self.evaluations = 0
        self.over = False
        self.x_best = np.full(len(low), np.nan)
        self.f_best = np.inf

    def __deepcopy__(self, memo: object) -> "Counted":
        return self

    def many(self, x: Array) -> Array:
        """Values (K,) of points (K, D).

        Raises:
            Spent: there is nothing left of the budget; a batch that runs over it is finished.
        """
        room = self.max_evals - self.evaluations
        if room <= 0:
            self.over = True
            raise Spent
        x = np.ascontiguousarray(x, dtype=np.float64)
        f = self._objective(x)
        self.evaluations += len(x)
        if np.fmin.reduce(f[:room]) < self.f_best:
            self._remember(x[:room], f[:room])
        return f

    def one(self, x: Array) -> float:
        """The value of a point (D,).

        Raises:
            Spent: there is nothing left of the budget.
        """
        if self.evaluations >= self.max_evals:
            self.over = True
            raise Spent
        x = np.ascontiguousarray(x, dtype=np.float64)[None]
        f = float(self._objective(x)[0])
        self.evaluations += 1
        if f < self.f_best:
            self._remember(x, np.array([f]))
        return f

    def _remember(self, x: Array, f: Array) -> None:
        good = ((x >= self.low) & (x <= self.high)).all(axis=1) & ~np.isnan(f)
        f = np.where(good, f, np.inf)
        k = int(np.argmin(f))
        if f[k] < self.f_best:
            self.x_best, self.f_best = x[k].copy(), float(f[k])


Runner = Callable[[Counted, int, int, int], object]
"""Runs a library: objective, population, steps behind the first population, seed."""


@dataclass(frozen=True)
class Peer:
    """One variant of one method of another library.

    Attributes:
        package: where it comes from.
        variant: what it is called there.
        run: how it is called.
        note: what was set that is not its default, beside population and steps.
    """

    package: str
    variant: str
    run: Runner
    note: str = ""

    @property
    def name(self) -> str:
        """Package and variant."""
        return f"{self.package} {self.variant}"

    def prepare(self, dimensions: int, max_evals: int, population: int) -> None:
        """Import it and count what its steps cost, which the first solve would do else."""
        _steps(self.run, dimensions, max_evals, population)

    def solve(
        self,
        objective: Objective,
        low: Array,
        high: Array,
        max_evals: int,
        population: int,
        seed: int,
    ) -> Answer:
        """Run it once.

        Raises:
            ModuleNotFoundError: the library is not installed.
        """
        counted = Counted(objective, low, high, max_evals)
        steps = _steps(self.run, len(low), max_evals, population)
        _stopped(self.run, counted, population, steps, seed)
        return Answer(counted.x_best, counted.f_best, counted.evaluations)


@cache
def _steps(run: Runner, dimensions: int, max_evals: int, population: int) -> int:
    """How many steps spend the budget: what the first few cost tells."""
    few, edge = 4, np.ones(dimensions)
    probe = Counted(lambda x: (x**2).sum(axis=1), -edge, edge, max_evals)
    _stopped(run, probe, population, few, 0)
    if probe.over:
        return few
    each = (probe.evaluations - population) / few
    return int(np.ceil((max_evals - population) / each))


def _stopped(run: Runner, counted: Counted, population: int, steps: int, seed: int) -> None:
    with _global_seed(seed):
        try:
            run(counted, population, steps, seed)
        except Exception:
            # some libraries wrap what an objective raises
            if not counted.over:
                raise


@contextmanager
def _global_seed(seed: int) -> Iterator[None]:
    """NumPy's global stream, which some peers draw from, seeded for a while."""
    before = np.random.get_state()
    np.random.seed(seed % 2**32)
    try:
        yield
    finally:
        np.random.set_state(before)


# ---------------------------------------------------------------------------- one library each
def _mealpy(
    module: str,
    kind: str,
    counted: Counted,
    population: int,
    steps: int,
    seed: int,
    **settings: Any,
) -> None:
    import mealpy

    model = getattr(getattr(mealpy, module), kind)(epoch=steps, pop_size=population, **settings)
    bounds = mealpy.FloatVar(lb=tuple(counted.low), ub=tuple(counted.high))
    model.solve(
        {"obj_func": counted.one, "bounds": bounds, "minmax": "min", "log_to": None}, seed=seed
    )


def _pymoo(
    module: str,
    kind: str,
    counted: Counted,
    population: int,
    steps: int,
    seed: int,
    **settings: Any,
) -> None:
    from importlib import import_module

    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Box(Problem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(n_var=len(counted.low), n_obj=1, xl=counted.low, xu=counted.high)

        def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
            out["F"] = counted.many(x)[:, None]

    made = getattr(import_module(f"pymoo.algorithms.soo.nonconvex.{module}"), kind)
    minimize(Box(), made(pop_size=population, **settings), ("n_gen", steps + 1), seed=seed)


class _Pagmo:
    """A pagmo problem."""

    def __init__(self, counted: Counted) -> None:
        self._counted = counted

    def fitness(self, x: Array) -> list[float]:
        return [self._counted.one(x)]

    def batch_fitness(self, x: Array) -> Array:
        return self._counted.many(x.reshape(-1, len(self._counted.low)))

    def get_bounds(self) -> tuple[Array, Array]:
        return self._counted.low, self._counted.high


def _pygmo(
    kind: str, counted: Counted, population: int, steps: int, seed: int, **settings: Any
) -> None:
    import pygmo

    method = getattr(pygmo, kind)(gen=steps, seed=seed, **settings)
    if hasattr(method, "set_bfe"):
        method.set_bfe(pygmo.bfe(pygmo.member_bfe()))
    batch = pygmo.bfe(pygmo.member_bfe())
    first = pygmo.population(pygmo.problem(_Pagmo(counted)), population, b=batch, seed=seed)
    pygmo.algorithm(method).evolve(first)


@contextmanager
def _no_report() -> Iterator[None]:
    """Pyswarms sets up logging for the whole process and leaves a report.log, if nobody tells it.

    It does so when it is imported, too.
    """
    with NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write("{version: 1, incremental: true}")
        file.flush()
        before = os.environ.get("LOG_CFG")
        os.environ["LOG_CFG"] = file.name
        try:
            yield
        finally:
            del os.environ["LOG_CFG"]
            if before is not None:
                os.environ["LOG_CFG"] = before


@_no_report()
def _pyswarms(
    kind: str, counted: Counted, population: int, steps: int, seed: int, **settings: Any
) -> None:
    from pyswarms import single

    swarm = getattr(single, kind)(
        n_particles=population,
        dimensions=len(counted.low),
        bounds=(counted.low, counted.high),
        **settings,
    )
    swarm.optimize(counted.many, iters=steps + 1, verbose=False)


def _scipy(
    strategy: str, counted: Counted, population: int, steps: int, seed: int, **settings: Any
) -> None:
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    # its own first population, but of this size: it takes multiples of D only
    first = qmc.LatinHypercube(len(counted.low), rng=seed).random(population)
    differential_evolution(
        lambda x: counted.many(x.T),
        list(zip(counted.low, counted.high, strict=True)),
        strategy=strategy,
        maxiter=steps,
        init=counted.low + first * (counted.high - counted.low),
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=seed,
        **settings,
    )


def _cma(
    name: str, counted: Counted, population: int, steps: int, seed: int, *, restarts: bool
) -> None:
    import cma

    low, span = counted.low, counted.high - counted.low
    rng = np.random.default_rng(seed)
    size = 4 + int(3 * np.log(len(low))) if restarts else population
    while counted.evaluations < (steps + 1) * population:
        options = {"bounds": [0.0, 1.0], "verbose": -9, "popsize": size}
        options["seed"] = int(rng.integers(1, 2**31))
        search = cma.CMAEvolutionStrategy(rng.random(len(low)), 0.3, options)
        while not search.stop() and counted.evaluations < (steps + 1) * population:
            points = search.ask()
            search.tell(points, counted.many(low + np.array(points) * span).tolist())
        size *= 2 if restarts else 1


# ---------------------------------------------------------------------------- which of them
def _of(
    package: str, run: Callable[..., None], *names: str, note: str = "", **settings: Any
) -> Peer:
    told = [f"{key}={value}" for key, value in settings.items() if key not in NEVER]
    variant = " ".join([names[-1], *told])
    return Peer(package, variant, partial(run, *names, **settings), note)


NEVER = {"ftol": 0.0, "xtol": 0.0}
_mealpy_ = partial(_of, "mealpy", _mealpy)
_pymoo_ = partial(_of, "pymoo", _pymoo)
_pygmo_ = partial(_of, "pygmo", _pygmo)
_pygmo_de = partial(_pygmo_, **NEVER, note="ftol and xtol 0: it spends the budget")
_pyswarms_ = partial(_of, "pyswarms", _pyswarms)
_scipy_ = partial(_of, "scipy", _scipy, note="vectorized, no polish, tol 0: it spends the budget")
_cma_ = partial(_of, "cma", _cma)

DOCUMENTED = {"c1": 0.5, "c2": 0.3, "w": 0.9}
CONSTRICTED = {"c1": 1.49618, "c2": 1.49618, "w": 0.7298}

PEERS: dict[str, tuple[Peer, ...]] = {
    "pso": (
        *(_mealpy_("PSO", kind) for kind in ("OriginalPSO", "LDW_PSO", "AIW_PSO", "P_PSO")),
        *(_mealpy_("PSO", kind) for kind in ("HPSO_TVAC", "C_PSO", "CL_PSO")),
        _pymoo_("pso", "PSO"),
        _pymoo_("pso", "PSO", adaptive=False),
        _pygmo_("pso"),
        *(_pygmo_("pso_gen", neighb_type=ring) for ring in (1, 2, 3)),
        _pygmo_("pso_gen", variant=3, neighb_type=3, omega=0.7),
        _pyswarms_("GlobalBestPSO", options=DOCUMENTED, note="no defaults: its documents' example"),
        _pyswarms_("GlobalBestPSO", options=CONSTRICTED, note="Clerc's constriction"),
        _pyswarms_("LocalBestPSO", options=CONSTRICTED | {"k": 5, "p": 2}),
    ),
    "ga": (
        *(
            _mealpy_("GA", kind)
            for kind in ("BaseGA", "SingleGA", "MultiGA", "EliteSingleGA", "EliteMultiGA")
        ),
        _mealpy_("GA", "EliteSingleGA", mutation="flip"),
        _pymoo_("ga", "GA"),
        _pygmo_("sga"),
        _pygmo_("sga", crossover="sbx", eta_c=2.0, m=0.17, mutation="gaussian", param_m=0.02),
    ),
    "gwo": (
        *(_mealpy_("GWO", kind) for kind in ("OriginalGWO", "RW_GWO", "IGWO", "GWO_WOA")),
        _pygmo_("gwo"),
    ),
    "tlbo": tuple(_mealpy_("TLO", kind) for kind in ("OriginalTLO", "ImprovedTLO", "DevTLO")),
    "bees": tuple(
        _mealpy_("BeesA", kind) for kind in ("OriginalBeesA", "ProbBeesA", "CleverBookBeesA")
    ),
    "abc": (_mealpy_("ABC", "OriginalABC"), _pygmo_("bee_colony")),
    "firefly": (_mealpy_("FFA", "OriginalFFA"),),
    "bbo": tuple(_mealpy_("BBO", kind) for kind in ("OriginalBBO", "DevBBO")),
    "de": (
        *(_scipy_(s) for s in ("best1bin", "rand1bin", "randtobest1bin", "currenttobest1bin")),
        _pymoo_("de", "DE"),
        *(_pymoo_("de", "DE", variant=f"DE/{base}/1/bin", CR=0.9) for base in ("rand", "best")),
        *(_pygmo_de("de", variant=kind) for kind in (2, 1, 6, 8)),
        *(_pygmo_de("sade", variant_adptv=kind) for kind in (1, 2)),
        _pygmo_de("sade", variant=6),
        *(_pygmo_de("de1220", variant_adptv=kind) for kind in (1, 2)),
        *(_mealpy_("DE", kind) for kind in ("OriginalDE", "JADE", "SADE", "SAP_DE")),
        *(_mealpy_("SHADE", kind) for kind in ("OriginalSHADE", "L_SHADE")),
    ),
    "cma": (
        _cma_("CMA-ES", restarts=False),
        _cma_("CMA-ES", restarts=True, note="its own population, doubled at every restart"),
    ),
}
"""Short name of a method: the peers that have it. No peer has ``cibo``.

Rows with settings are not defaults. Those of pygmo were picked from a screen of 24 settings of
pso_gen, 10 of de, 12 of sade and 8 of sga on the first 20 to 60 of the section's own targets, with
other seeds: they flatter the peer a little, never ours.
"""

"""The methods that are compared, under one budget of evaluations a pose."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kinverse.solvers import Solver

__all__ = ["ALONE", "BUDGET", "CALLS", "FAMILIES", "METHODS", "NETWORK", "TOLERANCE", "Method"]

BUDGET = 20_000
"""Evaluations of forward kinematics a pose, at most."""
POLISHED = 2_000
"""Of them, those of one search that descents follow ..."""
SEARCHES = 7
"""... and how often that may be done: the rest of the budget is for the descents."""
STEPS = {"lm": 60, "newton_raphson": 200, "gauss_newton": 200, "damped_least_squares": 200}
"""Of one start, as ``Numerical`` has them by default; as many starts as the budget pays for."""
TOLERANCE = 1e-6
"""Largest error of an answer [m], and [rad] where the task is a pose; the same for all."""

Make = Callable[[str, int, bool], Solver]


@dataclass(frozen=True)
class Method:
    """A way to solve, and how it is made.

    Args:
        name: as it stands in tables and pictures.
        family: "analytic", "numerical", "learned", "swarm" or "swarm and descent".
        make: task, seed of what it learns, quick -> a solver that is not fitted.
        call: the same for a reader, without what is left as it is.
        tasks: those it is run on.
    """

    name: str
    family: str
    make: Make
    call: str
    tasks: tuple[str, ...] = ("pose", "position")


def _analytic(task: str, seed: int, quick: bool) -> Solver:
    from kinverse.solvers.analytic import Analytic

    return Analytic(task=task)


def _numerical(method: str) -> Make:
    def make(task: str, seed: int, quick: bool) -> Solver:
        from kinverse.solvers.numerical import Numerical

        steps = STEPS[method]
        starts = BUDGET // (steps + 1)
        return Numerical(task=task, method=method, max_iterations=steps, max_starts=starts)

    return make


def _learned(task: str, seed: int, quick: bool) -> Solver:
    from kinverse.networks import MLP
    from kinverse.solvers.learned import Learned

    return Learned(
        MLP((20,), max_iter=10) if quick else None,
        n_samples=400 if quick else 5000,
        features="xyz+matrix" if task == "pose" else "xyz",
        random_state=seed,
        task=task,
    )


def _fusion(task: str, seed: int, quick: bool) -> Solver:
    from kinverse.networks import RBFNetwork
    from kinverse.solvers.fusion import Fusion

    given: dict[str, Any] = {
        "fallback": None,
        "random_state": seed,
        "tol_position": TOLERANCE,
        "tol_rotation": TOLERANCE,
    }
    if quick:
        return Fusion(RBFNetwork(20), n_poses=30, **given)
    return Fusion(**given)


def _swarm(optimizer: str, polish: bool = False) -> Make:
    def make(task: str, seed: int, quick: bool) -> Solver:
        from kinverse.solvers.swarm import Swarm

        if not polish:
            return Swarm(optimizer=optimizer, polish=False, max_evals=BUDGET, task=task)
        return Swarm(optimizer=optimizer, max_evals=POLISHED, max_searches=SEARCHES, task=task)

    return make


NETWORK = "network alone"
"""What ``Learned`` predicts, neither refined nor verified: judged beside it."""

ALONE = ("ga", "pso", "gwo", "tlbo", "cibo", "bees", "abc", "de", "bbo", "firefly")

METHODS = (
    Method("Analytic", "analytic", _analytic, "kv.Analytic()"),
    Method("Numerical", "numerical", _numerical("lm"), "kv.Numerical()"),
    *(
        Method(name, "numerical", _numerical(name), f'kv.Numerical(method="{name}")')
        for name in list(STEPS)[1:]
    ),
    Method("Learned", "learned", _learned, "kv.Learned()"),
    Method("Fusion loop", "learned", _fusion, "kv.Fusion(fallback=None)", ("pose",)),
    *(
        Method(name, "swarm", _swarm(name), f'kv.Swarm(optimizer="{name}", polish=False)')
        for name in ALONE
    ),
    *(
        Method(
            f"{name} + descent",
            "swarm and descent",
            _swarm(name, polish=True),
            f'kv.Swarm(optimizer="{name}")',
        )
        for name in ("pso", "bees")
    ),
)

CALLS = {method.name: method.call for method in METHODS} | {NETWORK: "kv.Learned().predict"}
"""How to call what a table names."""

FAMILIES = tuple(dict.fromkeys(method.family for method in METHODS))

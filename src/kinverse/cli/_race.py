"""Time solvers on the same random reachable poses."""

import statistics
import time
from typing import TYPE_CHECKING, Any

import kinverse as kv
from kinverse.solvers import make_solver, solver_names

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["race"]

SINGLE = 200
"""Poses that are also solved one by one, for the time of one pose."""


def race(
    robot: "Robot", poses: int, solvers: list[str], task: str, rng: int
) -> list[dict[str, Any]]:
    """One record for each solver.

    Args:
        robot: the arm.
        poses: how many targets; they come from joint values drawn inside the limits.
        solvers: names; empty: one of each kind, and those that do not fit are noted; ["all"]: the
            whole registry.
        task: the part of the pose that must hold.
        rng: seed of the targets; no solver draws from it.
    """
    import numpy as np

    T = robot.fk(robot.random(poses, np.random.default_rng(rng)))
    kinds = [name for name in solver_names() if ":" not in name]
    named = bool(solvers) and solvers != ["all"]
    chosen = solvers if named else [name for name in solver_names() if name != "swarm"]
    return [_time(robot, T, name, task, named) for name in (chosen if solvers else kinds)]


def _time(robot: "Robot", T: Any, name: str, task: str, must_fit: bool) -> dict[str, Any]:
    row: dict[str, Any] = {"solver": name, "note": ""}
    try:
        solver = make_solver(name, robot, task).fit(robot)
    except (kv.NoClosedForm, kv.MissingExtra) as error:
        if must_fit:
            raise
        return row | {"note": type(error).__name__}
    solver.solve(T[:1])
    start = time.perf_counter()
    s = solver.solve(T)
    batch = time.perf_counter() - start
    singles = []
    for one in T[:SINGLE]:
        start = time.perf_counter()
        _ = solver.solve(one).q
        singles.append(time.perf_counter() - start)
    return row | {
        "solved": 100.0 * float(s.ok.mean()),
        "branches": float(s.count.mean()),
        "worst_position_error": float(s.position_error.max(initial=0.0)),
        "worst_rotation_error": float(s.rotation_error.max(initial=0.0)),
        "one_us": 1e6 * statistics.median(singles),
        "batch_us": 1e6 * batch / len(T),
    }

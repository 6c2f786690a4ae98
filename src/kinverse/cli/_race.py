"""Time solvers on the same random reachable poses."""

import statistics
import time
from typing import TYPE_CHECKING, Any

import kinverse as kv
from kinverse.solvers import make_solver, solver_names

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["chosen", "race", "targets"]

SINGLE = 200
"""Poses that are also solved one by one, for the time of one pose."""


def race(
    robot: "Robot", poses: int, solvers: list[str], task: str, rng: int, alone: bool = False
) -> list[dict[str, Any]]:
    """One record for each solver.

    Args:
        robot: the arm.
        poses: how many targets; they come from joint values drawn inside the limits.
        solvers: names; see ``chosen``. Those that do not fit are noted if they were not named.
        task: the part of the pose that must hold.
        rng: seed of the targets; no solver draws from it.
        alone: swarm solvers do without polish.
    """
    T = targets(robot, poses, rng)
    named = bool(solvers) and solvers != ["all"]
    return [_time(robot, T, name, task, named, alone) for name in chosen(solvers)]


def targets(robot: "Robot", poses: int, rng: int) -> Any:
    """(N, 4, 4) poses of joint values drawn inside the limits."""
    import numpy as np

    return robot.fk(robot.random(poses, np.random.default_rng(rng)))


def chosen(solvers: list[str]) -> list[str]:
    """The names given; of none one of each kind, of ["all"] the whole registry."""
    if not solvers:
        return [name for name in solver_names() if ":" not in name]
    # "swarm" is one of the named ones
    return [name for name in solver_names() if name != "swarm"] if solvers == ["all"] else solvers


def _time(
    robot: "Robot", T: Any, name: str, task: str, must_fit: bool, alone: bool
) -> dict[str, Any]:
    row: dict[str, Any] = {"solver": name, "note": ""}
    try:
        made = make_solver(name, robot, task)
        if alone and name.startswith("swarm"):
            made.set_params(polish=False)
        solver = made.fit(robot)
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

"""The one verb."""

from threading import Lock

from numpy.typing import ArrayLike

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solutions import Solutions
from kinverse.solvers._base import Rng, Solver
from kinverse.solvers.registry import make_solver
from kinverse.task import as_task

__all__ = ["solve"]

CACHE_SIZE = 32
"""Fitted solvers kept for repeated calls; the oldest goes first, and its robot with it."""

_fitted: dict[tuple[int, str, str], Solver] = {}
_lock = Lock()


def solve(
    robot: Robot,
    T: ArrayLike,
    solver: str | Solver = "auto",
    task: str | None = None,
    q_seed: ArrayLike | None = None,
    rng: Rng = None,
) -> Solutions:
    """Every verified solution of every pose.

    Args:
        robot: from ``kv.load`` or ``kv.Robot.from_dh``.
        T: (4, 4) or (N, 4, 4) poses of the tool in the base frame [m]; also an object with
            ``as_matrix()`` or ``.A``.
        solver: a name ("auto", "analytic", "numerical": fitted once for a robot and kept) or a
            solver object: cloned and fitted at each call (fit it yourself for many calls), but
            one that is trained for this robot answers as it is.
        task: "pose" (also if None), "position", "position_axis", "planar" or "schoenflies"; a
            solver object brings its own.
        q_seed: (n,) or (N, n) joint values [rad or m] to be near to.
        rng: None (a fixed seed), an int >= 0 or a numpy Generator.

    Returns:
        ``Solutions``, of length 1 or N.

    Raises:
        InputError: an argument that cannot be used, a task beside a solver object, or a solver
            that is trained for another robot.
        NoClosedForm: "analytic" knows no family for this robot.
        TypeError: complex, object or text arrays.

    Example:
        >>> robot = kv.load("kr16")
        >>> kv.solve(robot, kv.pose([0.9, 0.3, 1.1], rpy=[0.2, 1.7, 0.3])).q
    """
    if isinstance(solver, str):
        name = "pose" if task is None else task
        if not isinstance(name, str):
            as_task(name)  # says what the tasks are
        # the robot's id is safe as a key: the entry keeps the robot alive
        fitted = _fitted.get((id(robot), solver, name))
        if fitted is None:
            fitted = _fit(robot, solver, name)
        return fitted.solve(T, q_seed, rng)
    if not isinstance(solver, Solver):
        hint = ", a class: write its name with ()" if isinstance(solver, type) else ""
        raise InputError(f"solver must be a name or a solver object, got {solver!r}{hint}")
    if task is not None:
        raise InputError("task belongs to the solver object: set it there, not in solve")
    return solver._ready(robot).solve(T, q_seed, rng)


def _fit(robot: Robot, solver: str, task: str) -> Solver:
    if not isinstance(robot, Robot):
        raise InputError(
            f"robot must be a kinverse.Robot (see kinverse.load), got {type(robot).__name__}"
        )
    fitted = make_solver(solver, robot, task).fit(robot)
    with _lock:
        while len(_fitted) >= CACHE_SIZE:
            del _fitted[next(iter(_fitted))]
        _fitted[id(robot), solver, task] = fitted
    return fitted

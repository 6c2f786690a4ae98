"""Descent from given joint values to the solution they lead to, nothing else tried."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.solvers._base import Settings
from kinverse.solvers.numerical import Numerical

__all__ = ["Descended", "Descent", "apart"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SHARPER = 1e-4
"""Tolerances of the last step in the caller's: two descents to one solution then agree."""


class Descended(NamedTuple):
    """Where descents from K starts ended."""

    q: Array  # (K, n)
    found: NDArray[np.bool_]  # (K,) whether it solves
    evaluations: Ints  # (K,)
    iterations: Ints  # (K,) of the descent, without those to the last digits


class Descent:
    """One descent from each start.

    Args:
        robot: whose joints they are.
        settings: task, tolerances and limits.
        method: of ``Numerical``: "lm" (limits held in every step) or "newton_raphson" (limits not
            looked at).
    """

    def __init__(self, robot: Robot, settings: Settings, method: str = "lm") -> None:
        self._descent = _numerical(settings, method, 1.0).fit(robot)
        self._last = _numerical(settings, method, SHARPER).fit(robot)

    def each(self, T: Array, starts: Array) -> Descended:
        """From starts (K, n) towards poses T (K, 4, 4)."""
        q, found, evaluations, iterations = _refined(self._descent, T, starts)
        done = np.flatnonzero(found)
        if len(done):
            # from a solution to its last digits; what rounding forbids keeps the solution
            sharp, better, more, _ = _refined(self._last, T[done], q[done])
            q[done[better]] = sharp[better]
            evaluations[done] += more
        return Descended(q, found, evaluations, iterations)


def apart(q: Array, other: Array, turns: NDArray[np.bool_], distance: float) -> NDArray[np.bool_]:
    """Whether a joint of q (..., n) is off by more than ``distance``, whole turns taken off."""
    # NaN is apart from everything
    return np.asarray(~(moved(q, other, turns) <= distance))


def moved(q: Array, other: Array, turns: NDArray[np.bool_]) -> Array:
    """Largest joint distance of q (..., n) from another [rad or m], whole turns taken off."""
    gap = q - other
    gap = np.where(turns, gap - 2.0 * np.pi * np.rint(gap / (2.0 * np.pi)), gap)
    return np.asarray(np.abs(gap).max(axis=-1))


def _numerical(settings: Settings, method: str, sharper: float) -> Numerical:
    return Numerical(
        task=settings.task,
        method=method,
        limits=settings.limits if method == "lm" else "ignore",
        tol_position=sharper * settings.tol_position,
        tol_rotation=sharper * settings.tol_rotation,
    )


def _refined(solver: Numerical, T: Array, starts: Array) -> tuple[Array, Any, Any, Any]:
    q, found, evaluations, iterations, *_ = solver._native.refine(
        np.ascontiguousarray(T), np.ascontiguousarray(starts)
    )
    return q, found.astype(np.bool_), evaluations, iterations

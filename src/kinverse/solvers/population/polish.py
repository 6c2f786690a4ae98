"""Descent from the members of a population: what turns a near miss into a solution."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.solvers._base import Settings
from kinverse.solvers.numerical import Numerical

__all__ = ["Polish", "Polished", "apart", "distinct"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

APART = 0.05
"""A start this near [largest joint, rad or m] to one that failed is taken to lead there too."""

SHARPER = 1e-4
"""Tolerances of the last step in the caller's: two descents to one solution then agree."""


class Polished(NamedTuple):
    """What descents found of N poses."""

    q: Array  # (N, n) the solution, or the best start where there is none
    found: NDArray[np.bool_]  # (N,)
    polishes: Ints  # (N,) descents made
    evaluations: Ints  # (N,)
    iterations: Ints  # (N,) of the last descent


class Polish:
    """Levenberg-Marquardt from given starts, one after another, no others.

    Args:
        robot: whose joints they are.
        settings: task, tolerances and limits.
    """

    def __init__(self, robot: Robot, settings: Settings) -> None:
        self._turns = turning(robot)
        self._descent = _numerical(settings, 1.0).fit(robot)
        self._last = _numerical(settings, SHARPER).fit(robot)

    def first_of_each(self, T: Array, members: Array, cost: Array) -> Polished:
        """For each pose the first member, in order of cost, that leads to a solution.

        A member next to one that failed is passed over.

        Args:
            T: (N, 4, 4) poses.
            members: (N, K, n) starts.
            cost: (N, K) their order; infinite ones are not tried.
        """
        poses = len(T)
        order = np.argsort(cost, axis=1, kind="stable")
        out = Polished(
            np.take_along_axis(members, order[:, :1, None], axis=1)[:, 0].copy(),
            np.zeros(poses, np.bool_),
            np.zeros(poses, np.int64),
            np.zeros(poses, np.int64),
            np.full(poses, -1),
        )
        open_ = np.arange(poses)
        rank = np.where(np.isfinite(cost), cost, np.inf)
        while len(open_):
            pick = rank.argmin(axis=1)
            left = np.isfinite(rank[np.arange(len(open_)), pick])
            open_, rank, pick = open_[left], rank[left], pick[left]
            if not len(open_):
                break
            starts = members[open_, pick]
            q, found, evaluations, iterations = self.each(T[open_], starts)
            out.polishes[open_] += 1
            out.evaluations[open_] += evaluations
            out.iterations[open_] = iterations
            out.q[open_[found]] = q[found]
            out.found[open_[found]] = True
            open_, rank, starts = open_[~found], rank[~found], starts[~found]
            near = ~apart(members[open_], starts[:, None], self._turns, APART)
            rank = np.where(near, np.inf, rank)
        return out

    def each(self, T: Array, starts: Array) -> tuple[Array, NDArray[np.bool_], Ints, Ints]:
        """One descent from each start (K, n): q, whether it solves, evaluations, iterations."""
        q, found, evaluations, iterations = _refined(self._descent, T, starts)
        done = np.flatnonzero(found)
        if len(done):
            # from a solution to its last digits; what rounding forbids keeps the solution
            sharp, better, more, _ = _refined(self._last, T[done], q[done])
            q[done[better]] = sharp[better]
            evaluations[done] += more
        return q, found, evaluations, iterations


def distinct(q: Array, within: float, turns: NDArray[np.bool_]) -> Ints:
    """Rows of q (K, n), each further than ``within`` from those kept before it."""
    kept: list[int] = []
    for k, row in enumerate(q):
        if not kept or apart(q[kept], row, turns, within).all():
            kept.append(k)
    return np.array(kept, dtype=np.int64)


def apart(q: Array, other: Array, turns: NDArray[np.bool_], distance: float) -> NDArray[np.bool_]:
    """Whether a joint of q (..., n) is off by more than ``distance``, whole turns taken off."""
    gap = q - other
    gap = np.where(turns, gap - 2.0 * np.pi * np.rint(gap / (2.0 * np.pi)), gap)
    # NaN is apart from everything
    return np.asarray(~(np.abs(gap).max(axis=-1) <= distance))


def _numerical(settings: Settings, sharper: float) -> Numerical:
    return Numerical(
        task=settings.task,
        limits=settings.limits,
        tol_position=sharper * settings.tol_position,
        tol_rotation=sharper * settings.tol_rotation,
    )


def _refined(solver: Numerical, T: Array, starts: Array) -> tuple[Array, Any, Any, Any]:
    q, found, evaluations, iterations, *_ = solver._native.refine(
        np.ascontiguousarray(T), np.ascontiguousarray(starts)
    )
    return q, found.astype(np.bool_), evaluations, iterations

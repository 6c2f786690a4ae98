"""Descent from the members of a population: what turns a near miss into a solution."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.solvers._base import Settings
from kinverse.solvers.descent import Descent, apart

__all__ = ["Polish", "Polished", "distinct"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

APART = 0.05
"""A start this near [largest joint, rad or m] to one that failed is taken to lead there too."""


class Polished(NamedTuple):
    """What descents found of N poses."""

    q: Array  # (N, n) the solution, or the best start where there is none
    found: NDArray[np.bool_]  # (N,)
    polishes: Ints  # (N,) descents made
    evaluations: Ints  # (N,)
    iterations: Ints  # (N,) of the last descent


class Polish(Descent):
    """Levenberg-Marquardt from given starts, one after another, no others.

    Args:
        robot: whose joints they are.
        settings: task, tolerances and limits.
    """

    def __init__(self, robot: Robot, settings: Settings) -> None:
        super().__init__(robot, settings)
        self._turns = turning(robot)

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


def distinct(q: Array, within: float, turns: NDArray[np.bool_]) -> Ints:
    """Rows of q (K, n), each further than ``within`` from those kept before it."""
    kept: list[int] = []
    for k, row in enumerate(q):
        if not kept or apart(q[kept], row, turns, within).all():
            kept.append(k)
    return np.array(kept, dtype=np.int64)

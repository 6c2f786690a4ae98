"""Descents from several starts for each pose and branch, until each branch has its own solution."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.solvers.descent import Descent

__all__ = ["Found", "Rounds"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Starts = Callable[[int, Ints, int], Array]
"""(branch, poses (K,), k) -> start number k of these poses (K, n)."""


class Found(NamedTuple):
    """What was found for N poses and B branches."""

    q: Array  # (N, B, n) the final solution, else another, else where the first descent ended
    solved: Flags  # (N, B) whether q solves
    final: Flags  # (N, B) whether it is final
    starts: Ints  # (N, B) descents made
    evaluations: Ints  # (N,)
    iterations: Ints  # (N, B) of the last descent


class Rounds:
    """Round after round every branch that has no final solution takes its next start.

    A solution counts for the branch it lies on: one that a descent strayed to is not lost.

    Args:
        descent: how one start is followed.
        branch_of: q (K, n) -> the branch each lies on; None: there is one only.
        is_final: q (K, n) -> whether a solution ends the search of its branch.
    """

    def __init__(
        self,
        descent: Descent,
        branch_of: Callable[[Array], Ints] | None,
        is_final: Callable[[Array], Flags],
    ) -> None:
        self._descent, self._branch_of, self._is_final = descent, branch_of, is_final

    def solve(self, T: Array, branches: int, dof: int, starts: Starts, most: int) -> Found:
        """Solutions of poses T (N, 4, 4) on branches 0..B-1 from at most so many starts each."""
        N = len(T)
        found = Found(
            np.full((N, branches, dof), np.nan),
            np.zeros((N, branches), np.bool_),
            np.zeros((N, branches), np.bool_),
            np.zeros((N, branches), np.int64),
            np.zeros(N, np.int64),
            np.full((N, branches), -1),
        )
        for k in range(most):
            open_ = ~found.final
            if not open_.any():
                break
            for branch in range(branches):
                poses = np.flatnonzero(open_[:, branch])
                if len(poses):
                    self._follow(found, T, branch, poses, starts(branch, poses, k))
        return found

    def _follow(self, found: Found, T: Array, branch: int, poses: Ints, start: Array) -> None:
        """One descent for each of some poses, and whose branch it ended on."""
        q, solves, evaluations, iterations = self._descent.each(T[poses], start)
        found.evaluations[poses] += evaluations
        found.starts[poses, branch] += 1
        found.iterations[poses, branch] = iterations
        first = found.starts[poses, branch] == 1
        untouched = poses[first & ~found.solved[poses, branch]]
        found.q[untouched, branch] = q[np.searchsorted(poses, untouched)]
        good = np.flatnonzero(solves)
        q, poses = q[good], poses[good]
        numbers = np.full(len(q), branch) if self._branch_of is None else self._branch_of(q)
        final = self._is_final(q)
        # better than what the branch has: a first solution, or the first that is final
        own = numbers >= 0
        own &= ~found.final[poses, numbers] & (final | ~found.solved[poses, numbers])
        found.q[poses[own], numbers[own]] = q[own]
        found.solved[poses[own], numbers[own]] = True
        found.final[poses[own], numbers[own]] = final[own]

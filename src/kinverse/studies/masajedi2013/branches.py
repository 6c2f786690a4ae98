"""The eight closed-form branches along a path of accuracy points."""

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.errors import InputError

__all__ = ["ROBOT", "branches_along", "largest_step"]

Array = NDArray[np.float64]
ROBOT = "kr16"


def branches_along(T: Array) -> tuple[Array, tuple[str, ...]]:
    """Every branch of the KR16 as a motion without jumps.

    Args:
        T: (N, 4, 4) poses in order, near enough to one another that a joint turns by less than
            half a turn between two.

    Returns:
        Joint values (8, N, 6) [rad], and the names of the branches.

    Raises:
        InputError: a branch is missing at some pose.
    """
    solver = kv.Analytic(limits="ignore").fit(kv.load(ROBOT))
    answers = solver.solve(T)
    lost = np.flatnonzero(answers.count != 8)
    if len(lost):
        raise InputError(f"pose {lost[0]} has {answers.count[lost[0]]} solutions, not 8")
    q = np.empty((8, len(T), 6))
    q[answers.branch, answers.pose_index] = answers.q
    return np.unwrap(q, axis=1), solver.branch_labels_


def largest_step(q: Array) -> float:
    """Between neighbours of (N, n), whole turns the same: the largest of any joint [rad]."""
    step = np.abs((np.diff(q, axis=0) + np.pi) % (2.0 * np.pi) - np.pi)
    return float(step.max())

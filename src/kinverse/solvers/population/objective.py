"""How far joint values are from a pose, as one number: document 004, chapter 6.4."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.task import Task

__all__ = ["NORMS", "ORIENTATION_ERRORS", "PoseObjective", "search_box"]

Array = NDArray[np.float64]
Secondary = str | Callable[[Array], Any] | None

NORMS = ("l2", "l1", "squared")
"""Of the position error, and of orientation errors that are vectors; the native core's order."""

ORIENTATION_ERRORS = ("quaternion", "rotation_vector", "euler")
"""Equation 6.34, and the vectors whose norm may take its place; the native core's order."""


class PoseObjective:
    """Costs of joint values against poses: position error + weight * orientation error + secondary.

    Args:
        robot: whose forward kinematics it is.
        task: what counts of the pose.
        norm: one of ``NORMS``.
        orientation_error: one of ``ORIENTATION_ERRORS``.
        secondary: None, "least_motion" (distance from q_seed) or a callable q (K, n) -> (K,).
        secondary_weight: its factor.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        norm: str,
        orientation_error: str,
        secondary: Secondary,
        secondary_weight: float,
    ) -> None:
        self._chain = robot.chain
        self._codes = (task.code, NORMS.index(norm), ORIENTATION_ERRORS.index(orientation_error))
        self._secondary = secondary
        self._factor = secondary_weight

    def __call__(self, T: Array, weight: Array, q_seed: Array | None, q: Array) -> Array:
        """(A, K) costs of q (A, K, n) against T (A, 4, 4) with weights (A,)."""
        cost: Array = self._chain.pose_costs(*self._codes, T, weight, q)
        if callable(self._secondary):
            more = np.asarray(self._secondary(q.reshape(-1, q.shape[2])), dtype=np.float64)
            if more.shape != (cost.size,):
                raise InputError(
                    f"secondary must return ({cost.size},) for q of {q.shape[2]} joints,"
                    f" got {more.shape}"
                )
            cost += self._factor * more.reshape(cost.shape)
        elif self._secondary is not None and q_seed is not None:
            cost += self._factor * np.sqrt(((q - q_seed[:, None]) ** 2).sum(axis=2))
        return cost


def search_box(robot: Robot, limits: str) -> Array:
    """(n, 2) where joint values are looked for: the limits, at most one turn of a turning joint.

    Where limits are ignored a turning joint is looked for anywhere in a turn; a slide stays inside
    its limits, since a search needs a box.
    """
    box = np.array(robot.limits)
    turns = turning(robot)
    middle = 0.5 * box.sum(axis=1)
    wide = turns & ((box[:, 1] - box[:, 0] > 2.0 * np.pi) | (limits == "ignore"))
    box[wide] = middle[wide, None] + np.array([-np.pi, np.pi])
    # a joint that cannot move is searched in a sliver; verification moves it back
    stuck = box[:, 0] >= box[:, 1]
    box[stuck] += np.array([-1e-9, 1e-9])
    return box

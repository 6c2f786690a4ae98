"""How far joint values are from a pose, as one number: document 004, chapter 6.4."""

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import real_array
from kinverse.ranking import rewound, turning
from kinverse.robot import Robot
from kinverse.task import Task

logger = logging.getLogger(__name__)

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
        limits: "hold" or "ignore": which whole turns lead to q_seed.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        norm: str,
        orientation_error: str,
        secondary: Secondary,
        secondary_weight: float,
        limits: str = "hold",
    ) -> None:
        self._robot, self._limits = robot, limits
        self._chain = robot.chain
        self._codes = (task.code, NORMS.index(norm), ORIENTATION_ERRORS.index(orientation_error))
        self._secondary = secondary
        self._factor = secondary_weight

    def __call__(self, T: Array, weight: Array, q_seed: Array | None, q: Array) -> Array:
        """(A, K) costs of q (A, K, n) against T (A, 4, 4) with weights (A,)."""
        cost: Array = self._chain.pose_costs(*self._codes, T, weight, q)
        if callable(self._secondary):
            cost += self._factor * self._called(self._secondary, q)
        elif self._secondary is not None and q_seed is not None:
            near = q_seed[:, None]
            moved = rewound(self._robot, q, near, self._limits) - near
            cost += self._factor * np.sqrt((moved**2).sum(axis=2))
        return cost

    def _called(self, secondary: Callable[[Array], Any], q: Array) -> Array:
        """The caller's own objective (A, K), which is handed a copy and must give real numbers."""
        count = q.shape[0] * q.shape[1]
        values = real_array("secondary", secondary(q.reshape(count, -1).copy()))
        if values.shape != (count,):
            raise InputError(
                f"secondary must return ({count},) for q of {q.shape[2]} joints, got {values.shape}"
            )
        bad = int((~(values > -np.inf)).sum())
        if bad:
            logger.warning("secondary gave %d of %d values NaN or -inf: they are worst", bad, count)
        return values.reshape(q.shape[:2])


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

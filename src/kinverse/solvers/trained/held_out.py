"""Predictions beside examples that the networks have not seen."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.solvers.trained.expert import wrapped
from kinverse.solvers.trained.joint_targets import joint_targets
from kinverse.task import as_task

__all__ = ["HeldOut", "held_out", "task_errors"]

Array = NDArray[np.float64]


class HeldOut(NamedTuple):
    """K examples, those of a network one after another."""

    network: NDArray[np.int64]  # (K,) which network was asked
    T: Array  # (K, 4, 4)
    q: Array  # (K, n) joint values that reach T [rad or m]
    predicted: Array  # (K, n) circular joints by the whole turn that is nearest to q
    position_error: Array  # (K,) of the prediction by forward kinematics [m]
    rotation_error: Array  # (K,) as far as the task constrains rotations [rad]


def held_out(
    robot: Robot, task: str, network: int, q: Array, T: Array, predicted: Array
) -> HeldOut:
    """What one network predicts for poses T (K, 4, 4) of joint values q (K, n)."""
    position, rotation = task_errors(robot, task, predicted, T)
    near = q + wrapped(predicted - q, joint_targets(robot).circular)
    return HeldOut(np.full(len(q), network), T, q, near, position, rotation)


def task_errors(robot: Robot, task: str, q: Array, T: Array) -> tuple[Array, Array]:
    """Position errors [m] and rotation errors [rad], (K,) each, of joint values q (K, n)."""
    code, rows = as_task(task).code, np.ascontiguousarray(q[:, None])
    T = np.ascontiguousarray(T)
    # norms 0, 0: position error [m] + weight * rotation angle [rad]
    position = robot.chain.pose_costs(code, 0, 0, T, np.zeros(len(T)), rows)[:, 0]
    both = robot.chain.pose_costs(code, 0, 0, T, np.ones(len(T)), rows)[:, 0]
    return position, both - position

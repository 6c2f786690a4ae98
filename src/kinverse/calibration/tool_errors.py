"""The error of the real tool: what was measured minus what the forward kinematics say."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.robot import Robot

__all__ = ["tool_error"]

Array = NDArray[np.float64]


def tool_error(robot: Robot, q: ArrayLike, measured: ArrayLike) -> Array:
    """Errors of measured positions or poses against the robot's forward kinematics.

    Args:
        robot: the robot as it is said to be.
        q: (N, n) joint values [rad or m].
        measured: (N, 3) positions of the tool [m], or (N, 4, 4) poses, in the base frame.

    Returns:
        (N, 3) [m]; for poses (N, 6) with the rotation vector [rad] of R_measured R_computed^T
        behind it.

    Raises:
        TypeError: complex, object or text data.
        InputError: NaN or inf (the row is named), another shape, matrices that are not rigid.

    Example:
        >>> tool_error(robot, q, robot.fk(q)[:, :3, 3]).max()
        0.0
    """
    joints = se3.as_joints(q, robot.dof)
    if joints.ndim != 2:
        raise InputError(f"q must have shape (N, {robot.dof}), got {joints.shape}")
    values = se3.as_real(measured, "measured")
    T = robot.fk(joints)
    if values.ndim == 3:
        poses = se3.as_poses(values, "measured")
        _check_rows(poses, len(joints))
        turned = se3.rotation_log(poses[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2))
        return np.hstack([poses[:, :3, 3] - T[:, :3, 3], turned])
    points = se3.as_joints(values, 3, "measured")
    if points.ndim != 2:
        raise InputError(f"measured must have shape (N, 3) or (N, 4, 4), got {points.shape}")
    _check_rows(points, len(joints))
    error: Array = points - T[:, :3, 3]
    return error


def _check_rows(measured: Array, rows: int) -> None:
    if len(measured) != rows:
        raise InputError(f"{rows} rows of joint values need as many measured, got {len(measured)}")

"""Forward kinematics through other forms of a rigid transform than the matrix.

Checks of one another and material for comparisons; :meth:`kinverse.Robot.fk` is the fast one.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.dual_quaternion import DualQuaternion
from kinverse.geometry import axis_lines
from kinverse.pairs import QuaternionPair
from kinverse.robot import Robot
from kinverse.screw import screw_exp, screw_of_axis

__all__ = ["fk_dual_quaternions", "fk_exponentials", "fk_pairs"]

Array = NDArray[np.float64]


def fk_pairs(robot: Robot, q: ArrayLike) -> QuaternionPair:
    """Forward kinematics by quaternion-vector pairs (thesis of Jha 2015, eq. 4.108).

    Args:
        robot: any chain.
        q: (..., n) joint values [rad or m].

    Raises:
        InputError: as ``robot.fk``.

    Example:
        >>> fk_pairs(robot, q).matrix()  # robot.fk(q)
    """
    values, half, zero = _joint_values(robot, q)
    T = QuaternionPair.from_matrix(robot.frames[0])
    for i, kind in enumerate(robot.kinds):
        if kind == "R":
            joint = QuaternionPair(half[..., i, :], np.zeros(3))
        else:
            joint = QuaternionPair(np.array([1.0, 0, 0, 0]), zero + values[..., i, None] * _Z)
        T = T @ joint @ QuaternionPair.from_matrix(robot.frames[i + 1])
    return T


def fk_dual_quaternions(robot: Robot, q: ArrayLike) -> DualQuaternion:
    """Forward kinematics by unit dual quaternions; see :func:`fk_pairs`.

    Example:
        >>> fk_dual_quaternions(robot, q).matrix()  # robot.fk(q)
    """
    values, half, zero = _joint_values(robot, q)
    T = DualQuaternion.from_matrix(robot.frames[0])
    for i, kind in enumerate(robot.kinds):
        if kind == "R":
            joint = DualQuaternion(half[..., i, :], np.zeros(4))
        else:
            slide = np.zeros((*zero.shape[:-1], 4))
            slide[..., 3] = 0.5 * values[..., i]
            joint = DualQuaternion(np.array([1.0, 0, 0, 0]), slide)
        T = T @ joint @ DualQuaternion.from_matrix(robot.frames[i + 1])
    return T


def fk_exponentials(robot: Robot, q: ArrayLike) -> Array:
    """Forward kinematics by the product of exponentials (Brockett 1984); see :func:`fk_pairs`.

    Returns:
        (..., 4, 4).

    Example:
        >>> fk_exponentials(robot, q)  # robot.fk(q)
    """
    values, _, _ = _joint_values(robot, q)
    lines = axis_lines(robot.frames, robot.kinds)
    T = np.eye(4)
    for i, kind in enumerate(robot.kinds):
        unit = screw_of_axis(kind, lines.direction[i], lines.point[i])
        T = T @ screw_exp(values[..., i, None] * unit)
    return np.asarray(T @ lines.T_zero)


_Z = np.array([0.0, 0.0, 1.0])


def _joint_values(robot: Robot, q: ArrayLike) -> tuple[Array, Array, Array]:
    """Values of all moving joints (..., m), turns about z as quaternions, and zeros (..., 3)."""
    q = se3.as_joints(q, robot.dof)
    values = q[..., robot.source] * robot.multiplier + robot.offset
    half = np.zeros((*values.shape, 4))
    half[..., 0], half[..., 3] = np.cos(0.5 * values), np.sin(0.5 * values)
    return values, half, np.zeros((*values.shape[:-1], 3))

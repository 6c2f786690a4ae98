"""A small rigid error behind every fixed transform of a chain, and how the tool moves with it.

Error i is (x, y, z, rx, ry, rz) [m, rad] in its own frame: ``frames[i] @ [exp(r), xyz]``. DH
parameters are among the motions it allows, and parallel axes are nothing special to it; what
cannot be told apart (a turn about an axis before and behind the joint) is left to the rank of the
identification Jacobian.
"""

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.ranking import turning
from kinverse.robot import Robot

__all__ = [
    "COMPONENTS",
    "gear_waves",
    "identification_jacobian",
    "independent",
    "with_link_errors",
]

Array = NDArray[np.float64]

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


def with_link_errors(robot: Robot, errors: Array) -> Robot:
    """The robot whose frames have errors (m + 1, 6) [m, rad].

    Example:
        >>> with_link_errors(robot, np.zeros((7, 6))) == robot
        True
    """
    return Robot(
        robot.frames @ _motions(errors),
        robot.kinds,
        robot.limits,
        robot.joint_names,
        robot.source,
        robot.multiplier,
        robot.offset,
        robot.name,
        robot.source_note,
        robot.unverified,
    )


def identification_jacobian(robot: Robot, q: Array, errors: Array) -> Array:
    """How the tool of the robot with errors moves with each of them.

    Args:
        robot: without the errors.
        q: (N, n) joint values.
        errors: (m + 1, 6) where to linearize.

    Returns:
        (N, 6, m + 1, 6): rows linear [m] and angular [rad] in the base frame, then frame and
        component.
    """
    count = len(robot.frames)
    motions, turns = _motions(errors), _left_jacobians(errors[:, 3:])
    values = robot.multiplier * q[:, robot.source] + robot.offset
    stations = np.empty((len(q), count, 4, 4))  # where each error acts, before and behind it
    behind = np.empty_like(stations)
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for i in range(count):
        stations[:, i] = T @ robot.frames[i]
        behind[:, i] = T = stations[:, i] @ motions[i]
        if i < count - 1:
            T = T @ _joint_motions(robot.kinds[i], values[:, i])
    R = stations[..., :3, :3]
    axes = R @ turns
    lever = behind[:, -1:, :3, 3] - behind[..., :3, 3]
    J = np.zeros((len(q), 6, count, 6))
    J[:, :3, :, :3] = R.transpose(0, 2, 1, 3)
    swept = np.cross(axes, lever[..., None], axis=2)
    J[:, :3, :, 3:] = swept.transpose(0, 2, 1, 3)
    J[:, 3:, :, 3:] = axes.transpose(0, 2, 1, 3)
    return J


def gear_waves(robot: Robot, q: Array, harmonics: int) -> Array:
    """Cosine and sine of each harmonic of each joint: (N, n, 2 h) of (N, n); 0 for slides."""
    each = q[:, :, None] * np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(each), np.sin(each)], axis=3).reshape(*q.shape, 2 * harmonics)
    return np.asarray(waves * turning(robot)[:, None])


def independent(J: Array, tolerance: float) -> NDArray[np.int64]:
    """Columns (k,) of J (rows, columns) that can be told apart, ascending.

    Columns are brought to unit length; one counts as dependent if less than ``tolerance`` of it is
    not explained by those chosen before (QR with column pivoting).

    Example:
        >>> independent(np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]), 1e-6)
        array([0, 2])
    """
    from scipy.linalg import qr

    length = np.linalg.norm(J, axis=0)
    moving = np.flatnonzero(length > 1e-12 * length.max(initial=0.0))
    if not len(moving):
        return np.empty(0, np.int64)
    triangle, order = qr(J[:, moving] / length[moving], mode="r", pivoting=True)
    new = np.abs(np.diagonal(triangle))
    return np.sort(moving[order[: len(new)][new > tolerance]]).astype(np.int64)


def _motions(errors: Array) -> Array:
    """(k, 4, 4) of errors (k, 6)."""
    E = np.broadcast_to(np.eye(4), (len(errors), 4, 4)).copy()
    E[:, :3, :3] = se3.rotation_exp(errors[:, 3:])
    E[:, :3, 3] = errors[:, :3]
    return E


def _left_jacobians(vectors: Array) -> Array:
    """(k, 3, 3): the angular velocity of exp(r) in the frame before it, for each rate of r."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    K = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    # below 1e-4 the series is exact to rounding and the quotients are not
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def _joint_motions(kind: str, values: Array) -> Array:
    T = np.broadcast_to(np.eye(4), (len(values), 4, 4)).copy()
    if kind == "P":
        T[:, 2, 3] = values
        return T
    c, s = np.cos(values), np.sin(values)
    T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1] = c, -s, s, c
    return T

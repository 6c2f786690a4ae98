"""Answers judged in plain NumPy, by the robot's numbers alone: it shares no code with the core."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["apart", "errors", "frames", "inside", "pose"]

Array = NDArray[np.float64]


def frames(robot: "Robot", q: Array) -> list[Array]:
    """Joint values (N, n) to the frame of each joint after its motion, then the tool's (N, 4, 4).

    Example:
        >>> frames(kv.load("kr16"), np.zeros((1, 6)))[2][0, :3, 3]
    """
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    found = []
    for i, kind in enumerate(robot.kinds):
        value = robot.multiplier[i] * q[:, robot.source[i]] + robot.offset[i]
        motion = np.tile(np.eye(4), (len(q), 1, 1))
        if kind == "P":
            motion[:, 2, 3] = value
        else:
            motion[:, 0, 0] = motion[:, 1, 1] = np.cos(value)
            motion[:, 1, 0] = np.sin(value)
            motion[:, 0, 1] = -motion[:, 1, 0]
        T = T @ robot.frames[i] @ motion
        found.append(T)
    return [*found, T @ robot.frames[-1]]


def pose(robot: "Robot", q: Array) -> Array:
    """Joint values (N, n) to poses of the tool (N, 4, 4)."""
    return frames(robot, q)[-1]


def errors(wanted: Array, reached: Array) -> tuple[Array, Array]:
    """Distances (N,) [m] and angles (N,) [rad] between poses (N, 4, 4)."""
    far = np.linalg.norm(wanted[:, :3, 3] - reached[:, :3, 3], axis=1)
    R = np.swapaxes(wanted[:, :3, :3], 1, 2) @ reached[:, :3, :3]
    skew = [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]]
    trace = np.trace(R, axis1=1, axis2=2)
    return far, np.arctan2(np.linalg.norm(skew, axis=0), trace - 1.0)


def inside(robot: "Robot", q: Array, slack: float = 1e-9) -> NDArray[np.bool_]:
    """Which rows of q (N, n) are finite and inside the limits."""
    low, high = robot.limits.T
    held: NDArray[np.bool_] = ((q >= low - slack) & (q <= high + slack)).all(axis=1)
    return held


def apart(q: Array, other: Array) -> Array:
    """Largest difference (...) of turning joints (..., n) [rad], whole turns apart are the same."""
    gap: Array = np.abs((q - other + np.pi) % (2.0 * np.pi) - np.pi).max(axis=-1)
    return gap

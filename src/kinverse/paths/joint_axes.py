"""The axes of an arm's joints in a posture, and whether those of another model are the same."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["differing", "joint_axes"]

Array = NDArray[np.float64]
Axes = tuple[Array, Array]

SAME = 1e-3
"""Lines are alike if their distance and angle agree to so much [m, rad]: files have few digits."""


def joint_axes(robot: "Robot", q: Array) -> Axes:
    """Directions (n, 3) of the moving joints' axes, and points (n, 3) on them [m], base frame.

    Example:
        >>> joint_axes(kv.load("kr16"), np.zeros(6))[0][0]
    """
    moving = robot.multiplier * q[robot.source] + robot.offset
    T, directions, points = np.eye(4), [], []
    for frame, kind, value in zip(robot.frames, robot.kinds, moving, strict=False):
        T = T @ frame
        directions.append(T[:3, 2])
        points.append(T[:3, 3])
        motion = np.eye(4)
        if kind == "R":
            c, s = np.cos(value), np.sin(value)
            motion[:2, :2] = [[c, -s], [s, c]]
        else:
            motion[2, 3] = value
        T = T @ motion
    return np.array(directions), np.array(points)


def differing(kinds: str, one: Axes, other: Axes) -> tuple[int, int] | None:
    """The first two joints whose axes lie otherwise to each other in the one than in the other.

    What is compared does not depend on where the base stands: angles, and of turning joints
    distances, with sign where the axes are not parallel.
    """
    for j in range(len(kinds)):
        for i in range(j):
            both = kinds[i] == kinds[j] == "R"
            a, b = (_between(axes, i, j, both) for axes in (one, other))
            if np.abs(a - b).max() > SAME:
                return i, j
    return None


def _between(axes: Axes, i: int, j: int, both: bool) -> Array:
    """Cosine of the angle, and for lines their distance: reciprocal product, or if parallel."""
    (a, b), (p, r) = axes[0][[i, j]], axes[1][[i, j]]
    cosine = a @ b
    if not both:
        return np.array([cosine, 0.0, 0.0])
    across = np.cross(a, b)
    gap = r - p
    parallel = np.linalg.norm(across) < SAME
    away = np.linalg.norm(np.cross(a, gap)) if parallel else 0.0
    return np.array([cosine, gap @ across, away])

"""Rules that choose one solution a pose: each scores all M solutions, lowest wins.

A rule gives the chosen rows and their joint values: those that go by distance turn revolute joints
by whole turns towards where the arm is (:func:`rewound`).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.table import TableLike
from kinverse.task import Task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = [
    "RULES",
    "first_of_each",
    "has_lost_rank",
    "joint_distance",
    "least_motion",
    "manipulability",
    "rewound",
    "turning",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Chosen = tuple[Ints, Array]

TURN = 2.0 * np.pi

LOST = 1e-6
"""A singular value below this fraction of the greatest has vanished."""

MOST_TURNED = 1e6
"""Joint values [rad] beyond this are not turned to: rounding would show in the errors."""


def joint_distance(q: Array, other: Array) -> Array:
    """Largest joint difference (...,) [rad or m] of (..., n) joint values, as travelled."""
    return np.asarray(np.abs(q - other).max(axis=-1, initial=0.0))


def turning(robot: "Robot") -> NDArray[np.bool_]:
    """(n,) the free joints of which a whole turn changes nothing.

    Neither a slide nor a joint that drives another one by a ratio that is no whole number.
    """
    mask = np.ones(robot.dof, dtype=np.bool_)
    for kind, joint, ratio in zip(robot.kinds, robot.source, robot.multiplier, strict=True):
        if kind == "P" or ratio != np.rint(ratio):
            mask[joint] = False
    return mask


def rewound(robot: "Robot", q: Array, near: Array, limits: str = "hold") -> Array:
    """Joint values turned by whole turns to where they are nearest to ``near``.

    Args:
        robot: whose joints they are.
        q: (..., n) joint values [rad or m].
        near: (..., n) where to be near to, of a shape that broadcasts with q.
        limits: "hold": no turn leads out of the limits; "ignore": any number of turns.

    Returns:
        (..., n); a joint that no turn brings nearer keeps its value to the last bit.

    Example:
        >>> np.degrees(rewound(ur5, np.radians([0, 0, 0, 0, 0, -160]), np.radians([0] * 5 + [190])))
        array([  0.,   0.,   0.,   0.,   0., 200.])
    """
    turns = np.where(np.abs(near) <= MOST_TURNED, np.rint((near - q) / TURN), 0.0)
    if limits == "hold":
        low, high = robot.limits.T
        least = np.minimum(np.ceil((low - q) / TURN), 0.0)
        turns = np.clip(turns, least, np.maximum(np.floor((high - q) / TURN), 0.0))
    moved = q + np.where(turning(robot), turns, 0.0) * TURN
    return np.where(np.abs(moved - near) < np.abs(q - near), moved, q)


def first_of_each(table: TableLike, score: Array) -> Ints:
    """Row of the lowest score in each pose that has solutions; ties go to the earlier row."""
    order = np.lexsort((score, table.pose_index))
    index = table.pose_index[order]
    new = np.ones(len(index), dtype=np.bool_)
    new[1:] = index[1:] != index[:-1]
    return np.asarray(order[new])


def manipulability(robot: "Robot", task: Task, q: Array) -> Array:
    """Yoshikawa's measure (M,): the product of the singular values of the task's Jacobian.

    Equals sqrt(det(J J')) for arms with at least as many joints as the task has components
    (Yoshikawa, Int. J. Robotics Research 4(2), 1985, eq. 9). Units mix metres and radians.
    """
    J = task.constrained(robot.jacobian(q), robot.fk(q))
    return np.asarray(np.linalg.svd(J, compute_uv=False).prod(axis=-1))


def has_lost_rank(robot: "Robot", task: Task, q: Array) -> NDArray[np.bool_]:
    """(M,) joint values at which the task's Jacobian has lost rank.

    Its least singular value is below ``LOST`` of its greatest, lengths counted in the arm's own.
    Where two solutions meet, joint values are known to half the digits only, hence the bound.
    """
    if not len(q):
        return np.empty(0, np.bool_)
    length = float(np.linalg.norm(robot.frames[1:-1, :3, 3], axis=1).sum()) or 1.0
    J = task.constrained(robot.jacobian(q), robot.fk(q))
    J[:, : task.position] /= length
    J[:, :, ~turning(robot)] *= length
    values = np.linalg.svd(J, compute_uv=False)
    return np.asarray(values[:, -1] <= LOST * values[:, 0])


def nearest(robot: "Robot", task: Task, table: TableLike, q: Array | None, limits: str) -> Chosen:
    """Least largest joint distance to q; without q the first of each pose as solved."""
    if q is None:
        rows = first_of_each(table, np.zeros(len(table.q)))
        return rows, table.q[rows]
    near = q if q.ndim == 1 else q[table.pose_index]
    turned = rewound(robot, table.q, near, limits)
    rows = first_of_each(table, joint_distance(turned, near))
    return rows, turned[rows]


def mid_limits(
    robot: "Robot", task: Task, table: TableLike, q: Array | None, limits: str
) -> Chosen:
    """Least largest distance from the middle of the limits, as a share of the half range."""
    low, high = robot.limits.T
    half = np.maximum((high - low) / 2.0, 1e-12)
    away = np.abs(table.q - (low + high) / 2.0) / half
    rows = first_of_each(table, away.max(axis=-1, initial=0.0))
    return rows, table.q[rows]


def most_manipulable(
    robot: "Robot", task: Task, table: TableLike, q: Array | None, limits: str
) -> Chosen:
    """Greatest manipulability: farthest from singular."""
    rows = first_of_each(table, -manipulability(robot, task, table.q))
    return rows, table.q[rows]


def least_motion(
    robot: "Robot", task: Task, table: TableLike, q: Array | None, limits: str
) -> Chosen:
    """The poses as a path: least sum of largest joint distances from each pose to the next.

    Dynamic programming over the solutions of each pose, from q (n,) if given; each solution is
    turned by whole turns towards the one before it on its path. Poses without solutions are
    passed over.
    """
    ends = np.cumsum(table.count)
    groups = [np.arange(e - c, e) for e, c in zip(ends, table.count, strict=True) if c]
    if not groups:
        return np.empty(0, dtype=np.int64), np.empty((0, robot.dof))
    here = table.q[groups[0]]
    cost = np.zeros(len(here))
    if q is not None:
        start = q if q.ndim == 1 else q[table.pose_index[0]]
        here = rewound(robot, here, start, limits)
        cost = joint_distance(here, start)
    back: list[Ints] = []
    turned = [here]
    for group in groups[1:]:
        ways = rewound(robot, table.q[group][:, None], here, limits)
        total = cost + joint_distance(ways, here)
        via = total.argmin(axis=1)
        back.append(via)
        here, cost = ways[np.arange(len(group)), via], total.min(axis=1)
        turned.append(here)
    at = int(cost.argmin())
    rows, values = [int(groups[-1][at])], [turned[-1][at]]
    for group, joints, via in zip(groups[-2::-1], turned[-2::-1], back[::-1], strict=True):
        at = int(via[at])
        rows.append(int(group[at]))
        values.append(joints[at])
    return np.array(rows[::-1], dtype=np.int64), np.array(values[::-1])


RULES: dict[str, Callable[["Robot", Task, TableLike, Array | None, str], Chosen]] = {
    "nearest": nearest,
    "least_motion": least_motion,
    "mid_limits": mid_limits,
    "manipulability": most_manipulable,
}

"""Rules that choose one solution a pose: each scores all M solutions, lowest wins."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.table import TableLike
from kinverse.task import Task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["RULES", "first_of_each", "joint_distance", "least_motion", "manipulability"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def joint_distance(q: Array, other: Array) -> Array:
    """Largest joint difference (...,) [rad or m] of (..., n) joint values, as travelled."""
    return np.asarray(np.abs(q - other).max(axis=-1, initial=0.0))


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


def nearest(robot: "Robot", task: Task, table: TableLike, q: Array | None) -> Ints:
    """Least largest joint distance to q; without q the first of each pose as solved."""
    if q is None:
        return first_of_each(table, np.zeros(len(table.q)))
    near = q if q.ndim == 1 else q[table.pose_index]
    return first_of_each(table, joint_distance(table.q, near))


def mid_limits(robot: "Robot", task: Task, table: TableLike, q: Array | None) -> Ints:
    """Least largest distance from the middle of the limits, as a share of the half range."""
    low, high = robot.limits.T
    half = np.maximum((high - low) / 2.0, 1e-12)
    away = np.abs(table.q - (low + high) / 2.0) / half
    return first_of_each(table, away.max(axis=-1, initial=0.0))


def most_manipulable(robot: "Robot", task: Task, table: TableLike, q: Array | None) -> Ints:
    """Greatest manipulability: farthest from singular."""
    return first_of_each(table, -manipulability(robot, task, table.q))


def least_motion(robot: "Robot", task: Task, table: TableLike, q: Array | None) -> Ints:
    """The poses as a path: least sum of largest joint distances from each pose to the next.

    Dynamic programming over the solutions of each pose, from q (n,) if given. Poses without
    solutions are passed over.
    """
    ends = np.cumsum(table.count)
    groups = [np.arange(e - c, e) for e, c in zip(ends, table.count, strict=True) if c]
    if not groups:
        return np.empty(0, dtype=np.int64)
    cost = np.zeros(len(groups[0]))
    if q is not None:
        start = q if q.ndim == 1 else q[table.pose_index[0]]
        cost = joint_distance(table.q[groups[0]], start)
    back: list[Ints] = []
    for before, here in zip(groups, groups[1:], strict=False):
        total = cost + joint_distance(table.q[here][:, None], table.q[before])
        back.append(total.argmin(axis=1))
        cost = total.min(axis=1)
    at = int(cost.argmin())
    rows = [int(groups[-1][at])]
    for group, via in zip(groups[-2::-1], back[::-1], strict=True):
        at = int(via[at])
        rows.append(int(group[at]))
    return np.array(rows[::-1], dtype=np.int64)


RULES: dict[str, Callable[["Robot", Task, TableLike, Array | None], Ints]] = {
    "nearest": nearest,
    "least_motion": least_motion,
    "mid_limits": mid_limits,
    "manipulability": most_manipulable,
}

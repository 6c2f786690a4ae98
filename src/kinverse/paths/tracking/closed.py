"""Closed paths: of an arm that may come back to its first pose otherwise, the way that does not."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.joint_path import SAME_POSE, Angle, Gap, Reason
from kinverse.paths.joint_units import joint_units
from kinverse.paths.tracking.layers import Layers, short_way
from kinverse.paths.tracking.problem import Problem
from kinverse.paths.tracking.samples import Samples
from kinverse.paths.tracking.search import Found, follow, shortest

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["check_closed", "held_at_ends", "not_closed"]

Array = NDArray[np.float64]

STARTS = 16
"""Joint values at the first pose, near the best way, that a closed way is looked for from."""
GRID_STARTS = 32
"""The same of a whole grid, spread evenly."""
SAME = 1e-4
"""Solutions of the first pose and of the last that differ by less [rad or m] are one."""
BACK = 1e-5
"""Joints that end so near their start [rad or m] are back."""


def check_closed(samples: Samples) -> None:
    """Raise InputError unless the last pose is the first."""
    a, b = samples.T[0], samples.T[-1]
    if np.abs(b - a).max() > SAME_POSE:
        away = np.linalg.norm(b[:3, 3] - a[:3, 3])
        turned = np.linalg.norm(se3.rotation_log(a[:3, :3].T @ b[:3, :3]))
        raise InputError(
            "closed asks for a path that ends with its first pose, this one ends"
            f" {away:.3g} m and {turned:.3g} rad from it"
        )


def held_at_ends(problem: Problem, every: Layers, layers: Layers, found: Found) -> Layers | None:
    """Layers with one row at both ends, the same, from which there is a way back to it.

    Of some rows of the first sample near the start of the best way, the one from which the way is
    cheapest; where there is none, the first of those of the whole grid. None if nothing comes back.

    Args:
        problem: the path.
        every: its layers as they were solved.
        layers: those that the best way was found in: of a grid only what is near it.
        found: the best way, without a break.
    """
    best, cost = None, np.inf
    for start in itertools.islice(_starts(problem, layers, found), STARTS):
        if (held := _held(problem, layers, start)) is not None:
            _, way = follow(problem, held)
            if way.breaks == 0 and way.cost < cost:
                best, cost = held, way.cost
    if best is not None or layers is every:
        return best
    rows = (layers.sample, layers.q, layers.branch, layers.side, layers.fixed)
    # behind the others of their sample
    found = found._replace(row=found.row + every.start[1:])
    layers = every.with_rows(*rows)
    starts = list(_starts(problem, layers, found))
    for start in starts[:: -(-len(starts) // GRID_STARTS)]:
        if (held := _held(problem, layers, start)) is not None:
            if shortest(problem, held, np.empty((0, 2), np.int64)).breaks == 0:
                return held
    return None


def not_closed(robot: "Robot", q: Array, has_gaps: bool) -> tuple[Gap, ...]:
    """The gap between the end of joint values (N, n) and their start, if they do not meet."""
    apart = np.abs(q[-1] - q[0])
    if np.isnan(apart).any() or apart.max() <= BACK:
        return ()
    j = int(apart.argmax())
    moved = Angle(apart[j]) if joint_units(robot)[j] == "rad" else f"{apart[j]:.3g} m"
    # over a gap no way back is looked for
    none = "" if has_gaps else "; of the ways that were looked at none comes back"
    words = (f"joint {robot.joint_names[j]!r} ends ", moved, f" from where it begins{none}")
    return (Gap(len(q), len(q), Reason.NOT_CLOSED, words),)


@dataclass(frozen=True, slots=True)
class _Start:
    q: Array
    branch: int
    side: int


def _starts(problem: Problem, layers: Layers, found: Found) -> Iterator[_Start]:
    """Where the best way begins and ends, then other rows of the first sample, nearest first."""
    robot, steps = problem.robot, problem.steps
    low, high = robot.limits.T
    first = found.q[0]
    rows = np.concatenate([found.row[[0, -1]], np.arange(layers.start[1])])
    q = np.concatenate([found.q[[0, -1]], layers.q[: layers.start[1]]])
    q[2:] = first + short_way(robot, first[None], q[2:], layers.fixed[rows[2:]])
    order = np.append([0, 1], 2 + np.argsort(np.abs(q[2:] - first).max(axis=1), kind="stable"))
    taken: list[Array] = []
    near_start = steps.q_start is not None and _near(first, steps.q_start, steps.max_step)
    for k in order.tolist():
        inside = ((q[k] >= low) & (q[k] <= high)).all()
        if near_start and steps.q_start is not None:
            inside &= _near(q[k], steps.q_start, steps.max_step)
        if inside and all(np.abs(q[k] - other).max() > SAME for other in taken):
            taken.append(q[k])
            yield _Start(q[k], int(layers.branch[rows[k]]), int(layers.side[rows[k]]))


def _near(q: Array, other: Array, max_step: Array) -> bool:
    return bool((np.abs(q - other) <= max_step).all())


def _held(problem: Problem, layers: Layers, start: _Start) -> Layers | None:
    """The layers with nothing but one solution at the first sample and at the last."""
    last = len(layers) - 1
    robot = problem.robot
    low, high = robot.limits.T
    ends = []
    for k in (0, last):
        near = problem.branches.near(problem.samples.T[k : k + 1], start.q[None])
        if not len(near.q):
            return None
        q = start.q + short_way(robot, start.q[None], near.q, near.fixed)
        q = q[np.abs(q - start.q).max(axis=1).argmin()]
        if np.abs(q - start.q).max() > SAME:
            return None
        ends.append(np.clip(q, low, high))
    sample = layers.sample
    inner = layers.only((sample > 0) & (sample < last))
    at = np.array([0, last])
    return inner.with_rows(at, np.array(ends), start.branch, start.side, True)

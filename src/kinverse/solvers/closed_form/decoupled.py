"""Three slides and three turning joints, in any order: Cartesian gantries and their kin.

Slides do not turn the tool, so the three turning joints alone make its rotation: one quadratic
equation for the middle one, then the outer two. What is left of the position is linear in the
slides. Two branches, and each step is exact, which no elimination is for such arms.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.geometry import PARALLEL, AxisLines, any_perpendicular, axis_lines, cross
from kinverse.robot import Robot
from kinverse.status import Status
from kinverse.table import plain_evidence

__all__ = ["DecoupledForm", "is_decoupled"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

SPREAD = 24
"""Values tried of an angle that the target leaves free."""

IN_LINE = 1e-10
"""Sine of the angle between the outer two turning axes below which they are in line."""

DEPENDENT = 1e-9
"""Ratio of singular values below which slides, as they stand, do not move apart."""

ROUNDING = 1e-12
"""Of an angle between directions [rad]."""


def is_decoupled(lines: AxisLines, kinds: str) -> bool:
    """Whether an arm has three slides that move apart and three joints that turn any way.

    Example:
        >>> is_decoupled(axis_lines(gantry.frames, gantry.kinds), gantry.kinds)
        True
    """
    if sorted(kinds) != ["P"] * 3 + ["R"] * 3:
        return False
    z = lines.direction[[kind == "R" for kind in kinds]]
    if np.linalg.norm(np.cross(z[:-1], z[1:]), axis=1).min() < PARALLEL:
        return False
    theta = np.random.default_rng(0).uniform(-np.pi, np.pi, (8, 3))
    values = np.linalg.svd(_ways(lines, kinds, theta), compute_uv=False)
    return bool((values[:, -1] > PARALLEL).any())


@dataclass(frozen=True)
class Branches:
    """What a native form gives an extension, before anything is verified: arrays as in a table."""

    q: Array
    pose_index: NDArray[np.int64]
    branch: NDArray[np.int32]
    status: NDArray[np.uint8]
    singular: Bools
    evidence: NDArray[np.void]

    @property
    def count(self) -> NDArray[np.int64]:
        """(N,) branches a pose."""
        return np.bincount(self.pose_index, minlength=len(self.status))


@dataclass(frozen=True)
class DecoupledForm:
    """The closed form of one robot; it stands where the native forms do.

    Attributes:
        robot: the arm.
        tol_rotation: largest rotation error [rad].
    """

    robot: Robot
    tol_rotation: float

    def solve(self, T: Array, q_seed: Array | None, seed: int) -> Branches:
        """Every branch."""
        return Branches(*self.propose(T, q_seed))

    def propose(self, T: Array, q_seed: Array | None) -> tuple[Any, ...]:
        """Every branch of poses (N, 4, 4), unverified: the arrays of a ``Proposal``."""
        robot = self.robot
        lines = axis_lines(robot.frames, robot.kinds)
        is_turn = np.array([kind == "R" for kind in robot.kinds])
        near = np.broadcast_to(robot.limits.mean(axis=1), (len(T), 6))
        if q_seed is not None:
            near = np.clip(q_seed, *robot.limits.T)
        axes = lines.direction[is_turn]
        theta, row, is_free, gap = _turns(axes, lines.T_zero, T, near[:, is_turn])
        q, p = near[row], T[row, :3, 3]
        q[:, is_turn] = theta
        slides, is_dependent = _slides(lines, robot.kinds, theta, p, q[:, ~is_turn])
        q[:, ~is_turn] = slides
        singular = np.zeros(len(T), np.bool_)
        np.logical_or.at(singular, row, is_free | is_dependent)
        shown = gap > self.tol_rotation + ROUNDING
        hint = np.where(shown, Status.UNREACHABLE, Status.NOT_FOUND).astype(np.uint8)
        branch = (np.arange(len(row)) & 1).astype(np.int32)
        return q, row, branch, hint, singular, plain_evidence("closed form", len(T))


def _turns(
    axes: Array, T_zero: Array, T: Array, near: Array
) -> tuple[Array, NDArray[np.int64], Bools, Array]:
    """Angles (K, 3) that make the rotation, their poses, and which of them are one of many.

    Last comes by how much (N,) the rotation is out of reach [rad].
    ``Rot(a, t1) Rot(b, t2) Rot(c, t3) = M``: t2 alone sets the angle between a and M c.
    """
    a, b, c = axes
    M = T[:, :3, :3] @ T_zero[:3, :3].T
    first, second = _angle(a, b), _angle(b, c)
    between = _angle(a, M @ c)
    gap = np.maximum(
        np.abs(first - second) - between, between - min(first + second, 2 * np.pi - first - second)
    )
    # the angle at b of the spherical triangle a, b, Rot(b, t2) c, exact where it is flat
    s = 0.5 * (first + second + between)
    opposite = np.maximum(np.sin(s - first) * np.sin(s - second), 0.0)
    beside = np.maximum(np.sin(s) * np.sin(s - between), 0.0)
    corner = 2.0 * np.arctan2(np.sqrt(opposite), np.sqrt(beside))
    flat = np.arctan2(cross(c, a) @ b, (a - (a @ b) * b) @ (c - (c @ b) * b))
    t2 = np.stack([flat + corner, flat - corner], axis=1).reshape(-1)
    row = np.repeat(np.arange(len(T)), 2)
    v, w = _turned(b, t2, c), (M @ c)[row]
    v, w = v - _dot(v, a)[:, None] * a, w - _dot(w, a)[:, None] * a
    is_free = np.linalg.norm(v, axis=1) < IN_LINE
    t1 = np.where(is_free, near[row, 0], _from_to(a, v, w))
    # both branches of a pose are spread or none is, so that they stay side by side
    spread = np.repeat(is_free.reshape(-1, 2).any(axis=1), SPREAD).reshape(-1, SPREAD)
    copies = np.where(spread[:, 0], SPREAD, 1)
    pair = np.repeat(np.arange(len(T)), copies)
    step = np.arange(len(pair)) - np.searchsorted(pair, pair)
    k = (2 * pair[:, None] + np.arange(2)).reshape(-1)
    step = np.repeat(step, 2)
    t1 = t1[k] + np.where(is_free[k], step * (2 * np.pi / SPREAD), 0.0)
    t2, row, is_free = t2[k], row[k], is_free[k]
    x = any_perpendicular(c)
    rest = _turned(b, -t2, _turned(a, -t1, M[row] @ x))
    t3 = _from_to(c, np.broadcast_to(x, rest.shape), rest)
    return np.stack([t1, t2, t3], axis=1), row, is_free, gap


def _slides(
    lines: AxisLines, kinds: str, theta: Array, p: Array, near: Array
) -> tuple[Array, Bools]:
    """Where the slides (K, 3) bring the tool point to p, and which of them do not move apart.

    These stay as near to ``near`` as can be.
    """
    x = np.broadcast_to(lines.T_zero[:3, 3], p.shape)
    turns = np.flatnonzero([kind == "R" for kind in kinds])
    for k in (2, 1, 0):
        point = lines.point[turns[k]]
        x = point + _turned(lines.direction[turns[k]], theta[:, k], x - point)
    W = _ways(lines, kinds, theta)
    U, S, Vt = np.linalg.svd(W)
    is_dependent = S[:, -1] <= DEPENDENT * S[:, 0]
    start = np.where(is_dependent[:, None], near, 0.0)
    rest = p - x - (W @ start[:, :, None])[:, :, 0]
    along = (np.swapaxes(U, 1, 2) @ rest[:, :, None])[:, :, 0]
    along = np.where(S > DEPENDENT * S[:, :1], along / np.maximum(S, 1e-300), 0.0)
    return start + (np.swapaxes(Vt, 1, 2) @ along[:, :, None])[:, :, 0], is_dependent


def _ways(lines: AxisLines, kinds: str, theta: Array) -> Array:
    """Directions of the slides, (K, 3, 3) in columns, while the turning joints stand at theta."""
    columns = []
    for i, kind in enumerate(kinds):
        if kind == "P":
            before = [j for j in range(i) if kinds[j] == "R"]
            way = np.broadcast_to(lines.direction[i], (len(theta), 3))
            for k in range(len(before) - 1, -1, -1):
                way = _turned(lines.direction[before[k]], theta[:, k], way)
            columns.append(way)
    return np.stack(columns, axis=2)


def _turned(axis: Array, angle: Array, v: Array) -> Array:
    """Vectors (3,) or (K, 3) turned about an axis (3,) by angles (K,)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = _dot(v, axis)[..., None] * axis
    return np.asarray(c * (v - along) + s * np.cross(axis, v) + along)


def _from_to(axis: Array, v: Array, w: Array) -> Array:
    """The turns (K,) about an axis from directions v (K, 3), square to it, to w (K, 3)."""
    return np.asarray(np.arctan2(_dot(np.cross(v, w), axis), _dot(v, w)))


def _angle(a: Array, b: Array) -> Any:
    """Between directions (3,) and (..., 3), exact near 0 and pi [rad]."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), _dot(b, a))


def _dot(a: Array, b: Array) -> Array:
    """Row by row, so that a row's bits do not depend on how many there are."""
    return np.asarray((a * b).sum(axis=-1))

"""Arms and tasks that are no six-joint pose problem, made one by virtual joints.

A closed form solves as many equations as it has joints. Where the arm has fewer joints than the
pose has components, joints that must stand still are added; where the task leaves components free,
joints that move exactly these are added, and what they take is dropped.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import NoClosedForm
from kinverse.geometry import PARALLEL, axis_lines
from kinverse.robot import Robot
from kinverse.se3 import pose
from kinverse.solvers._base import Proposal
from kinverse.solvers.families import MOST_ROOTS
from kinverse.status import METHODS, Status
from kinverse.task import as_task

__all__ = ["STANDING", "Extension", "check_mobility", "extended"]

Array = NDArray[np.float64]

CLEAR_GAP = 1e-3
"""Gap between roots [rad] above which each is sure to be told from its neighbours."""

STANDING = 1e-2
"""A virtual joint [rad] further from rest than this in every solution shows that the arm itself has
none: within the tolerances a solution moves it by far less."""

MOVES = 1e-7
"""Singular value above which a direction of motion counts, of a Jacobian with unit columns."""


@dataclass(frozen=True)
class Extension:
    """The six-joint arm that stands for another.

    Attributes:
        robot: the arm with virtual joints.
        columns: (n,) which of its joints are the real ones.
        standing: the other joints, which must stand at zero; empty where they are free.
        turns: (4, 4) rotations that the task leaves free, each added to the targets: what is missed
            with one, where roots are alike by chance, is found with another.
        other: an arm with other virtual joints, asked where the evidence of the first is doubtful.
    """

    robot: Robot
    columns: NDArray[np.int64]
    standing: NDArray[np.int64]
    turns: tuple[Array, ...] = (np.eye(4),)
    other: "Extension | None" = None

    def propose(self, form: Any, other: Callable[[], Any], T: Array, exact: float) -> Proposal:
        """Candidates of the real arm: the extended arm's solutions without what is virtual.

        Args:
            form: the native closed form of the extended arm, limits ignored.
            other: makes that of the other arm.
            T: (N, 4, 4) poses.
            exact: error that rounding explains [m, rad].
        """
        found = [self._free(form, T @ turn) for turn in self.turns]
        if len(self.standing):
            first, doubtful = self._still(form.solve(T, None, 0))
            found = [first]
            if self.other is not None and len(doubtful):
                table = other().solve(np.ascontiguousarray(T[doubtful]), None, 0)
                found.append(first.extended_by(self.other._still(table)[0], doubtful))
        return _united(found, exact)

    def _free(self, form: Any, T: Array) -> "_Found":
        q, index, branch, hint, singular, evidence = form.propose(np.ascontiguousarray(T), None)
        shown = hint == Status.UNREACHABLE
        return _Found(q[:, self.columns], index, branch, shown, singular, evidence)

    def _still(self, table: Any) -> tuple["_Found", NDArray[np.int64]]:
        """What it says, and the poses of which another arm should be asked.

        A pose is out of reach if no solution lets the virtual joints stand, on good evidence.
        """
        moved = np.abs(np.remainder(table.q[:, self.standing] + np.pi, 2 * np.pi) - np.pi)
        least = np.full(len(table.status), np.inf)
        np.minimum.at(least, table.pose_index, moved.max(axis=1, initial=0.0))
        evidence = table.evidence
        # an elimination that other starts have proved wrong may have missed more
        sound = ~evidence["weak"] & (evidence["real_roots"] == table.count)
        sound &= evidence["root_gap"] > CLEAR_GAP
        # a closed form counts no roots and misses nothing, but on a continuum it gives members only
        sound |= (evidence["method"] == METHODS.index("closed form")) & ~table.singular
        shown = table.status == Status.UNREACHABLE
        shown = shown | (sound & (table.count > 0) & (least > STANDING))
        q = table.q[:, self.columns]
        found = _Found(q, table.pose_index, table.branch, shown, table.singular, evidence)
        return found, np.flatnonzero(~sound | (least > STANDING))


@dataclass(frozen=True)
class _Found:
    """What one extended arm says: K candidates of the real arm, N poses."""

    q: Array
    index: NDArray[np.int64]
    branch: NDArray[np.int32]
    is_shown: NDArray[np.bool_]
    is_singular: NDArray[np.bool_]
    evidence: NDArray[np.void]

    def extended_by(self, other: "_Found", poses: NDArray[np.int64]) -> "_Found":
        """What another says of some of the poses, and nothing of the rest."""
        shown, singular = self.is_shown.copy(), self.is_singular.copy()
        evidence = self.evidence.copy()
        shown[poses], singular[poses] = other.is_shown, other.is_singular
        evidence[poses] = other.evidence
        return _Found(other.q, poses[other.index], other.branch, shown, singular, evidence)


def _united(found: list[_Found], exact: float) -> Proposal:
    """Candidates of all; out of reach is what each of them shows to be."""
    poses, evidence = len(found[0].is_shown), found[0].evidence.copy()
    for other in found[1:]:
        better = evidence["weak"] & ~other.evidence["weak"]
        evidence[better] = other.evidence[better]
    index = np.concatenate([one.index for one in found])
    order = np.argsort(index, kind="stable")
    index = index[order]
    # later arms number their roots after the earlier ones', which they may find again
    number = np.concatenate([one.branch for one in found])[order]
    if len(found) > 1:
        number = np.minimum(np.arange(len(index)) - np.searchsorted(index, index), MOST_ROOTS - 1)
    return Proposal(
        q=np.ascontiguousarray(np.concatenate([one.q for one in found])[order]),
        pose_index=index,
        branch=number.astype(np.int32),
        hint=np.where(
            np.logical_and.reduce([one.is_shown for one in found]),
            Status.UNREACHABLE,
            Status.NOT_FOUND,
        ).astype(np.uint8),
        evaluations=np.bincount(index, minlength=poses),
        singular=np.logical_or.reduce([one.is_singular for one in found]),
        exact=exact,
        evidence=evidence,
    )


def extended(robot: Robot, task: str) -> Extension:
    """The extension of an arm for a task.

    "pose" with fewer than six joints: joints about random lines, which must not move. "position"
    with three joints: a spherical wrist at the tool point. "position_axis" with five joints: a roll
    about the tool's z axis.

    Raises:
        NoClosedForm: the task does not close the system with this number of joints.

    Example:
        >>> extended(elbow_arm, "position").robot.dof
        6
    """
    n = robot.dof
    if task == "pose" and n < 6:
        return replace(_held(robot, 0), other=_held(robot, 1))
    if task == "position" and n == 3:
        check_mobility(robot, task)
        wrist = _freed(robot, [0.0, np.pi / 2, -np.pi / 2])
        return replace(wrist, turns=(_turn(0.7, -1.1, 0.4), _turn(-0.5, 0.8, 2.1)))
    if task == "position_axis" and n == 5:
        lines = axis_lines(robot.frames, robot.kinds)
        z, p = lines.T_zero[:3, 2], lines.T_zero[:3, 3]
        across = np.cross(lines.point[-1] - p, z)
        tiny = PARALLEL * lines.size
        if robot.kinds[-1] == "R" and np.linalg.norm(across) < tiny:
            if np.linalg.norm(np.cross(lines.direction[-1], z)) < PARALLEL:
                raise NoClosedForm(
                    f"no closed form for task {task!r}: {robot.joint_names[-1]} turns about the"
                    " tool's z axis, which the task leaves free; use Numerical"
                )
        check_mobility(robot, task)
        return replace(_freed(robot, [0.0]), turns=(_turn(0.0, 0.0, 0.0), _turn(0.0, 0.0, 1.0)))
    closes = (
        "pose with up to six, position with three, position_axis with five, planar with three,"
        " schoenflies with four"
    )
    raise NoClosedForm(
        f"no closed form for task {task!r} with {n} joints: joints and task close the system for"
        f" {closes}; use Numerical"
    )


def check_mobility(robot: Robot, task: str) -> None:
    """Refuse an arm that has solutions in a continuum, though it has as many joints as equations.

    Raises:
        NoClosedForm: nowhere do its joints move every component of the task.
    """
    constrained = as_task(task)
    size = axis_lines(robot.frames, robot.kinds).size
    slides = np.array([kind == "P" for kind in robot.kinds])
    q = np.random.default_rng(0).uniform(0.1, 1.5, (8, robot.dof)) * np.where(slides, size, 1.0)
    J = constrained.constrained(robot.jacobian(q), robot.fk(q))
    J[:, : constrained.position] /= size
    J[:, :, slides] *= size
    J /= np.maximum(np.linalg.norm(J, axis=1, keepdims=True), MOVES)
    rank = int(np.linalg.matrix_rank(J, tol=MOVES).max())
    if rank < constrained.size:
        raise NoClosedForm(
            f"no closed form for task {task!r}: it constrains {constrained.size} components, and"
            f" the joints of {robot.name} move {rank} of them independently; use Numerical"
        )


def _freed(robot: Robot, turns: list[float]) -> Extension:
    """Revolute joints behind the tool point, each behind a turn about x."""
    frames = list(robot.frames)
    for angle in turns:
        frames[-1] = frames[-1] @ pose([0, 0, 0], rpy=[angle, 0, 0])
        frames.append(np.eye(4))
    n, added = robot.dof, len(turns)
    limits = np.vstack([robot.limits, np.tile([-np.pi, np.pi], (added, 1))])
    name = f"{robot.name} + {added} free"
    arm = Robot(np.array(frames), robot.kinds + "R" * added, limits, name=name)
    return Extension(arm, np.arange(n), np.arange(0))


def _turn(roll: float, pitch: float, yaw: float) -> Array:
    return pose([0.0, 0.0, 0.0], rpy=[roll, pitch, yaw])


def _held(robot: Robot, variant: int) -> Extension:
    """Revolute joints about random lines, spread so that an elimination has joints to work with.

    The elimination needs two opposite joints (i and i + 3 of the closed loop) that both turn.
    Slides side by side in the loop, or next to the tool or the base, make it slow and lose roots.
    """
    n = robot.dof

    def merit(places: tuple[int, ...]) -> tuple[int, int, int]:
        sliding = {p for p, kind in zip(places, robot.kinds, strict=True) if kind == "P"}
        turning = sum(not sliding & {i, i + 3} for i in range(3))
        beside = sum((p + 1) % 6 in sliding for p in sliding)
        return min(turning, 2), -beside, -len(sliding & {0, 5})

    places = sorted(combinations(range(6), n), key=merit, reverse=True)[variant]
    rng = np.random.default_rng(n + 6 * variant)
    size = float(np.linalg.norm(robot.frames[:, :3, 3], axis=1).sum()) or 1.0
    frames: list[Array] = []
    kinds, real = "", iter(zip(robot.frames, robot.kinds, strict=False))
    before: Array = np.eye(4)
    limits = np.tile([-np.pi, np.pi], (6, 1))
    limits[list(places)] = robot.limits
    for place in range(6):
        if place in places:
            frame, kind = next(real)
            frames.append(before @ frame)
            kinds += kind
            before = np.eye(4)
        else:
            line = pose(rng.uniform(-0.5, 0.5, 3) * size, rpy=rng.uniform(-2.5, 2.5, 3))
            frames.append(before @ line)
            kinds += "R"
            before = np.asarray(np.linalg.inv(line), dtype=np.float64)
    frames.append(before @ robot.frames[n])
    arm = Robot(np.array(frames), kinds, limits, name=f"{robot.name} + {6 - n} held")
    columns = np.array(places)
    return Extension(arm, columns, np.setdiff1d(np.arange(6), columns))

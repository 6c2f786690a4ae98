"""Arms and tasks that are no six-joint pose problem, made one by virtual joints.

A closed form solves as many equations as it has joints. Where the arm has fewer joints than the
pose has components, joints that must stand still are added; where the task leaves components free,
joints that move exactly these are added, and what they take is dropped.
"""

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
from kinverse.status import Status
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
        turn: (4, 4) rotation added to the targets: a free wrist would be singular at rest.
    """

    robot: Robot
    columns: NDArray[np.int64]
    standing: NDArray[np.int64]
    turn: Array | None = None

    def propose(self, form: Any, T: Array, exact: float) -> Proposal:
        """Candidates of the real arm: the extended arm's solutions without what is virtual.

        Args:
            form: the native closed form of the extended arm, limits ignored.
            T: (N, 4, 4) poses.
            exact: error that rounding explains [m, rad].
        """
        if self.turn is not None:
            T = np.ascontiguousarray(T @ self.turn)
        if not len(self.standing):
            q, index, branch, hint, singular, evidence = form.propose(T, None)
        else:
            table = form.solve(T, None, 0)
            q, index, branch, singular = table.q, table.pose_index, table.branch, table.singular
            evidence = table.evidence
            hint = np.where(self._shown_unreachable(table), Status.UNREACHABLE, Status.NOT_FOUND)
        return Proposal(
            q=np.ascontiguousarray(q[:, self.columns]),
            pose_index=index,
            branch=branch,
            hint=hint.astype(np.uint8),
            evaluations=np.bincount(index, minlength=len(T)),
            singular=singular,
            exact=exact,
            evidence=evidence,
        )

    def _shown_unreachable(self, table: Any) -> NDArray[np.bool_]:
        """No solution of the extended arm lets its virtual joints stand, on good evidence."""
        moved = np.abs(np.remainder(table.q[:, self.standing] + np.pi, 2 * np.pi) - np.pi)
        least = np.full(len(table.status), np.inf)
        np.minimum.at(least, table.pose_index, moved.max(axis=1, initial=0.0))
        sound = ~table.evidence["weak"] & (table.evidence["root_gap"] > CLEAR_GAP)
        shown = table.status == Status.UNREACHABLE
        return np.asarray(shown | (sound & (table.count > 0) & (least > STANDING)))


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
        return _held(robot)
    if task == "position" and n == 3:
        check_mobility(robot, task)
        wrist = _freed(robot, [0.0, np.pi / 2, -np.pi / 2])
        return replace(wrist, turn=pose([0, 0, 0], rpy=[0.7, -1.1, 0.4]))
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
        return _freed(robot, [0.0])
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


def _held(robot: Robot) -> Extension:
    """Revolute joints about random lines, spread so that an elimination has joints to work with.

    The elimination needs two opposite joints (i and i + 3 of the closed loop) that both turn.
    """
    n = robot.dof
    best: tuple[int, tuple[int, ...]] = (-1, ())
    for places in combinations(range(6), n):
        sliding = {p for p, kind in zip(places, robot.kinds, strict=True) if kind == "P"}
        turning = sum(not sliding & {i, i + 3} for i in range(3))
        best = max(best, (min(turning, 2), places), key=lambda entry: entry[0])
    places = best[1]
    rng = np.random.default_rng(n)
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

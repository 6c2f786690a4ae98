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
from kinverse.solvers.closed_form.families import MOST_ROOTS
from kinverse.solvers.closed_form.settle import MOVES, Polish
from kinverse.status import METHODS, Status
from kinverse.table import plain_evidence
from kinverse.task import as_task

__all__ = ["STANDING", "Extension", "check_mobility", "extended"]

Array = NDArray[np.float64]

CLEAR_GAP = 1e-3
"""Gap between roots [rad] above which each is sure to be told from its neighbours."""

STANDING = 1e-2
"""A virtual joint [rad] further from rest than this in every solution shows that the arm itself has
none: within the tolerances a solution moves it by far less."""

CLEAR_MARGIN = 2e-2
"""Complex roots nearer to a real one than this [rad] might be one within the tolerances."""

CLEAR_MISS = 100.0
"""Where virtual joints nearly stand: least errors of the arm beside them, in tolerances, that show
that it has no solution there, if they grow with the distance from it as they must."""

EDGE = 0.3
"""Errors [tolerances] from which on it matters how the two are weighed."""

NEARLY = 0.1
"""Virtual joints further from rest than this are not worth a polish of the real ones [rad]."""

ROUNDING = 1e-12
"""Of lengths, as a part of them, and of angles [rad]."""

RESTING = 1e-10
"""Virtual joints nearer to rest than this leave nothing to polish [rad]."""

TRIALS = 12
"""Poses on which the roots of an elimination are counted."""

STARTS = 6
"""Places from which a continuum is looked for, beside the roots and the seed."""

LONGEST_RATIO = 1e4
"""Slides may go so many times further than the links; beyond it, roots show nothing."""

LONGEST_STROKE = 1e3
"""Slides that go further [m], and than the links so many times, have no limits: the arm is no
longer for that."""


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
        arm: the real arm, where virtual joints must stand.
        moves: how many directions its joints move the tool in; fewer than joints: it meets every
            pose in a continuum.
        is_long: whether its slides are too long beside its links to trust in roots.
    """

    robot: Robot
    columns: NDArray[np.int64]
    standing: NDArray[np.int64]
    turns: tuple[Array, ...] = (np.eye(4),)
    other: "Extension | None" = None
    arm: Polish | None = None
    moves: int = 6
    is_long: bool = False

    def most_roots(self, form: Any) -> int:
        """Real and complex roots that the extended arm's form finds, where it loses none.

        An elimination that drops roots (of slides, far off) tells nothing of it.
        """
        q = np.random.default_rng(3).uniform(
            self.robot.limits[:, 0], self.robot.limits[:, 1], (TRIALS, self.robot.dof)
        )
        evidence = form.solve(self.robot.fk(q), None, 0).evidence
        return int((evidence["real_roots"] + evidence["complex_roots"]).max())

    def propose(
        self,
        form: tuple[Any, int],
        other: Callable[[], tuple[Any, int]],
        T: Array,
        q_seed: Array | None,
        tolerances: tuple[float, float],
        exact: float,
    ) -> Proposal:
        """Candidates of the real arm: the extended arm's solutions without what is virtual.

        Args:
            form: the native closed form of the extended arm, limits ignored, and its most roots.
            other: makes that of the other arm.
            T: (N, 4, 4) poses.
            q_seed: (N, n) joint values to be near to, where there is a choice.
            tolerances: of position [m] and rotation [rad].
            exact: error that rounding explains [m, rad].
        """
        if self.arm is None:
            return _united([self._free(form[0], T @ turn) for turn in self.turns], exact)
        first, doubtful = self._still(form, T, tolerances)
        found = [first]
        if self.other is not None and len(doubtful):
            some = np.ascontiguousarray(T[doubtful])
            second, _ = self.other._still(other(), some, tolerances)
            found.append(first.extended_by(second, doubtful))
        # what is polished on the arm itself is told by the tolerances alone
        proposal = _united(found, np.inf)
        if self.is_continuous:
            proposal = self._representatives(proposal, T, q_seed)
        beyond = _is_beyond(self.arm.robot, T, tolerances)
        if not beyond.any():
            return proposal
        assert proposal.hint is not None and proposal.evidence is not None
        proposal.hint[beyond] = Status.UNREACHABLE
        evidence = proposal.evidence.copy()
        evidence[beyond] = plain_evidence("bounds", 1)
        return replace(proposal, evidence=evidence)

    @property
    def is_continuous(self) -> bool:
        """Whether the real arm meets every pose it reaches in a continuum."""
        return self.moves < len(self.columns)

    def _free(self, form: Any, T: Array) -> "_Found":
        q, index, branch, hint, singular, evidence = form.propose(np.ascontiguousarray(T), None)
        shown = hint == Status.UNREACHABLE
        return _Found(q[:, self.columns], index, branch, shown, singular, evidence)

    def _still(
        self, form: tuple[Any, int], T: Array, tolerances: tuple[float, float]
    ) -> tuple["_Found", NDArray[np.int64]]:
        """What it says, and the poses of which another arm should be asked.

        A pose is out of reach if no solution lets the virtual joints stand, on good evidence: they
        stand far from rest, or the arm's error beside them has a least value, and a clear one.
        """
        assert self.arm is not None
        table = form[0].solve(T, None, 0)
        index, q = table.pose_index, table.q[:, self.columns]
        moved = np.abs(np.remainder(table.q[:, self.standing] + np.pi, 2 * np.pi) - np.pi)
        moved = moved.max(axis=1, initial=0.0)
        least = np.full(len(table.status), np.inf)
        np.minimum.at(least, index, moved)
        is_clear = moved > STANDING
        rows = np.flatnonzero((moved < NEARLY) & (moved > RESTING))
        if len(rows):
            q[rows], is_clear[rows] = self._beside(
                T[index[rows]], q[rows], is_clear[rows], tolerances
            )
        missed = np.ones(len(table.status), np.bool_)
        np.logical_and.at(missed, index, is_clear)
        evidence = table.evidence.copy()
        # an elimination that other starts have proved wrong may have missed more
        # a closed form counts no roots and misses nothing, but on a continuum it gives members only
        exact = evidence["method"] == METHODS.index("closed form")
        evidence["weak"] |= (table.count > 0) & (evidence["real_roots"] != table.count) & ~exact
        exact &= ~table.singular
        roots = evidence["real_roots"] + evidence["complex_roots"]
        sound = ~evidence["weak"] & (evidence["root_gap"] > CLEAR_GAP) & (roots >= form[1])
        clear = exact | (sound & (evidence["root_margin"] > CLEAR_MARGIN))
        shown = clear & (table.count > 0) & missed
        shown = shown | (table.status == Status.UNREACHABLE)
        shown &= not (self.is_continuous or self.is_long)
        found = _Found(q, index, table.branch, shown, table.singular, evidence)
        return found, np.flatnonzero(~(sound | exact) | (least > STANDING) | missed)

    def _beside(
        self, T: Array, q: Array, is_far: NDArray[np.bool_], tolerances: tuple[float, float]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """The arm's best joint values next to those of roots, and whether they clearly miss."""
        assert self.arm is not None
        settled = self.arm.settled(T, q)
        error = self.arm.error(T, settled, tolerances)
        # what just misses a tolerance may meet both where the other error counts less
        edge = np.flatnonzero((error > EDGE) & (error < 1.0 / EDGE))
        if len(edge):
            ratio = self.arm.size * tolerances[1] / tolerances[0]
            for heft in (ratio, 3.0 * ratio, ratio / 3.0):
                q_edge = self.arm.settled(T[edge], settled[edge], float(np.clip(heft, 1e-2, 1e2)))
                again = self.arm.error(T[edge], q_edge, tolerances)
                better = np.flatnonzero(again < error[edge])
                settled[edge[better]], error[edge[better]] = q_edge[better], again[better]
        e = self.arm.residual(T, settled)
        # a solution would lie no further from a root than virtual joints that stand for rest; at a
        # distance r from the least error e the arm misses by hypot(e, firmness r) - bend r^2
        r = STANDING + 2.0 * np.linalg.norm((settled - q) / self.arm.unit, axis=1)
        bend = q.shape[1] / np.sqrt(2.0)
        within = max(tolerances[0] / self.arm.size, tolerances[1])
        grown = np.hypot(np.linalg.norm(e, axis=1), self.arm.firmness(settled) * r)
        is_clear = error > CLEAR_MISS
        return settled, is_clear & (is_far | (grown > within + bend * r * r))

    def _representatives(self, proposal: Proposal, T: Array, q_seed: Array | None) -> Proposal:
        """Members of the continua, inside the limits where there are such, near the seed."""
        assert self.arm is not None
        robot = self.arm.robot
        middle = np.broadcast_to(robot.limits.mean(axis=1), (len(T), robot.dof))
        near = middle if q_seed is None else np.clip(q_seed, *robot.limits.T)
        starts = [proposal.q, near]
        index = [proposal.pose_index, np.arange(len(T))]
        rng = np.random.default_rng(0)
        for _ in range(STARTS):
            start = rng.uniform(robot.limits[:, 0], robot.limits[:, 1])
            starts.append(np.broadcast_to(start, near.shape))
            index.append(np.arange(len(T)))
        row = np.concatenate(index)
        order = np.argsort(row, kind="stable")
        q, row = np.concatenate(starts)[order], row[order]
        q = self.arm.members(T[row], self.arm.settled(T[row], q), near[row])
        return replace(
            proposal,
            q=q,
            pose_index=row,
            branch=np.minimum(
                np.arange(len(row)) - np.searchsorted(row, row), MOST_ROOTS - 1
            ).astype(np.int32),
            evaluations=np.bincount(row, minlength=len(T)),
            singular=np.ones(len(T), np.bool_),
        )


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
        links, strokes = _lengths(robot)
        most = max(LONGEST_RATIO * links, LONGEST_STROKE)
        is_long = strokes > most or strokes > LONGEST_RATIO * links > 0.0
        size = links + min(strokes, most) or 1.0
        arm = Polish(robot, size)
        first, second = (
            replace(_held(robot, variant, size), arm=arm, moves=arm.rank(), is_long=is_long)
            for variant in (0, 1)
        )
        return replace(first, other=second)
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


def _lengths(robot: Robot) -> tuple[float, float]:
    """The links of an arm, and the furthest its slides go, added up [m]."""
    links = float(np.linalg.norm(robot.frames[:, :3, 3], axis=1).sum())
    slides = np.array([kind == "P" for kind in robot.kinds])
    return links, float(np.abs(robot.limits[slides]).max(axis=1).sum())


def _is_beyond(robot: Robot, T: Array, tolerances: tuple[float, float]) -> NDArray[np.bool_]:
    """Poses (N,) that an arm misses in what its joints do not move, limits ignored.

    Joints that only slide keep the tool's rotation, and those that turn about one direction its
    angle to that; links in a straight line reach no further than their length.
    """
    position, rotation = tolerances
    lines = axis_lines(robot.frames, robot.kinds)
    is_turn = np.array([kind == "R" for kind in robot.kinds])
    R = T[:, :3, :3] @ lines.T_zero[:3, :3].T
    beyond = np.zeros(len(T), np.bool_)
    if not is_turn.any():
        beyond |= _angle(R) > rotation + ROUNDING
        # and it moves in the span of the slides alone
        way = np.linalg.svd(lines.direction.T)
        across = way[0][:, int((way[1] > ROUNDING).sum()) :]
        off = np.linalg.norm((T[:, :3, 3] - lines.T_zero[:3, 3]) @ across, axis=1)
        far = np.linalg.norm(T[:, :3, 3], axis=1) + np.linalg.norm(lines.T_zero[:3, 3])
        return np.asarray(beyond | (off > position + ROUNDING * far))
    u = lines.direction[is_turn][0]
    apart = float(np.linalg.norm(np.cross(lines.direction[is_turn], u), axis=1).sum())
    if apart < PARALLEL:
        beyond |= (
            2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(R @ u - u, axis=1)))
            > rotation + 2.0 * np.pi * apart + ROUNDING
        )
    if is_turn.all():
        reach = float(np.linalg.norm(robot.frames[1:, :3, 3], axis=1).sum())
        away = np.linalg.norm(T[:, :3, 3] - robot.frames[0, :3, 3], axis=1)
        beyond |= away > reach * (1.0 + ROUNDING) + position + ROUNDING * away
    return beyond


def _angle(R: Array) -> Array:
    """The angle (N,) of rotations, good for small ones too."""
    moment = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]])
    angle = np.arctan2(np.linalg.norm(moment, axis=0), np.trace(R, axis1=1, axis2=2) - 1.0)
    return np.asarray(angle)


def _held(robot: Robot, variant: int, size: float) -> Extension:
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

"""Arms that only slide and turn about one direction, for the tasks that leave the tool's tilt free.

The tool of such an arm stands at ``Rot(u, psi) R_zero`` and nowhere else. "planar" and
"schoenflies" ask that the rotation ``R_target (Rot(u, psi) R_zero)^T`` that is left over has no
part about the base's z axis, which gives psi. The tool point is then a sum of links, each turned
about u by the angles before it, with a slide added to some of them. One angle phi between the
first turn and psi stays unknown, and what is left of the position equations when the slides are
eliminated has the form ``a cos(phi) + b sin(phi) + c = 0``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import NoClosedForm
from kinverse.geometry import PARALLEL, axis_lines
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal
from kinverse.status import Status
from kinverse.table import plain_evidence

__all__ = ["PARALLEL_TASKS", "ParallelArm", "parallel_arm"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

PARALLEL_TASKS = {"planar": 3, "schoenflies": 4}
"""The tasks and the number of joints that closes them."""

SPREAD = 24
"""Values tried of an angle that the target leaves free."""

FREE = 1e-12
"""Terms of an angle's equation below this part of the arm's length leave it free."""

ROUNDING = 1e-12
"""Of lengths, as a part of the largest one."""

DEPENDENT = 1e-9
"""Ratio of singular values below which slides, as they stand, do not move apart."""


@dataclass(frozen=True)
class ParallelArm:
    """Closed form of an arm whose turning axes are all parallel; every slide moves the tool.

    Attributes:
        axis: (3,) the direction u of the turning axes, in the base frame.
        turns: (k,) indices of the joints that turn, k = 1, 2 or 3.
        sign: (k,) 1 or -1: whether each turns about u or the other way round.
        link: (k + 1, 3) from the base's origin to the first axis, on from axis to axis, and to the
            tool point, while all joints stand at zero [m].
        slides: indices of the joints that slide, in order; -1 for the height that "planar" leaves
            free.
        level: how many turns come before each slide.
        way: (4 - k, 3) unit direction of each slide while the turns stand at zero.
        R_zero: (3, 3) the tool's rotation while all joints stand at zero.
        limits: (n, 2) of the joints [rad or m].
        deviation: how far the equations may be from the arm [m, rad]: axes that are parallel to
            within ``PARALLEL`` are taken to be so.
    """

    axis: Array
    turns: NDArray[np.int64]
    sign: Array
    link: Array
    slides: tuple[int, ...]
    level: tuple[int, ...]
    way: Array
    R_zero: Array
    limits: Array
    deviation: float = 0.0

    @property
    def branch_labels(self) -> tuple[str, ...]:
        """The sign of the root; arms that turn once have none."""
        return ("elbow+", "elbow-") if len(self.turns) > 1 else ("one",)

    @property
    def size(self) -> float:
        """A length of the arm [m]."""
        return float(np.linalg.norm(self.link, axis=1).sum()) or 1.0

    def propose(
        self, T: Array, q_seed: Array | None, tol_position: float, tol_rotation: float, exact: float
    ) -> Proposal:
        """Every branch.

        Args:
            T: (N, 4, 4) targets.
            q_seed: (N, n) joint values to be near to where the target leaves some free.
            tol_position: largest position error [m].
            tol_rotation: largest rotation error [rad].
            exact: error that rounding explains [m, rad].
        """
        near = np.broadcast_to(self.limits.mean(axis=1), (len(T), len(self.limits)))
        if q_seed is not None:
            near = np.clip(q_seed, *self.limits.T)
        turned = near[:, self.turns] * self.sign
        psi, hold = self._psi(T[:, :3, :3])
        # the part about z, h sin((psi - psi_0) / 2) of the left over unit quaternion, belongs to
        # a rotation error of 2 to pi times as much
        is_free = np.pi * hold <= tol_rotation
        psi, row = _spread(psi, turned.sum(axis=1), is_free)
        slack = 2.0 * np.arcsin(np.minimum(1.0, tol_rotation / (2.0 * hold + 1e-300)))[row]
        p = np.ascontiguousarray(T[row, :3, 3])
        if -1 in self.slides:
            p[:, 2] = self.link.sum(axis=0)[2]  # any height will do
        outside, singular = np.zeros(len(p), np.bool_), is_free[row]
        phi, branch = np.empty((len(p), 0)), np.zeros(len(p), np.int32)
        if len(self.turns) > 1:
            a, b, c, outside = self._equation(p, psi, tol_position, slack)
            any_phi = np.hypot(a, b) + np.abs(c) <= FREE * (self.size + np.abs(p).sum(axis=1))
            middle, k = _spread(np.arctan2(b, a), turned[row, 0], any_phi)
            half = np.arctan2(np.sqrt(np.maximum(a * a + b * b - c * c, 0.0)), -c)
            half = np.where(any_phi, 0.0, half)[k]
            phi = np.stack([middle + half, middle - half], axis=1).reshape(-1, 1)
            branch = np.tile(np.array([0, 1], np.int32), len(k))
            k = np.repeat(k, 2)
            outside, singular = outside[k], (singular | any_phi)[k]
            psi, p, row = psi[k], p[k], row[k]
        q, is_dependent = self._joints(p, psi, phi, near[row])
        singular = singular | is_dependent
        shown, met = np.ones(len(T), np.bool_), np.zeros(len(T), np.bool_)
        np.logical_and.at(shown, row, outside)
        np.logical_or.at(met, row, singular)
        return Proposal(
            q=q,
            pose_index=row,
            branch=branch,
            hint=np.where(shown, Status.UNREACHABLE, Status.NOT_FOUND).astype(np.uint8),
            evaluations=np.bincount(row, minlength=len(T)),
            singular=met,
            exact=exact,
            evidence=plain_evidence("closed form", len(T)),
        )

    def _psi(self, R: Array) -> tuple[Array, Array]:
        """The angle (N,) of the tool, and how fast the task's rotation error grows with it."""
        w, x, y, z = np.moveaxis(se3.quat_from_rotation(R @ self.R_zero.T), -1, 0)
        # z part of the quaternion product with (cos psi/2, -u sin psi/2)
        u = self.axis
        along = w * u[2] + x * u[1] - y * u[0]
        return 2.0 * np.arctan2(z, along), np.hypot(along, z)

    def _equation(
        self, p: Array, psi: Array, tol_position: float, slack: Array
    ) -> tuple[Array, Array, Array, Bools]:
        """Coefficients of phi's equation [m], and where no phi within the tolerances solves it."""
        u = self.axis
        if len(self.turns) == 3:
            t, v, far, hand = self._two_links(p, psi)
            reach, inner, outer, hand = (
                np.linalg.norm(x - _dot(x, u)[:, None] * u, axis=1) for x in (t, v, far, hand)
            )
            a, b = _turned_dot(t, v, u)
            c = -0.5 * (reach * reach + inner * inner - outer * outer)
            scale = np.maximum(reach + inner + outer, 1e-300)
            # a slide that leans moves one link when the height changes
            lean = np.linalg.norm(np.cross(self.way[0], u)) / abs(self.way[0] @ u)
            moved = tol_position * (1.0 + lean) + slack * hand
            gap = np.maximum(reach - inner - outer, np.abs(inner - outer) - reach)
            return a / scale, b / scale, c / scale, gap > moved + ROUNDING * self._span(p)
        t = p - self.link[0] - self._turned(psi, self.link[2])
        v, zero = self.link[1], np.zeros(len(p))
        one, other = (self._way(m, psi, zero) for m in (0, 1))
        carried = [level == 1 for level in self.level]
        if not any(carried):
            n = np.cross(one, other)
            a, b = _turned_dot(-n, v, u)
            c = _dot(n, t) - _dot(n, u) * (v @ u)
        elif all(carried):
            n = np.cross(self.way[0], self.way[1])
            a, b = _turned_dot(t, n, u)
            c = _dot(t, u) * (n @ u) - n @ v
        else:
            still, moving = (one, other) if carried[1] else (other, one)
            beside, carrying = np.cross(t, still), np.cross(moving, v)
            a, b = _turned_dot(beside, moving, u)
            a_carried, b_carried = _turned_dot(still, carrying, u)
            a, b = a - a_carried, b - b_carried
            c = _dot(beside, u) * _dot(moving, u) - _dot(still, u) * _dot(carrying, u)
        moved = tol_position + 3.0 * slack * self._span(p)
        return a, b, c, np.abs(c) - np.hypot(a, b) > moved + ROUNDING * self._span(p)

    def _two_links(self, p: Array, psi: Array) -> tuple[Array, Array, Array, Array]:
        """The way that two links must bridge (K, 3), these and the last, with the slide put in."""
        u = self.axis
        d = _dot(p - self.link.sum(axis=0), u) / (self.way[0] @ u)
        link = np.broadcast_to(self.link, (len(p), 4, 3)).copy()
        link[:, self.level[0]] += d[:, None] * self.way[0]
        t = p - link[:, 0] - self._turned(psi, link[:, 3])
        return t, link[:, 1], link[:, 2], link[:, 3]

    def _joints(self, p: Array, psi: Array, phi: Array, near: Array) -> tuple[Array, Bools]:
        """Joint values (K, n) from the angles, and where slides do not move apart."""
        angles = [np.zeros(len(p)), *phi.T]
        if len(self.turns) == 3:
            t, v, far, _ = self._two_links(p, psi)
            rest = t - self._turned(phi[:, 0], v)
            c, s = _turned_dot(rest, far, self.axis)
            angles.append(np.arctan2(s, c))
        angles.append(psi)
        q = near.copy()
        q[:, self.turns] = np.diff(np.stack(angles, axis=1), axis=1) * self.sign
        rest = p - self.link[0]
        for angle, link in zip(angles[1:], self.link[1:], strict=True):
            rest = rest - self._turned(angle, link)
        ways = [self._turned(angles[k], w) for k, w in zip(self.level, self.way, strict=True)]
        W = np.stack(ways, axis=2)
        U, S, Vt = np.linalg.svd(W, full_matrices=False)
        is_dependent = S[:, -1] <= DEPENDENT * S[:, 0]
        columns = list(self.slides)
        start = np.where(is_dependent[:, None], near[:, columns], 0.0)
        start[:, [column < 0 for column in columns]] = 0.0
        rest = rest - (W @ start[:, :, None])[:, :, 0]
        along = (np.swapaxes(U, 1, 2) @ rest[:, :, None])[:, :, 0]
        along = np.where(S > DEPENDENT * S[:, :1], along / np.maximum(S, 1e-300), 0.0)
        d = start + (np.swapaxes(Vt, 1, 2) @ along[:, :, None])[:, :, 0]
        for k, column in enumerate(columns):
            if column >= 0:
                q[:, column] = d[:, k]
        return q, is_dependent

    def _turned(self, angle: Array, v: Array) -> Array:
        """Vectors (3,) or (K, 3) turned about u by angles (K,)."""
        u = self.axis
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        along = _dot(v, u)[..., None] * u
        return np.asarray(c * (v - along) + s * np.cross(u, v) + along)

    def _way(self, slide: int, psi: Array, phi: Array) -> Array:
        """A slide's direction (K, 3) of an arm that turns twice."""
        return self._turned((np.zeros(len(psi)), phi, psi)[self.level[slide]], self.way[slide])

    def _span(self, p: Array) -> Array:
        """More than any length in the equations, and the slides (K,) [m]."""
        return np.asarray(4.0 * (np.linalg.norm(p, axis=1) + self.size))


def parallel_arm(robot: Robot, task: str) -> ParallelArm:
    """The closed form of an arm for "planar" or "schoenflies".

    Raises:
        NoClosedForm: its turning axes are not all parallel, or its joints do not move what the
            task constrains.

    Example:
        >>> parallel_arm(kv.load("adept_one"), "schoenflies").branch_labels
        ('elbow+', 'elbow-')
    """
    lines = axis_lines(robot.frames, robot.kinds)
    is_turn = np.array([kind == "R" for kind in robot.kinds])
    turns = np.flatnonzero(is_turn)
    if not len(turns):
        raise NoClosedForm(
            f"no closed form for task {task!r}: {robot.name} has slides only and cannot turn its"
            " tool; use Numerical"
        )
    u = lines.direction[turns[0]]
    apart = np.linalg.norm(np.cross(lines.direction[turns], u), axis=1)
    if apart.max() > PARALLEL:
        one, other = (robot.joint_names[i] for i in (turns[0], turns[apart.argmax()]))
        raise NoClosedForm(
            f"no closed form for task {task!r}: it takes turning axes that are all parallel, and"
            f" those of {one} and {other} are {np.degrees(np.arcsin(apart.max())):.3g} degrees"
            " apart; use Numerical"
        )
    stations = np.vstack([np.zeros(3), lines.point[turns], lines.T_zero[:3, 3]])
    slides = tuple(int(i) for i in np.flatnonzero(~is_turn))
    level = tuple(int(is_turn[:i].sum()) for i in slides)
    way = lines.direction[list(slides)].reshape(-1, 3)
    if task == "planar":
        slides, level, way = (-1, *slides), (0, *level), np.vstack([[0.0, 0.0, 1.0], way])
    link = np.diff(stations, axis=0)
    span = 1.0 + np.linalg.norm(link, axis=1).sum() + np.abs(robot.limits[~is_turn]).sum()
    return ParallelArm(
        axis=u,
        turns=turns,
        sign=np.sign(lines.direction[turns] @ u),
        link=link,
        slides=slides,
        level=level,
        way=way,
        R_zero=lines.T_zero[:3, :3],
        limits=robot.limits,
        # what rounding makes of parallel axes is none
        deviation=float(4.0 * span * apart.sum()) if apart.max() > 1e-14 else 0.0,
    )


def _spread(angle: Array, start: Array, is_free: Bools) -> tuple[Array, NDArray[np.int64]]:
    """Angles with those that are free spread over a turn from their start, and their rows."""
    row = np.repeat(np.arange(len(angle)), np.where(is_free, SPREAD, 1))
    step = np.arange(len(row)) - np.searchsorted(row, row)
    return np.where(is_free, start, angle)[row] + step * (2.0 * np.pi / SPREAD), row


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))


def _turned_dot(a: Array, b: Array, u: Array) -> tuple[Array, Array]:
    """Factors of cos(phi) and sin(phi) in ``a . Rot(u, phi) b``; the rest is (a . u)(b . u)."""
    return _dot(a, b) - _dot(a, u) * _dot(b, u), _dot(a, np.cross(u, b))

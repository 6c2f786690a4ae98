"""Denavit-Hartenberg tables of arms that were given in any other way.

Frames are assigned by the five steps of the thesis of Jha (NIT Rourkela 2015), section 4.2.3:
1 the base, 2 origins where common normals meet the axes, 3 x axes along the common normals, 4 the
end effector, 5 the parameters read off.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.dh import CONVENTIONS
from kinverse.errors import InputError
from kinverse.geometry import AxisLines, any_perpendicular, common_normal, frame_on_axis

__all__ = ["DHTable", "dh_table"]

Array = NDArray[np.float64]

SAME_DIRECTION = 1e-13
"""Sine of the angle below which two axes count as parallel: what is lost stays below rounding."""
NEARLY_PARALLEL = 1e-3
"""Sine below which rounding decides where along the axes their common normal lies: its place is
known to rounding/sine^2 (Hayati & Mirmirani 1985)."""
FAR = 30.0
"""Sizes of the arm beyond which the foot of a common normal costs digits of d: the normal of axes
nearly parallel runs off as 1/sine, and what is added there is taken off again a row later."""
SNAPPED = 1e-14
"""Distance from a quarter turn [rad] from which a table must not rely on its angle being kept:
:func:`kinverse.se3.cos_sin` takes angles that near for the quarter turn itself."""


@dataclass(frozen=True, eq=False)
class DHTable:
    """The rows of an arm; ``Robot.from_dh(**table.arguments())`` is the arm again.

    "standard" rows read ``Rz(theta) Tz(d) Tx(a) Rx(alpha)``, "modified" (Craig) ones
    ``Rx(alpha) Tx(a) Rz(theta) Tz(d)``; the joint value is added to theta (R) or to d (P).

    Attributes:
        a: (rows,) link lengths [m], never negative between two joints.
        d: (rows,) link offsets [m].
        alpha: (rows,) twists [rad].
        theta: (rows,) constant angles [rad].
        joints: one letter a row: R, P, or F for fixed rows; see :meth:`kinverse.Robot.to_dh`.
        convention: "standard" or "modified".
        base: (4, 4) pose of the first row in the base frame; the identity where it can be.
        tool: (4, 4) pose of the tool in the frame of the last row; likewise.
        limits: (n, 2) of the moving rows [rad or m].
        joint_names: n names.
        name: the robot's name.
    """

    a: Array
    d: Array
    alpha: Array
    theta: Array
    joints: str
    convention: str
    base: Array
    tool: Array
    limits: Array
    joint_names: tuple[str, ...]
    name: str

    def arguments(self) -> dict[str, Any]:
        """What :meth:`kinverse.Robot.from_dh` takes to build the arm again.

        Example:
            >>> kv.Robot.from_dh(**robot.to_dh("modified").arguments()).dof
            6
        """
        return {field.name: getattr(self, field.name) for field in fields(self)}


class _Rows:
    """Screws along z and x in turn: z0 x0 z1 x1 ... as they are read along the chain."""

    def __init__(self, z: Array, x: Array, origin: Array) -> None:
        self.z, self.x, self.origin = z, x, origin
        self.turns: list[tuple[float, float]] = []  # (theta, d) about and along each z
        self.links: list[tuple[float, float]] = []  # (alpha, a) about and along each x
        self.kinds = ""

    def turn(self, x: Array, foot: Array, kind: str) -> None:
        """About and along the axis, to a new x and origin."""
        y = np.cross(self.z, self.x)
        self.turns.append((_angle(x @ y, x @ self.x), float(self.z @ (foot - self.origin))))
        self.x, self.origin, self.kinds = x, foot, self.kinds + kind

    def link(self, z: Array, a: float) -> None:
        """About and along the common normal, to the next axis."""
        self.links.append((_angle(np.cross(self.z, z) @ self.x, self.z @ z), a))
        self.z, self.origin = z, self.origin + a * self.x
        # rounding must not make the frames drift from their right angles
        self.x = _unit(self.x - (self.x @ z) * z)


def dh_table(
    lines: AxisLines,
    kinds: str,
    convention: str,
    limits: Array,
    joint_names: tuple[str, ...],
    name: str,
) -> DHTable:
    """Rows of the chain whose axes are ``lines``; see :meth:`kinverse.Robot.to_dh`.

    Raises:
        InputError: an unknown convention.
    """
    if convention not in CONVENTIONS:
        raise InputError(f"convention must be {' or '.join(CONVENTIONS)}, got {convention!r}")
    standard = convention == "standard"
    base, rows, first = _step_1_base(lines, standard)
    tiny = 1e-14 * lines.size
    for i, kind in enumerate(kinds[:-1]):
        _steps_2_and_3(rows, kind, lines, i, tiny)
    tool, last = _step_4_end_effector(rows, kinds[-1], lines.T_zero, standard, tiny)
    # step 5: standard rows are z x, z x, ...; modified ones x z, x z, ...
    links = [*rows.links, last] if standard else [first, *rows.links]
    joints, read = _kept(rows.kinds, np.column_stack([rows.turns, links]), standard)
    theta, d, alpha, a = read.T
    return DHTable(
        a=_clean(a, tiny),
        d=_clean(d, tiny),
        alpha=_clean(alpha, 1e-15),
        theta=_clean(theta, 1e-15),
        joints=joints,
        convention=convention,
        base=base,
        tool=tool,
        limits=limits,
        joint_names=joint_names,
        name=name,
    )


def _step_1_base(lines: AxisLines, standard: bool) -> tuple[Array, _Rows, tuple[float, float]]:
    """The first frame: the robot's own base frame where the convention lets it be."""
    z, point = lines.direction[0], lines.point[0]
    e_x, e_z = np.eye(3)[0], np.eye(3)[2]
    off_axis = point - (point @ z) * z
    tiny = 1e-15 * lines.size
    nothing = (0.0, 0.0)
    if np.linalg.norm(np.cross(z, e_z)) < SAME_DIRECTION and np.linalg.norm(off_axis) < tiny:
        if z @ e_z > 0.0:
            return np.eye(4), _Rows(e_z, e_x, np.zeros(3)), nothing
    if not standard and abs(z[0]) < SAME_DIRECTION:
        # Rx(alpha0) Tx(a0) leads to an axis that crosses the base's x axis at right angles
        crossing = point - (point @ z) * z
        if np.linalg.norm(crossing[1:]) < tiny:
            a = float(crossing[0])
            alpha = _angle(-z[1], z[2])
            return np.eye(4), _Rows(z, e_x, np.array([a, 0.0, 0.0])), (alpha, a)
    x = any_perpendicular(z) if abs(z[0]) > 0.9 else _unit(e_x - z[0] * z)
    return frame_on_axis(z, x, point), _Rows(z, x, point), nothing


def _steps_2_and_3(rows: _Rows, kind: str, lines: AxisLines, i: int, tiny: float) -> None:
    """Origin where the common normal meets axis i, x along it, then on to axis i + 1."""
    z, point = lines.direction[i + 1], lines.point[i + 1]
    foot, next_foot, normal, a = _normal(rows, z, point, tiny)
    sine = float(np.linalg.norm(np.cross(rows.z, z)))
    if sine > SAME_DIRECTION:
        far = max(np.linalg.norm(foot - lines.point[i]), np.linalg.norm(next_foot - point))
        if sine < NEARLY_PARALLEL or far > FAR * lines.size:
            # an axis in between, square to both, reaches what a distant normal cannot
            across_x, across = _square_axis(rows, z, point, tiny)
            rows.turn(across_x, rows.origin, kind)
            rows.link(across, 0.0)
            kind = "F"
            foot, _, normal, a = _normal(rows, z, point, tiny)
    along = normal @ rows.x
    # where axes meet either direction will do: the one that turns x less
    if a == 0.0 and (
        along < -1e-9 or (abs(along) <= 1e-9 and np.cross(rows.x, normal) @ rows.z < 0)
    ):
        normal = -normal
    rows.turn(_unit(normal - (normal @ rows.z) * rows.z), foot, kind)
    rows.link(z, a)


def _normal(rows: _Rows, z: Array, point: Array, tiny: float) -> tuple[Array, Array, Array, float]:
    return common_normal(rows.z, rows.origin, z, point, rows.x, tiny, parallel=SAME_DIRECTION)


def _square_axis(rows: _Rows, z: Array, point: Array, tiny: float) -> tuple[Array, Array]:
    """A direction square to this axis, towards the next one, and the x axis that leads to it."""
    towards = point - rows.origin
    towards = towards - (towards @ z) / (rows.z @ z) * rows.z
    towards = towards - (towards @ rows.z) * rows.z
    across = _unit(towards) if np.linalg.norm(towards) > 1e3 * tiny else rows.x
    return np.cross(rows.z, across), across


def _step_4_end_effector(
    rows: _Rows, kind: str, T_zero: Array, standard: bool, tiny: float
) -> tuple[Array, tuple[float, float]]:
    """The last frame: the tool's own where the convention allows it, else along the last axis."""
    x_tool, z_tool, tip = T_zero[:3, 0], T_zero[:3, 2], T_zero[:3, 3]
    height = (tip - rows.origin) @ rows.z
    off_axis = tip - rows.origin - height * rows.z
    foot, reach = rows.origin + height * rows.z, float(np.linalg.norm(off_axis))
    if not standard:
        on_axis = reach < tiny and np.linalg.norm(np.cross(rows.z, z_tool)) < SAME_DIRECTION
        if on_axis and rows.z @ z_tool > 0.0:
            rows.turn(x_tool, foot, kind)
            return np.eye(4), (0.0, 0.0)
    elif abs(x_tool @ rows.z) < SAME_DIRECTION:
        # x of the tool is square to the axis; it must also cross it
        a = float(off_axis @ x_tool)
        if np.linalg.norm(off_axis - a * x_tool) < tiny:
            rows.turn(x_tool, foot, kind)
            return np.eye(4), (_angle(np.cross(rows.z, z_tool) @ x_tool, rows.z @ z_tool), a)
    x = off_axis / reach if reach > 1e3 * tiny else rows.x
    rows.turn(_unit(x - (x @ rows.z) * rows.z), foot, kind)
    a = reach if standard and reach > 1e3 * tiny else 0.0
    last = frame_on_axis(rows.z, rows.x, rows.origin + a * rows.x)
    return se3.inverse(last) @ T_zero, (0.0, a)


def _kept(kinds: str, rows: Array, standard: bool) -> tuple[str, Array]:
    """Rows (theta, d, alpha, a) without angles that reading a table would change.

    Angles next to a quarter turn but not on it are shared with a fixed row, a third to two thirds.
    """
    out: list[tuple[float, ...]] = []
    joints = ""
    for kind, (theta, d, alpha, a) in zip(kinds, rows.tolist(), strict=True):
        before: list[tuple[float, ...]] = []
        after: list[tuple[float, ...]] = []
        more_theta, more_alpha = (_snap_loss(angle) for angle in (theta, alpha))
        # the turn comes first in a standard row, the twist in a modified one
        first, second = (before, after) if standard else (after, before)
        if more_theta > SNAPPED:
            first.append((theta / 3, 0.0, 0.0, 0.0))
            theta -= theta / 3
        if more_alpha > SNAPPED:
            second.append((0.0, 0.0, alpha / 3, 0.0))
            alpha -= alpha / 3
        out += [*before, (theta, d, alpha, a), *after]
        joints += "F" * len(before) + kind + "F" * len(after)
    return joints, np.array(out, dtype=np.float64)


def _snap_loss(angle: float) -> float:
    """How much of an angle is lost where a table is read [rad]."""
    c, s = se3.cos_sin(angle)
    return abs(float(s * np.cos(angle) - c * np.sin(angle)))


def _unit(x: Array) -> Array:
    return np.asarray(x / np.linalg.norm(x))


def _angle(sine: ArrayLike, cosine: ArrayLike) -> float:
    return float(np.arctan2(sine, cosine))


def _clean(values: Array, tiny: float) -> Array:
    """Rounding about zero removed; the array closed to writing."""
    out = np.where(np.abs(values) <= tiny, 0.0, values) + 0.0
    out.setflags(write=False)
    return out

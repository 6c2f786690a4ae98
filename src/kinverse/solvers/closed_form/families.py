"""Which closed form solves an arm, found from the geometry of its axes.

A family is a property of the lines in space, not of a table: whether axes meet or are parallel.
The numbers of the enumerations are those of the core (closed_form_spec.hpp).
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import NoClosedForm
from kinverse.geometry import (
    PARALLEL,
    AxisLines,
    Links,
    axis_lines,
    links_between,
    reversed_lines,
)
from kinverse.robot import Robot
from kinverse.solvers.closed_form.decoupled import is_decoupled

__all__ = [
    "BRANCH_SIGNS",
    "MOST_ROOTS",
    "ClosedFormSpec",
    "Family",
    "Regional",
    "check_own_joints",
    "closed_form_spec",
]

Array = NDArray[np.float64]


class Family(IntEnum):
    """The equations that solve an arm."""

    SPHERICAL_WRIST = 0
    THREE_PARALLEL = 1
    TWO_AXIS_WRIST = 2
    THREE_PARALLEL_SHORT = 3
    SCARA = 4
    GENERAL_6R = 5
    DECOUPLED = 6  # in Python: kinverse.solvers.closed_form.decoupled


class Regional(IntEnum):
    """What makes the first three joints solvable by quadratic equations (Pieper 1968)."""

    PARALLEL_23 = 0
    PARALLEL_12 = 1
    INTERSECTING_12 = 2
    INTERSECTING_23 = 3


MISFIT = 3e-10
"""Largest difference between a six-joint arm and the DH rows of its family, as a part of its size:
an arm that just misses a family is solved as a general one, on its own geometry."""

MISFIT_SHORT = 1e-13
"""The same below six joints: such an arm does not reach what its family reaches."""

MISFIT_SEVEN = 1e-8
"""The same for seven joints, where a general arm costs a thousand times more."""

BRANCH_SIGNS = {
    Family.SPHERICAL_WRIST: ("shoulder", "elbow", "wrist"),
    Family.THREE_PARALLEL: ("shoulder", "elbow", "wrist"),
    Family.TWO_AXIS_WRIST: ("shoulder", "elbow"),
    Family.THREE_PARALLEL_SHORT: ("shoulder", "elbow"),
    Family.SCARA: ("elbow",),
    Family.GENERAL_6R: (),
    Family.DECOUPLED: ("wrist",),
}
"""What the bits of a branch number stand for, the highest bit first; a general arm has roots."""

MOST_ROOTS = 16
"""Solutions of a six-joint arm, at most (Lee & Liang 1988)."""


@dataclass(frozen=True)
class ClosedFormSpec:
    """An arm in the form its family's equations are written for.

    Attributes:
        family: the equations.
        regional: the way of the first three joints, where the family has one.
        is_reversed: solved from the tool: the wrist is at the base.
        links: DH rows of the arm as solved.
        joint: (n,) which joint of the robot each row moves.
        size: length of the arm [m].
    """

    family: Family
    regional: Regional
    is_reversed: bool
    links: Links
    joint: NDArray[np.int32]
    size: float

    @property
    def perpendicular_wrist(self) -> bool:
        """Whether the axes of the hand's three joints stand at right angles, exactly."""
        c = self.links.cos_alpha
        return len(c) == 6 and bool(abs(c[3]) < 1e-14 and abs(c[4]) < 1e-14)

    def pose(self, q: Array) -> Array:
        """Forward kinematics (N, 4, 4) of the rows, for joint values (N, n) of the robot."""
        links = self.links
        theta = links.sign * q[:, self.joint] + links.offset
        T = np.broadcast_to(links.base, (len(q), 4, 4))
        for i in range(len(self.joint)):
            slides = self.family is Family.SCARA and i == 3
            turn, slide = (0.0, theta[:, i]) if slides else (theta[:, i], links.d[i])
            T = T @ _row(turn, slide, links.a[i], links.cos_alpha[i], links.sin_alpha[i], len(q))
        T = T @ links.tool
        return np.asarray(np.linalg.inv(T) if self.is_reversed else T)

    def deviation(self, robot: Robot) -> float:
        """How far the rows' forward kinematics may be from the robot's own [m, rad].

        Axes that are parallel or meet to within ``PARALLEL`` are taken to be so exactly. Measured
        on joint values from -pi to pi, times four.
        """
        return 4.0 * self._misfit(robot)

    def fits(self, robot: Robot) -> bool:
        """Whether the rows are near enough to the robot to stand for it."""
        n = robot.dof
        most = MISFIT if n == 6 else MISFIT_SHORT if n < 6 else MISFIT_SEVEN
        return self._misfit(robot) < most * self.size

    def _misfit(self, robot: Robot) -> float:
        q = np.random.default_rng(0).uniform(-np.pi, np.pi, (64, robot.dof))
        return float(np.abs(self.pose(q) - robot.fk(q)).max())

    @property
    def branch_labels(self) -> tuple[str, ...]:
        """A name for each branch number: the signs taken, or the rank of the root."""
        if self.family is Family.GENERAL_6R:
            return tuple(f"root {rank + 1}" for rank in range(MOST_ROOTS))
        names = BRANCH_SIGNS[self.family]
        labels = []
        for number in range(2 ** len(names)):
            bits = f"{number:0{len(names)}b}"
            signs = ("+" if bit == "0" else "-" for bit in bits)
            labels.append(" ".join(name + sign for name, sign in zip(names, signs, strict=True)))
        return tuple(labels)


def _row(theta: Array | float, d: Array | float, a: float, ca: float, sa: float, n: int) -> Array:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) for n angles."""
    c, s = np.cos(theta), np.sin(theta)
    T = np.zeros((n, 4, 4))
    T[:, 0, 0], T[:, 0, 1], T[:, 0, 2], T[:, 0, 3] = c, -s * ca, s * sa, a * c
    T[:, 1, 0], T[:, 1, 1], T[:, 1, 2], T[:, 1, 3] = s, c * ca, -c * sa, a * s
    T[:, 2, 1], T[:, 2, 2], T[:, 2, 3], T[:, 3, 3] = sa, ca, d, 1.0
    return T


def closed_form_spec(robot: Robot) -> ClosedFormSpec:
    """The closed form of a robot.

    Raises:
        NoClosedForm: no family fits; the message says what was looked for.

    Example:
        >>> closed_form_spec(kv.load("puma560")).family.name
        'SPHERICAL_WRIST'
    """
    check_own_joints(robot)
    n = robot.dof
    lines = axis_lines(robot.frames, robot.kinds)
    if (spec := _scara(lines, robot.kinds)) and spec.fits(robot):
        return spec
    if n in (5, 6):
        links = links_between(lines)
        if "P" not in robot.kinds:
            if spec := _wristed(robot, lines, links, is_reversed=False):
                return spec
            back = reversed_lines(lines)
            if spec := _wristed(robot, back, links_between(back), is_reversed=True):
                return spec
        if n == 6:
            joint = np.arange(n, dtype=np.int32)
            family = Family.DECOUPLED if is_decoupled(lines, robot.kinds) else Family.GENERAL_6R
            return ClosedFormSpec(family, Regional.PARALLEL_23, False, links, joint, lines.size)
    raise NoClosedForm(
        f"{robot.name} ({robot.kinds}) has no closed form here: it was looked for a spherical wrist"
        " at either end, three consecutive parallel axes with the last two meeting, their 5R forms,"
        " and three parallel revolute joints with or without a parallel slide; use Numerical"
    )


def _wristed(
    robot: Robot, lines: AxisLines, links: Links, is_reversed: bool
) -> ClosedFormSpec | None:
    """A family of five or six turning joints, the wrist at the end of these lines."""
    found = _six(links, lines.size) if robot.dof == 6 else _five(links, lines.size)
    if not found:
        return None
    order = np.arange(robot.dof, dtype=np.int32)
    joint = order[::-1].copy() if is_reversed else order
    spec = ClosedFormSpec(*found, is_reversed, links, joint, lines.size)
    return spec if spec.fits(robot) else None


def check_own_joints(robot: Robot) -> None:
    """Refuse joints that do not stand at their own value: frames alone would not be the arm.

    Raises:
        NoClosedForm: mimic joints, a multiple, a shift, or another order.
    """
    n = robot.dof
    if len(robot.kinds) != n:
        raise NoClosedForm(f"{robot.name}: mimic joints have no closed form; use Numerical")
    own = np.array_equal(robot.source, np.arange(n)) and not robot.offset.any()
    if not own or (robot.multiplier != 1.0).any():
        raise NoClosedForm(
            f"{robot.name}: joints that stand at a multiple or a shift of their value have no"
            " closed form; use Numerical"
        )


def _regional(links: Links, size: float) -> Regional | None:
    tiny = PARALLEL * size
    parallel = np.abs(links.sin_alpha) < PARALLEL
    meeting = np.abs(links.a) < tiny
    reach = np.hypot(links.a[2], links.d[3] * links.sin_alpha[2])
    if parallel[1] and not parallel[0] and not meeting[1] and reach > tiny:
        return Regional.PARALLEL_23
    if meeting[0] and not parallel[0]:
        return Regional.INTERSECTING_12
    if meeting[1] and not parallel[1]:
        return Regional.INTERSECTING_23
    if parallel[0] and not parallel[1] and not meeting[0]:
        return Regional.PARALLEL_12
    return None


def _six(links: Links, size: float) -> tuple[Family, Regional] | None:
    tiny = PARALLEL * size
    parallel = np.abs(links.sin_alpha) < PARALLEL
    meeting = np.abs(links.a) < tiny
    if parallel[3] or parallel[4] or not meeting[4]:
        return None
    if meeting[3] and abs(links.d[4]) < tiny:
        regional = _regional(links, size)
        if regional is not None:
            return Family.SPHERICAL_WRIST, regional
    if parallel[1] and parallel[2] and not (parallel[0] or meeting[1] or meeting[2]):
        return Family.THREE_PARALLEL, Regional.PARALLEL_23
    return None


def _five(links: Links, size: float) -> tuple[Family, Regional] | None:
    parallel = np.abs(links.sin_alpha) < PARALLEL
    meeting = np.abs(links.a) < PARALLEL * size
    if parallel[3]:
        return None
    if meeting[3]:
        regional = _regional(links, size)
        if regional is not None:
            return Family.TWO_AXIS_WRIST, regional
    if parallel[1] and parallel[2] and not (parallel[0] or meeting[1] or meeting[2]):
        return Family.THREE_PARALLEL_SHORT, Regional.PARALLEL_23
    return None


def _scara(lines: AxisLines, kinds: str) -> ClosedFormSpec | None:
    """Three revolute joints about parallel axes, and at most one slide along them."""
    if sorted(kinds) not in (["R"] * 3, ["P", *["R"] * 3]):
        return None
    turning = [i for i, kind in enumerate(kinds) if kind == "R"]
    order = turning + [i for i, kind in enumerate(kinds) if kind == "P"]
    z = lines.direction[turning[0]]
    if np.linalg.norm(np.cross(lines.direction, z), axis=1).max() > PARALLEL:
        return None
    points = lines.point[turning]
    steps = np.diff(points, axis=0)
    steps = steps - np.outer(steps @ z, z)
    lengths = np.linalg.norm(steps, axis=1)
    if lengths.min() < PARALLEL * lines.size:
        return None
    x = steps[0] / lengths[0]
    y = np.cross(z, x)
    bend = np.arctan2(steps[1] @ y, steps[1] @ x)
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = np.column_stack([x, y, z]), points[0]
    c, s = np.cos(bend), np.sin(bend)
    wrist = np.eye(4)
    wrist[:2, :2] = [[c, -s], [s, c]]
    wrist[:2, 3] = [lengths[0] + lengths[1] * c, lengths[1] * s]
    n = len(kinds)
    links = Links(
        a=np.array([*lengths, *np.zeros(n - 2)]),
        d=np.zeros(n),
        cos_alpha=np.ones(n),
        sin_alpha=np.zeros(n),
        sign=np.sign(lines.direction[order] @ z),
        offset=np.array([0.0, bend, *np.zeros(n - 2)]),
        base=base,
        tool=np.asarray(np.linalg.solve(base @ wrist, lines.T_zero), dtype=np.float64),
    )
    joint = np.array(order, dtype=np.int32)
    return ClosedFormSpec(Family.SCARA, Regional.PARALLEL_23, False, links, joint, lines.size)

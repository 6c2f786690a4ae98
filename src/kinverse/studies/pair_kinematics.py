"""Inverse kinematics of the seven arms of the thesis of Jha (2015), through pairs and matrices.

Chapter 4 of the thesis solves them by homogeneous matrices (4.2) and by quaternion-vector pairs
(4.3); the equations here are its closed forms with the corrections of the project's errata, written
once for both forms and for any number type. The arm's joints follow from the wrist centre, so the
forms differ where rotations are composed, applied and taken apart.
"""

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.studies.counted import Number, atan2, sqrt
from kinverse.studies.forms import Matrix, Numbers, Pair
from kinverse.studies.wrist_angles import three_axes, two_axes
from kinverse.studies.zero_arm import ZeroArm

__all__ = ["THESIS_ROBOTS", "inverse"]

THESIS_ROBOTS = ("planar3r", "adept_one", "pioneer2", "puma560", "irb1400", "irb6", "rx160l")

Array = NDArray[np.float64]
Route = TypeVar("Route", Matrix, Pair)

REACHED = 1e-9
"""How far off zero the condition of a two-axis wrist may be."""


def inverse(arm: ZeroArm, target: Route) -> list[Numbers]:
    """Every branch, limits ignored; generic poses (no singular ones) of reachable positions.

    Args:
        arm: one of the thesis' robots, by :func:`kinverse.studies.zero_arm.zero_arm`.
        target: pose of the tool in the base frame; the form chooses the route.

    Raises:
        InputError: an arm of another kind.

    Example:
        >>> len(inverse(zero_arm(robot), Pair.of(robot.fk(q))))
        8
    """
    solve = _SOLVERS.get("".join("xyz"[axis] for axis, _ in arm.axes))
    if solve is None:
        raise InputError("this study solves the seven arms of the thesis only")
    return [
        tuple(sign * angle for (_, sign), angle in zip(arm.axes, angles, strict=True))
        for angles in solve(arm, target)
    ]


def _wrist_and_rotation(arm: ZeroArm, target: Route, last: Numbers) -> tuple[Numbers, Route]:
    """The wrist centre, and the rotation since the zero posture."""
    R = target.rotation().compose(type(target).of(arm.turned, arm.number).inverse())
    reach = R.act(last)
    return tuple(p - r for p, r in zip(target.p, reach, strict=True)), R


def _elbow(
    arm: ZeroArm, upper: Array, fore: Array, u: Number, v: Number
) -> Iterator[tuple[Number, Number]]:
    """Both (shoulder, elbow) angles of ``(u, v) = R(t) (upper + R(e) fore)`` in a plane."""
    # lengths and angles of the arm: computed once, not for each pose
    A, B = 2.0 * (upper @ fore), 2.0 * (upper[1] * fore[0] - upper[0] * fore[1])
    D = A * A + B * B
    k, root, first = map(arm.number, (upper @ upper + fore @ fore, D, np.arctan2(B, A)))
    a, b = arm.number(A / D), arm.number(B / D)
    U, F = arm.vector(upper), arm.vector(fore)
    K = (u * u + v * v) - k
    inside = root - K * K
    if inside < 0.0:
        return
    S = sqrt(inside)
    bend = atan2(S, K)
    for sign in (1, -1):
        c, s = a * K - sign * (b * S), b * K + sign * (a * S)
        x, y = U[0] + (c * F[0] - s * F[1]), U[1] + (s * F[0] + c * F[1])
        yield atan2(x * v - y * u, x * u + y * v), first + sign * bend


def _shoulder(arm: ZeroArm, centre: Array, w: Numbers) -> Iterator[Numbers]:
    """(t1, [(t2, t3), ...]) of an arm with axes z, y, y that carries the point centre to w."""
    P = arm.points
    base = arm.vector(np.array([P[1][0], centre[1], P[1][2]]))
    offset, height = base[1], w[2] - base[2]
    level = w[0] * w[0] + w[1] * w[1]
    if type(offset) is not int:
        level = level - arm.number(centre[1] ** 2)
    if level < 0.0:
        return
    rho = sqrt(level)
    # about +y the plane turns from z to x
    upper, fore = (P[2] - P[1])[[2, 0]], (centre - P[2])[[2, 0]]
    for sign in (1, -1):
        if type(offset) is int:
            first = atan2(sign * w[1], sign * w[0])
        else:
            r = sign * rho
            first = atan2(w[1] * r - w[0] * offset, w[0] * r + w[1] * offset)
        yield first, list(_elbow(arm, upper, fore, height, sign * rho - base[0]))


def _spherical_wrist(arm: ZeroArm, target: Route) -> Iterator[Numbers]:
    """Axes z y y and three axes through one point: eight branches."""
    centre = arm.points[4]
    w, R = _wrist_and_rotation(arm, target, arm.vector(arm.points[6] - centre))
    form = type(target)
    i, j = arm.axes[3][0], arm.axes[4][0]
    for t1, planes in _shoulder(arm, centre, w):
        back = form.turn(2, -t1).compose(R)
        for t2, t3 in planes:
            W = form.turn(1, -(t2 + t3)).compose(back)
            for t4, t5, t6 in three_axes(W, i, j):
                yield t1, t2, t3, t4, t5, t6


def _two_axis_wrist(arm: ZeroArm, target: Route) -> Iterator[Numbers]:
    """Axes z y y and two axes that meet: of four arm branches those that the wrist can finish."""
    centre = arm.points[4]
    w, R = _wrist_and_rotation(arm, target, arm.vector(arm.points[5] - centre))
    form = type(target)
    i, j = arm.axes[3][0], arm.axes[4][0]
    for t1, planes in _shoulder(arm, centre, w):
        back = form.turn(2, -t1).compose(R)
        for t2, t3 in planes:
            t4, t5, off = two_axes(form.turn(1, -(t2 + t3)).compose(back), i, j)
            if abs(off) < REACHED:
                yield t1, t2, t3, t4, t5


def _three_parallel(arm: ZeroArm, target: Route) -> Iterator[Numbers]:
    """Axes z y y y z: the three parallel axes turn as one; four branches."""
    centre = arm.points[3]
    w, R = _wrist_and_rotation(arm, target, arm.vector(arm.points[5] - centre))
    form = type(target)
    for t1, planes in _shoulder(arm, centre, w):
        pitch, t5, off = two_axes(form.turn(2, -t1).compose(R), 1, 2)
        if abs(off) < REACHED:
            for t2, t3 in planes:
                yield t1, t2, t3, pitch - (t2 + t3), t5


def _planar(arm: ZeroArm, target: Route) -> Iterator[Numbers]:
    """Three turns about z, and a slide along it or none: two branches."""
    P, n = arm.points, len(arm.axes)
    turning = [k for k, kind in enumerate(arm.kinds) if kind == "R"]
    w, R = _wrist_and_rotation(arm, target, arm.vector(P[n] - P[turning[2]]))
    if isinstance(R, Matrix):
        total = atan2(R.R[1][0], R.R[0][0])
    else:
        half = atan2(R.h[3], R.h[0])
        total = half + half
    upper, fore = (P[turning[1]] - P[turning[0]])[:2], (P[turning[2]] - P[turning[1]])[:2]
    x, y = w[0] - arm.number(P[0][0]), w[1] - arm.number(P[0][1])
    for t1, t2 in _elbow(arm, upper, fore, x, y):
        angles: list[Number] = [t1, t2, total - (t1 + t2)]
        for k in set(range(n)) - set(turning):
            angles.insert(k, w[2] - arm.number(P[turning[2]][2]))
        yield tuple(angles)


_SOLVERS: dict[str, Callable[[ZeroArm, Any], Iterator[Numbers]]] = {
    "zzz": _planar,
    "zzzz": _planar,
    "zyyxy": _two_axis_wrist,
    "zyyyz": _three_parallel,
    "zyyzyz": _spherical_wrist,
    "zyyxyx": _spherical_wrist,
}

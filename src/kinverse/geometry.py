"""The joint axes of a chain as lines in space, and the DH rows that describe them.

Everything here works on arrays; it knows no robots. Closed forms are found from it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "PARALLEL",
    "AxisLines",
    "Links",
    "any_perpendicular",
    "axis_lines",
    "common_normal",
    "cross",
    "frame_on_axis",
    "links_between",
    "reversed_lines",
]

Array = NDArray[np.float64]

PARALLEL = 1e-8
"""Sine of the angle below which two axes count as parallel; lengths below this fraction of the
arm's size count as zero. Files that print pi/2 with nine digits stay inside it."""


@dataclass(frozen=True)
class AxisLines:
    """Joint axes in the base frame while all joints stand at zero.

    Attributes:
        direction: (n, 3) unit vectors.
        point: (n, 3) a point on each axis [m].
        T_zero: (4, 4) the tool in the base frame.
    """

    direction: Array
    point: Array
    T_zero: Array

    @cached_property
    def size(self) -> float:
        """A length of the arm [m]: the distances from axis to axis and to the tool, added up."""
        stations = np.vstack([self.point, self.T_zero[:3, 3]])
        return float(np.linalg.norm(np.diff(stations, axis=0), axis=1).sum()) or 1.0


@dataclass(frozen=True)
class Links:
    """Standard DH rows: ``T = base * prod_i [Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)] * tool``.

    Joint i of the arm stands at ``sign[i] * (theta_i - offset[i])``. The last row is zero: what is
    fixed behind the last joint belongs to ``tool``.

    Attributes:
        a: (n,) [m].
        d: (n,) [m].
        cos_alpha: (n,) cosine of alpha; with sin_alpha exact where axes are perpendicular.
        sin_alpha: (n,).
        sign: (n,) -1 where an axis was turned round to point the way of the one before it.
        offset: (n,) [rad].
        base: (4, 4).
        tool: (4, 4).
    """

    a: Array
    d: Array
    cos_alpha: Array
    sin_alpha: Array
    sign: Array
    offset: Array
    base: Array
    tool: Array


def axis_lines(frames: Array, kinds: str) -> AxisLines:
    """The axes of a chain given as (n + 1, 4, 4) fixed transforms before each joint and the tool.

    Example:
        >>> axis_lines(robot.frames, robot.kinds).direction.shape
        (6, 3)
    """
    T = np.eye(4)
    direction, point = [], []
    for frame in frames[: len(kinds)]:
        T = T @ frame
        direction.append(T[:3, 2])
        point.append(T[:3, 3])
    return AxisLines(np.array(direction), np.array(point), T @ frames[-1])


def reversed_lines(lines: AxisLines) -> AxisLines:
    """The same arm seen from its tool: ``T(q)^-1``, with the joints in reverse order."""
    R, p = lines.T_zero[:3, :3], lines.T_zero[:3, 3]
    inverse = np.eye(4)
    inverse[:3, :3], inverse[:3, 3] = R.T, -R.T @ p
    return AxisLines(-lines.direction[::-1] @ R, (lines.point[::-1] - p) @ R, inverse)


def links_between(lines: AxisLines) -> Links:
    """DH rows by common normals; parallel neighbours get the normal through the frame before.

    The first frame sits where the common normal of axes 1 and 2 meets axis 1, so that d and the
    offset of the first row vanish (Denavit & Hartenberg 1955).
    """
    n = len(lines.direction)
    tiny = PARALLEL * lines.size
    z = lines.direction.copy()
    sign = np.ones(n)
    for i in range(1, n):
        if np.linalg.norm(cross(z[i - 1], z[i])) < PARALLEL and z[i - 1] @ z[i] < 0:
            z[i], sign[i] = -z[i], -1.0
    a, d, offset = np.zeros(n), np.zeros(n), np.zeros(n)
    cosine, sine = np.ones(n), np.zeros(n)
    origin, x = lines.point[0], any_perpendicular(z[0])
    base = np.eye(4)
    for i in range(n - 1):
        foot, next_origin, normal, a[i] = common_normal(
            z[i], origin, z[i + 1], lines.point[i + 1], x, tiny
        )
        if i == 0:
            base = frame_on_axis(z[0], normal, foot)
        else:
            d[i] = z[i] @ (foot - origin)
            offset[i] = np.arctan2(cross(x, normal) @ z[i], x @ normal)
        cosine[i] = z[i] @ z[i + 1]
        sine[i] = cross(z[i], z[i + 1]) @ normal
        if abs(sine[i]) < PARALLEL:
            cosine[i], sine[i] = 1.0, 0.0
        elif abs(cosine[i]) < 1e-14:
            cosine[i], sine[i] = 0.0, np.sign(sine[i])
        origin, x = next_origin, normal
    last = frame_on_axis(z[-1], x, origin) if n > 1 else frame_on_axis(z[0], x, origin)
    if n == 1:
        base = last
    tool = np.asarray(np.linalg.solve(last, lines.T_zero), dtype=np.float64)
    return Links(a, d, cosine, sine, sign, offset, base, tool)


def common_normal(
    z: Array,
    origin: Array,
    z_next: Array,
    point: Array,
    x: Array,
    tiny: float,
    parallel: float = PARALLEL,
) -> tuple[Array, Array, Array, float]:
    """The shortest way from one axis to the next.

    Args:
        z: (3,) direction of this axis, a unit vector.
        origin: (3,) a point on it [m]; the normal of parallel axes starts here.
        z_next: (3,) direction of the next axis.
        point: (3,) a point on it [m].
        x: (3,) the direction to keep where both are the same line.
        tiny: length [m] below which the axes meet.
        parallel: sine of the angle below which they count as parallel.

    Returns:
        Feet on this axis and on the next, the direction from one to the other, and its length.

    Example:
        >>> common_normal(z, p, z_next, p_next, x, 1e-9)[3]
        0.15
    """
    between = point - origin
    across = cross(z, z_next)
    s2 = across @ across
    if s2 < parallel**2:
        normal = between - (between @ z) * z
        length = float(np.linalg.norm(normal))
        if length < tiny:  # the same line: any direction will do, so keep the last one
            return origin, origin, x - (x @ z) * z, 0.0
        return origin, origin + normal, normal / length, length
    # square to z by one more step, and what is left between the feet is along the normal: then
    # nearly parallel axes lose nothing but the rounding of how far off the feet are
    normal = across / np.sqrt(s2)
    normal = normal - (normal @ z) * z
    normal = normal / np.sqrt(normal @ normal)
    side = cross(z, normal)
    along_next = -(between @ side) / (z_next @ side)
    reach = between + along_next * z_next
    foot, next_foot = origin + (reach @ z) * z, point + along_next * z_next
    length = float(reach @ normal)
    if abs(length) < tiny:
        return foot, foot, normal, 0.0
    return foot, next_foot, normal * np.sign(length), abs(length)


def cross(a: Array, b: Array) -> Array:
    """The cross product of two vectors (3,): np.cross, made for stacks, takes twenty times longer.

    Example:
        >>> cross(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        array([0., 0., 1.])
    """
    x, y, z = a.tolist()
    u, v, w = b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def any_perpendicular(z: Array) -> Array:
    """A unit vector square to z (3,)."""
    x = np.eye(3)[np.argmin(np.abs(z))]
    x = x - (x @ z) * z
    return np.asarray(x / np.linalg.norm(x))


def frame_on_axis(z: Array, x: Array, origin: Array) -> Array:
    """The (4, 4) frame at origin with these z and x axes, which are square to each other."""
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, cross(z, x), z, origin
    return T

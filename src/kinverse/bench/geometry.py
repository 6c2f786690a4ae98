"""Where an arm is singular and where its workspace ends, from the axes alone.

The bench needs exact singular poses and poses that are provably out of reach, without asking a
solver. Everything is read off the robot at zero: axis directions and points, by the oracle.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import oracle

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Arm", "extremes", "read"]

Array = NDArray[np.float64]
EPS = 1e-9


def extremes(values: Array) -> tuple[float, float]:
    """Angles of the maximum and the minimum of A + B cos t + C sin t, given at 0, pi/2, pi."""
    at_0, at_90, at_180 = values
    middle = 0.5 * (at_0 + at_180)
    top = float(np.arctan2(at_90 - middle, at_0 - middle))
    return top, float(np.arctan2(middle - at_90, middle - at_0))


@dataclass(frozen=True)
class Arm:
    """The bench's reading of an arm.

    The point c lies on the last turning axis, as near to the axis before as can be, and is fixed
    to the tool at ``tool_c``. The joints ``planar`` turn about parallel axes; c moves in their
    plane by links of lengths ``links``. If ``waist`` is true, joint 0 turns that plane about its
    own axis, which the shoulder misses by ``a1`` [m] along and the plane by ``lateral`` [m].
    """

    robot: "Robot"
    tool_c: Array
    planar: tuple[int, ...]
    links: Array
    waist: bool
    a1: float
    lateral: float
    axis_point: Array
    axis: Array
    height: float

    @property
    def reach(self) -> tuple[float, float]:
        """Least and greatest distance of c from the first planar joint, in the plane [m]."""
        longest = float(self.links.max())
        return max(0.0, 2 * longest - float(self.links.sum())), float(self.links.sum())

    def point(self, T: Array) -> Array:
        """(N, 4, 4) tool poses to the points c (N, 3)."""
        return np.asarray(T[:, :3, :3] @ self.tool_c + T[:, :3, 3])

    def clearance(self, T: Array) -> Array:
        """(N,) how far c lies out of reach [m], limits ignored; 0 where it may be in reach.

        A pose with a clearance above zero cannot be reached, whatever its orientation.
        """
        low, high = self.reach
        offset = self.point(T) - self.axis_point
        along = offset @ self.axis
        from_axis = np.linalg.norm(offset - along[:, None] * self.axis, axis=1)
        if not self.waist:
            gap = np.maximum(from_axis - high, low - from_axis)
            return np.asarray(np.maximum(gap, 0.0))
        in_plane = from_axis**2 - self.lateral**2
        side = np.sqrt(np.maximum(in_plane, 0.0))
        gaps = []
        for radial in (side, -side):
            d = np.hypot(radial - self.a1, along - self.height)
            gaps.append(np.maximum(d - high, low - d))
        gap = np.where(in_plane < 0.0, abs(self.lateral) - from_axis, np.minimum(*gaps))
        return np.asarray(np.maximum(gap, 0.0))


def read(robot: "Robot") -> Arm | None:
    """The reading of an arm; None if it is not built that way."""
    turning = [i for i, kind in enumerate(robot.kinds) if kind == "R"]
    if robot.dof != len(robot.kinds) or len(turning) < 3:
        return None
    *joints, tool = (T[0] for T in oracle.frames(robot, np.zeros((1, robot.dof))))
    axis = [T[:3, 2] for T in joints]
    point = [T[:3, 3] for T in joints]
    last, before = turning[-1], turning[-2]
    c = _near(point[last], axis[last], point[before], axis[before])
    waist = not _parallel(axis[turning[0]], axis[turning[1]])
    first = 1 if waist else 0
    planar = []
    for i in turning[first:]:
        if not _parallel(axis[i], axis[turning[first]]):
            break
        planar.append(i)
    # the last axis may be parallel too (planar arms, SCARA): c is on it, it moves c no more
    planar = [i for i in planar if i != last]
    if len(planar) < 2:
        return None
    normal = axis[planar[0]]
    stops = [point[i] for i in planar]
    links = [np.linalg.norm(_across(b - a, normal)) for a, b in zip(stops, stops[1:], strict=False)]
    end = _across(c - stops[-1], normal)
    links.append(np.linalg.norm(end))
    if not _rigid_beyond(robot, planar[-1], c, last):
        return None
    z, o = axis[turning[0]], point[turning[0]]
    if waist and abs(z @ normal) > EPS:
        return None  # the plane must hold the waist's axis
    radial = np.cross(normal, z)
    return Arm(
        robot=robot,
        tool_c=tool[:3, :3].T @ (c - tool[:3, 3]),
        planar=tuple(planar),
        links=np.array(links),
        waist=waist,
        a1=float((stops[0] - o) @ radial) if waist else 0.0,
        lateral=float((c - o) @ normal) if waist else 0.0,
        axis_point=o,
        axis=z,
        height=float((stops[0] - o) @ z),
    )


def _parallel(a: Array, b: Array) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < EPS


def _across(v: Array, normal: Array) -> Array:
    return np.asarray(v - (v @ normal) * normal)


def _near(p: Array, u: Array, o: Array, v: Array) -> Array:
    # the point of the line p + t u that is nearest to the line o + s v
    n = np.cross(u, v)
    if n @ n < EPS:
        return np.asarray(p + ((o - p) @ u) * u)
    return np.asarray(p + ((o - p) @ np.cross(v, n)) / (n @ n) * u)


def _rigid_beyond(robot: "Robot", hinge: int, c: Array, last: int) -> bool:
    # c keeps its distance from the last planar axis and its place along it, whatever the joints
    # behind do; a slide along that axis is harmless
    rng = np.random.default_rng(12)
    q = np.zeros((16, robot.dof))
    behind = [i for i in range(hinge + 1, robot.dof) if i != last and robot.kinds[i] == "R"]
    q[:, behind] = rng.uniform(-3, 3, (16, len(behind)))
    *joints, tool = oracle.frames(robot, q)
    zero = oracle.frames(robot, np.zeros((1, robot.dof)))[-1][0]
    moved = np.asarray(tool[:, :3, :3] @ (zero[:3, :3].T @ (c - zero[:3, 3])) + tool[:, :3, 3])
    axis, origin = joints[hinge][0, :3, 2], joints[hinge][0, :3, 3]
    offset = moved - origin
    across = offset - (offset @ axis)[:, None] * axis
    far = np.linalg.norm(across, axis=1)
    flat = np.ptp(offset @ axis) < 1e-9 or "P" in robot.kinds
    return bool(np.ptp(far) < 1e-9 and flat)

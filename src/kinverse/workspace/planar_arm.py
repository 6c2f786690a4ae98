"""An arm whose joints all turn about parallel axes, as links in its plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.geometry import PARALLEL, any_perpendicular, axis_lines
from kinverse.robot import Robot
from kinverse.workspace.links import FULL_TURN, SHORT, Links

__all__ = ["PlanarArm", "planar_arm"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class PlanarArm:
    """An arm in its plane.

    Attributes:
        robot: as given.
        frame: (4, 4) of the plane in the base frame: its x and y are what points count in. An arm
            whose axes are along the base's z has the base's x and y.
        first: place of the first joint in the plane [m].
        reach: the links that count for reach: joints on one axis made one, the last left out if
            the tool is on its axis.
        rest: the same without the last joint and link.
        last_link: from the last axis to the tool, where every joint reads zero.
        last_full: whether the last joint reaches every angle.
    """

    robot: Robot
    frame: Array
    first: complex
    reach: Links
    rest: Links
    last_link: complex
    last_full: bool


def planar_arm(robot: Robot) -> PlanarArm:
    """The planar arm that a robot is.

    Raises:
        InputError: slides, joints that follow others, axes that are not parallel, fewer than two
            joints, or no reach at all.

    Example:
        >>> planar_arm(kv.load("planar3r_003")).reach.annulus
        (0.0, 22.0)
    """
    name = f"robot {robot.name!r}"
    count = len(robot.kinds)
    if "P" in robot.kinds:
        slide = robot.joint_names[robot.source[robot.kinds.index("P")]]
        raise InputError(f"{name} is no planar arm of turning joints: {slide!r} slides")
    if robot.dof != count or (robot.multiplier != 1.0).any():
        raise InputError(f"{name} has joints that follow others (mimic joints)")
    if count < 2:
        raise InputError(f"{name} has one joint: a workspace in a plane takes two or more")
    lines = axis_lines(robot.frames, robot.kinds)
    normal = lines.direction[0]
    normal = normal * np.sign(normal[np.argmax(np.abs(normal))])
    tilt = np.linalg.norm(np.cross(lines.direction, normal), axis=1)
    if (tilt > PARALLEL).any():
        joint = robot.joint_names[int(np.argmax(tilt > PARALLEL))]
        raise InputError(
            f"{name} is not planar: the axis of {joint!r} is not parallel to the first"
        )
    sign = np.sign(lines.direction @ normal)
    stations = np.vstack([lines.point, lines.T_zero[:3, 3]])
    frame = _plane(normal, stations[-1])
    flat = (stations - frame[:3, 3]) @ frame[:3, :2]
    places = flat[:, 0] + 1j * flat[:, 1]
    zeros = robot.offset[robot.source] * sign
    ends = robot.limits * sign[:, None] + zeros[:, None]
    d, low, high = np.diff(places), ends.min(axis=1), ends.max(axis=1)
    size = float(np.abs(d).sum())
    if size <= 0.0:
        raise InputError(f"{name} does not move its tool: all its axes lead through it")
    reach = _merged(d, low, high, SHORT * size)
    rest = _merged(d[:-1], low[:-1], high[:-1], SHORT * size)
    last_full = bool(high[-1] - low[-1] >= FULL_TURN)
    last_link = complex(d[-1] * np.exp(1j * zeros.sum()))
    return PlanarArm(robot, frame, places[0], reach, rest, last_link, last_full)


def _plane(normal: Array, tool: Array) -> Array:
    """The plane of the tool: origin below the base's, x as near to the base's x as it can be."""
    x = np.array([1.0, 0.0, 0.0])
    x = x - (x @ normal) * normal
    size = float(np.linalg.norm(x))
    x = x / size if size > 0.5 else any_perpendicular(normal)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    frame[:3, 3] = (tool @ normal) * normal
    return frame


def _merged(d: Complex, low: Array, high: Array, short: float) -> Links:
    """Links with length only: the range of a joint on the next one's axis is added to that."""
    kept: list[tuple[complex, float, float]] = []
    below = above = 0.0
    for link, least, most in zip(d.tolist(), low.tolist(), high.tolist(), strict=True):
        below, above = below + least, above + most
        if abs(link) > short:
            kept.append((link, below, above))
            below = above = 0.0
    rows = np.array(kept, dtype=np.complex128).reshape(-1, 3)
    return Links(rows[:, 0], rows[:, 1].real.copy(), rows[:, 2].real.copy())

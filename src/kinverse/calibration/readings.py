"""Whether the columns of measurements mean what they say: other readings, and errors too large."""

import math
import warnings
from collections.abc import Iterator
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.geometry import axis_lines
from kinverse.robot import Robot

__all__ = ["Reading", "check_reading"]

Array = NDArray[np.float64]

AXES, TURNS = ("x", "y", "z"), ("roll", "pitch", "yaw")

SUSPECT = 0.002
"""Median error from which another reading of the columns is looked for. Errors here are lengths
of the arm for the position, rad for the rotation, both squared and added."""
REMARKED = 0.01
"""The same from which measurements are remarked on even if no other reading explains them."""
HOPELESS = 0.1
"""The same from which they are refused."""
BETTER = 0.2
"""Another reading explains them if it leaves no more than this share of the error."""
ALIKE = 2.0
"""Readings that leave no more than this times the error of the best cannot be told from it."""


class Reading(NamedTuple):
    """Measurements as they are read from the columns."""

    q: Array
    """(N, n) joint values [rad or m]."""
    points: Array
    """(N, 3) positions of the tool [m]."""
    rpy: Array | None = None
    """(N, 3) roll, pitch and yaw [rad] if they were measured."""


class _Miss(NamedTuple):
    """How far measurements are from forward kinematics, medians."""

    share: float
    length: float
    angle: float | None

    def __str__(self) -> str:
        angle = "" if self.angle is None else f" and {self.angle:.3g} rad"
        return f"{self.length:.3g} m{angle}"


def check_reading(where: str, robot: Robot, reading: Reading) -> None:
    """Refuse measurements that another order, unit or sign of columns explains, or nothing does.

    Args:
        where: the file, for messages.
        robot: the arm as it is said to be.
        reading: of N rows.

    Raises:
        InputError: the columns are confused, or the errors are hopelessly large.

    Warns:
        UserWarning: the errors are large for an arm that is to be corrected.

    Example:
        >>> check_reading("measured.csv", robot, Reading(q, robot.fk(q)[:, :3, 3]))
    """
    size = axis_lines(robot.frames, robot.kinds).size
    off = _miss(robot, size, reading)
    if off.share <= SUSPECT:
        return
    said = f"{where}: the tool was measured {off} (median) from where {robot.name!r} has it"
    found = [(_miss(robot, size, other), words) for words, other in _others(robot, reading)]
    best = min((miss for miss, _ in found), key=lambda miss: miss.share)
    if best.share <= BETTER * off.share:
        alike = [words for miss, words in found if miss.share <= ALIKE * best.share]
        raise InputError(f"{said}, and {best} {', or '.join(alike[:3])}: are these confused?")
    if off.share <= REMARKED:
        return
    said += _shift(robot, reading, off.length)
    asked = (
        "are joint names, units, signs and zeros the robot's, and x, y, z the tool point's in its"
        " base frame?"
    )
    if reading.rpy is not None:
        asked = asked[:-1] + ", and roll, pitch, yaw the tool's?"
    if off.share > HOPELESS:
        raise InputError(f"{said}: {asked}")
    warnings.warn(f"{said}, much for an error: {asked}", UserWarning, stacklevel=3)


def _miss(robot: Robot, size: float, reading: Reading) -> _Miss:
    T = robot.fk(reading.q)
    length = np.linalg.norm(reading.points - T[:, :3, 3], axis=1)
    if reading.rpy is None:
        middle = float(np.median(length))
        return _Miss(middle / size, middle, None)
    turned = se3.rotation_from_rpy(reading.rpy) @ np.swapaxes(T[:, :3, :3], 1, 2)
    angle = np.linalg.norm(se3.rotation_log(turned), axis=1)
    share = float(np.median(np.hypot(length / size, angle)))
    return _Miss(share, float(np.median(length)), float(np.median(angle)))


def _shift(robot: Robot, reading: Reading, off: float) -> str:
    """A constant shift that explains the positions, in words; nothing if none does."""
    T = robot.fk(reading.q)
    away = reading.points - T[:, :3, 3]
    within = np.einsum("nji,nj->ni", T[:, :3, :3], away)
    for frame, shifts in (("base", away), ("tool", within)):
        middle = np.median(shifts, axis=0)
        left = float(np.median(np.linalg.norm(shifts - middle, axis=1)))
        if left <= BETTER * off:
            x, y, z = (f"{value:.3g}" for value in middle)
            return f" (but {left:.3g} m from there shifted by {x}, {y}, {z} m in the {frame} frame)"
    return ""


# ---------------------------------------------------------------------------- other readings
def _others(robot: Robot, reading: Reading) -> Iterator[tuple[str, Reading]]:
    """Other ways to read the columns, in words; what is simpler comes first."""
    yield from _other_joints(robot, reading)
    for words, points in _other_axes(reading.points):
        yield words, reading._replace(points=points)
    if reading.rpy is not None:
        for words, rpy in _other_turns(reading.rpy):
            yield words, reading._replace(rpy=rpy)


def _other_joints(robot: Robot, reading: Reading) -> Iterator[tuple[str, Reading]]:
    q, names = reading.q, robot.joint_names
    turns = np.array([robot.kinds[robot.source.tolist().index(j)] == "R" for j in range(robot.dof)])
    units = (("radians", 180.0 / math.pi), ("degrees", math.pi / 180.0))
    for words, factor in units:
        yield f"with the joints in {words}", reading._replace(q=np.where(turns, factor * q, q))
    for i, j in combinations(range(robot.dof), 2):
        order = list(range(robot.dof))
        order[i], order[j] = j, i
        words = f"with the columns {names[i]} and {names[j]} exchanged"
        yield words, reading._replace(q=q[:, order])
    for j, name in enumerate(names):
        scales = [(f"in {words}", factor) for words, factor in units]
        if not turns[j]:
            scales = [("a thousand times as long", 1000.0), ("a thousandth as long", 0.001)]
        for words, factor in scales:
            yield f"with {name} alone {words}", reading._replace(q=_scaled(q, j, factor))
        yield f"with the sign of {name} turned", reading._replace(q=_scaled(q, j, -1.0))


def _other_axes(points: Array) -> Iterator[tuple[str, Array]]:
    scales = (("a thousand times", 1000.0), ("a thousandth", 0.001))
    for words, factor in scales:
        yield f"with positions {words} as long", factor * points
    for order, names in _orders(AXES):
        yield f"with the columns of x, y, z read as {names}", points[:, order]
    for k, name in enumerate(AXES):
        for words, factor in scales:
            yield f"with {name} alone {words} as long", _scaled(points, k, factor)
        yield f"with the sign of {name} turned", _scaled(points, k, -1.0)


def _other_turns(rpy: Array) -> Iterator[tuple[str, Array]]:
    units = (("radians", 180.0 / math.pi), ("degrees", math.pi / 180.0))
    for words, factor in units:
        yield f"with roll, pitch, yaw in {words}", factor * rpy
    for order, names in _orders(TURNS):
        yield f"with the columns of roll, pitch, yaw read as {names}", rpy[:, order]
    for k, name in enumerate(TURNS):
        for words, factor in units:
            yield f"with {name} alone in {words}", _scaled(rpy, k, factor)
        yield f"with the sign of {name} turned", _scaled(rpy, k, -1.0)


def _orders(names: tuple[str, str, str]) -> Iterator[tuple[list[int], str]]:
    for order in permutations(range(3)):
        if order != (0, 1, 2):
            yield list(order), ", ".join(names[k] for k in order)


def _scaled(table: Array, column: int, factor: float) -> Array:
    out = table.copy()
    out[:, column] *= factor
    return out

"""Arms and tasks that are no six-joint pose problem, made one by virtual joints.

A closed form solves as many equations as it has joints. Where the arm has fewer joints than the
pose has components, joints that must stand still are added; where the task leaves components free,
joints that move exactly these are added, and what they take is dropped.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import NoClosedForm
from kinverse.robot import Robot
from kinverse.se3 import pose

__all__ = ["STANDING", "Extension", "extended"]

Array = NDArray[np.float64]

STANDING = 1e-2
"""A virtual joint [rad] further from rest than this in every solution shows that the arm itself has
none: within the tolerances a solution moves it by far less."""


@dataclass(frozen=True)
class Extension:
    """The six-joint arm that stands for another.

    Attributes:
        robot: the arm with virtual joints.
        columns: (n,) which of its joints are the real ones.
        standing: the other joints, which must stand at zero; empty where they are free.
    """

    robot: Robot
    columns: NDArray[np.int64]
    standing: NDArray[np.int64]


def extended(robot: Robot, task: str) -> Extension:
    """The extension of an arm for a task.

    "pose" with fewer than six joints: joints about random lines, which must not move. "position"
    with three joints: a spherical wrist at the tool point. "position_axis" with five joints: a roll
    about the tool's z axis.

    Raises:
        NoClosedForm: the task does not close the system with this number of joints.

    Example:
        >>> extended(kv.load("planar3r"), "position").robot.dof
        6
    """
    n = robot.dof
    if task == "pose" and n < 6:
        return _held(robot)
    if task == "position" and n == 3:
        return _freed(robot, [0.0, np.pi / 2, -np.pi / 2])
    if task == "position_axis" and n == 5:
        return _freed(robot, [0.0])
    closes = "pose with up to six, position with three, position_axis with five"
    raise NoClosedForm(
        f"no closed form for task {task!r} with {n} joints: joints and task close the system for"
        f" {closes}; use Numerical"
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

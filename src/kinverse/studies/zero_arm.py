"""Arms whose axes lie along x, y and z while the joints stand at zero, as the thesis writes them.

All frames are parallel to the base frame in that posture, so that a joint is a turn about a unit
vector and a link a translation (Gupta, Int. J. Robotics Research 5(2), 1986).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.geometry import axis_lines
from kinverse.robot import Robot
from kinverse.studies.counted import Number
from kinverse.studies.forms import AnyForm, Lift, Numbers

__all__ = ["ZeroArm", "forward", "zero_arm"]

Array = NDArray[np.float64]
TINY = 1e-12


@dataclass(frozen=True)
class ZeroArm:
    """A chain in its zero posture; numbers that are 0 or +-1 by structure are plain ints.

    Attributes:
        kinds: R and P.
        axes: for each joint 0, 1, 2 for x, y, z, and the sign.
        points: a point on each axis [m], then the tool point.
        turned: (4, 4) the tool's rotation in this posture, as a pose.
        lift: what numbers are made into.
    """

    kinds: str
    axes: tuple[tuple[int, int], ...]
    points: Array
    turned: Array
    lift: Lift

    def vector(self, values: Array) -> Numbers:
        """Constants of the arm, as numbers."""
        return tuple(self.number(x) for x in values)

    def number(self, x: float) -> Number:
        """A constant of the arm: 0 and +-1 stay ints, nobody computes with them."""
        nearest = round(float(x))
        near = abs(nearest) <= 1 and abs(x - nearest) < TINY
        return nearest if near else self.lift(float(x))


def zero_arm(robot: Robot, lift: Lift = float) -> ZeroArm:
    """The arm in its zero posture.

    Args:
        robot: any chain without mimic joints whose axes are along x, y or z of the base frame
            while the joints stand at zero.
        lift: makes constants into the numbers to compute with.

    Raises:
        InputError: an axis in any other direction, or mimic joints.

    Example:
        >>> zero_arm(kv.load("puma560")).axes[:2]
        ((2, 1), (1, -1))
    """
    if len(robot.kinds) != robot.dof:
        raise InputError(f"{robot.name}: mimic joints")
    lines = axis_lines(robot.frames, robot.kinds)
    axes = []
    for direction in lines.direction:
        k = int(np.argmax(np.abs(direction)))
        if abs(abs(direction[k]) - 1.0) > TINY:
            raise InputError(f"{robot.name}: an axis is not along x, y or z: {direction.tolist()}")
        axes.append((k, 1 if direction[k] > 0 else -1))
    points = np.vstack([lines.point, lines.T_zero[:3, 3]])
    turned = se3.transform(lines.T_zero[:3, :3])
    return ZeroArm(robot.kinds, tuple(axes), points, turned, lift)


def forward(arm: ZeroArm, form: type[AnyForm], q: Numbers) -> AnyForm:
    """Forward kinematics of one posture q (n numbers) through a form.

    Example:
        >>> forward(zero_arm(robot), Pair, (0.1, 0.2, 0.3)).p
    """
    steps = np.diff(arm.points, axis=0)
    T = form.shift(arm.vector(arm.points[0]))
    for (axis, sign), kind, value, step in zip(arm.axes, arm.kinds, q, steps, strict=True):
        if kind == "R":
            joint = form.turn(axis, sign * value)
        else:
            slide: list[Number] = [0, 0, 0]
            slide[axis] = sign * value
            joint = form.shift(slide)
        T = T.compose(joint).compose(form.shift(arm.vector(step)))
    return T.compose(form.of(arm.turned, arm.number))

"""A tool behind the robot's own, by the numbers of --tool."""

import math
from typing import TYPE_CHECKING

from kinverse import se3
from kinverse.cli._args import all_numbers
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["with_tool"]


def with_tool(arm: "Robot", text: str | None, degrees: bool) -> "Robot":
    """The robot with x y z [m], or x y z roll pitch yaw, added behind its tool point.

    Raises:
        InputError: another count of numbers, or something that is no number.
    """
    if text is None:
        return arm
    values = all_numbers(text, "--tool")
    if len(values) not in (3, 6):
        raise InputError(
            f"--tool needs 3 numbers (x y z) or 6 (x y z roll pitch yaw), got {len(values)}"
        )
    rpy = values[3:] or [0.0, 0.0, 0.0]
    return arm.with_tool(se3.pose(values[:3], rpy=list(map(math.radians, rpy)) if degrees else rpy))

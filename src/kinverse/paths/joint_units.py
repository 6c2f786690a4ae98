"""In what the values of each joint are measured."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["joint_units"]


def joint_units(robot: "Robot") -> tuple[str, ...]:
    """The unit of each free joint, "rad" or "m": that of the first moving joint that it drives.

    Example:
        >>> joint_units(kv.load("adept_one"))
        ('rad', 'rad', 'm', 'rad')
    """
    source = robot.source.tolist()
    kinds = (robot.kinds[source.index(joint)] for joint in range(robot.dof))
    return tuple("m" if kind == "P" else "rad" for kind in kinds)

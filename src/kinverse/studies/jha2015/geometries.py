"""The arms that searches and networks work on: rows of ``arms``, how they are read, and limits."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.studies.jha2015.arms import arm, source

__all__ = ["GEOMETRIES", "geometry", "geometry_source"]


@dataclass(frozen=True)
class Reading:
    """How the rows of an arm are taken.

    Attributes:
        arm: whose rows; see ``arms``.
        convention: in which they are read.
        limits: of which arm, or "full turns"; None: its own, full turns where none are printed.
        note: what of it is a choice.
    """

    arm: str
    convention: str = "standard"
    limits: str | None = None
    note: str = ""


FULL = "full turns: no row of table {} keeps the printed ranges"
GEOMETRIES = {
    "planar3r": Reading("planar3r_7.2.1", note="lengths are printed without a unit, read as cm"),
    "planar3r_60": Reading(
        "planar3r_7.2.1", note="the joints add up to 60 deg, as in every row of table 7.1"
    ),
    "scara": Reading("scara", note="the range of joint 4 is not printed: a full turn"),
    "pioneer2": Reading("5r_4.4"),
    "pioneer2_7_7": Reading("5r_inferred"),
    "puma560": Reading("puma560_4.5", "modified"),
    "irb1400": Reading("irb1400_4.212", "modified"),
    "irb1400_7_17": Reading("irb1400_inferred", "modified", "irb1400"),
    "irb6": Reading("irb6", note="d1 is printed 070 and read as 0.07 m"),
    "irb6_4_251": Reading("irb6_4.251"),
    "irb6_free": Reading("irb6", limits="full turns", note=FULL.format("7.35")),
    "rx160l": Reading("rx160l"),
    "rx160l_7_23": Reading("rx160l_inferred", "modified", note=FULL.format("7.37")),
}
"""The printed arms, and those that the rows of a table belong to, named by the table."""


@cache
def geometry(name: str) -> Robot:
    """An arm of ``GEOMETRIES``.

    Raises:
        InputError: no such geometry; the message lists them.

    Example:
        >>> geometry("irb1400_7_17").dof
        6
    """
    if name not in GEOMETRIES:
        raise InputError(f"no geometry {name!r}; there are {', '.join(GEOMETRIES)}")
    each = GEOMETRIES[name]
    robot = arm(each.arm, each.convention)
    if each.limits == "full turns":
        return robot.with_limits(np.tile([-np.pi, np.pi], (robot.dof, 1)))
    if each.limits is not None:
        return robot.with_limits(arm(each.limits, each.convention).limits)
    return robot


def geometry_source(name: str) -> str:
    """Where the numbers of a geometry come from, and what of it is a choice."""
    each = GEOMETRIES[name]
    return source(each.arm) + (f" ({each.note})" if each.note else "")

"""The arms of the thesis as its tables print them, and as their numbers can be had back."""

from functools import cache

import numpy as np

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.studies.data import printed

__all__ = ["METRES", "geometry", "geometry_source"]

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""One of a printed unit [m]."""

READ_AS = {
    "planar3r": "lengths 10, 7, 5 are printed without a unit and read as cm",
    "scara": "the range of joint 4 is not printed: a full turn",
    "irb6": "d1 is printed 070 and read as 0.07 m",
    "irb6_free": "full turns: no row of table 7.35 keeps the printed ranges",
    "rx160l_7_23": "full turns: no row of table 7.37 keeps the printed ranges",
    "irb1400": "theta2 starts at 90 deg, rows read as Craig's: so equations 4.212 to 4.214 hold",
}


@cache
def geometry(name: str) -> Robot:
    """An arm of ``data/geometries.csv``.

    Args:
        name: "scara", or "irb1400_7_17" for the arm that the rows of table 7.17 belong to.

    Raises:
        InputError: no such geometry; the message lists them.

    Example:
        >>> geometry("irb1400_7_17").dof
        6
    """
    rows = printed("jha2015", "geometries")
    mine = rows.where("geometry", name)
    if not len(mine):
        known = ", ".join(dict.fromkeys(rows.text("geometry")))
        raise InputError(f"no geometry {name!r}; there are {known}")
    theta, d, a, alpha, low, high = mine.numbers(
        ["theta_deg", "d", "a", "alpha_deg", "low", "high"]
    ).T
    kinds, unit = mine.text("joint"), METRES[mine.text("length_unit")[0]]
    scale = np.array([unit if kind == "P" else np.pi / 180.0 for kind in kinds])
    moving = [kind != "F" for kind in kinds]
    return Robot.from_dh(
        a=unit * a,
        d=unit * d,
        alpha=np.radians(alpha),
        theta=np.radians(theta),
        joints=kinds,
        convention=mine.text("convention")[0],
        limits=(np.stack([low, high], axis=1) * scale[:, None])[moving],
        name=name,
        source_note=geometry_source(name),
        unverified=[READ_AS[name]] if name in READ_AS else (),
    )


def geometry_source(name: str) -> str:
    """Where the numbers of a geometry come from."""
    return printed("jha2015", "geometries").where("geometry", name).text("source")[0]

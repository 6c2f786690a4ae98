"""The arms of the thesis as it prints them, and the ones that its tables fit."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.studies.data import Printed, printed
from kinverse.studies.jha2015.units import METRES

__all__ = ["arm", "arm_names", "conventions", "printed_limits", "source"]


def arm_names() -> list[str]:
    """All of them: ``_inferred`` ones were found from a table, the others are printed."""
    return list(dict.fromkeys(printed("jha2015", "arms").text("arm")))


def arm(name: str, convention: str) -> Robot:
    """An arm by its name, its rows read in one of its conventions.

    Args:
        name: "irb1400", "irb1400_inferred" ...; see ``arm_names``.
        convention: of the Denavit-Hartenberg rows, "standard" or "modified".

    Example:
        >>> arm("5r_inferred", "standard").dof
        5
    """
    rows = _rows(name)
    unit = METRES[rows.text("unit")[0]]
    theta, d, a, alpha = rows.numbers(["theta_deg", "d", "a", "alpha_deg"]).T
    joints = "".join(rows.text("joint"))
    limits = printed_limits(name)
    turns = np.array([kind == "R" for kind in joints if kind != "F"])
    limits[np.isnan(limits).any(axis=1)] = (-180.0, 180.0)
    return Robot.from_dh(
        a=a * unit,
        d=d * unit,
        alpha=np.radians(alpha),
        theta=np.radians(theta),
        joints=joints,
        convention=convention,
        limits=np.where(turns[:, None], np.radians(limits), limits * unit),
        name=name,
        source_note=source(name),
    )


def conventions(name: str) -> list[str]:
    """In which conventions the rows can be read: both where the arm is as printed."""
    return _rows(name).text("conventions")[0].split()


def printed_limits(name: str) -> NDArray[np.float64]:
    """(n, 2) limits of the joints as printed [deg; a slide: the arm's unit]; NaN for none."""
    rows = _rows(name)
    moving = [kind != "F" for kind in rows.text("joint")]
    return rows.numbers(["low", "high"])[moving]


def source(name: str) -> str:
    """Where the rows are printed, or which table they were found from."""
    return _rows(name).text("source")[0]


def _rows(name: str) -> Printed:
    rows = printed("jha2015", "arms").where("arm", name)
    if not rows:
        raise InputError(f"no arm {name!r}; there are {', '.join(arm_names())}")
    return rows

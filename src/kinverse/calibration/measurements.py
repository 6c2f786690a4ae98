"""Measurements of a real arm from a CSV file: joint values and where the tool was."""

import csv
import math
import os
import re
from collections.abc import Sequence
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.calibration.readings import Reading, check_reading
from kinverse.calibration.tool_errors import tool_error
from kinverse.errors import InputError
from kinverse.robot import Robot

__all__ = ["Measurements", "read_measurements"]

Array = NDArray[np.float64]

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0}
POSITION, ROTATION = ("x", "y", "z"), ("roll", "pitch", "yaw")
HEAD = re.compile(r"\s*(?P<name>[^\[\]]*?)\s*(\[\s*(?P<unit>[^\[\]]*?)\s*\])?\s*")


class Measurements(NamedTuple):
    """What was measured, N rows."""

    q: Array
    """(N, n) joint values [rad or m]."""
    measured: Array
    """(N, 3) positions of the tool [m], or (N, 4, 4) poses if rotations were measured."""
    error: Array
    """(N, 3) or (N, 6) measured minus computed, see :func:`kinverse.calibration.tool_error`."""
    ignored: tuple[str, ...]
    """Columns that were not read."""


def read_measurements(path: "str | os.PathLike[str]", robot: Robot) -> Measurements:
    """Joint values and measured tool positions from a CSV file.

    The first row names the columns, each with its unit in brackets: a column for each joint of the
    robot, by its name ("joint1 [deg]", slides "[mm]"), and "x [mm]", "y [mm]", "z [mm]" of the tool
    point in the base frame; "roll [deg]", "pitch [deg]", "yaw [deg]" beside them make poses.
    Columns may come in any order, others are left out. Units are rad, mrad, deg and m, cm, mm, um.
    A file whose first row has semicolons between its columns may have commas for decimal points.

    Args:
        path: the file.
        robot: the arm as it is said to be.

    Raises:
        InputError: a column that is missing, twice there or without a unit; a unit that does not
            suit; cells that are no finite numbers (rows and columns are named); no rows; positions
            or rotations so far from the arm that columns, units or signs must be confused (it says
            which, if it finds out).
        OSError: the file cannot be read.

    Warns:
        UserWarning: errors that are large for an arm to be corrected; if a constant shift
            explains them, it is told.

    Example:
        >>> read_measurements("measurements.csv", kv.load("kr16")).error.shape
        (300, 3)
    """
    where = str(path)
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = _rows(file)
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{where}: not a CSV text file: {error}") from error
    if not lines:
        raise InputError(f"{where}: the file is empty")
    columns = _columns(where, lines[0], robot)
    values = _numbers(where, lines[0], lines[1:], list(columns.values()))
    factors = np.array([_factor(where, lines[0][at], name, robot) for name, at in columns.items()])
    n, table = robot.dof, values * factors
    q, points = table[:, :n], table[:, n : n + 3]
    rpy = table[:, n + 3 :] if len(columns) > n + 3 else None
    check_reading(where, robot, Reading(q, points, rpy))
    ignored = tuple(head.strip() for at, head in enumerate(lines[0]) if at not in columns.values())
    measured = points
    if rpy is not None:
        measured = np.tile(np.eye(4), (len(q), 1, 1))
        measured[:, :3, :3] = se3.rotation_from_rpy(rpy)
        measured[:, :3, 3] = points
    return Measurements(q, measured, tool_error(robot, q, measured), ignored)


def _rows(file: TextIO) -> list[list[str]]:
    """The rows that are not empty; those between semicolons with points in their numbers."""
    head = file.readline()
    file.seek(0)
    if ";" not in head or "," in head:
        return [row for row in csv.reader(file) if any(map(str.strip, row))]
    rows = [row for row in csv.reader(file, delimiter=";") if any(map(str.strip, row))]
    return [rows[0], *([cell.replace(",", ".") for cell in row] for row in rows[1:])]


# ---------------------------------------------------------------------------- header
def _columns(where: str, header: Sequence[str], robot: Robot) -> dict[str, int]:
    """Which column holds what, in the order joints, position, rotation."""
    wanted = [*robot.joint_names, *POSITION, *ROTATION]
    if len(set(wanted)) < len(wanted):
        twice = sorted(set(robot.joint_names) & {*POSITION, *ROTATION})
        raise InputError(f"joints called {', '.join(twice)} cannot be told from the tool's columns")
    names = [_split(head)[0] for head in header]
    twice = sorted(name for name in set(names) & set(wanted) if names.count(name) > 1)
    if twice:
        raise InputError(f"{where}: column {', '.join(twice)} is there more than once")
    turned = [name for name in ROTATION if name in names]
    needed = wanted[: -len(ROTATION)] + (list(ROTATION) if turned else [])
    missing = [name for name in needed if name not in names]
    if missing:
        known = ", ".join(f"{name!r}" for name in names) or "nothing"
        raise InputError(
            f"{where}: no column {', '.join(missing)}; the first row must name"
            f" {', '.join(needed)} with their units, such as 'x [mm]'; found {known}"
        )
    return {name: names.index(name) for name in needed}


def _split(head: str) -> tuple[str, str | None]:
    """Name and unit of "x [mm]"; the unit is None where there is none."""
    match = HEAD.fullmatch(head)
    if match is None:
        return head.strip(), None
    return match["name"], match["unit"]


def _factor(where: str, head: str, name: str, robot: Robot) -> float:
    unit = _split(head)[1]
    if name in robot.joint_names:
        moving = robot.source.tolist().index(robot.joint_names.index(name))
        valid = LENGTHS if robot.kinds[moving] == "P" else ANGLES
    else:
        valid = LENGTHS if name in POSITION else ANGLES
    if not unit:
        raise InputError(
            f"{where}: column {name!r} has no unit: write '{name} [{'] or ['.join(valid)}]'"
        )
    if unit not in valid:
        raise InputError(
            f"{where}: column {name!r} has the unit {unit!r}; it must be {', '.join(valid)}"
        )
    return valid[unit]


# ---------------------------------------------------------------------------- rows
def _numbers(
    where: str, header: Sequence[str], rows: Sequence[Sequence[str]], columns: Sequence[int]
) -> Array:
    """The cells (N, k) of the chosen columns; bad ones are named by row and column."""
    if not rows:
        raise InputError(f"{where}: no measurements below the first row")
    out, bad = np.empty((len(rows), len(columns))), []
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            bad.append(f"row {number} has {len(row)} cells, the first row {len(header)}")
            continue
        for k, at in enumerate(columns):
            try:
                out[number - 1, k] = float(row[at])
            except ValueError:
                out[number - 1, k] = np.nan
            if not math.isfinite(out[number - 1, k]):
                bad.append(f"row {number}, column {header[at].strip()!r}: {row[at].strip()!r}")
    if bad:
        more = f" and {len(bad) - 5} more" if len(bad) > 5 else ""
        raise InputError(
            f"{where}: cells that are missing or no finite numbers: {'; '.join(bad[:5])}{more}"
        )
    return out

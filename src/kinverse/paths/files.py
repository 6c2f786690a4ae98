"""Poses from files; a broken row is named by file, row and column."""

import csv
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["Poses", "from_csv", "from_file", "from_matrix", "from_npz"]

Array = NDArray[np.float64]

POSITION = ("x", "y", "z")
RPY = ("roll", "pitch", "yaw")
QUAT = ("qw", "qx", "qy", "qz")
MATRIX = tuple(f"m{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4))
LAST_ROW = tuple(f"m4{j}" for j in (1, 2, 3, 4))
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0}
UNITS = {
    **dict.fromkeys((*POSITION, "m14", "m24", "m34"), LENGTHS),
    **dict.fromkeys(RPY, ANGLES),
}
"""Units a column may state behind its name, as in ``x [mm]``; the first is read where none is."""


class Poses(NamedTuple):
    """Good poses and what was wrong with the others.

    ``T`` (N, 4, 4); ``rows`` (N,) numbers of the rows they come from, from 1; ``problems`` one
    line for each row left out; ``ignored`` columns that were not read; ``largest`` the greatest
    angle as it was written in a column without unit, 0 where there was none.
    """

    T: Array
    rows: NDArray[np.int64]
    problems: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    largest: float = 0.0


def from_file(path: Path, degrees: bool | None) -> Array:
    """Poses (N, 4, 4) of a .csv, .npz or .npy file.

    Args:
        path: the file; of a .csv x y z alone will do.
        degrees: what angles without a unit are in; None: radians, of at most a turn.

    Raises:
        InputError: another kind of file, or what its reader refuses.
        OSError: the file cannot be read.
    """
    kind = path.suffix.lower()
    if kind == ".npz":
        return from_npz(path).T
    if kind == ".npy":
        return from_matrix(path).T
    if kind != ".csv":
        raise InputError(f"{path}: a path file ends in .csv, .npz or .npy")
    read = from_csv(path, bool(degrees), skip=False, task="position")
    if degrees is None and abs(read.largest) > 2.0 * math.pi:
        raise InputError(
            f"{path}: roll, pitch and yaw are read as radians, and {read.largest:g} is more than a"
            ' turn: name the columns "roll [deg]", or give degrees=True or False'
        )
    return read.T


def from_matrix(path: Path) -> Poses:
    """Poses from a file of 4 x 4 matrices: .npy, or text with four numbers a line.

    Raises:
        InputError: not numbers, not 4 x 4, not rigid; the message names the file.
        OSError: the file cannot be read.
    """
    try:
        if path.suffix == ".npy":
            values = np.load(path, allow_pickle=False)
        else:
            lines = path.read_text(encoding="utf-8").splitlines()
            rows = [line.replace(",", " ").split() for line in lines if line.strip()]
            values = np.array([[float(word) for word in row] for row in rows])
            if values.ndim != 2 or values.shape[1] != 4 or len(values) % 4:
                raise InputError(f"found {values.shape} numbers")
            values = values.reshape(-1, 4, 4)
        T = se3.as_poses(values, str(path))
    except (InputError, TypeError) as error:
        raise InputError(f"{path}: rows of 4 x 4 matrices are needed: {error}") from error
    except ValueError as error:  # text that is no number, ragged rows, a file that is no .npy
        raise InputError(f"{path}: rows of 4 x 4 matrices are needed: {error}") from error
    return Poses(T, np.arange(1, len(T) + 1))


def from_npz(path: Path) -> Poses:
    """Poses from an .npz file that holds them as ``T`` (N, 4, 4).

    Raises:
        InputError: no such array, or poses that cannot be used; the message names the file.
        OSError: the file cannot be read.
    """
    from zipfile import BadZipFile

    try:
        # opened here: NumPy leaves a file that it cannot read open
        with path.open("rb") as file:
            arrays = np.load(file, allow_pickle=False)
            if not isinstance(arrays, np.lib.npyio.NpzFile):
                raise InputError("is no .npz archive")
            if "T" not in arrays:
                raise InputError(f"needs an array T (N, 4, 4); found {', '.join(arrays) or 'none'}")
            T = se3.as_poses(arrays["T"], "T")
    except (ValueError, TypeError, EOFError, BadZipFile) as error:
        raise InputError(f"{path}: {error}") from error
    return Poses(T, np.arange(1, len(T) + 1))


def from_csv(path: Path, degrees: bool, skip: bool, task: str = "pose") -> Poses:
    """Poses from a CSV file with a header, columns in any order.

    Either x, y, z with roll, pitch, yaw or with qw, qx, qy, qz; or m11 ... m34 (m41 ... m44 are
    checked if they are there). x, y, z alone do for the task "position". Other columns are
    ignored. Cells are separated by commas, or, as the header is, by semicolons; decimals have a
    point. A name may carry its unit, ``x [mm]`` or ``roll [deg]``; without one it is read in
    metres or radians.

    Args:
        path: the file.
        degrees: roll, pitch and yaw that carry no unit are in degrees.
        skip: keep the good rows and list the broken ones, instead of raising at the first.
        task: what the poses are for.

    Raises:
        InputError: no usable header, an unknown unit, or a broken row; the message names file,
            row and column.
        OSError: the file cannot be read.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            header_line = file.readline()
            semicolons = ";" in header_line and "," not in header_line
            file.seek(0)
            reader = csv.reader(file, delimiter=";" if semicolons else ",")
            lines = [(row, reader.line_num) for row in reader if any(map(str.strip, row))]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV text file: {error}") from error
    cells_of_header = lines[0][0] if lines else []
    header, scales, stated = _named(path, cells_of_header, degrees)
    columns, build = _layout(path, header, task)
    used = {name: header.index(name) for name in columns}
    plain = [name for name in RPY if name in used and name not in stated]
    poses, rows, problems, largest = [], [], [], 0.0
    for number, (cells, line) in enumerate(lines[1:], start=1):
        try:
            if len(cells) != len(header):
                raise InputError(f"{len(cells)} cells where the header has {len(header)}")
            values = {name: _cell(cells[at], name) for name, at in used.items()}
            poses.append(build({name: value * scales[name] for name, value in values.items()}))
            largest = max([largest, *(values[name] for name in plain)], key=abs)
            rows.append(number)
        except InputError as error:
            problem = f"{path}: row {number} (line {line}): {error}"
            if not skip:
                raise InputError(problem) from error
            problems.append(problem)
    ignored = tuple(name for name in header if name not in used)
    T = np.array(poses) if poses else np.empty((0, 4, 4))
    return Poses(T, np.array(rows, dtype=np.int64), tuple(problems), ignored, largest)


def _named(
    path: Path, cells: list[str], degrees: bool
) -> tuple[list[str], dict[str, float], set[str]]:
    """Column names, the factor of each to metres or radians, and which of them state a unit."""
    header, scales, stated = [], {}, set()
    for cell in cells:
        parts = re.fullmatch(r"\s*([^\[\]]*?)\s*\[\s*([^\[\]]*?)\s*\]\s*", cell.lower())
        name, unit = parts.groups() if parts else (cell.strip().lower(), "")
        known = UNITS.get(name)
        if unit and known is not None:
            if unit not in known:
                raise InputError(
                    f"{path}: column {name}: unit {unit!r} is not known: {', '.join(known)}"
                )
            if degrees and unit == "rad":
                raise InputError(f"{path}: column {name} is in rad, but degrees were asked for")
            stated.add(name)
            scales[name] = known[unit]
        else:
            scales[name] = ANGLES["deg"] if degrees and name in RPY else 1.0
        header.append(name)
    return header, scales, stated


def _layout(
    path: Path, header: list[str], task: str
) -> tuple[tuple[str, ...], Callable[[dict[str, float]], Array]]:
    have = {name for name in header if header.count(name) == 1}

    def by_rpy(row: dict[str, float]) -> Array:
        return se3.pose([row[k] for k in POSITION], rpy=[row[k] for k in RPY])

    def by_quat(row: dict[str, float]) -> Array:
        return se3.pose([row[k] for k in POSITION], quat=[row[k] for k in QUAT])

    def by_xyz(row: dict[str, float]) -> Array:
        return se3.pose([row[k] for k in POSITION])

    def by_matrix(row: dict[str, float]) -> Array:
        last = [row.get(k, float(k == "m44")) for k in LAST_ROW]
        return se3.as_pose(np.array([row[k] for k in MATRIX] + last).reshape(4, 4), "the matrix")

    for columns, build in ((POSITION + RPY, by_rpy), (POSITION + QUAT, by_quat)):
        if have.issuperset(columns):
            return columns, build
    if have.issuperset(MATRIX):
        whole = have.issuperset(LAST_ROW)
        return MATRIX + (LAST_ROW if whole else ()), by_matrix
    if task == "position" and have.issuperset(POSITION):
        return POSITION, by_xyz
    mixed = "; commas and semicolons both: separate by one" if any(";" in k for k in header) else ""
    alone = "or x y z alone" if task == "position" else "(with --task position x y z alone)"
    raise InputError(
        f"{path}: the first row must name the columns x y z roll pitch yaw, x y z qw qx qy qz, or "
        f"m11 ... m34 {alone}, each once; found {', '.join(header) or 'nothing'}{mixed}"
    )


def _cell(text: str, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        comma = "; write decimals with a point" if text.count(",") == 1 else ""
        raise InputError(f"column {column}: {text.strip()!r} is not a number{comma}") from None
    if not math.isfinite(value):
        raise InputError(f"column {column}: {text.strip()!r} is not finite")
    return value

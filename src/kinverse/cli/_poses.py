"""Poses from the command line and from files; a broken row is named by file, row and column."""

import csv
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["Poses", "from_csv", "from_matrix", "from_numbers"]

Array = NDArray[np.float64]

POSITION = ("x", "y", "z")
RPY = ("roll", "pitch", "yaw")
QUAT = ("qw", "qx", "qy", "qz")
MATRIX = tuple(f"m{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3, 4))
LAST_ROW = tuple(f"m4{j}" for j in (1, 2, 3, 4))


class Poses(NamedTuple):
    """Good poses and what was wrong with the others.

    ``T`` (N, 4, 4); ``rows`` (N,) numbers of the rows they come from, from 1; ``problems`` one
    line for each row left out; ``ignored`` columns that were not read; ``largest`` the greatest
    angle as it was written, 0 where none was.
    """

    T: Array
    rows: NDArray[np.int64]
    problems: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    largest: float = 0.0


def from_numbers(values: Sequence[float], degrees: bool) -> Poses:
    """One pose from x y z [m] and roll pitch yaw [rad, or deg], or from x y z alone."""
    if len(values) == 3:
        return _stack([se3.pose(values)], [1])
    rpy = [math.radians(v) for v in values[3:]] if degrees else list(values[3:])
    largest = max(values[3:], key=abs)
    return _stack([se3.pose(values[:3], rpy=rpy)], [1])._replace(largest=largest)


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


def from_csv(path: Path, degrees: bool, skip: bool, task: str = "pose") -> Poses:
    """Poses from a CSV file with a header, columns in any order.

    Either x, y, z with roll, pitch, yaw [rad, or deg] or with qw, qx, qy, qz; or m11 ... m34
    (m41 ... m44 are checked if they are there). x, y, z alone do for the task "position". Other
    columns are ignored.

    Args:
        path: the file.
        degrees: roll, pitch and yaw are in degrees.
        skip: keep the good rows and list the broken ones, instead of raising at the first.
        task: what the poses are for.

    Raises:
        InputError: no usable header, or a broken row; the message names file, row and column.
        OSError: the file cannot be read.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            lines = [(row, reader.line_num) for row in reader if any(map(str.strip, row))]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV text file: {error}") from error
    header = [cell.strip().lower() for cell in lines[0][0]] if lines else []
    columns, build = _layout(path, header, degrees, task)
    used = {name: header.index(name) for name in columns}
    poses, rows, problems, largest = [], [], [], 0.0
    for number, (cells, line) in enumerate(lines[1:], start=1):
        try:
            if len(cells) != len(header):
                raise InputError(f"{len(cells)} cells where the header has {len(header)}")
            values = {name: _cell(cells[at], name) for name, at in used.items()}
            poses.append(build(values))
            largest = max([largest, *(values.get(name, 0.0) for name in RPY)], key=abs)
            rows.append(number)
        except InputError as error:
            problem = f"{path}: row {number} (line {line}): {error}"
            if not skip:
                raise InputError(problem) from error
            problems.append(problem)
    ignored = tuple(name for name in header if name not in used)
    return _stack(poses, rows)._replace(problems=tuple(problems), ignored=ignored, largest=largest)


def _layout(
    path: Path, header: list[str], degrees: bool, task: str
) -> tuple[tuple[str, ...], Callable[[dict[str, float]], Array]]:
    have = {name for name in header if header.count(name) == 1}
    scale = math.pi / 180.0 if degrees else 1.0

    def by_rpy(row: dict[str, float]) -> Array:
        return se3.pose([row[k] for k in POSITION], rpy=[row[k] * scale for k in RPY])

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
    raise InputError(
        f"{path}: the first row must name the columns x y z roll pitch yaw, x y z qw qx qy qz, or "
        f"m11 ... m34 (with --task position x y z alone), each once;"
        f" found {', '.join(header) or 'nothing'}"
    )


def _cell(text: str, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"column {column}: {text.strip()!r} is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"column {column}: {text.strip()!r} is not finite")
    return value


def _stack(poses: list[Array], rows: list[int]) -> Poses:
    T = np.array(poses) if poses else np.empty((0, 4, 4))
    return Poses(T, np.array(rows, dtype=np.int64))

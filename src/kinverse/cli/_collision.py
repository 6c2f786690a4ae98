"""What the arm must keep clear of, from the options of a command line."""

import csv
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.paths.collision import Capsules
from kinverse.paths.files import LENGTHS

if TYPE_CHECKING:
    from kinverse.paths.mesh_collision import MeshCollision
    from kinverse.robot import Robot

__all__ = ["keep_of", "spheres_of"]

Array = NDArray[np.float64]

COLUMNS = ("x", "y", "z", "radius")


class Both:
    """Joint values that capsules and a model keep."""

    ignores_turns = True

    def __init__(self, capsules: Capsules, model: "MeshCollision") -> None:
        self.capsules, self.model = capsules, model

    def __call__(self, q: Array) -> NDArray[np.bool_]:
        """(M,) whether joint values (M, n) are clear of both."""
        clear = self.capsules(q)
        clear[clear] = self.model(q[clear])
        return clear


def keep_of(
    arm: "Robot",
    radius: float | None,
    floor: float | None,
    spheres: Path | None,
    model: Path | None,
    margin: float | None,
) -> "Capsules | MeshCollision | Both | None":
    """The predicate that the options ask for; None where they ask for none.

    Args:
        arm: the robot.
        radius: of the capsules about its links [m]; these are also tested against each other.
        floor: height [m] that they stay above.
        spheres: a file of spheres that they keep clear of.
        model: a .xml or .urdf file of the arm and what stands about it.
        margin: distance [m] to keep beyond touching.

    Raises:
        InputError: an option that needs another one, or a value or file that cannot be used.
        MissingExtra: a model, and MuJoCo is not installed.
        OSError: a file cannot be read.
    """
    if radius is None and (floor is not None or spheres is not None):
        raise InputError("--floor and --spheres need --radius, that of the links [m]")
    if radius is None and model is None:
        if margin is not None:
            raise InputError("--margin needs something to keep clear of: --radius or --model")
        return None
    far = 0.0 if margin is None else margin
    capsules = None
    if radius is not None:
        balls = None if spheres is None else spheres_of(spheres)
        capsules = Capsules(arm, radius, balls, floor, margin=far)
    if model is None:
        return capsules
    from kinverse.paths.mesh_collision import MeshCollision

    meshes = MeshCollision(arm, model, far)
    return meshes if capsules is None else Both(capsules, meshes)


def spheres_of(file: Path) -> Array:
    """Spheres (K, 4) x, y, z, radius [m] of a .csv file with these columns.

    A name may carry its unit, ``x [mm]``; without one it is read in metres.

    Raises:
        InputError: other columns, an unknown unit, or a broken row; the message names it.
        OSError: the file cannot be read.
    """
    try:
        with file.open(encoding="utf-8-sig", newline="") as text:
            lines = [row for row in csv.reader(text) if any(map(str.strip, row))]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{file}: not a CSV text file: {error}") from error
    heads = [re.fullmatch(r"\s*(\w+)\s*(?:\[\s*(\w+)\s*\])?\s*", c) for c in (lines or [[]])[0]]
    names = [head[1].lower() if head else "" for head in heads]
    units = [head[2].lower() if head and head[2] else "m" for head in heads]
    if sorted(names) != sorted(COLUMNS) or not set(units) <= set(LENGTHS):
        raise InputError(
            f"{file}: the first row must name the columns x, y, z and radius, each alone or with"
            f" its unit behind it as in x [mm] ({', '.join(LENGTHS)})"
        )
    rows = []
    for number, cells in enumerate(lines[1:], start=1):
        try:
            if len(cells) != len(names):
                raise ValueError(f"{len(cells)} cells where the header has {len(names)}")
            read = zip(names, cells, units, strict=True)
            values = {name: float(cell) * LENGTHS[unit] for name, cell, unit in read}
        except ValueError as error:
            raise InputError(f"{file}: row {number}: {error}") from None
        if not np.isfinite(list(values.values())).all():
            raise InputError(f"{file}: row {number}: a value is not finite")
        rows.append([values[name] for name in COLUMNS])
    return np.array(rows).reshape(-1, 4)

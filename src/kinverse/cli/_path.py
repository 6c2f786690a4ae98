"""Which path PATH means: a file of poses, or a path of a source document by its name."""

from pathlib import Path as FilePath
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.cli._show import arm_size, note, note_turns
from kinverse.errors import InputError
from kinverse.paths import Path, named_path, named_samples, path_names
from kinverse.paths.files import Poses, from_csv, from_matrix, from_npz

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Given", "given_path", "remark_unit"]

Array = NDArray[np.float64]

FAR = 3.0
"""Poses all so many times farther away than the arm reaches are taken for a mistake of units."""


class Given(NamedTuple):
    """Poses T (N, 4, 4) [m] in order, where known at parameters s (N,) of a path."""

    T: Array
    s: Array | None = None
    path: Path | None = None


def given_path(
    text: str, degrees: bool, task: str, samples: int | None = None, least: int | None = None
) -> Given:
    """The poses to follow.

    Args:
        text: a name of ``kinverse.paths``, or a .csv, .npz or .npy file.
        degrees: angles of a .csv that state no unit are in degrees.
        task: what the poses are for; x y z alone do for "position".
        samples: so many, evenly along the path (of a file: straight from pose to pose); None: the
            poses of the file, or those at which the source document samples its path.
        least: where samples is None: as many as these poses, but at least so many, evenly along
            the path; None: the poses themselves.

    Raises:
        InputError: neither a file nor a name, a file that cannot be used, or too few samples.
        OSError: the file cannot be read.
    """
    if text in path_names():
        path = named_path(text)
        told = named_samples(text)
        if samples is None and least is not None:
            samples = max(len(told.T), least)
        if samples is not None:
            told = path.sample(samples)
        return Given(told.T, told.s, path)
    poses = _of_file(text, degrees, task)
    if samples is None and least is not None:
        samples = max(len(poses.T), least)
    if samples is None:
        return Given(poses.T)
    try:
        path = Path.from_poses(poses.T)
    except InputError as error:
        raise InputError(f"{text}: {error}") from error
    told = path.sample(samples)
    return Given(told.T, told.s, path)


def remark_unit(robot: "Robot", T: Array) -> None:
    """Say on standard error if positions [m] must be millimetres: far off, a thousandth is not."""
    away, size = np.linalg.norm(T[:, :3, 3], axis=1), arm_size(robot)
    if away.min() > FAR * size and 1e-3 * away.max() <= size:
        note(
            f"positions are read as metres: the nearest pose is {away.min():.4g} m from the base,"
            f" the arm reaches {size:.3g} m at most. If they are millimetres, name the columns"
            ' "x [mm]", "y [mm]", "z [mm]"'
        )


def _of_file(text: str, degrees: bool, task: str) -> Poses:
    file = FilePath(text)
    if not file.suffix and not file.exists():
        raise InputError(
            f"unknown path {text!r}: give a .csv, .npz or .npy file of poses, or one of"
            f" {', '.join(path_names())}"
        )
    if file.suffix == ".npz":
        return from_npz(file)
    if file.suffix == ".npy":
        return from_matrix(file)
    poses = from_csv(file, degrees, skip=False, task=task)
    note_turns([poses.largest], degrees)
    if poses.ignored:
        note(f"columns not read: {', '.join(poses.ignored)}")
    return poses

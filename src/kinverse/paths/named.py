"""The paths of the source documents, by name.

"habibkhah_1" to "habibkhah_4" are the trajectories of document 003 (Habibkhah and Mayorga 2021,
equations 8 to 11), for the arm ``planar3r_003``. The document prints no unit of length; its numbers
are metres here, as in that arm. The tool turns about z by atan2(y, x). Readings:

- equation 10 names the sides of a rectangle only: it is taken from (5, -1) counter-clockwise,
  in steps of 0.01;
- equation 11, "a semi rectangle" of the same sides, is taken as that rectangle's part that meets
  condition (5): from (sqrt(63), -1) along the bottom, right and top side, down to (5, sqrt(39)).

"masajedi_straight" and "masajedi_curved" are for the arm ``kr16``. Document 002 (Masajedi, Shirazi
and Ghanbarzadeh 2013, section 7) follows a straight and a curved path in space through 21 accuracy
points, and says of each point that eight sets of joint angles reach it within the limits. It
prints no coordinate: these two were chosen so that what it says holds all along them, and that
each of the eight goes on from start to end within the limits and past no singularity.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.path import Path, Samples

__all__ = ["named_path", "named_samples", "path_names"]

Array = NDArray[np.float64]

ACCURACY_POINTS = 21
"""Accuracy points of document 002, section 7."""

STEP = 0.01
"""Step of document 003: of t [rad] in equations 8 and 9; read [m] for 10 and 11."""

CENTER, RADIUS = (12.9, 3.087, 0.0), 8.0
ARC = (1.4 * np.pi, 2.75 * np.pi)


def path_names() -> tuple[str, ...]:
    """The names that ``named_path`` takes."""
    return tuple(_PATHS)


def named_path(name: str) -> Path:
    """A path of a source document.

    Raises:
        InputError: no such path; the message lists the names.

    Example:
        >>> named_path("habibkhah_2").length
        33.929...
    """
    return _known(name)[0]()


def named_samples(name: str) -> Samples:
    """The poses at which the document samples that path.

    629, 425, 4200 and 3182 points of document 003; 21 of document 002, evenly along the path.

    Raises:
        InputError: no such path; the message lists the names.

    Example:
        >>> named_samples("masajedi_straight").T.shape
        (21, 4, 4)
    """
    make, parameters = _known(name)
    path = make()
    s = parameters(path)
    return Samples(path(s), s)


def _known(name: str) -> tuple[Callable[[], Path], Callable[[Path], Array]]:
    entry = _PATHS.get(name) if isinstance(name, str) else None
    if entry is None:
        raise InputError(f"unknown path {name!r}: the paths are {', '.join(_PATHS)}")
    return entry


def _circle() -> Path:
    return Path.circle(CENTER, RADIUS, orientation="radial")


def _arc() -> Path:
    return Path.circle(CENTER, RADIUS, angles=ARC, orientation="radial")


def _rectangle() -> Path:
    return Path.rectangle(x=[5, 15], y=[-1, 10], orientation="radial")


def _semi_rectangle() -> Path:
    corners = [[np.sqrt(63), -1, 0], [15, -1, 0], [15, 10, 0], [5, 10, 0], [5, np.sqrt(39), 0]]
    return Path.polyline(corners, orientation="radial")


def _straight() -> Path:
    start = se3.pose([-0.25, -0.4, 1.7], rpy=np.radians([45, 15, 80]))
    end = se3.pose([0.25, -0.5, 1.8], rpy=np.radians([45, 15, 100]))
    return Path.line(start, end)


def _curved() -> Path:
    points = [
        [-0.24, -0.40, 1.70],
        [-0.12, -0.46, 1.77],
        [0.00, -0.44, 1.72],
        [0.12, -0.50, 1.78],
        [0.24, -0.46, 1.74],
    ]
    return Path.spline(points, orientation=se3.pose(rpy=np.radians([45, 15, 80])))


def _by_angle(path: Path) -> Array:
    # t = first : 0.01 : last, and s = radius * (t - first)
    return np.asarray(RADIUS * STEP * np.arange(int(path.length / (RADIUS * STEP)) + 1))


def _perimeter(path: Path) -> Array:
    return np.asarray(STEP * np.arange(round(path.length / STEP)))


def _part_of_perimeter(path: Path) -> Array:
    # the points of the whole rectangle that lie on this part of it: the first at x = 7.94
    first = 7.94 - np.sqrt(63)
    return np.asarray(first + STEP * np.arange(int((path.length - first) / STEP) + 1))


def _accuracy_points(path: Path) -> Array:
    return np.linspace(0.0, path.length, ACCURACY_POINTS)


_PATHS: dict[str, tuple[Callable[[], Path], Callable[[Path], Array]]] = {
    "habibkhah_1": (_circle, _by_angle),
    "habibkhah_2": (_arc, _by_angle),
    "habibkhah_3": (_rectangle, _perimeter),
    "habibkhah_4": (_semi_rectangle, _part_of_perimeter),
    "masajedi_straight": (_straight, _accuracy_points),
    "masajedi_curved": (_curved, _accuracy_points),
}

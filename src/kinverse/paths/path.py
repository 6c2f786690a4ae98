"""A path: where the tool goes and how it is turned, by arc length."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.checks import (
    as_bounds,
    as_frame,
    as_length,
    as_stations,
    check_blend,
    check_pieces,
    stacked,
    turns_between,
)
from kinverse.paths.files import from_file
from kinverse.paths.orientation import Constant, Orientation, Slerp, as_orientation
from kinverse.paths.shapes import Arc, Curve, Polyline, Still, rounded
from kinverse.paths.smooth import spline

__all__ = ["MOST_SAMPLES", "Path", "Samples"]

Array = NDArray[np.float64]

MOST_SAMPLES = 10_000_000
"""Poses a call of ``sample`` gives, at most."""


class Samples(NamedTuple):
    """Poses ``T`` (N, 4, 4) of a path at its parameters ``s`` (N,)."""

    T: Array
    s: Array


@dataclass(frozen=True, eq=False, repr=False)
class Path:
    """A curve of poses over s from 0 to ``length``; s is the way gone [m].

    A path that only turns about one point is measured by its turn instead: s and ``length`` are in
    rad, and ``unit`` says so.

    Paths are made by ``line``, ``arc``, ``circle``, ``polyline``, ``rectangle``, ``spline``,
    ``from_poses`` and ``from_file``. Where they take points, these are (K, 3) positions [m] or
    (K, 4, 4) poses. The tool turns as the poses say (from one to the next about one axis, at an
    even rate), or as ``orientation`` says, which comes before the poses: a rotation (3, 3),
    "radial" (about the base's z axis by atan2(y, x), document 003), "tangent" (x along the path),
    or an object such as ``Tangent(up=...)``; positions without orientation keep that of the base.

    Attributes:
        curve: positions by s.
        orientation: rotations by s.

    Example:
        >>> path = Path.line(kv.pose([0.9, -0.3, 1.0]), kv.pose([0.9, 0.3, 1.0]))
        >>> path.length, path(0.3)[:3, 3]
        (0.6, array([0.9, 0. , 1. ]))
    """

    curve: Curve
    orientation: Orientation

    # ------------------------------------------------------------------ shapes
    @classmethod
    def line(cls, start: ArrayLike, end: ArrayLike, orientation: Any = None) -> "Path":
        """Straight from start to end, each a position (3,) or a pose (4, 4).

        Raises:
            InputError: start and end are the same, are not both positions or poses, or are not
                finite or rigid.

        Example:
            >>> Path.line([0.5, 0, 1], [0.5, 0.3, 1]).length
            0.3
        """
        return cls.polyline(stacked([start, end], ("start", "end")), orientation=orientation)

    @classmethod
    def arc(
        cls, start: ArrayLike, via: ArrayLike, end: ArrayLike, orientation: Any = None
    ) -> "Path":
        """The circle's arc from start by way of via to end, each (3,) or (4, 4).

        Raises:
            InputError: the three lie on a line (or two of them in one place), or as ``line``.

        Example:
            >>> Path.arc([1, 0, 0], [0, 1, 0], [-1, 0, 0]).length / np.pi
            1.0
        """
        points, given = as_stations(stacked([start, via, end], ("start", "via", "end")), "arc")
        u, v = points[1] - points[0], points[2] - points[0]
        normal = np.cross(u, v)
        flat = float(np.linalg.norm(normal))
        sides = [float(np.linalg.norm(w)) for w in (u, v, points[2] - points[1])]
        if flat <= 1e-9 * max(sides) ** 2 or min(sides) == 0.0:
            raise InputError("start, via and end lie on a line: no arc leads through them")
        # the centre of the circle about a triangle, from its corner at the start
        toward = np.cross(normal, u) * (v @ v) + np.cross(v, normal) * (u @ u)
        center = points[0] + toward / (2.0 * flat**2)
        radius = float(np.linalg.norm(points[0] - center))
        x = (points[0] - center) / radius
        y = np.cross(normal / flat, x)
        t = np.arctan2((points - center) @ y, (points - center) @ x)
        at_via, at_end = np.mod(t[1:], 2.0 * np.pi).tolist()
        curve = Arc(center, x, y, radius, 0.0, at_end)
        return cls(curve, _turning(orientation, given, radius * np.array([0.0, at_via, at_end])))

    @classmethod
    def circle(
        cls,
        center: ArrayLike,
        radius: float,
        angles: ArrayLike = (0.0, 2.0 * np.pi),
        orientation: Any = None,
    ) -> "Path":
        """A circle or a part of it, possibly more than one turn.

        Args:
            center: (3,) for a circle in the plane of the base's x and y, or (4, 4) a frame in
                whose x-y plane it lies.
            radius: [m].
            angles: first and last angle [rad], from the x axis towards the y axis.
            orientation: see :class:`Path`.

        Raises:
            InputError: a radius that is not positive, angles that are the same, or bad numbers.

        Example:
            >>> Path.circle([0.6, 0, 0.5], 0.2, angles=[0, np.pi / 2])(0.0)[:3, 3]
            array([0.8, 0. , 0.5])
        """
        frame = as_frame(center, "center")
        size = as_length(radius, "radius", least=1e-9)
        first, last = as_bounds(angles, "angles")
        x, y = frame[:3, 0], frame[:3, 1]
        return cls(Arc(frame[:3, 3], x, y, size, first, last), _turning(orientation, None, None))

    @classmethod
    def polyline(cls, points: ArrayLike, blend: float = 0.0, orientation: Any = None) -> "Path":
        """Straight from point to point, corners sharp or rounded.

        Args:
            points: (K, 3) positions [m] or (K, 4, 4) poses, at least two.
            blend: distance from each inner corner at which its rounding begins and ends [m], an
                arc that touches both sides; 0: sharp. A given pose's rotation is reached in the
                middle of its arc.
            orientation: see :class:`Path`.

        Raises:
            InputError: fewer than two points, neighbours in one place (the message names the
                rows), a blend that does not fit, bad numbers.

        Example:
            >>> Path.polyline([[0, 0, 0], [1, 0, 0], [1, 1, 0]], blend=0.1).length < 2
            True
        """
        places, given = as_stations(points, "points")
        if given is not None and orientation is None:
            turn = turns_between(places, given)
            if turn is not None:
                return cls(Still(places[0], turn), Slerp(turn, given))
        check_pieces(places, given, "points")
        size = as_length(blend, "blend")
        if size == 0.0:
            line = Polyline(places)
            return cls(line, _turning(orientation, given, line.breaks))
        check_blend(places, size)
        curve, passed = rounded(places, size)
        return cls(curve, _turning(orientation, given, passed))

    @classmethod
    def rectangle(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        frame: ArrayLike = (0.0, 0.0, 0.0),
        blend: float = 0.0,
        orientation: Any = None,
    ) -> "Path":
        """Once round a rectangle from its corner (x[0], y[0]), along x first.

        Counter-clockwise if x and y ascend.

        Args:
            x: both ends of its sides along x [m].
            y: both ends of its sides along y [m].
            frame: (3,) the origin that x and y are counted from, or a frame (4, 4) in whose x-y
                plane they lie.
            blend: as in ``polyline``, for all four corners; the path then begins behind the arc at
                its first corner.
            orientation: see :class:`Path`.

        Raises:
            InputError: a side of no length, or as ``polyline``.

        Example:
            >>> Path.rectangle(x=[5, 15], y=[-1, 10], orientation="radial").length
            42.0
        """
        placed = as_frame(frame, "frame")
        (x0, x1), (y0, y1) = as_bounds(x, "x"), as_bounds(y, "y")
        flat = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
        corners = flat @ placed[:3, :3].T + placed[:3, 3]
        ring = np.concatenate([corners, corners[:1]])
        size = as_length(blend, "blend")
        if size == 0.0:
            return cls(Polyline(ring), _turning(orientation, None, None))
        check_blend(ring, size, closed=True)
        return cls(rounded(corners, size, closed=True)[0], _turning(orientation, None, None))

    @classmethod
    def spline(cls, points: ArrayLike, closed: bool = False, orientation: Any = None) -> "Path":
        """A smooth curve through points: cubic, with continuous curvature.

        Args:
            points: (K, 3) positions [m] or (K, 4, 4) poses, at least two.
            closed: back to the first point, smoothly.
            orientation: see :class:`Path`.

        Raises:
            InputError: as ``polyline``; closed with fewer than three points.

        Example:
            >>> path = Path.spline(robot.fk(q))
            >>> path(path.breaks) - robot.fk(q)
        """
        places, given = as_stations(points, "points")
        check_pieces(places, given, "points", closed)
        if closed and len(places) < 3:
            raise InputError(f"a closed spline needs three points, got {len(places)}")
        curve = spline(places, closed)
        if closed and given is not None:
            given = np.concatenate([given, given[:1]])
        return cls(curve, _turning(orientation, given, curve.breaks))

    @classmethod
    def from_poses(cls, T: ArrayLike) -> "Path":
        """Straight from pose to pose (K, 4, 4), turning evenly between two.

        Poses that all have one position make a path that only turns, measured in rad.

        Raises:
            InputError: one pose, none, a pose that repeats the one before it or only turns where
                others move, NaN, or poses that are not rigid; the message names the row.

        Example:
            >>> Path.from_poses([kv.pose(rpy=[0, 0, yaw]) for yaw in (0, 1.5, 2)]).unit
            'rad'
        """
        return cls.polyline(se3.as_poses(T, "T"))

    @classmethod
    def from_file(
        cls, file: str | PathLike[str], degrees: bool | None = None, orientation: Any = None
    ) -> "Path":
        """Straight from pose to pose as a file lists them.

        Args:
            file: .csv with a header, the columns x y z with roll pitch yaw or qw qx qy qz, or
                m11 ... m34, or x y z alone; a name may carry its unit, "x [mm]", "roll [deg]",
                and is read in metres or radians if it does not. Or .npz with an array T
                (N, 4, 4); or .npy.
            degrees: what roll, pitch and yaw without a unit are in. None: radians, and values of
                more than a turn are refused.
            orientation: see :class:`Path`.

        Raises:
            InputError: another kind of file, no header, an unknown unit, a broken row or cell, or
                as ``from_poses``; the message names the file, the row and the column.
            OSError: the file cannot be read.

        Example:
            >>> path = Path.from_file("weld.csv", degrees=True)
        """
        source = FilePath(file)
        T = from_file(source, degrees)
        try:
            return cls.polyline(T, orientation=orientation)
        except InputError as error:
            raise InputError(f"{source}: {error}") from error

    # ------------------------------------------------------------------ what it is
    @property
    def length(self) -> float:
        """The way from start to end [m]; [rad] if the path only turns, see ``unit``."""
        return self.curve.length

    @property
    def unit(self) -> str:
        """What s and ``length`` are in: "m", or "rad" for a path that only turns."""
        return "rad" if isinstance(self.curve, Still) else "m"

    @property
    def breaks(self) -> Array:
        """(K,) parameters at which pieces meet, 0 and the length included."""
        return self.curve.breaks.copy()

    def __call__(self, s: ArrayLike) -> Array:
        """Poses (..., 4, 4) at parameters s (...), each from 0 to ``length``.

        Raises:
            InputError: a parameter that is not finite or off the path (by more than 1e-9 of it).
        """
        at = se3.as_real(s, "s")
        flat = at.reshape(-1)
        slack = 1e-9 * self.length
        off = ~((flat >= -slack) & (flat <= self.length + slack))
        if off.any():
            i = int(np.argmax(off))
            raise InputError(
                f"s must lie from 0 to {self.length:.9g} {self.unit}, got {flat[i]:g} at index {i}"
            )
        flat = np.clip(flat, 0.0, self.length)
        T = np.tile(np.eye(4), (len(flat), 1, 1))
        T[:, :3, 3] = self.curve.points(flat)
        tangents = self.curve.tangents(flat)
        T[:, :3, :3] = self.orientation.rotations(flat, T[:, :3, 3], tangents)
        return T.reshape(*at.shape, 4, 4)

    def sample(self, count: int | None = None, *, chord: float | None = None) -> Samples:
        """Poses along the path, both ends included; give one of the two.

        Args:
            count: so many, evenly along s (corners are met only by chance).
            chord: as few as keep straight lines between neighbours within this distance of the
                path [m]; the breaks are among them. It looks at positions only.

        Returns:
            ``Samples(T, s)``.

        Raises:
            InputError: both or none, fewer than two, a chord that is not positive or asks for more
                than ten million, or a chord for a path that only turns.

        Example:
            >>> T, s = Path.circle([0.6, 0, 0.5], 0.2).sample(chord=1e-4)
        """
        if (count is None) == (chord is None):
            raise InputError("sample takes either a count or a chord error")
        if count is not None:
            if isinstance(count, bool) or not isinstance(count, int | np.integer):
                raise InputError(f"count must be a whole number, got {count!r}")
            if not 2 <= count <= MOST_SAMPLES:
                raise InputError(f"count must lie in 2..{MOST_SAMPLES}, got {count}")
            s = np.linspace(0.0, self.length, int(count))
            return Samples(self(s), s)
        if self.unit == "rad":
            raise InputError("a path that only turns has no chord error: give a count")
        most = as_length(chord, "chord", least=1e-15)
        # a chord error falls with the square of the step: a circle tells the number of steps
        if self.length > MOST_SAMPLES * np.sqrt(most * self.length):
            raise InputError(f"chord = {most:g} m needs more than {MOST_SAMPLES} samples")
        s = self.curve.steps(most)
        return Samples(self(s), s)

    def __repr__(self) -> str:
        pieces = len(self.curve.breaks) - 1
        shape = type(self.curve).__name__.lower()
        turned = type(self.orientation).__name__.lower()
        return f"Path: {shape}, {pieces} pieces, {self.length:.6g} {self.unit}, {turned}"


def _turning(orientation: Any, given: Array | None, knots: Array | None) -> Orientation:
    """The orientation asked for; else between the given rotations at knots; else the base's."""
    if orientation is not None:
        return as_orientation(orientation)
    return Constant() if given is None or knots is None else Slerp(knots, given)

"""Joint values, or places of the tool, as splines along a path, and how far the tool strays."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError, NoSolution
from kinverse.paths.checks import as_length
from kinverse.paths.path import Path
from kinverse.robot import Robot

__all__ = [
    "DEGREES",
    "Deviation",
    "JointCurve",
    "Refined",
    "ToolCurve",
    "deviation",
    "refined",
    "tool_deviation",
]

Array = NDArray[np.float64]

DEGREES = (3, 4, 5, 6, 7)
"""Degrees a spline may have. Document 002 joins its points by "6th order interpolation"."""

BETWEEN = 15
"""Places looked at between two samples."""

MOST_SAMPLES = 100_000
"""Samples that ``refined`` takes, at most."""


@dataclass(frozen=True, eq=False, repr=False)
class _SplineCurve:
    """A spline through values (K, d) at ascending parameters s (K,)."""

    s: Any
    values: Any
    degree: int = 3
    _spline: Any = field(init=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import make_interp_spline

        s, values = se3.as_real(self.s, "s"), se3.as_real(self.values, "values")
        if self.degree not in DEGREES or isinstance(self.degree, bool | float):
            raise InputError(f"degree must be one of {DEGREES}, got {self.degree!r}")
        if s.ndim != 1 or values.ndim != 2 or len(values) != len(s) or not values.shape[1]:
            raise InputError(
                f"a curve takes s (K,) and values (K, d), got {s.shape} and {values.shape}"
            )
        if len(s) <= self.degree:
            raise InputError(
                f"a spline of degree {self.degree} needs {self.degree + 1} samples, got {len(s)}"
            )
        bad = ~(np.isfinite(values).all(axis=1) & np.isfinite(s))
        if bad.any():
            raise InputError(f"row {int(np.argmax(bad))} holds NaN or inf")
        if (np.diff(s) <= 0.0).any():
            row = int(np.argmax(np.diff(s) <= 0.0)) + 1
            raise InputError(f"s must increase: s[{row}] = {s[row]:g} follows {s[row - 1]:g}")
        for name, array in (("s", s + 0.0), ("values", values + 0.0)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "_spline", make_interp_spline(s, values, k=self.degree))

    def __call__(self, s: ArrayLike, order: int = 0) -> Array:
        """Values (..., d) at parameters s (...), or their derivative of that order by s.

        Raises:
            InputError: a parameter that is not finite or (by more than 1e-9 of it) off the curve.
        """
        at = se3.as_real(s, "s")
        first, last = self.s[0], self.s[-1]
        slack = 1e-9 * (last - first)
        if not ((at >= first - slack) & (at <= last + slack)).all():
            raise InputError(f"s must lie from {first:.9g} to {last:.9g}")
        return np.asarray(self._spline(np.clip(at, first, last), nu=order))

    def __repr__(self) -> str:
        name, (count, width) = type(self).__name__, self.values.shape
        return f"{name}: degree {self.degree}, {count} samples of {width}"


class JointCurve(_SplineCurve):
    """Joint values (K, n) [rad or m] at parameters s (K,) of a path, joined by a spline.

    Args:
        s: (K,) ascending; that of a ``Path``, so that even steps are even for the tool.
        values: (K, n); turns must be counted through, without jumps by a whole turn.
        degree: 3 to 7; K must be greater. Ends are not-a-knot.

    Raises:
        InputError: another degree or shape, too few samples, NaN, or s that does not increase.

    Example:
        >>> curve = JointCurve(s, q, degree=4)
        >>> curve(0.1), curve(0.1, order=1)
    """


class ToolCurve(_SplineCurve):
    """Places (K, 3) of the tool [m] at parameters s (K,) of a path, joined by a spline.

    Document 002, figure 7. Arguments and errors as of :class:`JointCurve`.

    Example:
        >>> ToolCurve(s, robot.fk(q)[:, :3, 3], degree=6)
    """


class Deviation(NamedTuple):
    """How far the tool strays from a path between samples, at the same parameter.

    Attributes:
        position: largest distance [m].
        rotation: largest angle [rad].
        at: parameter of the largest distance.
        positions: (K - 1,) largest distance between each two samples [m].
        rotations: (K - 1,) largest angle [rad].
    """

    position: float
    rotation: float
    at: float
    positions: Array
    rotations: Array

    def __repr__(self) -> str:
        return (
            f"Deviation: {self.position:.3g} m, {self.rotation:.3g} rad at most, at s ="
            f" {self.at:.6g}, between {len(self.positions) + 1} samples"
        )


def deviation(robot: Robot, curve: JointCurve, path: Path) -> Deviation:
    """The tool's largest deviation from a path if the joints follow a curve.

    Looked at in 15 places between two samples. The distance is that of places with the same
    parameter, so it is no less than the distance from the path as a set of points.

    Args:
        robot: the arm.
        curve: its joint values.
        path: what the tool is to follow; the curve's parameters must lie on it.

    Raises:
        InputError: a curve of another number of joints, or parameters off the path.

    Example:
        >>> T, s = named_samples("masajedi_straight")
        >>> q = kv.Numerical().fit(robot).follow(T, q_start).q
        >>> deviation(robot, JointCurve(s, q, degree=6), named_path("masajedi_straight")).position
    """
    if not isinstance(curve, JointCurve):
        raise InputError(f"curve must be a JointCurve, got {type(curve).__name__}")
    if curve.values.shape[1] != robot.dof:
        raise InputError(
            f"the curve has {curve.values.shape[1]} columns, robot {robot.name!r}"
            f" {robot.dof} joints"
        )
    s = _between(curve.s)
    got, want = robot.fk(curve(s)), path(s)
    away = np.linalg.norm(got[..., :3, 3] - want[..., :3, 3], axis=-1)
    between = np.swapaxes(want[..., :3, :3], -1, -2) @ got[..., :3, :3]
    return _largest(s, away, np.linalg.norm(se3.rotation_log(between), axis=-1))


def tool_deviation(curve: ToolCurve, path: Path) -> Deviation:
    """The same for a spline of the tool's places; its rotations are zero.

    Raises:
        InputError: a curve that is not of x, y and z, or parameters off the path.

    Example:
        >>> T, s = named_samples("masajedi_curved")
        >>> tool_deviation(ToolCurve(s, T[:, :3, 3]), named_path("masajedi_curved")).position
    """
    if not isinstance(curve, ToolCurve) or curve.values.shape[1] != 3:
        raise InputError(f"curve must be a ToolCurve of x, y and z, got {curve!r}")
    s = _between(curve.s)
    away = np.linalg.norm(curve(s) - path(s)[..., :3, 3], axis=-1)
    return _largest(s, away, np.zeros_like(away))


class Refined(NamedTuple):
    """A curve that keeps its tool near a path, and how near."""

    curve: JointCurve
    deviation: Deviation


def refined(
    robot: Robot,
    path: Path,
    follow: Callable[[Array, Array], Any],
    q_start: ArrayLike,
    tolerance: float,
    rotation_tolerance: float | None = None,
    degree: int = 3,
    count: int = 21,
) -> Refined:
    """A joint curve with as many samples as keep the tool within a tolerance of the path.

    Document 002's accuracy points, added where they are needed: where the tool strays, and next to
    it, steps are halved. Poses are solved anew in each round, from the start, so that an arm with
    joints to spare comes to one consistent motion.

    Args:
        robot: the arm.
        path: what the tool is to follow.
        follow: ``follow(T, q_start)`` gives joint values for poses T (N, 4, 4) in order, each near
            those before, as (N, n) or as ``Solutions``: ``kv.Numerical().fit(robot).follow``.
        q_start: (n,) joint values near the first pose; they choose the branch.
        tolerance: largest distance of the tool from the path [m].
        rotation_tolerance: largest angle [rad]; None: any.
        degree: of the spline, 3 to 7.
        count: samples to begin with, evenly, beside the path's breaks.

    Raises:
        InputError: an argument that cannot be used.
        NoSolution: ``follow`` has no solution at a sample, or 100,000 samples are not enough
            (joints that jump, or turn on the spot at a corner).

    Example:
        >>> solver = kv.Numerical().fit(robot)
        >>> refined(robot, path, solver.follow, q_start, tolerance=1e-5).curve
    """
    close = as_length(tolerance, "tolerance", least=1e-300)
    turned = np.inf
    if rotation_tolerance is not None:
        turned = as_length(rotation_tolerance, "rotation_tolerance", least=1e-300)
    start = se3.as_joints(q_start, robot.dof, "q_start")
    s = np.union1d(path.sample(max(count, degree + 1)).s, path.breaks)
    while True:
        curve = JointCurve(s, _followed(follow, path, s, start), degree)
        found = deviation(robot, curve, path)
        wide = (found.positions > close) | (found.rotations > turned)
        if not wide.any():
            return Refined(curve, found)
        wide[1:] |= wide[:-1].copy()
        wide[:-1] |= wide[1:].copy()
        middle = (s[:-1] + s[1:]) / 2.0
        if len(s) + wide.sum() > MOST_SAMPLES or np.isin(middle[wide], s).any():
            raise NoSolution(
                f"with {len(s)} samples the tool is still {found.position:.3g} m and"
                f" {found.rotation:.3g} rad off, at s = {found.at:.6g}"
            )
        s = np.sort(np.concatenate([s, middle[wide]]))


def _followed(follow: Callable[[Array, Array], Any], path: Path, s: Array, start: Array) -> Array:
    """Joint values (N, n) at parameters of a path, by the caller's solver."""
    answer = follow(path(s), start)
    if not hasattr(answer, "pose_index"):
        q = se3.as_joints(answer, len(start), "the answer of follow")
        if q.shape != (len(s), len(start)):
            raise InputError(f"follow must give ({len(s)}, {len(start)}) values, got {q.shape}")
        return q
    if not answer.ok.all():
        lost = int(np.argmin(answer.ok))
        raise NoSolution(f"follow found no solution at s = {s[lost]:.6g} (pose {lost})")
    if len(answer.q) != len(s):
        raise InputError("follow must give one solution a pose: select one")
    return np.asarray(answer.q)


def _between(s: Array) -> Array:
    """(K - 1, 15) parameters between each two samples."""
    share = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
    return np.asarray(s[:-1, None] + share * np.diff(s)[:, None])


def _largest(s: Array, away: Array, turned: Array) -> Deviation:
    at = float(s.ravel()[int(np.argmax(away))])
    return Deviation(
        float(away.max()), float(turned.max()), at, away.max(axis=1), turned.max(axis=1)
    )

"""The joint spline of one run: through its samples, near the path and inside limits between."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import Numerical, se3
from kinverse.cli._path import Given
from kinverse.cli._show import joint_kinds, note
from kinverse.errors import InputError
from kinverse.paths.joint_curve import JointCurve
from kinverse.paths.tracking.samples import Samples
from kinverse.paths.wanted import Beyond, beyond_limits
from kinverse.robot import LIMIT_SLACK
from kinverse.velocity import characteristic_length

if TYPE_CHECKING:
    from kinverse.paths import JointPath
    from kinverse.robot import Robot

__all__ = ["Joined", "joined"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]

DEGREE = 5
STANDS = 1e-12
"""Joints that move less than this from one pose to the next do not move [rad or m]."""
SHARE = 0.1
"""Between two poses the tool may stray by this share of what lies between them, ..."""
LEAST_WAY, LEAST_TURN = 1e-4, 1e-3
"""... and in any case by this [m, rad]."""
PLACES = 15
"""Looked at between two samples."""
ROUNDS, MOST_SAMPLES = 20, 50_000
"""Of adding samples; samples at most."""
NEAR = 0.1
"""An added sample is this near the middle of its neighbours, or as near as they are [rad or m]."""


class Joined(NamedTuple):
    """A joint spline and how well it does between the samples.

    Attributes:
        curve: joint values by the path's parameter, or by the way of the tool.
        position: largest distance of its tool from the path [m].
        rotation: largest angle [rad]; 0 where the task leaves the rotation open.
        added: samples beside those of the run.
        beyond: where it leaves the joint limits farthest; None if it does not.
        unsolved: places where a sample was wanted and none could be found.
    """

    curve: JointCurve
    position: float
    rotation: float
    added: int
    beyond: Beyond | None
    unsolved: int


class _Places(NamedTuple):
    """Samples between rows: the row before, the fraction of the way to the next, joint values."""

    row: Ints
    fraction: Array
    q: Array


def joined(
    found: "JointPath", given: Given, part: tuple[int, int], task: str, tolerance: float | None
) -> Joined:
    """A spline through one run, with samples added where it strays or leaves the limits.

    Between rows the path is the given one, or straight from pose to pose and turning evenly.

    Args:
        found: what was tracked.
        given: the poses, and the path they are from if there is one.
        part: first row of the run and the one behind its last, counted from 0.
        task: which part of the poses must hold.
        tolerance: largest distance of the tool from the path [m]; None: a tenth of the distance of
            the two poses, at least 0.1 mm. The tool turns off by at most a tenth of the angle
            between them, at least 1e-3 rad.

    Raises:
        InputError: fewer than two different poses.
    """
    first, last = part
    T, q = given.T[first:last], found.q[first:last]
    s = None if given.s is None else given.s[first:last]
    moved = np.append(True, np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0) > STANDS)
    if s is None and not moved.all():
        note(f"{int((~moved).sum())} poses repeat the one before: left out")
        T, q = T[moved], q[moved]
    if len(q) < 2 or not moved[1:].any():
        raise InputError(
            f"rows {first + 1} to {last}, the longest run, have {int(moved.sum())} different poses;"
            " a joint spline takes at least 2: --samples 100 takes so many along the path"
        )
    path = None if s is None else given.path
    samples = Samples(T, _way(found.robot, T, q, task) if s is None else s, path)
    allowed = _allowed(task, T, tolerance)
    solver = Numerical(task=task, tol_position=1e-9, tol_rotation=1e-9).fit(found.robot)
    rows = np.arange(len(q), dtype=np.int64)
    places = _Places(rows, np.zeros(len(q)), q)
    lost: Flags = np.zeros(len(q) - 1, dtype=np.bool_)
    for _ in range(ROUNDS):
        wide = _wide(found.robot, samples, places, task, allowed) & ~lost
        if not wide.any() or len(places.q) + wide.sum() > MOST_SAMPLES:
            break
        places, lost = _halved(solver, samples, places, wide, lost)
    curve, away, turned, asked = _between(found.robot, samples, places, task)
    return Joined(
        curve,
        float(away.max()),
        float(turned.max()),
        len(places.q) - len(q),
        beyond_limits(found.robot, asked.reshape(-1, found.robot.dof)),
        int(lost.sum()),
    )


def _allowed(task: str, T: Array, tolerance: float | None) -> tuple[Array, Array]:
    """(N - 1,) distance [m] and angle [rad] by which the tool may stray between two poses."""
    way, turn = _errors(task, T[:-1], T[1:])
    close = np.maximum(SHARE * way, LEAST_WAY)
    if tolerance is not None:
        close = np.full_like(way, tolerance)
    return close, np.maximum(SHARE * turn, LEAST_TURN)


def _curve(samples: Samples, places: _Places) -> JointCurve:
    s = samples.s
    assert s is not None
    return JointCurve(
        np.interp(places.row + places.fraction, np.arange(len(s)), s), places.q, DEGREE
    )


def _way(robot: "Robot", T: Array, q: Array, task: str) -> Array:
    """(N,) the way of the tool up to each pose [m]: a radian counts as the arm's length.

    Even along an even path, as the joints' own way is not. Where the tool stands and the joints
    move, theirs counts.
    """
    length = characteristic_length(robot)
    moved, turned = _errors(task, T[:-1], T[1:])
    turns = np.array([kind == "R" for kind in joint_kinds(robot)])
    joints = np.abs(np.diff(q, axis=0)) * np.where(turns, length, 1.0)
    tool = moved + length * turned
    steps = np.where(tool > STANDS, tool, joints.max(axis=1))
    return np.append(0.0, np.cumsum(steps))


def _between(
    robot: "Robot", samples: Samples, places: _Places, task: str
) -> tuple[JointCurve, Array, Array, Array]:
    """The spline; how far its tool strays and turns off, and its joints (K - 1, 15, ...)."""
    curve = _curve(samples, places)
    share = np.arange(1, PLACES + 1) / (PLACES + 1)
    q = curve(curve.s[:-1, None] + share * np.diff(curve.s)[:, None])
    begin = places.fraction[:-1]
    end = places.row[1:] + places.fraction[1:] - places.row[:-1]
    fraction = begin[:, None] + share * (end - begin)[:, None]
    row = np.repeat(places.row[:-1], PLACES)
    wanted = samples.at(row, fraction.ravel()).reshape(*fraction.shape, 4, 4)
    return curve, *_errors(task, wanted, robot.fk(q)), q


def _wide(
    robot: "Robot", samples: Samples, places: _Places, task: str, allowed: tuple[Array, Array]
) -> Flags:
    """(K - 1,) between which samples the spline strays or leaves the limits, or all: too few."""
    if len(places.q) <= DEGREE:
        return np.ones(len(places.q) - 1, dtype=np.bool_)
    _, away, turned, q = _between(robot, samples, places, task)
    low, high = robot.limits.T
    row = places.row[:-1]
    wide = (away > allowed[0][row, None]) | (turned > allowed[1][row, None])
    outside = ((q < low - LIMIT_SLACK) | (q > high + LIMIT_SLACK)).any(axis=(1, 2))
    flags = (wide.any(axis=1) | outside).astype(np.int64)
    # the neighbours have a hand in it
    return np.asarray(np.convolve(flags, [1, 1, 1])[1:-1] > 0)


def _halved(
    solver: Numerical, samples: Samples, places: _Places, wide: Flags, lost: Flags
) -> tuple[_Places, Flags]:
    """A sample more in the middle of each wide interval; those without a near one are lost."""
    at = np.flatnonzero(wide)
    row, begin = places.row[at], places.fraction[at]
    fraction = 0.5 * (begin + places.row[at + 1] + places.fraction[at + 1] - row)
    near = 0.5 * (places.q[at] + places.q[at + 1])
    answers = solver.solve(samples.at(row, fraction), q_seed=near)
    q = np.full_like(near, np.nan)
    q[answers.pose_index] = answers.q
    most = np.maximum(NEAR, np.abs(places.q[at + 1] - places.q[at]).max(axis=1))
    good = np.abs(q - near).max(axis=1) <= most
    lost = lost.copy()
    lost[at[~good]] = True
    at, row, fraction, q = at[good], row[good], fraction[good], q[good]
    more = _Places(
        np.insert(places.row, at + 1, row),
        np.insert(places.fraction, at + 1, fraction),
        np.insert(places.q, at + 1, q, axis=0),
    )
    return more, np.insert(lost, at + 1, False)


def _errors(task: str, wanted: Array, T: Array) -> tuple[Array, Array]:
    """Distance [m] and angle [rad] (...) between poses (..., 4, 4), of what a task holds."""
    gap = T[..., :3, 3] - wanted[..., :3, 3]
    away = np.linalg.norm(gap[..., :2] if task == "planar" else gap, axis=-1)
    if task == "position":
        return away, np.zeros_like(away)
    if task == "position_axis":
        a, b = wanted[..., :3, 2], T[..., :3, 2]
        return away, np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
    turn = se3.rotation_log(T[..., :3, :3] @ np.swapaxes(wanted[..., :3, :3], -1, -2))
    if task == "pose":
        return away, np.linalg.norm(turn, axis=-1)
    return away, np.abs(turn[..., 2])

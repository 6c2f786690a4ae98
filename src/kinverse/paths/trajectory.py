"""Motions in time: along a joint curve, from point to point, or through given samples."""

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError, MissingExtra, NoSolution
from kinverse.files import write_atomically
from kinverse.paths.checks import as_joint_limits
from kinverse.paths.joint_curve import JointCurve
from kinverse.paths.joint_path import JointPath
from kinverse.paths.motion_file import RATE, motion_csv
from kinverse.robot import Robot

__all__ = ["State", "Trajectory", "retime"]

Array = NDArray[np.float64]

LEAST_GRID = 400
"""Places at which a retimed curve is held to its limits, at least."""

LOOKED = 8
"""Parts of each step of a retimed motion in which the largest use of the limits is looked for."""

ROUNDS = 6
"""How often the largest of them are looked at closer, each time LOOKED / 2 times as close."""


class State(NamedTuple):
    """Joint values, velocities and accelerations (..., n), in rad or m, and seconds."""

    q: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """Joint values over time, from 0 to ``duration`` [s].

    Made by :func:`retime`, :func:`point_to_point` and :meth:`through`.

    Attributes:
        duration: [s].
        motion: a function of times (N,) that gives their ``State``.

    Example:
        >>> trajectory = retime(curve, velocity=2.0, acceleration=8.0)
        >>> trajectory(0.5 * trajectory.duration).q
    """

    duration: float
    motion: Callable[[Array], State]

    def __call__(self, t: ArrayLike) -> State:
        """The state at times t (...) [s]; arrays of shape (..., n).

        Raises:
            InputError: a time that is not finite or (by more than 1e-9 of it) outside the motion.
        """
        at = se3.as_real(t, "t")
        slack = 1e-9 * self.duration
        if not ((at >= -slack) & (at <= self.duration + slack)).all():
            raise InputError(f"t must lie from 0 to {self.duration:.9g} s")
        parts = self.motion(np.clip(at.reshape(-1), 0.0, self.duration))
        return State(*(part.reshape(*at.shape, part.shape[-1]) for part in parts))

    def sample(self, count: int) -> tuple[Array, State]:
        """Times (count,) [s], evenly from start to end, and the states there."""
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 2:
            raise InputError(f"count must be a whole number of at least 2, got {count!r}")
        t = np.linspace(0.0, self.duration, int(count))
        return t, self(t)

    @classmethod
    def through(cls, t: ArrayLike, q: ArrayLike, degree: int = 5) -> "Trajectory":
        """The spline through joint values q (K, n) at times t (K,) [s]; the first t counts as 0.

        Raises:
            InputError: times that do not increase, NaN, another shape, too few samples.

        Example:
            >>> Trajectory.through([0, 1, 2, 3], np.zeros((4, 6)), degree=3).duration
            3.0
        """
        times = se3.as_real(t, "t")
        if times.ndim == 1 and (np.diff(times) <= 0.0).any():
            row = int(np.argmax(np.diff(times) <= 0.0)) + 1
            raise InputError(
                f"times must increase: t[{row}] = {times[row]:g} s follows {times[row - 1]:g} s"
            )
        curve = JointCurve(times - times[:1] if times.ndim == 1 else times, q, degree)
        return cls(float(curve.s[-1]), _InTime(curve))

    def save(self, file: str | PathLike[str], robot: Robot, rate: float = RATE) -> None:
        """Write the motion for a controller: a .csv with a row every 1 / rate seconds.

        Columns: ``t_s``, then joint values, speeds and accelerations, each with its unit, such as
        ``joint1_rad``, ``joint1_velocity_rad_per_s`` and ``joint1_acceleration_rad_per_s2``. The
        last row is the end of the motion, less than a cycle after the one before.

        Args:
            file: its name ends in .csv.
            robot: whose joints move.
            rate: rows a second [1/s].

        Raises:
            InputError: another name, another number of joints, or a rate that cannot be used.
            OSError: the file cannot be written.

        Example:
            >>> retime(curve, velocity=1.0, acceleration=4.0).save("motion.csv", robot, rate=125)
        """
        path = Path(file)
        if path.suffix != ".csv":
            raise InputError(f"a motion is written to a .csv file, got {path.name!r}")
        write_atomically(path, motion_csv(self, robot, rate))

    def __repr__(self) -> str:
        return f"Trajectory: {self(0.0).q.shape[-1]} joints, {self.duration:.6g} s"


def retime(
    curve: JointCurve | JointPath, velocity: ArrayLike, acceleration: ArrayLike
) -> Trajectory:
    """The fastest motion along a curve, from rest to rest, that keeps two limits.

    By reachability analysis (Pham & Pham 2018, the package toppra) on a grid that holds the
    curve's samples; what its steps exceed in between, a little, is taken back by slowing the whole
    motion down until it keeps both limits where it uses them most.

    Args:
        curve: joint values by way, or a ``JointPath`` without gaps, whose ``curve()`` is taken.
        velocity: limit of each joint's speed, one number or (n,) [rad/s or m/s].
        acceleration: likewise [rad/s^2 or m/s^2].

    Raises:
        InputError: limits that are not positive, a curve that does not move, or a joint path with
            gaps (the first is named).
        NoSolution: no motion was found.
        MissingExtra: toppra is not installed.

    Example:
        >>> retime(curve, velocity=2.0, acceleration=8.0).duration
    """
    if isinstance(curve, JointPath):
        curve = curve.curve()
    if not isinstance(curve, JointCurve):
        raise InputError(f"curve must be a JointCurve or a JointPath, got {type(curve).__name__}")
    n = curve.values.shape[1]
    fast, strong = (
        as_joint_limits(velocity, n, "velocity"),
        as_joint_limits(acceleration, n, "acceleration"),
    )
    if np.ptp(curve.values, axis=0).max() == 0.0:
        raise InputError("the curve does not move: there is nothing to time")
    try:
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
    except ModuleNotFoundError as error:
        raise MissingExtra("the timing of a path", "paths") from error
    share = (curve.s - curve.s[0]) / (curve.s[-1] - curve.s[0])
    parts = max(2, -(-LEAST_GRID // (len(share) - 1)))
    steps = np.arange(parts) / parts
    grid = np.append((share[:-1, None] + steps * np.diff(share)[:, None]).ravel(), 1.0)
    limits = [JointVelocityConstraint(fast), JointAccelerationConstraint(strong)]
    problem = TOPPRA(limits, _Geometry(curve), gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = problem.compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        raise NoSolution("toppra found no motion along this curve within these limits")
    motion = _Along(curve, grid, np.maximum(speed, 0.0))
    slower = max(1.0, _most_used(motion, fast, strong))
    motion = _Along(curve, grid, np.maximum(speed, 0.0) / slower)
    return Trajectory(float(motion.times[-1]), motion)


# ---------------------------------------------------------------------------- motions
@dataclass(frozen=True, eq=False)
class _InTime:
    """A curve whose parameter is the time."""

    curve: JointCurve

    def __call__(self, t: Array) -> State:
        return State(*(self.curve(t, order) for order in range(3)))


class _Along:
    """A curve gone along with constant acceleration of its parameter in each step of a grid.

    Args:
        curve: joint values by parameter.
        grid: (G,) share of the parameter's range.
        speed: (G,) of the share at the grid [1/s].
    """

    def __init__(self, curve: JointCurve, grid: Array, speed: Array) -> None:
        self.curve, self.grid, self.speed = curve, grid, speed
        steps = 2.0 * np.diff(grid) / (speed[:-1] + speed[1:])
        self.times = np.concatenate([[0.0], np.cumsum(steps)])
        self.pull = np.diff(speed**2) / (2.0 * np.diff(grid))

    def __call__(self, t: Array) -> State:
        i = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.pull) - 1)
        return self.within(i, t - self.times[i])

    def within(self, i: Any, past: Array) -> State:
        """The state in steps i (N,), times past (N,) [s] after these begin."""
        pull = self.pull[i][:, None]
        speed = (self.speed[i] + past * self.pull[i])[:, None]
        share = self.grid[i] + past * (self.speed[i] + 0.5 * past * self.pull[i])
        geometry = _Geometry(self.curve)
        share = np.clip(share, 0.0, 1.0)
        first = geometry(share, 1)
        second = geometry(share, 2) * speed**2 + first * pull
        return State(geometry(share), first * speed, second)


def _most_used(motion: _Along, fast: Array, strong: Array) -> float:
    """How many times slower a motion must be for both limits, at the place where it is most.

    Places between which the most may lie are looked at closer. The acceleration jumps from step to
    step, so that each step is looked at with both its ends.
    """
    steps, width = np.diff(motion.times), 1.0 / LOOKED
    step = np.arange(len(steps))
    middle = np.full(len(steps), 0.5)
    part, most = np.linspace(-0.5, 0.5, LOOKED + 1), 0.0
    for _ in range(ROUNDS + 1):
        share = np.clip(middle[:, None] + part, 0.0, 1.0)
        i = np.repeat(step, len(part))
        state = motion.within(i, share.ravel() * steps[i])
        used = np.maximum(
            (np.abs(state.velocity) / fast).max(axis=1),
            np.sqrt((np.abs(state.acceleration) / strong).max(axis=1)),
        ).reshape(share.shape)
        most = max(most, float(used.max()))
        # peaks among the places that could hide more than the most, were their slopes to go on
        rise = np.pad(np.diff(used, axis=1), ((0, 0), (1, 1)))
        up, down = rise[:, :-1], -rise[:, 1:]
        hidden = used + np.maximum(up, down)
        row, place = np.nonzero((up >= 0.0) & (down >= 0.0) & (hidden > most))
        if not len(row):
            break
        step, middle = step[row], share[row, place]
        part, width = np.linspace(-width, width, LOOKED + 1), width * 2.0 / LOOKED
    return most


@dataclass(frozen=True, eq=False)
class _Geometry:
    """A curve by the share of its parameter's range, in the form that toppra asks for."""

    curve: JointCurve

    @property
    def dof(self) -> int:
        return int(self.curve.values.shape[1])

    @property
    def path_interval(self) -> Array:
        return np.array([0.0, 1.0])

    @property
    def waypoints(self) -> None:
        return None

    def __call__(self, share: Any, order: int = 0) -> Array:
        first, last = self.curve.s[0], self.curve.s[-1]
        values = self.curve(first + np.asarray(share) * (last - first), order)
        return np.asarray(values * (last - first) ** order)

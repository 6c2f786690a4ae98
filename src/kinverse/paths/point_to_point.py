"""The fastest motion from one rest to another, its jerk limited."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError, MissingExtra, NoSolution
from kinverse.paths.checks import as_joint_limits
from kinverse.paths.trajectory import State, Trajectory
from kinverse.robot import LIMIT_SLACK, Robot

__all__ = ["point_to_point"]

Array = NDArray[np.float64]


def point_to_point(
    robot: Robot,
    q_start: ArrayLike,
    q_end: ArrayLike,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    jerk: ArrayLike,
) -> Trajectory:
    """The fastest motion from rest to rest that keeps three limits; all joints end together.

    Berscheid & Kroeger 2021 (the package ruckig). No joint leaves the range between its two ends.

    Args:
        robot: the arm, whose joint limits must hold both ends.
        q_start: (n,) [rad or m].
        q_end: (n,) [rad or m].
        velocity: limit, one number or (n,) [rad/s or m/s].
        acceleration: likewise, per s^2.
        jerk: likewise, per s^3.

    Raises:
        InputError: limits that are not positive, ends outside the joint limits, or the same.
        NoSolution: no motion was found.
        MissingExtra: ruckig is not installed.

    Example:
        >>> point_to_point(robot, q_a, q_b, velocity=2, acceleration=8, jerk=80).duration
    """
    start, end = _inside(robot, q_start, "q_start"), _inside(robot, q_end, "q_end")
    if np.array_equal(start, end):
        raise InputError("q_start and q_end are the same: there is nothing to move")
    n = robot.dof
    limits = [
        as_joint_limits(value, n, name)
        for value, name in ((velocity, "velocity"), (acceleration, "acceleration"), (jerk, "jerk"))
    ]
    try:
        import ruckig
    except ModuleNotFoundError as error:
        raise MissingExtra("a motion with limited jerk", "paths") from error
    asked = ruckig.InputParameter(n)
    asked.current_position, asked.target_position = start.tolist(), end.tolist()
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = (row.tolist() for row in limits)
    answer = ruckig.Trajectory(n)
    try:
        result = ruckig.Ruckig(n).calculate(asked, answer)
    except ruckig.RuckigError as error:
        raise NoSolution(f"ruckig found no motion: {error}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise NoSolution(f"ruckig found no motion: {result.name}")
    rows = [_phases(profile) for profile in answer.profiles[0]]
    return Trajectory(float(answer.duration), _Phases(*map(np.array, zip(*rows, strict=True))))


@dataclass(frozen=True, eq=False)
class _Phases:
    """Constant jerk in phases, joint by joint.

    Attributes:
        start: (n, 8) time at which each phase begins.
        q: (n, 8) there, and likewise velocity and acceleration.
        jerk: (n, 8), zero in the last, in which the joint rests.
    """

    start: Array
    q: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    def __call__(self, t: Array) -> State:
        # the phase of each joint (N, n): the last that has begun
        phase = (self.start[None] <= t[:, None, None]).sum(axis=2) - 1
        joint = np.arange(len(self.start))
        past = t[:, None] - self.start[joint, phase]
        q, v = self.q[joint, phase], self.velocity[joint, phase]
        a, j = self.acceleration[joint, phase], self.jerk[joint, phase]
        return State(
            q + past * (v + past * (a / 2.0 + past * j / 6.0)),
            v + past * (a + past * j / 2.0),
            a + past * j,
        )


def _phases(profile: Any) -> tuple[Array, ...]:
    """Start times, values, speeds, accelerations and jerks (8,) of the phases of one joint."""
    start = np.concatenate([[0.0], np.cumsum(profile.t)])
    q, velocity, acceleration = (np.array(row) for row in (profile.p, profile.v, profile.a))
    # the joint rests in the last phase, and exactly where it is to go
    q[-1], velocity[-1], acceleration[-1] = profile.pf, 0.0, 0.0
    return start, q, velocity, acceleration, np.append(profile.j, 0.0)


def _inside(robot: Robot, value: ArrayLike, name: str) -> Array:
    q = se3.as_joints(value, robot.dof, name)
    if q.ndim != 1:
        raise InputError(f"{name} must have shape ({robot.dof},), got {q.shape}")
    low, high = robot.limits.T
    out = (q < low - LIMIT_SLACK) | (q > high + LIMIT_SLACK)
    if out.any():
        j = int(np.argmax(out))
        raise InputError(
            f"{name}: joint {robot.joint_names[j]!r} is at {q[j]:g}, outside its limits"
            f" {low[j]:g} to {high[j]:g}"
        )
    return q

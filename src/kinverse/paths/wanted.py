"""What is asked of the joints at each step of a simulation."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.trajectory import Trajectory
from kinverse.robot import LIMIT_SLACK, Robot

__all__ = ["BEYOND", "Beyond", "Wanted", "beyond_limits", "wanted_motion"]

Array = NDArray[np.float64]

MOST_STEPS = 5_000_000
"""Steps of a simulation, at most."""
BEYOND = 1e-3
"""How far beyond its limits a joint may be asked to go [rad or m]: splines overshoot a little."""


@dataclass(frozen=True)
class Wanted:
    """Times (K,), joint values, speeds and accelerations (K, n) at each step."""

    t: Array
    q: Array
    speed: Array
    acceleration: Array


def wanted_motion(
    robot: Robot, t: ArrayLike | Trajectory, q: ArrayLike | None, step: float
) -> Wanted:
    """A trajectory, or joint values q (N, n) at instants t (N,), at every step.

    Raises:
        InputError: q beside a trajectory or missing without one, times that do not increase,
            another number of joints, NaN, too many steps, or a motion that leaves the joint limits.
    """
    wanted = _at_every_step(robot, t, q, step)
    left = beyond_limits(robot, wanted.q)
    if left is not None and left.amount > BEYOND:
        raise InputError(f"at t = {wanted.t[left.row]:.6g} s {left.text}")
    return wanted


class Beyond(NamedTuple):
    """Where joint values are farthest outside the limits.

    Attributes:
        row: of the joint values.
        joint: counted from 0.
        amount: [rad or m].
        text: which joint stands where, and its limits.
    """

    row: int
    joint: int
    amount: float
    text: str


def beyond_limits(robot: Robot, q: Array) -> Beyond | None:
    """Where joint values (K, n) leave the limits farthest; None if they do not."""
    low, high = robot.limits.T
    out = np.maximum(low - q, q - high)
    row, joint = np.unravel_index(int(np.argmax(out)), out.shape)
    if out[row, joint] <= LIMIT_SLACK:
        return None
    text = (
        f"{robot.joint_names[joint]} is asked for {q[row, joint]:.6g}, its limits are"
        f" {low[joint]:.6g} and {high[joint]:.6g}"
    )
    return Beyond(int(row), int(joint), float(out[row, joint]), text)


def _at_every_step(
    robot: Robot, t: ArrayLike | Trajectory, q: ArrayLike | None, step: float
) -> Wanted:
    if isinstance(t, Trajectory):
        if q is not None:
            raise InputError("give either a Trajectory or times and joint values")
        width = t(0.0).q.shape[-1]
        if width != robot.dof:
            raise InputError(f"the trajectory has {width} joints, robot {robot.name!r} {robot.dof}")
        times = _times(0.0, t.duration, step)
        return Wanted(times, *t(times))
    if q is None:
        raise InputError("q is missing: joint values go with times, only a Trajectory goes alone")
    instants, joints = _checked(robot, t, q)
    return _splined(instants, joints, _times(instants[0], instants[-1], step))


def _checked(robot: Robot, t: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
    instants = se3.as_real(t, "t")
    joints = se3.as_joints(q, robot.dof, "q")
    if instants.ndim != 1 or joints.ndim != 2 or len(instants) != len(joints):
        raise InputError(
            f"t and q must have shapes (N,) and (N, {robot.dof}), got {instants.shape} and"
            f" {joints.shape}"
        )
    if len(instants) < 2:
        raise InputError(f"a trajectory needs at least two instants, got {len(instants)}")
    if not np.isfinite(instants).all():
        raise InputError(f"t is not finite at row {int(np.flatnonzero(~np.isfinite(instants))[0])}")
    late = np.flatnonzero(np.diff(instants) <= 0.0)
    if len(late):
        k = int(late[0])
        raise InputError(
            f"t must increase: row {k + 1} ({instants[k + 1]:g} s) follows {instants[k]:g} s"
        )
    return instants, joints


def _times(first: float, last: float, step: float) -> Array:
    count = round((last - first) / step) + 1
    if count > MOST_STEPS:
        raise InputError(f"{count} steps of {step:g} s are more than {MOST_STEPS}: a larger step")
    return np.asarray(np.minimum(first + step * np.arange(count), last))


def _splined(t: Array, q: Array, times: Array) -> Wanted:
    from scipy.interpolate import make_interp_spline

    # at rest at both ends, and as many conditions as degree five needs even for two instants
    rest = [(order, np.zeros(q.shape[1])) for order in (1, 2)]
    curve = make_interp_spline(t, q, 5, bc_type=(rest, rest))
    return Wanted(times, curve(times), curve(times, 1), curve(times, 2))

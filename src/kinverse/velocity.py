"""Kinematics of velocities: what the Jacobian says about a posture, and steps along it.

Jacobians are stacks (..., m, n), rows linear then angular as :meth:`kinverse.Robot.jacobian` gives
them, cut to the rows of a task where one is named. Linear rows are in metres and angular ones in
radians: numbers that mix them (condition number, manipulability) mean something only after
:func:`homogeneous` has brought them to one unit by a length, and they depend on that length.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.task import as_task

__all__ = [
    "SingularDirections",
    "characteristic_length",
    "condition_number",
    "damped_step",
    "homogeneous",
    "inverse_step",
    "manipulability",
    "null_projector",
    "null_space",
    "singular_directions",
    "task_jacobian",
    "variable_damping",
]

Array = NDArray[np.float64]

RANK = 1e-10
"""A singular value below this fraction of the largest counts as zero."""


# ---------------------------------------------------------------------------- Jacobians
def task_jacobian(robot: Robot, q: ArrayLike, task: str = "pose") -> Array:
    """The Jacobian rows that a task constrains, (..., size, n).

    Args:
        robot: any robot.
        q: (..., n) joint values [rad or m].
        task: see :mod:`kinverse.task`.

    Raises:
        InputError: an unknown task, or as ``robot.jacobian``.

    Example:
        >>> task_jacobian(robot, q, "position").shape
        (3, 6)
    """
    return as_task(task).constrained(robot.jacobian(q), robot.fk(q))


def characteristic_length(robot: Robot, samples: int = 64) -> float:
    """The arm's mean lever [m]: root mean square distance of the tool point from the joint axes.

    With it the columns of an average revolute joint are as long in their linear rows as in their
    angular ones. Taken over ``samples`` postures inside the limits, always the same ones; 1.0 for
    an arm without revolute joints. (Angeles' length, which minimizes the condition number over
    all postures, needs a search and lies near it.)

    Example:
        >>> round(characteristic_length(kv.load("puma560")), 2)
        0.32
    """
    J = robot.jacobian(robot.random(samples, rng=0))
    turning = np.linalg.norm(J[..., 3:, :], axis=-2) > 0.0
    lever = np.sqrt((J[..., :3, :] ** 2).sum(axis=-2)[turning].mean()) if turning.any() else 0.0
    return float(lever) or 1.0


def homogeneous(
    J: ArrayLike, length: float, task: str = "pose", prismatic: ArrayLike | None = None
) -> Array:
    """The Jacobian in one unit: linear rows divided by a length, columns of slides multiplied.

    Args:
        J: (..., size, n), the rows of the task.
        length: the length that counts as much as one radian [m], for example
            :func:`characteristic_length`.
        task: whose rows these are; its linear ones come first.
        prismatic: (n,) True where a free joint slides; None: none does.

    Raises:
        InputError: a length that is not positive, another number of rows or joints.

    Example:
        >>> condition_number(homogeneous(robot.jacobian(q), 0.3))
        4.1
    """
    J, kind = _stack(J), as_task(task)
    if not (np.isfinite(length) and length > 0.0):
        raise InputError(f"length must be positive and finite, got {length}")
    if J.shape[-2] != kind.size:
        raise InputError(f"task {task!r} has {kind.size} rows, the Jacobian {J.shape[-2]}")
    J[..., : kind.position, :] /= length
    if prismatic is not None:
        slides = np.asarray(prismatic)
        if slides.shape != (J.shape[-1],) or slides.dtype != np.bool_:
            raise InputError(f"prismatic must be {J.shape[-1]} true or false")
        J[..., :, slides] *= length
    return J


# ---------------------------------------------------------------------------- measures
def manipulability(J: ArrayLike) -> Array:
    """Yoshikawa's measure (...): the product of the singular values.

    ``sqrt(det(J J'))`` for m <= n (Yoshikawa, Int. J. Robotics Research 4(2), 1985); with fewer
    joints than rows ``sqrt(det(J' J))``, so that it is zero at singular postures only.

    Example:
        >>> manipulability(task_jacobian(planar, [0, 0.5, 0], "position"))
    """
    values = np.linalg.svd(_stack(J), compute_uv=False)
    return np.asarray(values.prod(axis=-1))


def condition_number(J: ArrayLike) -> Array:
    """Largest over smallest singular value (...), 1 at best, inf at a singular posture.

    The inverse is Salisbury & Craig's local conditioning (1982). Apply :func:`homogeneous` first
    if J has linear and angular rows.

    Example:
        >>> condition_number(np.eye(3))
        array(1.)
    """
    values = np.linalg.svd(_stack(J), compute_uv=False)
    low, high = values[..., -1], values[..., 0]
    lost = low <= np.finfo(np.float64).eps * high
    return np.asarray(np.where(lost, np.inf, high / np.where(lost, 1.0, low)))


@dataclass(frozen=True, eq=False)
class SingularDirections:
    """Singular value decomposition of Jacobians: ``J = sum_k values_k motion_k joints_k'``.

    Attributes:
        values: (..., k) singular values, the largest first; k is the smaller of m and n.
        motion: (..., m, m) columns are directions of tool motion; the last ones, with the
            smallest values or with none, are those that the arm cannot or can hardly go.
        joints: (..., n, n) columns are the joint rates that make them; those past k move nothing.
        rank: (...) number of values above 1e-10 of the largest.
    """

    values: Array
    motion: Array
    joints: Array
    rank: NDArray[np.int64]


def singular_directions(J: ArrayLike) -> SingularDirections:
    """Directions of motion with their gains, the lost ones last.

    Example:
        >>> d = singular_directions(robot.jacobian(q))
        >>> lost = d.motion[:, d.rank :]  # twists [linear; angular] the tool cannot make
    """
    u, values, vt = np.linalg.svd(_stack(J))
    rank = (values > RANK * values[..., :1]).sum(axis=-1)
    return SingularDirections(values, u, np.swapaxes(vt, -1, -2), rank)


def null_space(J: ArrayLike, rtol: float = RANK) -> Array:
    """An orthonormal basis (n, n - rank) of the joint rates that move nothing, of one Jacobian.

    Raises:
        InputError: a stack of Jacobians, whose ranks may differ: use :func:`null_projector`.

    Example:
        >>> null_space(iiwa14.jacobian(q)).shape
        (7, 1)
    """
    J = _stack(J)
    if J.ndim != 2:
        raise InputError(f"null_space takes one (m, n) Jacobian, got shape {J.shape}")
    _, values, vt = np.linalg.svd(J)
    rank = int((values > rtol * values[0]).sum())
    return np.asarray(vt[rank:].T)


def null_projector(J: ArrayLike, rtol: float = RANK) -> Array:
    """The projector (..., n, n) onto the null space, ``I - pinv(J) J``.

    Example:
        >>> null_projector(J) @ gradient  # moves the elbow, not the tool
    """
    _, values, vt = np.linalg.svd(_stack(J), full_matrices=False)
    kept = vt * (values > rtol * values[..., :1])[..., None]
    return np.asarray(np.eye(vt.shape[-1]) - np.swapaxes(kept, -1, -2) @ kept)


# ---------------------------------------------------------------------------- steps
def inverse_step(
    J: ArrayLike, error: ArrayLike, secondary: ArrayLike | None = None, rtol: float = RANK
) -> Array:
    """The joint step (..., n) by the pseudo-inverse: shortest of those that fit best.

    The plain inverse where J is square and regular (Whitney 1969). Gains above ``1 / (rtol *
    largest value)`` are left out, so a singular posture gives a finite step.

    Args:
        J: (..., m, n).
        error: (..., m) wanted small motion [m, rad].
        secondary: (..., n) a joint motion of which the part that moves nothing is added
            (Liegeois 1977), for example towards the middle of the limits.
        rtol: relative size of singular values that count as zero.

    Raises:
        InputError: shapes that do not fit.

    Example:
        >>> q = q + inverse_step(robot.jacobian(q), error)
    """
    J = _stack(J)
    u, values, vt = np.linalg.svd(J, full_matrices=False)
    kept = values > rtol * values[..., :1]
    gain = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    step = _through(u, gain, vt, _vector(error, J.shape[-2], "error"))
    if secondary is not None:
        other = _vector(secondary, J.shape[-1], "secondary")
        step = step + np.einsum("...ij,...j->...i", null_projector(J, rtol), other)
    return step


def damped_step(J: ArrayLike, error: ArrayLike, damping: ArrayLike) -> Array:
    """The joint step (..., n) by damped least squares: ``J' (J J' + damping^2 I)^-1 error``.

    Minimizes ``|J step - error|^2 + damping^2 |step|^2`` (Wampler 1986; Nakamura & Hanafusa
    1986); no singular direction gets a gain above ``1 / (2 damping)``.

    Args:
        J: (..., m, n).
        error: (..., m) wanted small motion [m, rad].
        damping: (...) one number, or one for each Jacobian, as :func:`variable_damping` gives.

    Raises:
        InputError: shapes that do not fit, damping that is negative or not finite.

    Example:
        >>> q = q + damped_step(J, error, variable_damping(J, threshold=0.01, greatest=0.1))
    """
    J = _stack(J)
    damp = se3.as_real(damping, "damping")
    if not (np.isfinite(damp).all() and (damp >= 0.0).all()):
        raise InputError("damping must be finite and not negative")
    u, values, vt = np.linalg.svd(J, full_matrices=False)
    square = values**2 + damp[..., None] ** 2
    gain = np.divide(values, square, out=np.zeros_like(square), where=square > 0.0)
    return _through(u, gain, vt, _vector(error, J.shape[-2], "error"))


def variable_damping(J: ArrayLike, threshold: float, greatest: float) -> Array:
    """Damping (...) that sets in near singular postures only.

    ``greatest * (1 - w / threshold)`` where the manipulability w is below the threshold, else 0
    (Nakamura & Hanafusa, J. Dynamic Systems, Measurement, and Control 108, 1986).

    Raises:
        InputError: a threshold that is not positive, a negative greatest damping.

    Example:
        >>> variable_damping(J, threshold=0.01, greatest=0.1)
    """
    if not (np.isfinite(threshold) and threshold > 0.0):
        raise InputError(f"threshold must be positive and finite, got {threshold}")
    if not (np.isfinite(greatest) and greatest >= 0.0):
        raise InputError(f"greatest must be finite and not negative, got {greatest}")
    return np.asarray(greatest * np.clip(1.0 - manipulability(J) / threshold, 0.0, None))


def _through(u: Array, gain: Array, vt: Array, error: Array) -> Array:
    seen = gain * np.einsum("...mk,...m->...k", u, error)
    return np.asarray(np.einsum("...kn,...k->...n", vt, seen))


def _stack(J: ArrayLike) -> Array:
    array = se3.as_real(J, "J")
    if array.ndim < 2 or 0 in array.shape[-2:]:
        raise InputError(f"a Jacobian must have shape (..., m, n), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError("a Jacobian must be finite")
    return array.copy()


def _vector(values: ArrayLike, length: int, name: str) -> Array:
    array = se3.as_real(values, name)
    if array.ndim == 0 or array.shape[-1] != length or not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, shape (..., {length}), got {array.shape}")
    return array

"""Every solution that many random starts end in: slow, and independent of all of kinverse.

Levenberg-Marquardt on [position; rotation] errors by the bench's oracle, all poses and starts side
by side. What it finds are solutions; what it does not find may still be there.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import oracle

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["closest", "merge", "search"]

Array = NDArray[np.float64]

EXACT = 1e-10
"""Largest error component [m or rad] of a solution."""
SAME = 1e-5
"""Ends of two starts that are nearer than this are one solution."""
ROUNDS = 60
"""Steps a start may take."""
HOPELESS = 1e6
"""Damping at which a start sits in a minimum that is no solution."""


def search(robot: "Robot", T: Array, starts: int, rng: np.random.Generator) -> list[Array]:
    """Distinct solutions of poses (N, 4, 4), limits ignored: one (K, n) array a pose.

    Starts are uniform over a turn; those of slides are the tangent of half of it [m], for solutions
    may lie far out.
    """
    poses, q = _starts(robot, len(T), starts, rng)
    q, error = _descend(robot, T[poses], q)
    return [merge(robot, q[(error < EXACT) & (poses == i)]) for i in range(len(T))]


def closest(robot: "Robot", T: Array, starts: int, rng: np.random.Generator) -> Array:
    """(N,) the least error of poses (N, 4, 4) that a start comes to [m and rad, the larger]."""
    poses, q = _starts(robot, len(T), starts, rng)
    _, error = _descend(robot, T[poses], q)
    return np.asarray(error.reshape(len(T), starts).min(axis=1))


def merge(robot: "Robot", q: Array) -> Array:
    """The rows that differ from all kept before them."""
    kept = np.empty((0, robot.dof))
    for row in q:
        if not len(kept) or oracle.wrapped(robot, kept - row).min() > SAME:
            kept = np.concatenate([kept, row[None]])
    return kept


def _starts(
    robot: "Robot", poses: int, starts: int, rng: np.random.Generator
) -> tuple[NDArray[np.intp], Array]:
    q = rng.uniform(-np.pi, np.pi, (poses * starts, robot.dof))
    return np.repeat(np.arange(poses), starts), np.where(oracle.slides(robot), np.tan(0.5 * q), q)


def _descend(robot: "Robot", T: Array, q: Array) -> tuple[Array, Array]:
    """Where each start ends, and the largest component of its error there."""
    q = q.copy()
    error = np.empty(len(q))
    active = np.arange(len(q))
    here, e, J = q, *_state(robot, T, q)
    damping = np.full(len(q), 1e-2)
    for _ in range(ROUNDS):
        JT = np.swapaxes(J, 1, 2)
        # damping that fades with the error: quadratic in the end
        size = damping * np.minimum(1.0, np.sum(e * e, axis=1)) + 1e-15
        A = JT @ J + size[:, None, None] * np.eye(robot.dof)
        trial = here + np.linalg.solve(A, JT @ e[:, :, None])[:, :, 0]
        trial_e, trial_J = _state(robot, T[active], trial)
        better = np.sum(trial_e**2, axis=1) < np.sum(e**2, axis=1)
        here = np.where(better[:, None], trial, here)
        e = np.where(better[:, None], trial_e, e)
        J = np.where(better[:, None, None], trial_J, J)
        damping = np.where(better, np.maximum(0.3 * damping, 1e-7), 5.0 * damping)
        error[active] = np.abs(e).max(axis=1)
        q[active] = here
        good = error[active] < EXACT
        # a solution goes on as long as it gets better: near singularities 1e-10 is far from it
        going = np.where(good, better, damping < HOPELESS)
        active, here, e, J = active[going], here[going], e[going], J[going]
        damping = damping[going]
        if not len(active):
            break
    return q, error


def _state(robot: "Robot", T: Array, q: Array) -> tuple[Array, Array]:
    """Errors (N, 6) [position; 2 sin(angle / 2) axis] and the Jacobian (N, 6, n)."""
    joints = oracle.frames(robot, q)
    tool = joints[-1]
    R = T[:, :3, :3] @ np.swapaxes(tool[:, :3, :3], 1, 2)
    skew = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    trace = R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2]
    turned = skew / np.sqrt(np.maximum(1.0 + trace, 1e-3))[:, None]
    e = np.concatenate([T[:, :3, 3] - tool[:, :3, 3], turned], axis=1)
    return e, oracle.jacobian(robot, q, joints)

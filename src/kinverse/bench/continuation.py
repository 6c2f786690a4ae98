"""Joint values led along a path by Newton's method in small steps, in plain NumPy."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import oracle

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["continued", "corrected"]

Array = NDArray[np.float64]

ITERATIONS = 20
DAMPING = 1e-10
"""Of the steps: where the arm loses a direction it does not run away."""
REACHED = 1e-8
"""Error of a pose [m and rad] that ends an iteration."""


def continued(
    robot: "Robot", poses: Array, q: Array, most: float, hold_limits: bool = True
) -> Array:
    """Where joint values are led to by poses in order; NaN rows where they are lost.

    Args:
        robot: the arm.
        poses: (S, K, 4, 4), close together; those of a row lead its joint values. (S, 1, 4, 4) lead
            all of them.
        q: (K, n) joint values before the first pose.
        most: largest movement of a joint from one pose to the next [rad].
        hold_limits: joint values outside the limits are lost.

    Returns:
        (S, K, n).
    """
    way = np.full((len(poses), *q.shape), np.nan)
    live, here = np.arange(len(q)), q
    for k, T in enumerate(poses):
        if not len(live):
            break
        there, good = corrected(robot, T[live] if len(T) > 1 else T, here)
        good &= np.abs(there - here).max(axis=1) <= most
        if hold_limits:
            good &= oracle.inside(robot, there)
        live, here = live[good], there[good]
        way[k, live] = here
    return way


def corrected(robot: "Robot", T: Array, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Joint values (K, n) near q that reach poses (K or 1, 4, 4), and which of them do."""
    q, T = q.copy(), np.broadcast_to(T, (len(q), 4, 4))
    open_ = np.arange(len(q))
    for _ in range(ITERATIONS):
        at = oracle.frames(robot, q[open_])
        error = _error(T[open_], at[-1])
        left = np.abs(error).max(axis=1) > REACHED
        open_, error = open_[left], error[left]
        if not len(open_):
            break
        J = oracle.jacobian(robot, q[open_], [stop[left] for stop in at])
        push = np.linalg.solve(J @ J.swapaxes(1, 2) + DAMPING * np.eye(6), error[:, :, None])
        q[open_] += (J.swapaxes(1, 2) @ push)[:, :, 0]
    reached = np.ones(len(q), np.bool_)
    far = np.abs(_error(T[open_], oracle.pose(robot, q[open_]))).max(axis=1, initial=0.0)
    reached[open_] = far <= REACHED
    return q, reached


def _error(T: Array, reached: Array) -> Array:
    """(K, 6) positions and, of small angles, rotation vectors from what is reached to T."""
    R = T[:, :3, :3] @ reached[:, :3, :3].swapaxes(1, 2)
    turn = [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]]
    # sin of angles beyond a quarter turn falls again, but steps are small here
    return np.concatenate([T[:, :3, 3] - reached[:, :3, 3], 0.5 * np.stack(turn, axis=1)], axis=1)

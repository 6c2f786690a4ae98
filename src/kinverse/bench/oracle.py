"""The bench's own forward kinematics and error measure: plain NumPy, nothing of the core's.

Whatever kinverse or a peer answers is judged here, by the robot's numbers alone.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = [
    "conditioning",
    "errors",
    "frames",
    "inside",
    "jacobian",
    "pose",
    "slides",
    "twin",
    "wrapped",
]

Array = NDArray[np.float64]


def frames(robot: "Robot", q: Array) -> list[Array]:
    """Where each joint is: one (N, 4, 4) array a moving joint, after its motion, then the tool."""
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    stops = []
    for i, kind in enumerate(robot.kinds):
        value = robot.multiplier[i] * q[:, robot.source[i]] + robot.offset[i]
        motion = np.zeros((len(q), 4, 4))
        motion[:, range(4), range(4)] = 1.0
        if kind == "P":
            motion[:, 2, 3] = value
        else:
            motion[:, 0, 0] = motion[:, 1, 1] = np.cos(value)
            motion[:, 1, 0] = np.sin(value)
            motion[:, 0, 1] = -motion[:, 1, 0]
        T = T @ robot.frames[i] @ motion
        stops.append(T)
    return [*stops, T @ robot.frames[-1]]


def pose(robot: "Robot", q: Array) -> Array:
    """(N, n) joint values to (N, 4, 4) poses."""
    return frames(robot, q)[-1]


def jacobian(robot: "Robot", q: Array, at: list[Array] | None = None) -> Array:
    """(N, 6, n) Jacobian, rows [linear; angular] in the base frame; ``at`` are q's frames."""
    *joints, tool = frames(robot, q) if at is None else at
    J = np.zeros((len(q), 6, robot.dof))
    for i, T in enumerate(joints):
        axis, arm = T[:, :3, 2], tool[:, :3, 3] - T[:, :3, 3]
        if robot.kinds[i] == "P":
            column = np.concatenate([axis, np.zeros_like(axis)], axis=1)
        else:
            column = np.concatenate([np.cross(axis, arm), axis], axis=1)
        J[:, :, robot.source[i]] += robot.multiplier[i] * column
    return J


def twin(robot: "Robot", q: Array) -> Array:
    """About how far from q (N, n) the nearest other solution is of those it can merge with.

    Along the direction v that moves the tool least, pose errors are s t + (u J'(v) v) t^2 / 2, with
    the smallest singular value s of the Jacobian J and its left vector u: 0 again at t = 2 s / |u
    J'(v) v|. Largest joint difference [rad or m]; for arms with as many joints as a pose has
    freedoms.
    """
    left, sizes, right = np.linalg.svd(jacobian(robot, q))
    u, v = left[:, :, robot.dof - 1], right[:, -1]
    step = 1e-5
    change = (jacobian(robot, q + step * v) - jacobian(robot, q - step * v)) / (2 * step)
    bend = np.abs(np.einsum("ki,kij,kj->k", u, change, v))
    return np.asarray(2 * sizes[:, -1] / np.maximum(bend, 1e-12) * np.abs(v).max(axis=1))


def conditioning(robot: "Robot", q: Array) -> Array:
    """(N,) least over greatest singular value of the Jacobian, lengths in the arm's own."""
    length = np.linalg.norm(robot.frames[1:-1, :3, 3], axis=1).sum() or 1.0
    J = jacobian(robot, q)
    J[:, :3] /= length
    J[:, :, slides(robot)] *= length
    values = np.linalg.svd(J, compute_uv=False)
    return np.asarray(values[:, -1] / values[:, 0])


def errors(target: Array, reached: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between poses (N, 4, 4)."""
    far = np.linalg.norm(target[:, :3, 3] - reached[:, :3, 3], axis=1)
    R = np.swapaxes(target[:, :3, :3], 1, 2) @ reached[:, :3, :3]
    skew = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    trace = R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2]
    return far, np.arctan2(np.linalg.norm(skew, axis=1), trace - 1.0)


def inside(robot: "Robot", q: Array, slack: float = 1e-9) -> NDArray[np.bool_]:
    """Which rows of q (N, n) are finite and inside the limits."""
    low, high = robot.limits.T
    held: NDArray[np.bool_] = ((q >= low - slack) & (q <= high + slack)).all(axis=1)
    return held


def slides(robot: "Robot") -> NDArray[np.bool_]:
    """(n,) which joints slide."""
    found = np.zeros(robot.dof, dtype=bool)
    for i, kind in enumerate(robot.kinds):
        found[robot.source[i]] |= kind == "P"
    return found


def wrapped(robot: "Robot", difference: Array) -> Array:
    """Largest joint difference of each row (N, n), turns modulo 2 pi."""
    turned = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
    return np.asarray(np.where(slides(robot), np.abs(difference), turned).max(axis=1))

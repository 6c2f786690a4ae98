"""Whatever kinverse or a peer answers is judged here: ``kinverse.judge``, and how near singular.

Plain NumPy, nothing of the core's.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.judge import errors, frames, inside, pose

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

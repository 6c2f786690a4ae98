"""Poses as rows of numbers that a network can read."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.settings import HasSettings

__all__ = ["KINDS", "PoseFeatures"]

Array = NDArray[np.float64]

KINDS = {
    "xyz": (),
    "xyz+rpy": ("roll", "pitch", "yaw"),
    "xyz+quat": ("qw", "qx", "qy", "qz"),
    "xyz+matrix": tuple(f"r{i}{j}" for i in range(3) for j in range(3)),
}
"""Kinds of features, and the columns that follow x, y, z."""


class PoseFeatures(HasSettings):
    """Position and, in one of several ways, rotation of the tool.

    ``fit`` learns the training poses' mean orientation. About it the angles of "xyz+rpy" are
    unwrapped (each lies within pi of its mean) and the quaternions of "xyz+quat" have the sign
    that is nearer to it: neither jumps inside a region of less than half a turn. "xyz+matrix"
    never jumps; its nine entries say more than is needed, and say it smoothly.

    Args:
        kind: "xyz", "xyz+rpy", "xyz+quat" (w first) or "xyz+matrix" (rows after one another).

    Attributes:
        reference_: mean angles (3,) or quaternion (4,), empty for the other kinds.
        names: names of the columns.

    Raises:
        InputError: (fit, transform) an unknown kind, poses that cannot be used, or not fitted.

    Example:
        >>> PoseFeatures("xyz+rpy").fit_transform(robot.fk(q)).shape
        (100, 6)
    """

    reference_: Array

    def __init__(self, kind: str = "xyz+matrix") -> None:
        self.kind = kind

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise InputError(f"features must be one of {', '.join(KINDS)}, got {self.kind!r}")
        return ("x", "y", "z", *KINDS[self.kind])

    def fit(self, T: ArrayLike) -> Self:
        """Learn the mean orientation of poses T (N, 4, 4); returns the features."""
        names, R = self.names, se3.as_poses(T)[:, :3, :3]
        if not len(R):
            raise InputError("PoseFeatures needs at least one pose to be fitted")
        if "roll" in names:
            angles = se3.rpy_from_rotation(R)
            self.reference_ = np.arctan2(np.sin(angles).mean(axis=0), np.cos(angles).mean(axis=0))
        elif "qw" in names:
            quats = se3.quat_from_rotation(R)
            # the eigenvector of the largest eigenvalue does not care for signs (Markley 2007)
            self.reference_ = np.linalg.eigh(quats.T @ quats)[1][:, -1]
        else:
            self.reference_ = np.empty(0)
        return self

    def transform(self, T: ArrayLike) -> Array:
        """Features (N, k) of poses T (N, 4, 4)."""
        if not hasattr(self, "reference_"):
            raise InputError("these PoseFeatures are not fitted: call fit(T) first")
        poses, names = se3.as_poses(T), self.names
        xyz, R = poses[:, :3, 3], poses[:, :3, :3]
        if len(names) == 3:
            return xyz.copy()
        if "roll" in names:
            return np.hstack([xyz, _near(se3.rpy_from_rotation(R), self.reference_)])
        if "qw" in names:
            quats = se3.quat_from_rotation(R)
            far = quats @ self.reference_ < 0.0
            return np.hstack([xyz, np.where(far[:, None], -quats, quats)])
        return np.hstack([xyz, R.reshape(-1, 9)])

    def fit_transform(self, T: ArrayLike) -> Array:
        """``fit``, then ``transform``."""
        return self.fit(T).transform(T)

    def difference(self, A: Array, B: Array) -> Array:
        """Feature rows B - A (N, k), angles wrapped to (-pi, pi]: document 000's pose increment."""
        gap = np.asarray(B - A)
        if "roll" in self.names:
            gap[:, 3:] = _near(gap[:, 3:], np.zeros(3))
        return gap


def _near(angles: Array, centre: Array) -> Array:
    """Angles (N, 3) by whole turns in (centre - pi, centre + pi]."""
    turns = np.ceil((angles - centre) / (2.0 * np.pi) - 0.5)
    return np.asarray(angles - 2.0 * np.pi * turns)

"""Rigid transforms as unit dual quaternions: eight numbers, two constraints (Clifford 1873)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3

__all__ = ["DualQuaternion"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DualQuaternion:
    """``real + eps dual`` with eps^2 = 0, |real| = 1 and real . dual = 0.

    The dual part is half the translation times the real part. ``a @ b`` composes: b acts first.

    Attributes:
        real: (..., 4) unit quaternions w, x, y, z.
        dual: (..., 4) [m].

    Example:
        >>> DualQuaternion.from_matrix(robot.fk(q)).translation()
        array([0.4521, 0.15005, 0.4318])
    """

    real: Array
    dual: Array

    @classmethod
    def from_matrix(cls, T: Array) -> "DualQuaternion":
        """Of poses (..., 4, 4); the real part has w >= 0."""
        T = np.asarray(T, dtype=np.float64)
        real = se3.quat_from_rotation(T[..., :3, :3])
        return cls(real, 0.5 * se3.quat_multiply(_pure(T[..., :3, 3]), real))

    def translation(self) -> Array:
        """(..., 3) [m]."""
        return np.asarray(2.0 * se3.quat_multiply(self.dual, se3.quat_conjugate(self.real)))[
            ..., 1:
        ]

    def matrix(self) -> Array:
        """(..., 4, 4)."""
        p = self.translation()
        out = np.zeros((*p.shape[:-1], 4, 4))
        out[..., :3, :3] = se3.rotation_from_quat(self.real)
        out[..., :3, 3] = p
        out[..., 3, 3] = 1.0
        return out

    def __matmul__(self, other: "DualQuaternion") -> "DualQuaternion":
        """The dual product: ``(r1 r2, r1 d2 + d1 r2)``."""
        return DualQuaternion(
            se3.quat_multiply(self.real, other.real),
            se3.quat_multiply(self.real, other.dual) + se3.quat_multiply(self.dual, other.real),
        )

    def inverse(self) -> "DualQuaternion":
        """Both parts conjugated: unit dual quaternions only."""
        return DualQuaternion(se3.quat_conjugate(self.real), se3.quat_conjugate(self.dual))

    def act(self, points: ArrayLike) -> Array:
        """Points (..., 3) moved by the transform [m]."""
        return np.asarray(se3.quat_rotate(self.real, points) + self.translation())


def _pure(vector: Array) -> Array:
    return np.concatenate([np.zeros_like(vector[..., :1]), vector], axis=-1)

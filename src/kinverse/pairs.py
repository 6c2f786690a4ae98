"""Rigid transforms as a unit quaternion and a vector: seven numbers.

The thesis of Jha (NIT Rourkela 2015), section 4.3.2, with its equation 4.98 corrected: the product
of two quaternions ends in v1 x v2; as printed, v2 x v1, it composes in reverse order.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3

__all__ = ["QuaternionPair"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class QuaternionPair:
    """``x -> h x h^-1 + p``, one transform or an array of them.

    h and -h are the same rotation. ``a @ b`` composes: b acts first.

    Attributes:
        h: (..., 4) unit quaternions w, x, y, z.
        p: (..., 3) translations [m].

    Example:
        >>> pair = QuaternionPair.from_matrix(robot.fk(q))
        >>> np.allclose((pair @ pair.inverse()).matrix(), np.eye(4))
        True
    """

    h: Array
    p: Array

    @classmethod
    def from_matrix(cls, T: Array) -> "QuaternionPair":
        """Of poses (..., 4, 4); h has w >= 0."""
        T = np.asarray(T, dtype=np.float64)
        return cls(se3.quat_from_rotation(T[..., :3, :3]), T[..., :3, 3].copy())

    def matrix(self) -> Array:
        """(..., 4, 4)."""
        shape = np.broadcast_shapes(self.h.shape[:-1], self.p.shape[:-1])
        out = np.zeros((*shape, 4, 4))
        out[..., :3, :3] = se3.rotation_from_quat(self.h)
        out[..., :3, 3] = self.p
        out[..., 3, 3] = 1.0
        return out

    def __matmul__(self, other: "QuaternionPair") -> "QuaternionPair":
        """Composition, equation 4.99: ``(h1 h2, h1 p2 h1^-1 + p1)``."""
        return QuaternionPair(se3.quat_multiply(self.h, other.h), self.act(other.p))

    def inverse(self) -> "QuaternionPair":
        """Equation 4.97: ``(h^-1, -h^-1 p h)``."""
        back = se3.quat_conjugate(self.h)
        return QuaternionPair(back, -se3.quat_rotate(back, self.p))

    def act(self, points: ArrayLike) -> Array:
        """Points (..., 3) moved by the transform [m]."""
        return np.asarray(se3.quat_rotate(self.h, points) + self.p)

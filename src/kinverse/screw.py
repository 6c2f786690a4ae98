"""Rigid transforms as exponentials of screws: six numbers (Brockett 1984).

A twist is ``[linear; angular]``, as the rows of a Jacobian are: the velocity of the point at the
origin [m] and the rotation vector [rad].
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3

__all__ = ["screw_exp", "screw_log", "screw_of_axis"]

Array = NDArray[np.float64]

SERIES = 0.3
"""Angle [rad] below which power series take over from quotients that cancel."""


def screw_exp(twist: ArrayLike) -> Array:
    """Twists (..., 6) to poses (..., 4, 4).

    Murray, Li & Sastry, A Mathematical Introduction to Robotic Manipulation (1994), eq. 2.36.

    Example:
        >>> screw_exp([0.1, 0, 0, 0, 0, 0])[:3, 3]
        array([0.1, 0. , 0. ])
    """
    twist = np.asarray(twist, dtype=np.float64)
    v, w = twist[..., :3], twist[..., 3:]
    angle = np.linalg.norm(w, axis=-1)[..., None]
    small = angle < SERIES
    safe = np.where(small, 1.0, angle)
    # (1 - cos x) / x^2 by the half angle, which does not cancel
    half = 0.5 * angle
    b = 0.5 * np.sinc(half / np.pi) ** 2
    c = np.where(small, _series(angle, _SINE), (safe - np.sin(safe)) / safe**3)
    across = np.cross(w, v)
    out = np.zeros((*angle.shape[:-1], 4, 4))
    # not se3.rotation_exp: that one reads angles of robot files and snaps them to quarter turns
    e = np.eye(3)
    turned = np.cross(w[..., None, :], e)
    twice = np.cross(w[..., None, :], turned)
    R = e + np.sinc(angle / np.pi)[..., None] * turned + b[..., None] * twice
    out[..., :3, :3] = np.swapaxes(R, -1, -2)
    out[..., :3, 3] = v + b * across + c * np.cross(w, across)
    out[..., 3, 3] = 1.0
    return out


def screw_log(T: ArrayLike) -> Array:
    """Poses (..., 4, 4) to twists (..., 6), the angular part no longer than pi.

    Inverse of :func:`screw_exp`; at a half turn either direction may come.

    Example:
        >>> screw_log(kv.pose(axis=([0, 0, 1], 0.5)))[3:]
        array([0. , 0. , 0.5])
    """
    T = np.asarray(T, dtype=np.float64)
    w = se3.rotation_log(T[..., :3, :3])
    angle = np.linalg.norm(w, axis=-1)[..., None]
    small = angle < SERIES
    half = 0.5 * np.where(small, 1.0, angle)
    # (1 - (x/2) cot(x/2)) / x^2; at pi the cotangent is zero and nothing cancels
    quotient = (1.0 - half * np.cos(half) / np.sin(half)) / (4.0 * half**2)
    c = np.where(small, _series(angle, _COTANGENT), quotient)
    p = T[..., :3, 3]
    across = np.cross(w, p)
    return np.concatenate([p - 0.5 * across + c * np.cross(w, across), w], axis=-1)


def screw_of_axis(kind: str, direction: Array, point: Array) -> Array:
    """The twist (6,) of a joint per unit: "R" about a line through point, "P" along it."""
    if kind == "P":
        return np.concatenate([direction, np.zeros(3)])
    return np.concatenate([np.cross(point, direction), direction])


_SINE = (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800)
"""(x - sin x) / x^3 in powers of x^2."""
_COTANGENT = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000)
"""(1 - (x/2) cot(x/2)) / x^2 in powers of x^2: Bernoulli numbers."""


def _series(x: Array, terms: tuple[float, ...]) -> Array:
    total = np.zeros_like(x)
    for term in reversed(terms):
        total = total * (x * x) + term
    return total

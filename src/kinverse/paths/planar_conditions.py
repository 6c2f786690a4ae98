"""When three parallel links reach a place with a given direction of the last one.

Conditions (5) and (6) of document 003 (Habibkhah and Mayorga 2021); both say that the triangle of
the first two links and the way to the third joint closes, so they are the same condition.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["Condition", "condition_5", "condition_6"]

Array = NDArray[np.float64]


class Condition(NamedTuple):
    """A quantity (N,) and the bounds (N,) it must lie between [m^2]."""

    lower: Array
    value: Array
    upper: Array

    @property
    def holds(self) -> NDArray[np.bool_]:
        """(N,) whether the value lies between the bounds."""
        return np.asarray((self.lower <= self.value) & (self.value <= self.upper))


def condition_5(lengths: ArrayLike, T: ArrayLike) -> Condition:
    """Equation 5: ``(l1 - l2)^2 <= |p - l3 (cos theta, sin theta)|^2 <= (l1 + l2)^2``.

    Args:
        lengths: (3,) of the links [m].
        T: (4, 4) or (N, 4, 4) poses of the tool: x, y and the rotation about z count.

    Raises:
        InputError: lengths that are not three positive numbers, poses that cannot be used.

    Example:
        >>> condition_5([10, 7, 5], named_samples("habibkhah_1").T).holds.sum()
        511
    """
    (l1, l2, _), squared = _wrist(lengths, T)
    return Condition(_full(squared, l1 - l2), squared, _full(squared, l1 + l2))


def condition_6(lengths: ArrayLike, T: ArrayLike) -> Condition:
    """Equation 6: ``(r - l1)^2 <= l2^2 <= (r + l1)^2`` with r the way to the third joint.

    Arguments, errors and result as of :func:`condition_5`.

    Example:
        >>> condition_6([10, 7, 5], named_samples("habibkhah_1").T).holds.sum()
        511
    """
    (l1, l2, _), squared = _wrist(lengths, T)
    r = np.sqrt(squared)
    return Condition((r - l1) ** 2, np.full_like(r, l2**2), (r + l1) ** 2)


def _full(like: Array, root: float) -> Array:
    return np.full_like(like, root**2)


def _wrist(lengths: ArrayLike, T: ArrayLike) -> tuple[list[float], Array]:
    """The lengths, and the squared distance (N,) of the third joint from the first."""
    links = se3.as_real(lengths, "lengths")
    if links.shape != (3,) or not ((links > 0.0) & (links <= se3.MOST_METRES)).all():
        raise InputError(f"lengths must be three positive numbers, got {links.tolist()}")
    poses = se3.as_poses(T)
    theta = np.arctan2(poses[:, 1, 0], poses[:, 0, 0])
    x = poses[:, 0, 3] - links[2] * np.cos(theta)
    y = poses[:, 1, 3] - links[2] * np.sin(theta)
    return links.tolist(), x**2 + y**2

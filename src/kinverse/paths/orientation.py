"""How a path turns the tool: constant, between given orientations, or tied to where it is.

An orientation has one method, ``rotations(s, points, tangents)``: (N, 3, 3) for arc lengths s
(N,), the points (N, 3) and unit tangents (N, 3) there.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["Constant", "Orientation", "Radial", "Slerp", "Tangent", "as_orientation", "as_rotation"]

Array = NDArray[np.float64]


class Orientation(Protocol):
    """What a path asks of an orientation."""

    def rotations(self, s: Array, points: Array, tangents: Array) -> Array:
        """Rotations (N, 3, 3) of the tool in the base frame."""


@dataclass(frozen=True, eq=False)
class Constant:
    """The same rotation (3, 3) everywhere.

    Example:
        >>> Path.line([0.5, 0, 1], [0.5, 0.3, 1], orientation=Constant(kv.pose(rpy=[0, 3.14, 0])))
    """

    rotation: Any = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", as_rotation(self.rotation))

    def rotations(self, s: Array, points: Array, tangents: Array) -> Array:
        """See :class:`Orientation`."""
        return np.tile(self.rotation, (len(s), 1, 1))


@dataclass(frozen=True, eq=False)
class Slerp:
    """Between orientations given at arc lengths, each time about one axis at one rate.

    Args:
        knots: (K,) ascending arc lengths; before the first and past the last nothing turns.
        given: (K, 3, 3) rotations there. Where two neighbours are half a turn apart either way
            round is as short, and one of them is taken.
    """

    knots: Array
    given: Array
    turns: Array = field(init=False)

    def __post_init__(self) -> None:
        between = np.swapaxes(self.given[:-1], -1, -2) @ self.given[1:]
        object.__setattr__(self, "turns", se3.rotation_log(between))

    def rotations(self, s: Array, points: Array, tangents: Array) -> Array:
        """See :class:`Orientation`."""
        i = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.knots) - 2)
        width = self.knots[i + 1] - self.knots[i]
        share = np.clip((s - self.knots[i]) / width, 0.0, 1.0)
        turned = self.given[i] @ se3.rotation_exp(share[:, None] * self.turns[i])
        # the given ones come out to the last bit
        exact = np.where((share == 1.0)[:, None, None], self.given[i + 1], turned)
        return np.where((share == 0.0)[:, None, None], self.given[i], exact)


@dataclass(frozen=True, eq=False)
class Radial:
    """Rotation about the base's z axis by ``atan2(y, x)``, behind it a fixed rotation.

    Document 003 (Habibkhah and Mayorga 2021), section 4.1: the tool points away from the base's z
    axis.

    Args:
        then: (3, 3) fixed rotation in the turned frame; default none.

    Raises:
        InputError: (when evaluated) a point on the z axis, where no direction leads away.

    Example:
        >>> Path.circle([0.6, 0, 0], 0.2, orientation=Radial())
    """

    then: Any = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "then", as_rotation(self.then))

    def rotations(self, s: Array, points: Array, tangents: Array) -> Array:
        """See :class:`Orientation`."""
        x, y = points[:, 0], points[:, 1]
        _refuse(np.hypot(x, y) < 1e-12, s, "is on the z axis, where atan2(y, x) means nothing")
        turned = se3.rotation_from_axis(np.array([0.0, 0.0, 1.0]), np.arctan2(y, x))
        return np.asarray(turned @ self.then)


@dataclass(frozen=True, eq=False)
class Tangent:
    """The tool's x axis along the path and its z axis as near to ``up`` as that allows.

    At a corner it turns at once.

    Args:
        up: (3,) direction in the base frame.
        then: (3, 3) fixed rotation in the turned frame; default none.

    Raises:
        InputError: ``up`` is zero; (when evaluated) the path runs along ``up`` or stands still.

    Example:
        >>> Path.circle([0.6, 0, 0.5], 0.2, orientation=Tangent(up=[0, 0, -1]))
    """

    up: Any = (0.0, 0.0, 1.0)
    then: Any = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        up = se3.as_real(self.up, "up")
        if up.shape != (3,) or not np.isfinite(up).all() or not up.any():
            raise InputError(f"up must be a direction of three numbers, got {up.tolist()}")
        up = up / np.abs(up).max()
        object.__setattr__(self, "up", up / np.linalg.norm(up))
        object.__setattr__(self, "then", as_rotation(self.then))

    def rotations(self, s: Array, points: Array, tangents: Array) -> Array:
        """See :class:`Orientation`."""
        _refuse((tangents == 0.0).all(axis=1), s, "has no tangent: the path stands still there")
        left = np.cross(self.up, tangents)
        size = np.linalg.norm(left, axis=1, keepdims=True)
        _refuse(size[:, 0] < 1e-9, s, f"runs along up = {self.up.tolist()}: give another up")
        left = left / size
        axes = [tangents, left, np.cross(tangents, left)]
        return np.asarray(np.stack(axes, axis=-1) @ self.then)


def as_orientation(value: Any) -> Orientation:
    """An orientation from "radial", "tangent", a rotation (3, 3), a pose (4, 4), or itself.

    Raises:
        InputError: none of these; the message lists them.
    """
    if isinstance(value, str):
        if value not in _BY_NAME:
            names = " or ".join(map(repr, _BY_NAME))
            raise InputError(f"orientation must be {names}, a rotation (3, 3), got {value!r}")
        return _BY_NAME[value]()
    if hasattr(value, "rotations"):
        orientation: Orientation = value
        return orientation
    return Constant(value)


_BY_NAME: dict[str, type[Radial] | type[Tangent]] = {"radial": Radial, "tangent": Tangent}


def as_rotation(value: ArrayLike) -> Array:
    """A rotation (3, 3), checked, from one or from a pose (4, 4)."""
    array = se3.as_real(value, "orientation")
    if array.shape == (3, 3):
        array = se3.transform(array)
    return se3.as_pose(array, "orientation")[:3, :3].copy()


def _refuse(bad: Any, s: Array, why: str) -> None:
    if bad.any():
        raise InputError(f"the path at s = {s[int(np.argmax(bad))]:.9g} {why}")

"""The poses of a path: at its samples, and between them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["Samples", "as_samples"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

COUNT = 200
"""Samples of a path where the caller says nothing."""
SAME_PLACE = 1e-9
"""Parameters that differ by less than this part of their range are one."""
AGREES = 1e-6
"""How far [m, and in the entries of the rotation] a path at s may be from its own samples."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Poses in order.

    Attributes:
        T: (N, 4, 4) poses [m].
        s: (N,) the path's parameter, None without.
        path: what is called with s (K,) for poses (K, 4, 4), or None.
    """

    T: Array
    s: Array | None = None
    path: Callable[[Array], Any] | None = None

    def at(self, sample: Ints, fraction: Array) -> Array:
        """Poses (K, 4, 4) at a fraction (K,) of the way from a sample (K,) to the next.

        Without a path: the position in a straight line, the rotation about one axis.
        """
        if self.path is not None and self.s is not None:
            return _called(self.path, self.parameter(sample, fraction))
        a, b = self.T[sample], self.T[sample + 1]
        T = a.copy()
        T[:, :3, 3] += fraction[:, None] * (b - a)[:, :3, 3]
        turn = se3.rotation_log(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3])
        T[:, :3, :3] = a[:, :3, :3] @ se3.rotation_exp(fraction[:, None] * turn)
        return T

    def parameter(self, sample: Ints, fraction: Array) -> Array:
        """The parameter (K,) there."""
        assert self.s is not None
        a, b = self.s[sample], self.s[sample + 1]
        return np.asarray(a + fraction * (b - a))

    def with_between(self, sample: Ints, fraction: Array) -> tuple["Samples", Ints]:
        """With samples added, sorted; and where each is: old ones first, then the added ones."""
        assert self.s is not None
        s = np.concatenate([self.s, self.parameter(sample, fraction)])
        T = np.concatenate([self.T, self.at(sample, fraction)])
        order = np.argsort(s, kind="stable")
        return Samples(T[order], s[order], self.path), order


def as_samples(path: Any, tolerance: float | None, count: int = COUNT) -> Samples:
    """The samples of poses (N, 4, 4), of a ``Path`` or its samples, or of a like object.

    Under a tolerance the places where a path's pieces meet are samples too, if it knows them: its
    ``breaks``, parameters (K,). What is between two samples is smooth then.

    Args:
        path: poses; an object with arrays ``T`` and ``s``; or one whose ``sample(count=count)``
            returns poses (even over s from 0 to 1) or such an object, and that gives the poses
            (K, 4, 4) at s (K,) when it is called.
        tolerance: what is asked of the way between samples [m], or None.
        count: samples of a path that has none of its own.

    Raises:
        InputError: fewer than two poses, a pose that is not rigid (named), s that does not
            increase, or a tolerance for a path that cannot be evaluated between its samples.
        TypeError: complex, object or text arrays.
    """
    given, s, call = path, None, None
    if callable(getattr(path, "sample", None)):
        given = path.sample(count=count)
        call = path if callable(path) else None
    if hasattr(given, "T") and hasattr(given, "s"):
        given, s = given.T, given.s
    T = se3.as_poses(given, "path")
    if len(T) < 2:
        raise InputError(f"a path needs at least two poses, got {len(T)}: kinverse.solve takes one")
    if s is not None or call is not None:
        s = _parameters(s, len(T))
    if call is not None:
        off = np.abs(_called(call, s) - T).max()
        if not off <= AGREES:
            raise InputError(
                f"the path called at s differs from its samples by {off:.3g}: sample() must return"
                " poses and their s, or poses that are even in s from 0 to 1"
            )
    if tolerance is not None and call is None:
        raise InputError(
            "tolerance adds samples between the given ones: path must be an object that has"
            " sample() and gives the poses at s when it is called"
        )
    if tolerance is not None and getattr(path, "breaks", None) is not None:
        assert s is not None
        s = _with_breaks(s, se3.as_real(path.breaks, "breaks"))
        T = _called(path, s)
    return Samples(T, s, call)


def _with_breaks(s: Array, breaks: Array) -> Array:
    """Parameters with those added at which pieces meet."""
    near = SAME_PLACE * (s[-1] - s[0])
    inner = breaks[(breaks > s[0] + near) & (breaks < s[-1] - near)]
    both = np.sort(np.concatenate([s, inner]))
    return np.asarray(both[np.append(True, np.diff(both) > near)])


def _parameters(s: ArrayLike | None, count: int) -> Array:
    if s is None:
        return np.linspace(0.0, 1.0, count)
    values = se3.as_real(s, "s")
    if values.shape != (count,) or not np.isfinite(values).all():
        raise InputError(f"s must be ({count},) finite numbers, got {values.shape}")
    if (np.diff(values) <= 0.0).any():
        at = int(np.argmax(np.diff(values) <= 0.0)) + 1
        raise InputError(f"s must increase, it does not from sample {at - 1} to sample {at}")
    return values


def _called(path: Callable[[Array], Any], s: Array | None) -> Array:
    assert s is not None
    T = np.asarray(path(s))
    if T.shape != (len(s), 4, 4):
        raise InputError(f"path(s) must return ({len(s)}, 4, 4) for s ({len(s)},), got {T.shape}")
    return se3.as_poses(T, "path(s)")

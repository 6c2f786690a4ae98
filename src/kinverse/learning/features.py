"""A pose as a row of numbers that a network can read."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.settings import HasSettings

__all__ = ["KINDS", "PoseFeatures"]

Array = NDArray[np.float64]

TURN = 2.0 * np.pi

_ROTATION = {
    "": (),
    "yaw": ("yaw",),
    "rpy": ("roll", "pitch", "yaw"),
    "quat": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
}
_ANGLES = frozenset(_ROTATION["rpy"])

KINDS: dict[str, tuple[str, ...]] = {
    kind: (*kind.partition("+")[0], *_ROTATION[kind.partition("+")[2]])
    for kind in ("xyz", "xyz+rpy", "xyz+quat", "xyz+matrix", "xy", "xy+yaw", "xyz+yaw")
}
"""The names of the features of each kind."""


class PoseFeatures(HasSettings):
    """Poses (N, 4, 4) as rows (N, k): the position, and the rotation in one of its readings.

    Angles and quaternions name a rotation more than once, and a network must not see the jump from
    one name to the next: +180 deg and -179 deg are neighbours. ``fit`` therefore learns a reference
    from the training poses, and ``transform`` gives every angle within half a turn of it and every
    quaternion in its hemisphere: poses that spread less than half a turn about it see no jump.
    Roll and yaw stay undefined where pitch is +-90 deg. The matrix has no such places: it says in
    nine numbers what three could, and is smooth everywhere.

    Args:
        kind: "xyz", "xyz+rpy" (roll, pitch, yaw as in :func:`kinverse.pose`), "xyz+quat" (w, x, y,
            z) or "xyz+matrix" (the rotation matrix by rows); for arms that turn the tool about z
            only "xy", "xy+yaw" and "xyz+yaw". Lengths in m, angles in rad.

    Attributes:
        reference_: circular means (3,) of roll, pitch and yaw [rad], (1,) of yaw, the mean
            quaternion (4,), or (0,) for kinds that need none. Nothing else is learned.

    Example:
        >>> features = PoseFeatures("xyz+rpy").fit(robot.fk(robot.random(100)))
        >>> features.transform(robot.fk(q)).shape
        (1, 6)
    """

    reference_: Array

    def __init__(self, kind: str = "xyz+matrix") -> None:
        self.kind = kind

    def fit(self, T: ArrayLike) -> "PoseFeatures":
        """Learn the reference from training poses; returns itself.

        Angles: the circular mean of each, ``atan2(mean sin, mean cos)`` (Mardia, Statistics of
        Directional Data, 1972). Quaternions: the unit vector with the largest sum of squared
        products with them, which does not heed their signs (Markley et al., J. Guidance, Control
        and Dynamics 30(4), 2007); its largest component is positive.

        Args:
            T: (4, 4) or (N, 4, 4) poses, at least one.

        Raises:
            InputError: an unknown kind, no pose, or poses that cannot be used.

        Example:
            >>> PoseFeatures("xy+yaw").fit(T).reference_.shape
            (1,)
        """
        names = self._names()
        poses = se3.as_poses(T)
        if not len(poses):
            raise InputError("PoseFeatures.fit needs at least one pose, got T of shape (0, 4, 4)")
        raw = self._rotation(poses)
        if _ANGLES & set(names):
            self.reference_ = np.arctan2(np.sin(raw).mean(axis=0), np.cos(raw).mean(axis=0))
        elif "qw" in names:
            mean = np.linalg.eigh(raw.T @ raw)[1][:, -1]
            self.reference_ = mean * np.sign(mean[np.argmax(np.abs(mean))])
        else:
            self.reference_ = np.empty(0)
        return self

    def transform(self, T: ArrayLike) -> Array:
        """The features (N, k) of poses (4, 4) or (N, 4, 4); N may be 0.

        Raises:
            InputError: not fitted, or poses that cannot be used.

        Example:
            >>> PoseFeatures("xyz").fit(T).transform(T)[0] == T[0, :3, 3]
            array([ True,  True,  True])
        """
        self._check_fitted()
        poses = se3.as_poses(T)
        raw, reference = self._rotation(poses), self.reference_
        if _ANGLES & set(self.names_):
            raw = reference + _wrapped(raw - reference)
        elif "qw" in self.names_:
            raw = np.where((raw @ reference < 0.0)[:, None], -raw, raw)
        return np.hstack([poses[:, : self._position(), 3], raw])

    def fit_transform(self, T: ArrayLike) -> Array:
        """``fit(T)``, then ``transform(T)``.

        Example:
            >>> X = PoseFeatures("xyz+quat").fit_transform(T)
        """
        return self.fit(T).transform(T)

    def difference(self, A: ArrayLike, B: ArrayLike) -> Array:
        """Features B minus features A, the short way round.

        Angles are wrapped to (-pi, pi]; of a quaternion in B and its negative the nearer to that in
        A is taken.

        Args:
            A: (..., k) features, as ``transform`` gives them or as sums of such.
            B: (..., k) features, of a shape that broadcasts with A.

        Raises:
            InputError: not fitted, another width, or values that are not finite.

        Example:
            >>> features.difference(features.transform(T_now), features.transform(T_goal))
        """
        a, b = self.checked(A, "A"), self.checked(B, "B")
        try:
            d = b - a
        except ValueError as error:
            raise InputError(
                f"A and B must broadcast, got shapes {a.shape} and {b.shape}"
            ) from error
        angles = [name in _ANGLES for name in self.names_]
        d[..., angles] = _wrapped(d[..., angles])
        if "qw" in self.names_:
            other = -b[..., 3:] - a[..., 3:]
            shorter = (other**2).sum(axis=-1) < (d[..., 3:] ** 2).sum(axis=-1)
            d[..., 3:] = np.where(shorter[..., None], other, d[..., 3:])
        return d

    def checked(self, X: Any, name: str = "features") -> Array:
        """X (..., k) as finite float64 of this width, for those who take features.

        Raises:
            TypeError: complex, object or text data.
            InputError: not fitted, another width, or values that are not finite.

        Example:
            >>> PoseFeatures("xy").fit(T).checked([0.1, 0.2])
            array([0.1, 0.2])
        """
        self._check_fitted()
        array = se3.as_real(X, name)
        if array.ndim == 0 or array.shape[-1] != self.n_features_:
            raise InputError(
                f"{name} must have shape (..., {self.n_features_}) for {self.kind!r}"
                f" ({', '.join(self.names_)}), got {array.shape}"
            )
        if not np.isfinite(array).all():
            raise InputError(f"{name} must be finite, got NaN or inf")
        return array

    @property
    def names_(self) -> tuple[str, ...]:
        """The names of the features, in order."""
        self._check_fitted()
        return self._names()

    @property
    def n_features_(self) -> int:
        """Their number k."""
        return len(self.names_)

    def _names(self) -> tuple[str, ...]:
        names = KINDS.get(self.kind) if isinstance(self.kind, str) else None
        if names is None:
            raise InputError(f"unknown features {self.kind!r}: the kinds are {', '.join(KINDS)}")
        return names

    def _check_fitted(self) -> None:
        names = self._names()
        learned = 4 if "qw" in names else len(_ANGLES & set(names))
        if getattr(self, "reference_", np.empty(9)).shape != (learned,):
            raise InputError(f"{self!r} is not fitted: call fit(T) on training poses first")

    def _position(self) -> int:
        return 3 if "z" in self._names() else 2

    def _rotation(self, T: Array) -> Array:
        """The rotation in this kind's reading, as the library gives it."""
        names, R = self._names(), T[:, :3, :3]
        if "qw" in names:
            return se3.quat_from_rotation(R)
        if "r11" in names:
            return R.reshape(-1, 9)
        angles = se3.rpy_from_rotation(R)
        return angles[:, [name in names for name in _ROTATION["rpy"]]]


def _wrapped(angle: Array) -> Array:
    """Angles [rad] turned by whole turns into (-pi, pi]."""
    near = angle - TURN * np.ceil((angle - np.pi) / TURN)
    # rounding may end a little outside
    return np.where(near <= -np.pi, np.pi, np.minimum(near, np.pi))

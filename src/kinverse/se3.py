"""Rigid poses as plain NumPy arrays: intake checks, constructors and conversions.

Conventions: lengths in metres, angles in radians, quaternions ``wxyz``, and roll-pitch-yaw read
as ``R = Rz(yaw) @ Ry(pitch) @ Rx(roll)`` (the URDF convention).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError

__all__ = [
    "MOST_METRES",
    "MOST_SEED",
    "RIGID_TOLERANCE",
    "as_joints",
    "as_pose",
    "as_poses",
    "as_real",
    "cos_sin",
    "inverse",
    "nearest_rotation",
    "pose",
    "quat_conjugate",
    "quat_from_rotation",
    "quat_multiply",
    "quat_rotate",
    "rotation_exp",
    "rotation_from_axis",
    "rotation_from_quat",
    "rotation_from_rpy",
    "rotation_log",
    "rpy_from_rotation",
    "transform",
]

Array = NDArray[np.float64]

RIGID_TOLERANCE = 1e-5
"""Largest entry of ``|R'R - I|`` that still counts as a rotation (six-digit files pass)."""

MOST_METRES = 1e100
"""Largest translation [m] of a pose: its square is still a number."""

MOST_SEED = 1e6
"""Largest joint value to be near to [rad or m]: its whole turns can still be told apart."""

_EYE = np.eye(3)
_EYE4 = np.eye(4)
_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


# ---------------------------------------------------------------------------- intake
def as_real(values: Any, name: str) -> Array:
    """Convert a real array-like to C-contiguous float64.

    Args:
        values: int, float32, strided and Fortran arrays and nested lists are all taken.
        name: how the argument is called in messages.

    Raises:
        TypeError: complex, boolean, object or text data.
        InputError: ragged nesting.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{name} is ragged: all its rows must have the same length") from error
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name} must hold real numbers, got an array of {array.dtype}")
    # not np.ascontiguousarray: it turns a number into an array of one
    return np.asarray(array, dtype=np.float64, order="C")


def as_joints(
    q: Any, dof: int, name: str = "q", count: int | None = None, bound: float | None = None
) -> Array:
    """Check joint values and convert them to float64.

    Args:
        q: (..., dof) joint values [rad or m].
        dof: number of free joints.
        name: how the argument is called in messages.
        count: if given, q must be (dof,) or (count, dof) and the answer is (count, dof).
        bound: if given, no value may be larger than this, with either sign.

    Returns:
        (..., dof) C-contiguous float64.

    Raises:
        TypeError: complex, boolean, object or text data.
        InputError: another shape, or values that are not finite or beyond the bound; the message
            names the first bad row.

    Example:
        >>> as_joints([1, 2, 3], 3).shape
        (3,)
    """
    array = as_real(q, name)
    if array.ndim == 0 or array.shape[-1] != dof:
        raise InputError(f"{name} must have shape (..., {dof}), got {array.shape}")
    if not np.isfinite(array).all():
        where, _ = _first(~np.isfinite(array), array)
        raise InputError(f"{name} must be finite, got NaN or inf{where}")
    if bound is not None and (np.abs(array) > bound).any():
        where, value = _first(np.abs(array) > bound, array)
        raise InputError(f"{name} must lie within +-{bound:g}, got {value:g}{where}")
    if count is not None:
        if array.shape not in ((dof,), (count, dof)):
            raise InputError(
                f"{name} must have shape ({dof},) or ({count}, {dof}), got {array.shape}"
            )
        return np.ascontiguousarray(np.broadcast_to(array, (count, dof)))
    return array


def _first(bad: NDArray[np.bool_], array: Array) -> tuple[str, float]:
    """Where the first bad joint value is, in words, and what it is."""
    at = tuple(np.argwhere(bad)[0].tolist())
    row = ", ".join(map(str, at[:-1]))
    return f" in row {row}" if row else "", float(array[at])


def as_poses(T: Any, name: str = "T") -> Array:
    """Check poses and stack them.

    Args:
        T: (4, 4) or (N, 4, 4) homogeneous matrices [m], or an object that has them as
            ``as_matrix()`` (SciPy's RigidTransform) or ``.A`` (spatialmath's SE3).
        name: how the argument is called in messages.

    Returns:
        (N, 4, 4) C-contiguous float64; N is 1 for a single pose and may be 0.

    Raises:
        TypeError: complex, boolean, object or text data.
        InputError: another shape, NaN or inf, a translation beyond 1e100 m, a last row that is
            not 0 0 0 1, or a rotation part with ``max|R'R - I| > 1e-5`` or a determinant that is
            not positive; the message names the first bad row.

    Example:
        >>> as_poses(np.eye(4)).shape
        (1, 4, 4)
    """
    if not isinstance(T, np.ndarray):
        if hasattr(T, "as_matrix"):
            T = T.as_matrix()
        elif hasattr(T, "A"):
            T = T.A
    array = as_real(T, name)
    if array.ndim not in (2, 3) or array.shape[-2:] != (4, 4):
        hint = "; for positions: kv.pose(xyz)" if array.shape[-1:] == (3,) else ""
        raise InputError(f"{name} must have shape (4, 4) or (N, 4, 4), got {array.shape}{hint}")
    single = array.ndim == 2
    if single and _is_rigid(array.tolist()):
        return array[None]
    array = array.reshape(-1, 4, 4)
    R = array[:, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        skew = np.abs(R.transpose(0, 2, 1) @ R - _EYE).max(axis=(1, 2), initial=0.0)
        good = (skew <= RIGID_TOLERANCE) & (array[:, 3] == _LAST_ROW).all(axis=1)
        good &= (np.abs(array[:, :3, 3]) <= MOST_METRES).all(axis=1) & (_determinant(R) > 0.0)
    if not good.all():
        row = int(np.argmin(good))
        where = name if single else f"{name}[{row}] (row {row})"
        raise InputError(f"{where} is not a rigid pose: {_why_not_rigid(array[row])}")
    return array


def as_pose(T: Any, name: str = "T") -> Array:
    """Like :func:`as_poses`, for exactly one pose: returns (4, 4)."""
    array = as_poses(T, name)
    if len(array) != 1:
        raise InputError(f"{name} must be one (4, 4) pose, got {len(array)} poses")
    single: Array = array[0]
    return single


def _is_rigid(rows: list[list[float]]) -> bool:
    # one pose in plain floats takes 2 us, the array code 40: single solves are that quick
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = rows
    return (
        last == [0.0, 0.0, 0.0, 1.0]
        and abs(a * a + d * d + g * g - 1.0) <= RIGID_TOLERANCE
        and abs(b * b + e * e + h * h - 1.0) <= RIGID_TOLERANCE
        and abs(c * c + f * f + i * i - 1.0) <= RIGID_TOLERANCE
        and abs(a * b + d * e + g * h) <= RIGID_TOLERANCE
        and abs(a * c + d * f + g * i) <= RIGID_TOLERANCE
        and abs(b * c + e * f + h * i) <= RIGID_TOLERANCE
        and a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0.0
        and abs(x) <= MOST_METRES
        and abs(y) <= MOST_METRES
        and abs(z) <= MOST_METRES
    )


def _determinant(R: Array) -> Array:
    # by hand: exact enough for a sign, and free of LAPACK's warnings
    (a, b, c), (d, e, f), (g, h, i) = R.transpose(1, 2, 0)
    return np.asarray(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))


def _why_not_rigid(T: Array) -> str:
    if not np.isfinite(T).all():
        return "it holds NaN or inf"
    if (T[3] != _LAST_ROW).any():
        return f"its last row is {T[3].tolist()}, not [0, 0, 0, 1]"
    far = float(np.abs(T[:3, 3]).max())
    if far > MOST_METRES:
        return f"its translation is {far:.3g} m, allowed is {MOST_METRES:g}"
    with np.errstate(over="ignore", invalid="ignore"):
        skew = float(np.abs(T[:3, :3].T @ T[:3, :3] - _EYE).max())
    if not skew <= RIGID_TOLERANCE:
        return f"its rotation part has max|R'R - I| = {skew:.3g}, allowed is {RIGID_TOLERANCE:g}"
    return "its rotation part is a reflection (negative determinant)"


# ---------------------------------------------------------------------------- constructors
def cos_sin(angle: ArrayLike) -> tuple[Array, Array]:
    """Cosine and sine [rad], exactly 0 or +-1 within 1e-12 of a multiple of pi/2 other than 0.

    Robot files hold right angles in twelve to sixteen digits; snapping them keeps zero entries of
    a robot's fixed transforms zero, which is what closed forms look for. Near 0 nothing is
    snapped: a small rotation stays what it is.
    """
    angle = np.asarray(angle, dtype=np.float64)
    quarter = np.round(angle / (np.pi / 2))
    exact = (np.abs(angle - quarter * (np.pi / 2)) <= 1e-12) & (quarter != 0.0)
    turn = np.mod(quarter, 4).astype(np.int64)
    c = np.where(exact, np.array([1.0, 0.0, -1.0, 0.0])[turn], np.cos(angle))
    s = np.where(exact, np.array([0.0, 1.0, 0.0, -1.0])[turn], np.sin(angle))
    return c, s


def transform(R: ArrayLike | None = None, xyz: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """A (4, 4) matrix from a (3, 3) rotation and a (3,) translation [m]; nothing is checked."""
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    T[:3, 3] = xyz
    return T


def pose(
    xyz: ArrayLike = (0.0, 0.0, 0.0),
    *,
    rpy: ArrayLike | None = None,
    quat: ArrayLike | None = None,
    axis: tuple[ArrayLike, ArrayLike] | None = None,
) -> Array:
    """Build poses from a position and at most one description of the rotation.

    Each may be one, or N of them; one goes with all N of the other.

    Args:
        xyz: (3,) or (N, 3) positions [m].
        rpy: (3,) or (N, 3) roll, pitch, yaw [rad]; ``R = Rz(yaw) Ry(pitch) Rx(roll)``.
        quat: (4,) or (N, 4) quaternions w, x, y, z; their length must be 1 within 1e-3.
        axis: directions (3,) or (N, 3) of any length and angles, one or (N,) [rad].

    Returns:
        (4, 4) float64; (N, 4, 4) if anything came as N.

    Raises:
        TypeError: complex, object or text data.
        InputError: wrong lengths, values that are not finite, two rotations, a zero axis or a
            quaternion that is not of unit length.

    Example:
        >>> pose([1, 2, 3], rpy=[0, 0, np.pi / 2])[:3, 0]
        array([0., 1., 0.])
    """
    if sum(given is not None for given in (rpy, quat, axis)) > 1:
        raise InputError("pose takes one rotation: rpy, quat or axis")
    R = _EYE
    if rpy is not None:
        R = rotation_from_rpy(_vectors(rpy, 3, "rpy"))
    elif quat is not None:
        wxyz = _vectors(quat, 4, "quat")
        length = np.atleast_1d(np.linalg.norm(wxyz, axis=-1))
        wrong = np.flatnonzero(~(np.abs(length - 1.0) <= 1e-3))
        if len(wrong):
            where = f" in row {wrong[0]}" if wxyz.ndim == 2 else ""
            raise InputError(
                f"quat must have length 1 (w, x, y, z), got length {length[wrong[0]]:.6g}{where}"
            )
        R = rotation_from_quat(wxyz)
    elif axis is not None:
        if not isinstance(axis, Sequence) or len(axis) != 2:
            raise InputError("axis must be a pair: a direction of three numbers and an angle")
        direction = _vectors(axis[0], 3, "axis direction")
        if not direction.any(axis=-1).all():
            raise InputError("axis direction must not be zero")
        angle = as_real(axis[1], "axis angle")
        if angle.ndim > 1 or not np.isfinite(angle).all():
            raise InputError("axis angle must be one finite number, or (N,) of them")
        if angle.ndim == direction.ndim - 1 == 1 and len(angle) != len(direction):
            raise InputError(f"axis has {len(direction)} directions and {len(angle)} angles")
        count = np.broadcast_shapes(angle.shape, direction.shape[:-1])
        R = rotation_from_axis(
            np.broadcast_to(direction, (*count, 3)), np.broadcast_to(angle, count)
        )
    place = _vectors(xyz, 3, "xyz")
    if place.ndim == 1 and R.ndim == 2:
        return transform(R, place)
    if place.ndim == 2 and R.ndim == 3 and len(place) != len(R):
        raise InputError(f"xyz has {len(place)} rows and the rotation {len(R)}")
    T = np.tile(_EYE4, (len(place) if place.ndim == 2 else len(R), 1, 1))
    T[:, :3, :3] = R
    T[:, :3, 3] = place
    return T


def _vectors(values: ArrayLike, length: int, name: str) -> Array:
    array = as_real(values, name)
    if array.ndim not in (1, 2) or array.shape[-1] != length:
        raise InputError(f"{name} must have shape ({length},) or (N, {length}), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got {array.tolist()}")
    return array


def inverse(T: Array) -> Array:
    """Inverse of rigid poses (..., 4, 4), by transposition."""
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", R, T[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


# ---------------------------------------------------------------------------- rotations
def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) [rad] to rotations (..., 3, 3): ``Rz(yaw) Ry(pitch) Rx(roll)``."""
    c, s = cos_sin(rpy)
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(c, -1, 0), np.moveaxis(s, -1, 0)
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) + 0.0


def rpy_from_rotation(R: ArrayLike) -> Array:
    """Rotations (..., 3, 3) to roll, pitch, yaw (..., 3) [rad].

    Pitch lies in [-pi/2, pi/2]. Where it is +-pi/2 (within 1e-9) only yaw -+ roll is defined
    and roll is set to 0.
    """
    R = np.asarray(R, dtype=np.float64)
    level = np.hypot(R[..., 0, 0], R[..., 1, 0])
    locked = level < 1e-9
    roll = np.where(locked, 0.0, np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    yaw = np.where(
        locked,
        np.arctan2(-R[..., 0, 1], R[..., 1, 1]),
        np.arctan2(R[..., 1, 0], R[..., 0, 0]),
    )
    return np.stack([roll, np.arctan2(-R[..., 2, 0], level), yaw], axis=-1)


def rotation_from_quat(wxyz: ArrayLike) -> Array:
    """Quaternions w, x, y, z (..., 4) of any length but zero to rotations (..., 3, 3)."""
    q = np.asarray(wxyz, dtype=np.float64)
    # scaled by the largest part first: the square of a tiny quaternion must not vanish
    q = q / np.abs(q).max(axis=-1, keepdims=True)
    w, x, y, z = np.moveaxis(q, -1, 0)
    n = w * w + x * x + y * y + z * z
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    R = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return np.asarray(R / n[..., None, None]) + 0.0


def quat_from_rotation(R: ArrayLike) -> Array:
    """Rotations (..., 3, 3) to unit quaternions w, x, y, z (..., 4) with w >= 0.

    Takes the best conditioned of the four products (Shepperd, J. Guidance and Control 1, 1978).
    """
    R = np.asarray(R, dtype=np.float64)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    wx, wy, wz = (
        R[..., 2, 1] - R[..., 1, 2],
        R[..., 0, 2] - R[..., 2, 0],
        R[..., 1, 0] - R[..., 0, 1],
    )
    xy, xz, yz = (
        R[..., 0, 1] + R[..., 1, 0],
        R[..., 0, 2] + R[..., 2, 0],
        R[..., 1, 2] + R[..., 2, 1],
    )
    # row k is 4 q_k q, so that its own entry k tells how well it is conditioned
    rows = np.stack(
        [
            np.stack([1 + xx + yy + zz, wx, wy, wz], axis=-1),
            np.stack([wx, 1 + xx - yy - zz, xy, xz], axis=-1),
            np.stack([wy, xy, 1 - xx + yy - zz, yz], axis=-1),
            np.stack([wz, xz, yz, 1 - xx - yy + zz], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0.0, -q, q)) + 0.0


def quat_multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton's product of quaternions w, x, y, z (..., 4), ``ij = k``: b acts first."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    r, v, s, u = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = r * s - (v * u).sum(axis=-1, keepdims=True)
    return np.concatenate([scalar, r * u + s * v + np.cross(v, u)], axis=-1)


def quat_conjugate(wxyz: ArrayLike) -> Array:
    """The conjugate (..., 4); the inverse of a unit quaternion."""
    return np.asarray(np.asarray(wxyz, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0]))


def quat_rotate(wxyz: ArrayLike, points: ArrayLike) -> Array:
    """Points (..., 3) turned by unit quaternions (..., 4): ``h x h^-1``."""
    q, x = np.asarray(wxyz, dtype=np.float64), np.asarray(points, dtype=np.float64)
    v = q[..., 1:]
    twice = 2.0 * np.cross(v, x)
    return np.asarray(x + q[..., :1] * twice + np.cross(v, twice))


def rotation_from_axis(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Directions (..., 3) of any length but zero and angles (...) [rad] to rotations (..., 3, 3).

    Rodrigues' formula.
    """
    axis = np.asarray(axis, dtype=np.float64)
    axis = axis / np.abs(axis).max(axis=-1, keepdims=True)
    x, y, z = np.moveaxis(axis / np.linalg.norm(axis, axis=-1, keepdims=True), -1, 0)
    c, s = cos_sin(angle)
    v = 1.0 - c
    rows = (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) + 0.0


def rotation_exp(vector: ArrayLike) -> Array:
    """Rotation vectors (..., 3) [rad] to rotations (..., 3, 3); inverse of :func:`rotation_log`."""
    vector = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(vector, axis=-1)
    still = angle == 0.0
    axis = np.where(still[..., None], np.array([0.0, 0.0, 1.0]), vector)
    return rotation_from_axis(axis, angle)


def rotation_log(R: ArrayLike) -> Array:
    """Rotations (..., 3, 3) to rotation vectors (..., 3) [rad], length in [0, pi].

    By way of the quaternion and atan2, so that it is accurate at 0 and at pi alike. At pi the
    direction may be either of the two.
    """
    q = quat_from_rotation(R)
    w, v = q[..., 0], q[..., 1:]
    n = np.linalg.norm(v, axis=-1)
    small = n < 1e-150
    scale = np.where(small, 2.0, 2.0 * np.arctan2(n, w) / np.where(small, 1.0, n))
    return np.asarray(scale[..., None] * v)


def nearest_rotation(R: ArrayLike) -> Array:
    """The rotations nearest to matrices (..., 3, 3) in the Frobenius norm (polar part, by SVD)."""
    u, _, vt = np.linalg.svd(np.asarray(R, dtype=np.float64))
    sign = np.where(np.linalg.det(u @ vt) < 0.0, -1.0, 1.0)
    u = np.concatenate([u[..., :2], u[..., 2:] * sign[..., None, None]], axis=-1)
    return np.asarray(u @ vt)

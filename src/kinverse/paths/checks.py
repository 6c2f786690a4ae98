"""What the points, lengths and corners of a path must be; messages name the row."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = [
    "SAME_PLACE",
    "as_bounds",
    "as_frame",
    "as_joint_limits",
    "as_length",
    "as_stations",
    "check_blend",
    "check_pieces",
    "stacked",
    "turns_between",
]

Array = NDArray[np.float64]

SAME_PLACE = 1e-9
"""Two points closer than this [m] are one."""

SAME_WAY = 1e-9
"""Two rotations closer than this [rad] are one."""


def as_stations(points: ArrayLike, name: str) -> tuple[Array, Array | None]:
    """Positions (K, 3) and, if poses were given, their rotations (K, 3, 3); at least two.

    Raises:
        InputError: another shape, fewer than two, NaN, or poses that are not rigid.
    """
    known = hasattr(points, "as_matrix") or hasattr(points, "A")
    array = se3.as_poses(points, name) if known else se3.as_real(points, name)
    if array.ndim == 2 and array.shape[-1] == 3:
        bad = ~(np.abs(array) <= se3.MOST_METRES).all(axis=1)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(f"{name}[{row}] (row {row}) is not finite: {array[row].tolist()}")
        given = None
    elif array.ndim == 3 or array.shape == (4, 4):
        poses = se3.as_poses(array, name)
        array, given = poses[:, :3, 3].copy(), se3.nearest_rotation(poses[:, :3, :3])
    else:
        raise InputError(f"{name} must have shape (K, 3) or (K, 4, 4), got {array.shape}")
    if len(array) < 2:
        count = "none" if len(array) == 0 else "one"
        raise InputError(f"a path needs at least two {name}, got {count}")
    return array, given


def stacked(parts: list[Any], names: tuple[str, ...]) -> Array:
    """Positions or poses given one by one, as (K, 3) or (K, 4, 4)."""
    arrays = []
    for part, name in zip(parts, names, strict=True):
        if hasattr(part, "as_matrix") or hasattr(part, "A"):
            part = se3.as_pose(part, name)
        array = se3.as_real(part, name)
        if array.shape not in ((3,), (4, 4)):
            raise InputError(f"{name} must be a position (3,) or a pose (4, 4), got {array.shape}")
        arrays.append(array)
    if len({array.ndim for array in arrays}) > 1:
        raise InputError(f"{', '.join(names)} must all be positions (3,) or all poses (4, 4)")
    return np.stack(arrays)


def as_frame(value: Any, name: str) -> Array:
    """A frame (4, 4) from one or from its origin (3,)."""
    array = se3.as_real(value, name)
    return se3.pose(array) if array.shape == (3,) else se3.as_pose(array, name)


def as_joint_limits(value: ArrayLike, n: int, name: str) -> Array:
    """Positive limits (n,) from one number or n.

    Raises:
        InputError: another count, or one that is not positive and finite.
    """
    array = se3.as_real(value, name)
    if array.shape not in ((), (n,)):
        raise InputError(f"{name} must be one number or ({n},), got {array.shape}")
    limits = np.broadcast_to(array, (n,)).astype(np.float64)
    bad = ~((limits > 0.0) & (limits <= 1e9))
    if bad.any():
        joint = int(np.argmax(bad))
        which = f"{name}[{joint}]" if array.ndim else name
        raise InputError(f"{which} must be positive and finite, got {limits[joint]:g}")
    return limits


def turns_between(places: Array, given: Array) -> Array | None:
    """(K,) turn done at each pose [rad] if all are in one place; None if any is elsewhere.

    Raises:
        InputError: a pose that repeats the one before.
    """
    if np.linalg.norm(places - places[0], axis=1).max() > SAME_PLACE:
        return None
    turns = _turn(given)
    if (turns <= SAME_WAY).any():
        row = int(np.argmax(turns <= SAME_WAY)) + 1
        raise InputError(f"T[{row}] repeats T[{row - 1}] (rows {row + 1} and {row} of a file)")
    return np.concatenate([[0.0], np.cumsum(turns)])


def check_pieces(places: Array, given: Array | None, name: str, closed: bool = False) -> None:
    """Refuse neighbours in one place; closed: the last and the first are neighbours too."""
    ring = np.concatenate([places, places[:1]]) if closed else places
    short = np.linalg.norm(np.diff(ring, axis=0), axis=1) <= SAME_PLACE
    if not short.any():
        return
    before = int(np.argmax(short))
    row = (before + 1) % len(places)
    rows = f"(rows {row + 1} and {before + 1} of a file)"
    where = f"{name}[{row}] is in the place of {name}[{before}] {rows}"
    if row == 0:
        raise InputError(f"{where}: a closed curve returns to its first point by itself")
    if given is not None and _turn(given[[before, row]])[0] > SAME_WAY:
        raise InputError(
            f"{where} and only turns: a path that goes on is measured in metres, and turning on"
            " the spot has none; make it a path of its own"
        )
    raise InputError(f"{where}: a piece without length")


def check_blend(points: Array, blend: float, closed: bool = False) -> None:
    """Refuse a blend that neighbouring corners have no room for, and corners that double back.

    Args:
        points: (K, 3); if closed, the last is the first.
        blend: [m].
        closed: the first point is a corner too.
    """
    along = np.diff(points, axis=0)
    room = np.linalg.norm(along, axis=1)
    along = along / room[:, None]
    # the pieces at both ends of an open path have one rounded corner
    ends = np.full(len(room), 2.0)
    if not closed:
        ends[0] -= 1.0
        ends[-1] -= 1.0
    tight = blend * ends > room * (1.0 + 1e-12)
    if tight.any():
        k = int(np.argmax(tight))
        raise InputError(
            f"blend = {blend:g} m has no room between points {k} and {k + 1}, which are"
            f" {room[k]:g} m apart: at most {room[k] / ends[k]:g}"
        )
    cosine = (along[:-1] * along[1:]).sum(axis=1)
    if (cosine < -1.0 + 1e-12).any():
        k = int(np.argmin(cosine)) + 1
        raise InputError(f"the path doubles back at point {k}: no arc rounds that corner")


def as_length(value: Any, name: str, least: float = 0.0) -> float:
    """A finite number that is not below least."""
    number = se3.as_real(value, name)
    if number.shape != () or not (least <= number <= se3.MOST_METRES):
        what = "positive" if least > 0.0 else "not negative"
        raise InputError(f"{name} must be one finite number, {what}, got {number.tolist()}")
    return float(number)


def as_bounds(value: ArrayLike, name: str) -> tuple[float, float]:
    """Two finite numbers that differ."""
    pair = se3.as_real(value, name)
    if pair.shape != (2,) or not (np.abs(pair) <= se3.MOST_METRES).all() or pair[0] == pair[1]:
        raise InputError(f"{name} must be two finite numbers that differ, got {pair.tolist()}")
    return float(pair[0]), float(pair[1])


def _turn(rotations: Array) -> Array:
    between = np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]
    return np.asarray(np.linalg.norm(se3.rotation_log(between), axis=-1))

"""Denavit-Hartenberg rows as a chain of fixed transforms and motions about z."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["CONVENTIONS", "frames", "motion"]

Array = NDArray[np.float64]

CONVENTIONS = ("standard", "modified")


def motion(kind: str, value: float) -> Array:
    """The (4, 4) motion of a joint: turn about ("R") or slide along ("P") its own z."""
    if kind == "P":
        return se3.transform(None, (0.0, 0.0, value))
    c, s = se3.cos_sin(value)
    return se3.transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def _row_parts(row: list[float], convention: str) -> tuple[Array, Array]:
    """Fixed transforms before and after the motion of one row [m, rad]."""
    a, d, alpha, theta = row
    c, s = se3.cos_sin(alpha)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    link = se3.transform(turn, (a, 0.0, 0.0))
    joint = motion("R", theta) @ motion("P", d)
    return (np.eye(4), joint @ link) if convention == "standard" else (link, joint)


def frames(
    a: ArrayLike,
    d: ArrayLike,
    alpha: ArrayLike,
    theta: ArrayLike,
    joints: str | Sequence[str],
    convention: str,
    base: Array | None = None,
    tool: Array | None = None,
) -> tuple[Array, str]:
    """Fold rows into (m + 1, 4, 4) fixed transforms and the m letters of the moving rows.

    See :meth:`kinverse.Robot.from_dh` for the arguments.

    Raises:
        InputError: unknown letters or convention, no moving row, rows of different length.
    """
    if convention not in CONVENTIONS:
        raise InputError(f"convention must be {' or '.join(CONVENTIONS)}, got {convention!r}")
    if isinstance(joints, (list, tuple)) and all(kind in ("R", "P", "F") for kind in joints):
        joints = "".join(joints)
    if not isinstance(joints, str) or set(joints) - set("RPF"):
        raise InputError(
            f"joints must be letters R (revolute), P (prismatic), F (fixed), got {joints!r}"
        )
    rows = len(joints)
    columns = []
    for name, values in (("a", a), ("d", d), ("alpha", alpha), ("theta", theta)):
        column = se3.as_real(values, name)
        if column.shape not in ((), (rows,)):
            raise InputError(
                f"{name} must be one number or {rows} (one for each letter of joints),"
                f" got shape {column.shape}"
            )
        if not np.isfinite(column).all():
            raise InputError(f"{name} must be finite, got {column.tolist()}")
        columns.append(np.broadcast_to(column, rows))
    out, kinds, before = [], "", np.eye(4) if base is None else base
    for kind, row in zip(joints, np.stack(columns, axis=1).tolist(), strict=True):
        pre, post = _row_parts(row, convention)
        before = before @ pre
        if kind != "F":
            out.append(before)
            kinds += kind
            before = np.eye(4)
        before = before @ post
    if not kinds:
        raise InputError(f"a robot needs at least one moving row, got joints={joints!r}")
    out.append(before if tool is None else before @ tool)
    return np.stack(out), kinds

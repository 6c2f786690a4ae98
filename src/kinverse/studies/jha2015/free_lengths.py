"""Could any arm with right angles between its axes stand behind a table of positions?

For given directions of the axes the position is linear in all lengths and offsets, so that the
best lengths are a least squares. All directions are tried, and the same is done with the positions
in shuffled order: a table that no arm fits fits no better than its shuffled copies.
"""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.forward_kinematics import joint_columns, position_columns
from kinverse.studies.jha2015.forward_pictures import fits_figure
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

__all__ = ["TABLES", "free_lengths", "position_matrices"]

Array = NDArray[np.float64]

CHECKED = ("7.1", "7.7", "7.14", "7.17", "7.20", "7.23")
"""Tables with more equations than lengths; those of five positions have too few."""
FITS = 1e-5
"""A relative residual that printing four decimals leaves."""
SHUFFLES = 99
BEST = 50
"""Readings that are tried again with each row left out."""


def _turn(axis: int, angle: float) -> Array:
    """Rotation about x (0) or y (1) by a multiple of 90 deg."""
    c, s = round(math.cos(angle)), round(math.sin(angle))
    if axis == 0:
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]], dtype=np.float64)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], dtype=np.float64)


NEXT = np.stack(
    [_turn(0, k * math.pi / 2) for k in range(4)] + [_turn(1, k * math.pi / 2) for k in (1, 3)]
)
"""(6, 3, 3) rotations that take z to z, -y, -z, y, x and -x."""


def position_matrices(q: Array) -> Array:
    """(6^(n-1), rows, 3, 3 + 2n): the position is such a matrix times the lengths.

    The first axis is z of the base; each other axis has six directions in the frame of the joint
    before it. Lengths are a constant offset (3), then for each joint the two across its axis:
    what lies along an axis belongs to the joint before. Constant joint offsets of 90 deg are
    other directions of the axes that follow.

    Args:
        q: (rows, n) joint angles [rad].
    """
    rows, n = q.shape
    c, s = np.cos(q), np.sin(q)
    R = np.broadcast_to(np.eye(3), (1, rows, 3, 3))
    columns = np.broadcast_to(np.eye(3), (1, rows, 3, 3))
    for joint in range(n):
        turn = np.zeros((rows, 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = c[:, joint]
        turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = s[:, joint], -s[:, joint], 1.0
        R = R @ turn
        columns = np.concatenate([columns, R[..., :2]], axis=-1)
        if joint < n - 1:
            R = (R[:, None] @ NEXT[:, None]).reshape(-1, rows, 3, 3)
            columns = np.repeat(columns, len(NEXT), axis=0)
    return columns


def free_lengths(table: str, shuffles: int, seed: int) -> list[Row]:
    """The best fit of a table, with one row left out, and of its shuffled copies.

    Args:
        table: its number.
        shuffles: how many copies with the positions in another order.
        seed: of their order.

    Returns:
        One row; residuals are root mean squares relative to those of the centred positions.
    """
    data = printed("jha2015", f"table_{table.replace('.', '_')}")
    places = position_columns(data)
    p = data.numbers(places)
    A = position_matrices(np.radians(data.numbers(joint_columns(data))))[:, :, : len(places)]
    rng = np.random.default_rng(seed)
    copies = np.stack([p, *(rng.permutation(p) for _ in range(shuffles))])
    every = _residuals(A, copies)
    of_copies = every[:, 1:].min(axis=0)
    least = np.argsort(every[:, 0])[:BEST]
    without = [
        _residuals(A[least][:, kept], p[None, kept])[:, 0].min()
        for kept in (np.arange(len(p)) != k for k in range(len(p)))
    ]
    worst = int(np.argmin(without))
    return [
        {
            "table": table,
            "readings": len(A),
            "equations": p.size,
            "unknowns": A.shape[-1],
            "residual": float(every[:, 0].min()),
            "residual, one row left out": float(min(without)),
            "row left out": worst + 1,
            "shuffled, least": float(of_copies.min()),
            "shuffled, median": float(np.median(of_copies)),
        }
    ]


def _residuals(A: Array, copies: Array) -> Array:
    """(readings, copies) relative residuals of the least squares."""
    flat = A.reshape(len(A), -1, A.shape[-1])
    b = copies.reshape(len(copies), -1).T
    U, size, _ = np.linalg.svd(flat, full_matrices=False)
    # directions that lengths cannot reach are no part of the fit: coaxial joints share lengths
    U = U * (size > 1e-9 * size[:, :1])[:, None]
    left = np.linalg.norm(b - U @ (np.swapaxes(U, 1, 2) @ b), axis=1)
    centred = np.linalg.norm(copies - copies.mean(axis=1, keepdims=True), axis=(1, 2))
    relative: Array = left / centred
    return relative


def _cells(quick: bool) -> list[Cell]:
    return [
        Cell(
            f"free-lengths-{table}",
            free_lengths,
            {"table": table, "shuffles": SHUFFLES, "seed": 20150 + k},
        )
        for k, table in enumerate(CHECKED)
    ]


def _build(rows: dict[str, list[Row]]) -> Table:
    lines = [row for each in rows.values() for row in each]
    fitted = [row for row in lines if _least(row) < FITS]
    names = ", ".join(str(row["table"]) for row in fitted)
    others = [row for row in lines if row not in fitted]
    alt = (
        f"Dots on a logarithmic scale, a line for each table. Tables {names} lie below {FITS:g}"
        f" with one row left out; {', '.join(str(row['table']) for row in others)} lie above"
        f" {min(map(_least, others)):.1f}, as shuffled copies do."
    )
    return Table(
        title="Could any lengths explain the printed positions?",
        rows=lines,
        verdict=Verdict.OURS,
        residual=f"tables {names} are fitted, to {max(map(_least, fitted)):.1g} of their spread",
        note="All directions of the axes at right angles or parallel, all lengths by least"
        " squares. The same is done with the positions shuffled among the rows: a residual like"
        " those of shuffled copies says that no arm of this family stands behind a table; it does"
        " not prove that no reading at all exists.",
        pictures=(Picture("Residuals of the best lengths", alt, partial(fits_figure, lines)),),
    )


def _least(row: Row) -> float:
    value = row["residual, one row left out"]
    assert isinstance(value, float)
    return value


TITLE = "Could any lengths explain the printed positions? (tables 7.1, 7.7, 7.14, 7.17, 7.20, 7.23)"
TABLES = (TableSpec("free-lengths", TITLE, _cells, _build),)

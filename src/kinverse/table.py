"""The bare arrays behind ``Solutions``: M solution rows grouped by pose, N pose rows."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels
from kinverse.status import METHODS, Status

__all__ = [
    "PER_INTERVAL",
    "PER_POSE",
    "PER_SOLUTION",
    "Table",
    "TableLike",
    "has_not_found",
    "kept",
    "merged",
    "plain_evidence",
    "replaced",
    "taken",
    "without",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

PER_SOLUTION = ("q", "pose_index", "position_error", "rotation_error", "branch")
PER_INTERVAL = ("interval_pose", "interval_branch", "interval_low", "interval_high")
PER_POSE = (
    "status",
    "count",
    "singular",
    "evaluations",
    "iterations",
    "starts",
    "stop",
    "cost",
    "best_q",
    "best_position_error",
    "best_rotation_error",
    "evidence",
)


class TableLike(Protocol):
    """What the native core's table and ``Table`` have in common; read-only arrays."""

    @property
    def q(self) -> Array:
        """(M, n) joint values."""

    @property
    def pose_index(self) -> Ints:
        """(M,) ascending."""

    @property
    def position_error(self) -> Array:
        """(M,) [m]."""

    @property
    def rotation_error(self) -> Array:
        """(M,) [rad]."""

    @property
    def branch(self) -> NDArray[np.int32]:
        """(M,) -1 where unknown."""

    @property
    def status(self) -> NDArray[np.uint8]:
        """(N,)."""

    @property
    def count(self) -> Ints:
        """(N,) solutions of each pose."""

    @property
    def singular(self) -> Bools:
        """(N,)."""

    @property
    def evaluations(self) -> Ints:
        """(N,)."""

    @property
    def iterations(self) -> Ints:
        """(N,) steps of the answered start; -1 where a method does not iterate."""

    @property
    def starts(self) -> Ints:
        """(N,) starts begun; -1 likewise."""

    @property
    def stop(self) -> Ints:
        """(N,) number of the reason in ``status.STOPS``; -1 likewise."""

    @property
    def cost(self) -> Array:
        """(N,) objective of a population method before any descent; NaN of other methods."""

    @property
    def best_q(self) -> Array:
        """(N, n) NaN where there was no candidate."""

    @property
    def best_position_error(self) -> Array:
        """(N,) [m]."""

    @property
    def best_rotation_error(self) -> Array:
        """(N,) [rad]."""

    @property
    def evidence(self) -> Records:
        """(N,) rows of ``kernels.EVIDENCE``."""

    @property
    def interval_pose(self) -> Ints:
        """(K,) ascending."""

    @property
    def interval_branch(self) -> NDArray[np.int32]:
        """(K,)."""

    @property
    def interval_low(self) -> Array:
        """(K,) [rad]."""

    @property
    def interval_high(self) -> Array:
        """(K,) [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A table made in Python, by slicing, filtering or merging; arrays are made read-only."""

    q: Array
    pose_index: Ints
    position_error: Array
    rotation_error: Array
    branch: NDArray[np.int32]
    status: NDArray[np.uint8]
    count: Ints
    singular: Bools
    evaluations: Ints
    iterations: Ints
    starts: Ints
    stop: Ints
    cost: Array
    best_q: Array
    best_position_error: Array
    best_rotation_error: Array
    evidence: Records
    interval_pose: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    interval_branch: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    interval_low: Array = field(default_factory=lambda: np.empty(0))
    interval_high: Array = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        for name in PER_SOLUTION + PER_POSE + PER_INTERVAL:
            getattr(self, name).flags.writeable = False


def plain_evidence(method: str, poses: int) -> Records:
    """The evidence of a method that counts no roots, one row a pose."""
    rows = np.zeros(poses, kernels.EVIDENCE)
    rows["method"] = METHODS.index(method)
    rows["real_roots"] = rows["complex_roots"] = -1
    rows["root_gap"] = rows["root_margin"] = np.nan
    rows["weak"] = method in ("search", "sweep")
    return rows


def has_not_found(table: TableLike) -> bool:
    """Whether any pose is NOT_FOUND: asked after every call of a solver that may fall through."""
    # the native table counts; making its status array would cost as much as a closed form
    count = getattr(table, "not_found", None)
    return Status.NOT_FOUND in table.status.tobytes() if count is None else bool(count)


def replaced(table: TableLike, **changes: NDArray[Any]) -> Table:
    """A copy of a table with some arrays exchanged; the others are shared."""
    names = PER_SOLUTION + PER_POSE + PER_INTERVAL
    return Table(**{name: changes.get(name, getattr(table, name)) for name in names})


def without(table: TableLike, poses: Ints) -> tuple[Table, Ints]:
    """A table without some poses that have neither solutions nor intervals; and which are left."""
    is_left = np.ones(len(table.status), dtype=np.bool_)
    is_left[poses] = False
    number = np.cumsum(is_left) - 1
    rest = replaced(
        table,
        pose_index=number[table.pose_index],
        interval_pose=number[table.interval_pose],
        **{name: getattr(table, name)[is_left] for name in PER_POSE},
    )
    return rest, np.flatnonzero(is_left)


def taken(table: TableLike, start: int, stop: int) -> Table:
    """The rows of poses start..stop-1, renumbered from 0; views, not copies."""
    first, last = np.searchsorted(table.pose_index, (start, stop))
    arrays = {name: getattr(table, name)[first:last] for name in PER_SOLUTION}
    arrays["pose_index"] = arrays["pose_index"] - start
    arrays |= {name: getattr(table, name)[start:stop] for name in PER_POSE}
    first, last = np.searchsorted(table.interval_pose, (start, stop))
    arrays |= {name: getattr(table, name)[first:last] for name in PER_INTERVAL}
    arrays["interval_pose"] = arrays["interval_pose"] - start
    return Table(**arrays)


def kept(table: TableLike, rows: NDArray[Any]) -> Table:
    """Only the solutions in ``rows`` (mask or ascending indices).

    A SOLVED pose that loses its last solution becomes NOT_FOUND. Intervals stay: they tell where
    solutions are, not which were kept.
    """
    arrays = {name: getattr(table, name)[rows] for name in PER_SOLUTION}
    count = np.bincount(arrays["pose_index"], minlength=len(table.status)).astype(np.int64)
    status = table.status.copy()
    status[(count == 0) & (table.count > 0)] = Status.NOT_FOUND
    return replaced(table, **arrays, count=count, status=status)


def merged(parts: Sequence[tuple[TableLike, Ints]], poses: int) -> Table:
    """One table for all poses from tables for some: ``parts`` are (table, its pose numbers).

    Every pose of 0..poses-1 must belong to exactly one part.
    """
    arrays: dict[str, NDArray[Any]] = {}
    index = np.concatenate([where[table.pose_index] for table, where in parts])
    order = np.argsort(index, kind="stable")
    for name in PER_SOLUTION:
        arrays[name] = np.concatenate([getattr(table, name) for table, _ in parts])[order]
    arrays["pose_index"] = index[order]
    index = np.concatenate([where[table.interval_pose] for table, where in parts])
    order = np.argsort(index, kind="stable")
    for name in PER_INTERVAL:
        arrays[name] = np.concatenate([getattr(table, name) for table, _ in parts])[order]
    arrays["interval_pose"] = index[order]
    back = np.argsort(np.concatenate([where for _, where in parts]), kind="stable")
    if len(back) != poses:
        raise ValueError(f"parts hold {len(back)} poses, not {poses}")
    for name in PER_POSE:
        arrays[name] = np.concatenate([getattr(table, name) for table, _ in parts])[back]
    return Table(**arrays)

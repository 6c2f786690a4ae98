"""The answer to one call: every verified solution of every pose, and why a pose has none."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError, NoSolution
from kinverse.task import Task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Intervals", "Origin", "Solutions", "Stats", "Status", "Table", "TableLike"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
PER_SOLUTION = ("q", "pose_index", "position_error", "rotation_error", "branch")


class Status(IntEnum):
    """What is known of one pose; ``text`` says it in a sentence.

    Example:
        >>> Status.OUT_OF_LIMITS.text
        'solutions exist, none inside the joint limits'
    """

    SOLVED = 0
    OUT_OF_LIMITS = 1
    UNREACHABLE = 2
    NOT_FOUND = 3

    @property
    def text(self) -> str:
        """One sentence for people."""
        return _TEXTS[self]


_TEXTS = (
    "at least one verified solution",
    "solutions exist, none inside the joint limits",
    "shown that no joint values meet the tolerances, limits ignored",
    "no solution was kept and none was shown to be impossible",
)


class TableLike(Protocol):
    """What ``Solutions`` reads: the native core's table, or ``Table`` after merging."""

    @property
    def q(self) -> Array: ...  # noqa: D102
    @property
    def pose_index(self) -> Ints: ...  # noqa: D102
    @property
    def position_error(self) -> Array: ...  # noqa: D102
    @property
    def rotation_error(self) -> Array: ...  # noqa: D102
    @property
    def branch(self) -> NDArray[np.int32]: ...  # noqa: D102
    @property
    def status(self) -> NDArray[np.uint8]: ...  # noqa: D102
    @property
    def count(self) -> Ints: ...  # noqa: D102
    @property
    def singular(self) -> Bools: ...  # noqa: D102
    @property
    def evaluations(self) -> Ints: ...  # noqa: D102
    @property
    def best_q(self) -> Array: ...  # noqa: D102
    @property
    def best_position_error(self) -> Array: ...  # noqa: D102
    @property
    def best_rotation_error(self) -> Array: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Rows of M solutions and N poses; ``pose_index`` ascends. Arrays are made read-only."""

    q: Array
    pose_index: Ints
    position_error: Array
    rotation_error: Array
    branch: NDArray[np.int32]
    status: NDArray[np.uint8]
    count: Ints
    singular: Bools
    evaluations: Ints
    best_q: Array
    best_position_error: Array
    best_rotation_error: Array

    def __post_init__(self) -> None:
        for name in FIELDS:
            getattr(self, name).flags.writeable = False


FIELDS = tuple(field.name for field in fields(Table))


class Origin(NamedTuple):
    """Where solutions come from; one object shared by all results of a fitted solver."""

    robot: "Robot"
    task: Task
    branch_labels: tuple[str, ...]


class Intervals(NamedTuple):
    """Ranges of the free joint of a redundant arm: each row one interval of one branch."""

    pose_index: Ints
    branch: NDArray[np.int32]
    low: Array
    high: Array

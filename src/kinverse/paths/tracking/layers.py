"""Layers: every known solution of every sample of a path, in flat arrays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import kernels
from kinverse.errors import InputError
from kinverse.ranking import TURN, turning

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Keep", "Layers", "joined", "kept", "nearest", "short_way", "tidy", "wound"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Keep = Callable[[Array], ArrayLike]

MOST_NODES = 20_000_000
"""Solutions, windings counted, of a whole path that a predicate is asked about."""

SAME = 1e-6
"""Joint values [rad or m] that differ by less are one solution."""


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """M solutions of N samples, grouped by sample.

    Attributes:
        q: (M, n) joint values [rad or m] inside the limits.
        start: (N + 1,) the rows of sample i are ``start[i]`` .. ``start[i + 1] - 1``.
        branch: (M,) number of the branch, -1 where unknown.
        side: (M,) on which side of the singularities a row lies, as a number; -1: on any.
        status: (N,) a ``Status``.
        continuum: (N,) the sample meets a continuum, of which the rows are members.
        removed: (N,) rows that ``keep`` refused.
        fixed: (M,) the row stands for itself; else for all of its windings inside the limits.
    """

    q: Array
    start: Ints
    branch: NDArray[np.int32]
    side: NDArray[np.int32]
    status: NDArray[np.uint8]
    continuum: NDArray[np.bool_]
    removed: Ints
    fixed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def sample(self) -> Ints:
        """(M,) the sample of each row."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    def taken(self, samples: Ints) -> "Layers":
        """The layers of some samples, in that order."""
        count = np.diff(self.start)[samples]
        start = np.concatenate([[0], np.cumsum(count)])
        rows = np.arange(start[-1]) + np.repeat(self.start[samples] - start[:-1], count)
        return Layers(
            self.q[rows],
            start,
            self.branch[rows],
            self.side[rows],
            self.status[samples],
            self.continuum[samples],
            self.removed[samples],
            self.fixed[rows],
        )

    def only(self, mask: NDArray[np.bool_]) -> "Layers":
        """The rows of a mask (M,)."""
        count = np.bincount(self.sample[mask], minlength=len(self))
        return replace(
            self,
            q=self.q[mask],
            start=np.concatenate([[0], np.cumsum(count)]),
            branch=self.branch[mask],
            side=self.side[mask],
            fixed=self.fixed[mask],
        )

    def with_rows(
        self, sample: Ints, q: Array, branch: Any = -1, side: Any = -1, fixed: Any = False
    ) -> "Layers":
        """More solutions q (K, n) of samples (K,)."""
        order = np.argsort(np.concatenate([self.sample, sample]), kind="stable")
        count = np.diff(self.start) + np.bincount(sample, minlength=len(self))
        given = {"branch": branch, "side": side, "fixed": fixed}
        arrays = {}
        for name, value in given.items():
            rows = getattr(self, name)
            more = np.broadcast_to(np.asarray(value, rows.dtype), len(q))
            arrays[name] = np.concatenate([rows, more])[order]
        return replace(
            self,
            q=np.ascontiguousarray(np.concatenate([self.q, q])[order]),
            start=np.concatenate([[0], np.cumsum(count)]),
            **arrays,
        )


def joined(parts: Sequence[Layers]) -> Layers:
    """The layers of all parts, one part behind the other."""
    count = np.concatenate([np.diff(part.start) for part in parts])
    names = ("q", "branch", "side", "fixed", "status", "continuum", "removed")
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    start = np.concatenate([[0], np.cumsum(count)])
    return Layers(start=start, **arrays)


def short_way(robot: "Robot", a: Array, b: Array, fixed: Any = False) -> Array:
    """From a to b (..., n); turning joints the shorter way, but not to rows that are fixed."""
    d = b - a
    turns = turning(robot) & ~np.asarray(fixed)[..., None]
    return np.asarray(np.where(turns, d - TURN * np.rint(d / TURN), d))


def nearest(robot: "Robot", layers: Layers, q: Array) -> tuple[Ints, Array]:
    """Of each sample the row nearest to q (K, n), and how far [rad or m]; infinity without rows."""
    row, aside = np.zeros(len(q), np.int64), np.full(len(q), np.inf)
    far = np.abs(short_way(robot, q[layers.sample], layers.q)).max(axis=1, initial=0.0)
    order = np.lexsort((far, layers.sample))
    has = np.flatnonzero(np.diff(layers.start))
    row[has] = order[layers.start[has]]
    aside[has] = far[row[has]]
    return row, aside


def tidy(robot: "Robot", layers: Layers) -> Layers:
    """Without rows that are the same solution of a sample but for rounding and whole turns.

    Of rows that are fixed other windings are other solutions.
    """
    turns = turning(robot) & ~layers.fixed[:, None]
    cells = np.where(turns, np.mod(layers.q + SAME, TURN), layers.q) / (8.0 * SAME)
    keys = np.column_stack([layers.sample, np.floor(cells).astype(np.int64)])
    _, first = np.unique(keys, axis=0, return_index=True)
    mask = np.zeros(len(layers.q), np.bool_)
    mask[first] = True
    return layers.only(mask)


def kept(robot: "Robot", layers: Layers, keep: Keep | None) -> Layers:
    """The rows that a predicate keeps.

    It is asked about every winding, unless it has an attribute ``ignores_turns`` that is true.

    Raises:
        InputError: it returned another shape than (M,) or no bool, or there are too many windings.
    """
    if keep is None:
        return layers
    if not getattr(keep, "ignores_turns", False):
        layers = wound(robot, layers)
    rows = len(layers.q)
    mask = np.asarray(keep(layers.q)) if rows else np.empty(0, np.bool_)
    if mask.shape != (rows,) or mask.dtype != np.bool_:
        raise InputError(f"keep must return ({rows},) of bool, got {mask.shape} of {mask.dtype}")
    removed = np.bincount(layers.sample[~mask], minlength=len(layers))
    return replace(layers.only(mask), removed=layers.removed + removed)


def wound(robot: "Robot", layers: Layers) -> Layers:
    """A row for each winding inside the limits, of rows that are not fixed."""
    if layers.fixed.any():
        free = wound(robot, layers.only(~layers.fixed))
        held = layers.only(layers.fixed)
        return held.with_rows(free.sample, free.q, free.branch, free.side, True)
    low, high = np.ascontiguousarray(robot.limits.T)
    turns = turning(robot)
    count = kernels.winding_counts(layers.q, low, high, turns)
    if count.sum() > MOST_NODES:
        raise InputError(
            f"keep would be asked about {count.sum()} joint values, more than {MOST_NODES}: give"
            " fewer samples, narrower limits, or set keep.ignores_turns = True if whole turns do"
            " not matter to it"
        )
    q = kernels.windings(layers.q, low, high, turns, MOST_NODES)
    sample = np.repeat(layers.sample, count)
    return replace(
        layers,
        q=np.clip(q, low, high),
        start=np.concatenate([[0], np.cumsum(np.bincount(sample, minlength=len(layers)))]),
        branch=np.repeat(layers.branch, count),
        side=np.repeat(layers.side, count),
        fixed=np.ones(len(q), np.bool_),
    )

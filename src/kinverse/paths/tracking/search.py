"""The cheapest way through the layers of a path, helped over the places where layers lack rows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels
from kinverse.paths.tracking.crossings import crossings
from kinverse.paths.tracking.layers import Layers, kept, short_way, tidy
from kinverse.paths.tracking.problem import Problem
from kinverse.ranking import turning

__all__ = ["Found", "follow"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Fresh = tuple[Ints, Array, NDArray[np.int32], NDArray[np.int32], NDArray[np.bool_]]

ROUNDS = 200
"""Searches of one path; each but the last has found rows or steps that were missing."""
MOST_NEAR = 32
"""Joint values that are searched from on either side of a barrier."""
NEW = 1e-6
"""A row nearer than this to another one of its sample [rad or m] is no new one."""


class Found(NamedTuple):
    """What the native core found; see shortest_path.hpp."""

    q: Array
    row: Ints
    linked: NDArray[np.bool_]
    level: NDArray[np.int32]
    cost: float
    barrier: Ints
    reached_start: Ints
    reached_row: Ints
    reached_q: Array

    @property
    def breaks(self) -> int:
        """Number of breaks of the way that was found."""
        return int(self.level[-1])

    def reached(self, k: int) -> tuple[Ints, Array]:
        """The nodes before barrier k, which none of them can pass: rows and joint values."""
        part = slice(self.reached_start[k], self.reached_start[k + 1])
        return self.reached_row[part], self.reached_q[part]


def follow(problem: Problem, layers: Layers) -> tuple[Layers, Found]:
    """The way with fewest breaks and least cost, and the layers with what was added to them.

    Steps join rows on the same side of the singularities. Only if every way breaks, those that pass
    through a singularity with the path are allowed too; and where a search may have missed
    solutions, they are looked for on both sides of each break.
    """
    opened = np.empty((0, 2), np.int64)
    tried: set[tuple[int, bytes]] = set()
    found = shortest(problem, layers, opened)
    if not len(found.barrier):
        return layers, found
    for _ in range(ROUNDS):
        crossing = crossings(problem, layers)
        if len(crossing) > len(opened):
            opened = crossing
            found = shortest(problem, layers, opened)
        if problem.branches.is_complete:
            break
        fresh: list[Fresh] = []
        for k, f in enumerate(found.barrier.tolist()):
            _, q = found.reached(k)
            key = f, q.tobytes()
            if key not in tried:
                tried.add(key)
                fresh += _missing(problem, layers, f, q)
        if not fresh:
            break
        layers = _with_fresh(problem, layers, fresh)
        found = shortest(problem, layers, opened[:0])
    return layers, found


def shortest(problem: Problem, layers: Layers, opened: Ints) -> Found:
    """One search; ``opened`` (K, 2): rows, ascending by the second, that may be joined anyway."""
    robot, steps = problem.robot, problem.steps
    low, high = np.ascontiguousarray(robot.limits.T)
    told = kernels.shortest_path(
        np.ascontiguousarray(layers.q),
        np.ascontiguousarray(layers.start, np.int64),
        layers.fixed,
        np.ascontiguousarray(layers.side, np.int32),
        low,
        high,
        turning(robot),
        steps.max_step,
        steps.weight,
        steps.squares,
        steps.q_start,
        *np.ascontiguousarray(opened.T),
    )
    # windings are exact but for rounding, which may lead out of the limits
    return Found(**(told | {"q": np.clip(told["q"], low, high)}))


def _missing(problem: Problem, layers: Layers, f: int, q: Array) -> list[Fresh]:
    """Solutions that a search has missed: near joint values on the other side of a barrier."""
    fresh = []
    ends = layers.q[layers.start[f + 1] : layers.start[f + 2]]
    for k, near in ((f + 1, q), (f, ends)):
        near = near[:MOST_NEAR]
        if not len(near):
            continue
        found = problem.branches.near(np.repeat(problem.samples.T[k : k + 1], len(near), 0), near)
        moved = short_way(problem.robot, near[found.sample], found.q)
        mask = (np.abs(moved) <= problem.steps.max_step).all(axis=1)
        old = layers.q[layers.start[k] : layers.start[k + 1]]
        apart = short_way(problem.robot, old[None], found.q[:, None])
        mask &= np.all(np.any(np.abs(apart) > NEW, axis=2), axis=1)
        if mask.any():
            sample = np.full(int(mask.sum()), k)
            rows = found.only(mask)
            fresh.append((sample, rows.q, rows.branch, rows.side, rows.fixed))
    return fresh


def _with_fresh(problem: Problem, layers: Layers, fresh: list[Fresh]) -> Layers:
    none = layers.only(np.zeros(len(layers.q), np.bool_))
    arrays = (np.concatenate(part) for part in zip(*fresh, strict=True))
    added = tidy(problem.robot, none.with_rows(*arrays))
    added = kept(problem.robot, added, problem.keep)
    return layers.with_rows(added.sample, added.q, added.branch, added.side, added.fixed)

"""The cheapest way through the layers of a path, helped over the places where layers lack rows."""

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels, se3
from kinverse.paths.tracking.branches import Branches
from kinverse.paths.tracking.continuum import with_members
from kinverse.paths.tracking.layers import Keep, Layers, kept, short_way, tidy
from kinverse.paths.tracking.samples import Samples
from kinverse.ranking import TURN, turning

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Found", "Problem", "Steps", "follow"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Fresh = tuple[Ints, Array, NDArray[np.int32], NDArray[np.int32], NDArray[np.bool_]]

ROUNDS = 200
"""Searches of one path; each but the last has found rows or steps that were missing."""
STRAYS = 0.1
"""A step that changes sides is one along the path if half-way the tool is not further from it than
this part of the distance between the two poses."""
LEAST_STRAY = 1e-7
"""That distance [m] does not matter."""
MOST_PAIRS = 1_000_000
"""Pairs of rows that are looked at together."""
MOST_NEAR = 32
"""Joint values that are searched from on either side of a barrier."""
NEW = 1e-6
"""A row nearer than this to another one of its sample [rad or m] is no new one."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """What a step costs and how large it may be.

    Attributes:
        max_step: (n,) largest step of each joint [rad or m].
        weight: (n,) factors of the joint steps in the cost.
        squares: the cost is the root of the sum of squares; else the largest.
        q_start: (n,) joint values before the path, or None.
    """

    max_step: Array
    weight: Array
    squares: bool = False
    q_start: Array | None = None


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


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A path for a robot: what it is solved with, and the rules of its steps."""

    branches: Branches
    samples: Samples
    steps: Steps
    keep: Keep | None = None

    @property
    def robot(self) -> "Robot":
        """The robot, whose limits hold."""
        return self.branches.robot

    def layers(self) -> Layers:
        """The solutions of all samples."""
        layers = self.branches.layers(self.samples.T)
        layers = with_members(self.branches, self.samples, layers, self.steps.max_step)
        return self._with_between(kept(self.robot, layers, self.keep))

    def _with_between(self, layers: Layers) -> Layers:
        """Where ``keep`` refuses all that a grid holds, what is between its values is tried too."""
        for level in itertools.count():
            lost = np.flatnonzero((np.diff(layers.start) == 0) & (layers.removed > 0))
            more = self.branches.between(self.samples.T[lost], level) if len(lost) else None
            if more is None:
                break
            more = kept(self.robot, more, self.keep)
            layers.removed[lost] += more.removed
            at = lost[more.sample]
            layers = layers.with_rows(at, more.q, more.branch, more.side, more.fixed)
        return layers


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


def crossings(problem: Problem, layers: Layers) -> Ints:
    """Steps (K, 2) between rows that change sides where the path passes a singularity."""
    found = []
    count = np.diff(layers.start)
    pairs = count[:-1] * count[1:]
    part = np.cumsum(pairs) // MOST_PAIRS
    for k in np.unique(part):
        of = np.flatnonzero((part == k) & (pairs > 0))
        if len(of):
            found.append(_crossings(problem, layers, of, pairs[of]))
    if not found:
        return np.empty((0, 2), np.int64)
    every = np.concatenate(found)
    return every[np.lexsort(every.T)]


def _crossings(problem: Problem, layers: Layers, of: Ints, pairs: Ints) -> Ints:
    sample = np.repeat(of, pairs)
    within = np.arange(pairs.sum()) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    rows = np.diff(layers.start)[sample + 1]
    a = layers.start[sample] + within // rows
    b = layers.start[sample + 1] + within % rows
    mask = (layers.side[a] != layers.side[b]) & (layers.side[a] >= 0) & (layers.side[b] >= 0)
    sample, a, b = sample[mask], a[mask], b[mask]
    for j, turns in enumerate(turning(problem.robot)):
        d = layers.q[b, j] - layers.q[a, j]
        if turns:
            d -= TURN * np.rint(d / TURN)
        near = np.abs(d) <= problem.steps.max_step[j]
        sample, a, b = sample[near], a[near], b[near]
    if not len(a):
        return np.empty((0, 2), np.int64)
    reached = problem.branches.fk(
        layers.q[a] + 0.5 * short_way(problem.robot, layers.q[a], layers.q[b])
    )
    half = problem.samples.at(sample, np.full(len(sample), 0.5))
    size = _size(problem.robot)
    moved = _apart(problem.samples.T[sample], problem.samples.T[sample + 1], size)
    good = _apart(reached, half, size) <= np.maximum(STRAYS * moved, LEAST_STRAY)
    return np.column_stack([a[good], b[good]])


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


def _apart(a: Array, b: Array, size: float) -> Array:
    """Distance of poses (K, 4, 4): positions, and angles times the arm's size [m]."""
    turn = se3.rotation_log(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3])
    away = np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    return np.asarray(away + size * np.linalg.norm(turn, axis=1))


def _size(robot: "Robot") -> float:
    """Rotations are weighed by a tenth of the arm's length."""
    return 0.1 * float(np.linalg.norm(robot.frames[1:, :3, 3], axis=1).sum())

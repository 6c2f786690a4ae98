"""Steps that go over to another branch, where the path itself leads through a singularity."""

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.paths.tracking.layers import Layers, nearest, short_way
from kinverse.paths.tracking.problem import Problem
from kinverse.paths.tracking.samples import Samples
from kinverse.ranking import TURN, turning
from kinverse.robot import Robot

__all__ = ["crossings"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

STRAYS = 0.1
"""Steps are looked at if half-way the tool is not further from the path than this part of the
distance between the two poses."""
LEAST_STRAY = 1e-7
"""That distance [m] does not matter."""
HALVINGS = 13
"""The place where a step changes sides is narrowed down to a part in 8,000 of it."""
ASIDE = 0.25
"""Half-way through a piece joint values may lie aside from the middle of its ends by this part of
its largest joint movement. A path that misses the singularity leads them far aside there."""
MOST_PAIRS = 1_000_000
"""Pairs of rows that are looked at together."""


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
    sample, a, b = _near(problem, layers, of, pairs)
    if not len(a):
        return np.empty((0, 2), np.int64)
    robot, samples = problem.robot, problem.samples
    step = short_way(robot, layers.q[a], layers.q[b])
    half = samples.at(sample, np.full(len(sample), 0.5))
    size = _size(robot)
    away = _apart(problem.branches.fk(layers.q[a] + 0.5 * step), half, size)
    moved = _apart(samples.T[sample], samples.T[sample + 1], size)
    near = away <= STRAYS * moved
    good = near & (away <= _unknown(samples, size)[sample])
    good |= away <= max(problem.tolerance, LEAST_STRAY)
    asked = np.flatnonzero(near & ~good)
    if len(asked):
        good[asked] = _leads_over(problem, layers, sample[asked], a[asked], b[asked])
    return np.column_stack([a[good], b[good]])


def _near(problem: Problem, layers: Layers, of: Ints, pairs: Ints) -> tuple[Ints, Ints, Ints]:
    """Samples (K,), rows there and rows at the next one: within a step, on different sides."""
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
    return sample, a, b


def _leads_over(
    problem: Problem, layers: Layers, sample: Ints, a: Ints, b: Ints
) -> NDArray[np.bool_]:
    """Which steps (K,) the path itself leads over, the change of sides halved in again and again.

    Half-way there must be a solution in the middle of the step. It tells in which half the sides
    change; a solution on neither side is at the singularity, which is then met.
    """
    robot = problem.robot
    q, to, side = layers.q[a], layers.q[b], layers.side[a]
    first, last = np.zeros(len(a)), np.ones(len(a))
    leads = np.ones(len(a), np.bool_)
    live = np.arange(len(a))
    for _ in range(HALVINGS):
        step = short_way(robot, q[live], to[live])
        middle = q[live] + 0.5 * step
        place = 0.5 * (first[live] + last[live])
        inner = problem.branches.near(problem.samples.at(sample[live], place), middle)
        row, aside = nearest(robot, inner, middle)
        met = aside <= ASIDE * np.abs(step).max(axis=1)
        leads[live[~met]] = False
        onward = np.flatnonzero(met)
        onward = onward[inner.side[row[onward]] >= 0]
        before = inner.side[row[onward]] == side[live[onward]]
        for part, ends, places in ((before, q, first), (~before, to, last)):
            ends[live[onward[part]]] = inner.q[row[onward[part]]]
            places[live[onward[part]]] = place[onward[part]]
        live = live[onward]
        if not len(live):
            break
    return leads


def _unknown(samples: Samples, size: float) -> Array:
    """(N - 1,) how far the way between two samples may be from where it is taken to be.

    Nothing for a path; between poses twice the height of the arc over their chord, which the
    poses before and behind them tell. At a corner, those on its other side.
    """
    T = samples.T
    if samples.path is not None or len(T) < 3:
        return np.zeros(len(T) - 1)
    chords = Samples(np.stack([T[:-2], T[2:]], axis=1).reshape(-1, 4, 4))
    every = 2 * np.arange(len(T) - 2)
    # over a chord of two steps the arc is four times as high
    height = _apart(chords.at(every, np.full(len(every), 0.5)), T[1:-1], size) / 4.0
    ends = np.concatenate([height[:1], height, height[-1:]])
    return np.asarray(2.0 * np.minimum(ends[:-1], ends[1:]))


def _apart(a: Array, b: Array, size: float) -> Array:
    """Distance of poses (K, 4, 4): positions, and angles times the arm's size [m]."""
    turn = se3.rotation_log(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3])
    away = np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    return np.asarray(away + size * np.linalg.norm(turn, axis=1))


def _size(robot: Robot) -> float:
    """Rotations are weighed by a tenth of the arm's length."""
    return 0.1 * float(np.linalg.norm(robot.frames[1:, :3, 3], axis=1).sum())

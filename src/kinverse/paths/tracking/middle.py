"""Whole turns of a way: of those that cost the same, the nearest to the middle of the limits."""

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.layers import Layers
from kinverse.paths.tracking.problem import Problem
from kinverse.paths.tracking.search import Found
from kinverse.ranking import TURN, turning
from kinverse.robot import LIMIT_SLACK, Robot

__all__ = ["nearest_middle"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SAME = 1e-9
"""Rows that stand for themselves and differ by less [rad or m] are one."""


def nearest_middle(problem: Problem, layers: Layers, found: Found) -> Found:
    """The same way, each run turned so that it begins nearest the middle of the limits.

    Turning joints of a whole run by whole turns changes no step, so no cost. A run stays where the
    limits leave no other turns, and where rows that stand for themselves (of a predicate, of a real
    tool) have no such twins. With ``q_start`` the way begins where the arm is.
    """
    if problem.steps.q_start is not None:
        return found
    live = found.row >= 0
    starts = np.flatnonzero(live & ~found.linked)
    ends = np.flatnonzero(live & ~np.append(found.linked[1:], False)) + 1
    q, row = found.q.copy(), found.row.copy()
    low, high = problem.robot.limits.T
    for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
        shift = _shift(problem.robot, q[a:b])
        if not shift.any():
            continue
        turned = np.clip(q[a:b] + shift, low, high)
        twins = _twins(layers, np.arange(a, b), row[a:b], turned)
        if (twins >= 0).all():
            q[a:b], row[a:b] = turned, twins
    return found._replace(q=q, row=row)


def _shift(robot: Robot, q: Array) -> Array:
    """(n,) whole turns [rad] after which a run (K, n) begins nearest the middle, within limits."""
    low, high = robot.limits.T
    wanted = np.rint((0.5 * (low + high) - q[0]) / TURN)
    least = np.ceil((low - LIMIT_SLACK - q.min(axis=0)) / TURN)
    most = np.floor((high + LIMIT_SLACK - q.max(axis=0)) / TURN)
    turns = np.minimum(np.maximum(wanted, least), most)
    return np.where(turning(robot), TURN * turns, 0.0)


def _twins(layers: Layers, samples: Ints, row: Ints, q: Array) -> Ints:
    """The rows (K,) that have joint values q (K, n) at K samples in a row: these rows, or -1."""
    if not layers.fixed[row].any():
        return row
    rows = np.arange(layers.start[samples[0]], layers.start[samples[-1] + 1])
    at = np.repeat(np.arange(len(q)), np.diff(layers.start)[samples])
    same = np.flatnonzero(np.abs(layers.q[rows] - q[at]).max(axis=1) <= SAME)
    twins = np.where(layers.fixed[row], -1, row)
    twins[at[same]] = np.where(layers.fixed[row[at[same]]], rows[same], row[at[same]])
    return np.asarray(twins)

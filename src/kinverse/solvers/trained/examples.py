"""Training examples of a robot in which a pose has one answer: by branch, or by a rule."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.learning import passing, sample
from kinverse.robot import Robot
from kinverse.solvers._base import Settings
from kinverse.solvers.numerical import Numerical
from kinverse.solvers.trained.branch_labels import BranchLabels

__all__ = ["Examples", "by_branch", "nearest_middle", "unchanged"]

Array = NDArray[np.float64]

MOST_DRAWN = 20
"""Poses drawn in search of examples of a rare branch, in those asked for."""
LEAST = 100
"""A branch with fewer examples after that has no network: it hardly lies inside the limits."""
TRIES = 6
"""Solutions of a pose that ``nearest_middle`` chooses from."""


class Examples(NamedTuple):
    """Joint values and the poses they reach."""

    q: Array  # (K, n)
    T: Array  # (K, 4, 4)


def by_branch(
    robot: Robot, labels: BranchLabels, n_samples: int, rng: np.random.Generator, keep: Any
) -> dict[int, Examples]:
    """For each branch up to ``n_samples`` examples: every solution of poses drawn at random."""
    parts: dict[int, list[Examples]] = {k: [] for k in range(len(labels.names))}
    counts = np.zeros(len(parts), np.int64)
    for _ in range(MOST_DRAWN):
        T = sample(robot, n_samples, random_state=rng, keep=keep).T
        answers = labels.solver.solve(T)
        good = passing(answers.q, keep)
        for k, rows in parts.items():
            chosen = np.flatnonzero((answers.branch == k) & good)[: n_samples - counts[k]]
            rows.append(Examples(answers.q[chosen], T[answers.pose_index[chosen]]))
            counts[k] += len(chosen)
        if (counts[counts > 0] >= n_samples).all():
            break
    joined = {k: Examples(*map(np.concatenate, zip(*v, strict=True))) for k, v in parts.items()}
    least = min(LEAST, n_samples)
    return {k: examples for k, examples in joined.items() if len(examples.q) >= least}


def nearest_middle(
    robot: Robot, settings: Settings, n_samples: int, rng: np.random.Generator, keep: Any
) -> Examples:
    """Examples in which a pose has the joint values nearest the middle of the limits.

    Of ``TRIES`` numerical solutions and the configuration drawn, the one whose joints stay nearest
    the middle, each counted in half its range: one map that is smooth nearly everywhere.
    """
    drawn = sample(robot, n_samples, random_state=rng, keep=keep)
    middle, half = robot.limits.mean(axis=1), 0.5 * np.ptp(robot.limits, axis=1)
    half = np.where(half > 0.0, half, 1.0)
    solver = Numerical(task=settings.task).fit(robot)
    q = drawn.q.copy()
    cost = (((q - middle) / half) ** 2).sum(axis=1)
    for k in range(TRIES):
        start = np.tile(middle, (n_samples, 1)) if k == 0 else robot.random(n_samples, rng)
        answers = solver.solve(drawn.T, q_seed=start, rng=rng)
        value = (((answers.q - middle) / half) ** 2).sum(axis=1)
        better = (value < cost[answers.pose_index]) & passing(answers.q, keep)
        rows = answers.pose_index[better]
        q[rows], cost[rows] = answers.q[better], value[better]
    return Examples(q, drawn.T)


def unchanged(robot: Robot, n_samples: int, rng: np.random.Generator, keep: Any) -> Examples:
    """Examples as they are drawn: what completes the task space makes their answers unique."""
    drawn = sample(robot, n_samples, random_state=rng, keep=keep)
    return Examples(drawn.q, drawn.T)

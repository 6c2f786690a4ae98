"""Solutions that a search finds at some samples of a path, followed from there."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.layers import Layers, tidy
from kinverse.solvers import Solver
from kinverse.solvers.numerical import Numerical
from kinverse.task import as_task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["SearchedBranches", "follower", "sides"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SEEDS = 24
"""Starts of a search for the solutions of a sample."""
ANCHORS = 12
"""Samples along a path whose solutions are searched for, and followed to both sides."""
FOLLOWED = 8
"""Samples that are followed at once at first."""
FOLLOW_STARTS = 4
"""Starts at each of them: what ends would cost as much as thousands of samples with all starts."""
MOST_FOLLOWED = 500_000
"""Joint values that are followed through all samples together, of arms with joints to spare, whose
solutions are as many as the starts..."""
LEAST_MEMBERS = 24
"""...but so many solutions are followed, however long the path."""
FLAT = 1e-9
"""A determinant below this part of the product of its columns' lengths has no sign."""


class SearchedBranches:
    """Whatever a search finds at some samples, followed along the path from there."""

    is_complete = False
    is_exhaustive = False

    def __init__(self, solver: Solver) -> None:
        self.solver = solver
        self.robot = solver.robot_
        self.task = solver.settings_.task
        self.branch_labels: tuple[str, ...] = ()
        self.follower = follower(solver)
        self._runner = follower(solver).set_params(max_starts=FOLLOW_STARTS).fit(self.robot)

    def fk(self, q: Array) -> Array:
        """Forward kinematics."""
        return self.robot.fk(q)

    def layers(self, T: Array) -> Layers:
        """What starts all over the limits lead to at some samples, followed to both ends."""
        anchors = np.unique(np.linspace(0, len(T) - 1, min(ANCHORS, len(T))).round().astype(int))
        low, high = self.robot.limits.T
        starts = low + _low_discrepancy(SEEDS, self.robot.dof) * (high - low)
        found = [self.solver.solve(T[anchors], q_seed=start) for start in starts]
        first = tidy(
            self.robot,
            _layers(
                len(T),
                np.concatenate([anchors[s.pose_index] for s in found]),
                np.concatenate([s.q for s in found]),
            ),
        )
        sample, q = [first.sample], [first.q]
        for row in self._members(first):
            anchor, start = first.sample[row], first.q[row]
            for where in (np.arange(anchor + 1, len(T)), np.arange(anchor - 1, -1, -1)):
                rows = self._followed(T[where], start)
                sample.append(where[: len(rows)])
                q.append(rows)
        layers = _layers(len(T), np.concatenate(sample), np.concatenate(q))
        empty = np.flatnonzero(np.diff(layers.start) == 0)
        if len(empty):
            rest = self.solver.solve(T[empty])
            layers.status[empty] = rest.status
            layers = layers.with_rows(empty[rest.pose_index], rest.q)
        layers = tidy(self.robot, layers)
        layers.side[:] = sides(self.robot, self.task, layers.q)
        return layers

    def _members(self, layers: Layers) -> Ints:
        """Rows to follow: all, but some of many where solutions are no points."""
        count = len(layers.q)
        most = max(MOST_FOLLOWED // len(layers), LEAST_MEMBERS)
        if as_task(self.task).size >= self.robot.dof or count <= most:
            return np.arange(count)
        return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))

    def _followed(self, T: Array, start: Array) -> Array:
        """Joint values (K, n) that start leads to, up to the first pose that is missed."""
        rows = [np.empty((0, len(start)))]
        first, count = 0, FOLLOWED
        while first < len(T):
            found = self._runner.follow(T[first : first + count], start)
            missed = np.flatnonzero(~found.ok)
            # one solution a pose, so those before the first miss are the first rows
            rows.append(found.q[: missed[0]] if len(missed) else found.q)
            if len(missed):
                break
            start, first, count = found.q[-1], first + count, 2 * count
        return np.concatenate(rows)

    def near(self, T: Array, q: Array) -> Layers:
        """What the nearest joint values lead to."""
        found = self.follower.solve(T, np.where(np.isnan(q), self.robot.limits.mean(axis=1), q))
        layers = _layers(len(T), found.pose_index, found.q)
        layers.status[:] = found.status
        layers.side[:] = sides(self.robot, self.task, layers.q)
        return layers

    def finer(self, T: Array, q: Array, level: int) -> Layers | None:
        """The search ends where it ends."""
        return None

    def between(self, T: Array, level: int) -> Layers | None:
        """There is no grid."""
        return None

    def on(self, robot: "Robot") -> "SearchedBranches":
        """The same for another robot; for one without its limits nothing is trained again."""
        search = self.follower if self.solver._trains else self.solver
        return SearchedBranches(search.clone().fit(robot))


def follower(solver: Solver) -> Numerical:
    """What goes on from one solution of a solver to those near it."""
    settings = solver.settings_
    return Numerical(
        task=settings.task,
        tol_position=settings.tol_position,
        tol_rotation=settings.tol_rotation,
    ).fit(solver.robot_)


def sides(robot: "Robot", task: str, q: Array) -> NDArray[np.int32]:
    """The sign of the Jacobian's determinant, 0 or 1; -1 where it vanishes or is not square.

    No continuous motion changes it without meeting a singularity.
    """
    kind = as_task(task)
    if kind.size != robot.dof or not len(q):
        return np.full(len(q), -1, np.int32)
    J = kind.constrained(robot.jacobian(q), robot.fk(q))
    size = np.linalg.norm(J, axis=1)
    det = np.linalg.det(J / np.maximum(size, 1e-300)[:, None, :])
    return np.where(np.abs(det) < FLAT, -1, (det > 0.0).astype(int)).astype(np.int32)


def _layers(samples: int, sample: Ints, q: Array) -> Layers:
    """Solutions without branches in any order; a sample without any is NOT_FOUND."""
    order = np.argsort(sample, kind="stable")
    count = np.bincount(sample, minlength=samples)
    unknown = np.full(len(q), -1, np.int32)
    return Layers(
        np.ascontiguousarray(q[order]),
        np.concatenate([[0], np.cumsum(count)]),
        unknown,
        unknown.copy(),
        np.where(count > 0, np.uint8(0), np.uint8(3)),
        np.zeros(samples, np.bool_),
        np.zeros(samples, np.int64),
        np.zeros(len(q), np.bool_),
    )


def _low_discrepancy(count: int, dimensions: int) -> Array:
    """Points (count, dimensions) spread evenly over the unit cube: the R_n sequence (Roberts)."""
    root = 1.5
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1.0)
    return np.asarray(np.mod(0.5 + np.arange(1, count + 1)[:, None] * steps, 1.0))

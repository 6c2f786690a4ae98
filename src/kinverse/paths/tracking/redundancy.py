"""Arms with seven joints: a grid over their free parameter, made finer about a path."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.layers import Layers
from kinverse.solvers.analytic import Analytic

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["RedundantBranches"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

GRID = 64
"""Values of the free parameter at each sample of a short path."""
LEAST_GRID = 16
"""The same of a long path."""
MOST_SOLVED = 400_000
"""Values at all samples together above which the grid becomes coarser."""
ABOUT = np.array([-1.0, -0.5, 0.5, 1.0])
"""Values about those of a path, in steps of the level before."""
LEVELS = 6
"""Times the step is halved."""
BETWEEN_LEVELS = 3
"""Times the grid is halved where nothing of it may be used: to 512 values on a short path."""
MOST_BETWEEN = 20_000
"""Values at all samples together that one such halving may take."""


class RedundantBranches:
    """Every branch at values of the free parameter; its grid is the coarsest level."""

    # a grid misses what lies between its values, but the samples beside it have them as well
    is_complete = True
    is_exhaustive = False

    def __init__(self, solver: Analytic) -> None:
        self.solver = solver
        self.robot: Robot = solver.robot_
        self.task = "pose"
        form = solver.redundant_form_
        assert form is not None
        self.branch_labels = solver.branch_labels_ if form.lasting else ()
        self.has_lasting_branches = form.lasting
        self.is_round = isinstance(solver.redundancy_, str)
        if self.is_round:
            self.low, self.high = -np.pi, np.pi
        else:
            self.low, self.high = self.robot.limits[int(solver.redundancy_ or 0)]
        self.step = (self.high - self.low) / GRID

    def fk(self, q: Array) -> Array:
        """Forward kinematics."""
        return self.robot.fk(q)

    def layers(self, T: Array) -> Layers:
        """The solutions at all values of the grid; where there is none, what a sweep finds."""
        count = int(np.clip(MOST_SOLVED // max(len(T), 1), LEAST_GRID, GRID))
        self.step = (self.high - self.low) / count
        values = np.linspace(self.low, self.high, count, endpoint=not self.is_round)
        layers = self._at(T, np.tile(values, (len(T), 1)))
        empty = np.flatnonzero(np.diff(layers.start) == 0)
        if not len(empty):
            return layers
        swept = self.solver.solve(T[empty])
        layers.status[empty] = swept.status
        branch = swept.branch if self.has_lasting_branches else np.int32(-1)
        return layers.with_rows(empty[swept.pose_index], swept.q, branch, branch)

    def near(self, T: Array, q: Array) -> Layers:
        """The solutions about the values at q; all of them where q is not a number."""
        known = ~np.isnan(q).any(axis=1)
        layers = self.finer(T, q, LEVELS - 1)
        assert layers is not None
        if not known.all():
            rest, at = self.layers(T[~known]), np.flatnonzero(~known)
            layers = layers.with_rows(at[rest.sample], rest.q, rest.branch, rest.side)
            layers.status[at] = rest.status
        return layers

    def finer(self, T: Array, q: Array, level: int) -> Layers | None:
        """The solutions at values about those at q, closer at each level; None after the last."""
        if level >= LEVELS:
            return None
        known = np.flatnonzero(~np.isnan(q).any(axis=1))
        values = np.full((len(T), len(ABOUT) + 1), np.nan)
        about = np.append(ABOUT, 0.0) * self.step * 0.5**level
        values[known] = self.solver.redundancy_at(q[known])[:, None] + about
        if not self.is_round:
            values = np.clip(values, self.low, self.high)
        return self._at(T, values)

    def between(self, T: Array, level: int) -> Layers | None:
        """The solutions half-way between the values of the grid, halved ``level`` times before."""
        count = round((self.high - self.low) / self.step) * 2**level
        if level >= BETWEEN_LEVELS or count * len(T) > MOST_BETWEEN:
            return None
        values = self.low + (self.high - self.low) * (np.arange(count) + 0.5) / count
        return self._at(T, np.tile(values, (len(T), 1)))

    def on(self, robot: "Robot") -> "RedundantBranches":
        """The same for another robot."""
        return RedundantBranches(self.solver.clone().fit(robot))

    def _at(self, T: Array, values: Array) -> Layers:
        """The solutions at values (N, K) of the free parameter, NaN for none."""
        sample, which = np.nonzero(~np.isnan(values))
        found = self.solver.solve_at(np.ascontiguousarray(T[sample]), values[sample, which])
        count = np.bincount(sample[found.pose_index], minlength=len(T))
        branch = found.branch if self.has_lasting_branches else np.full(len(found.q), -1, np.int32)
        continuum = np.zeros(len(T), np.bool_)
        side = np.where(found.stats.continuum[found.pose_index], np.int32(-1), branch)
        return Layers(
            np.ascontiguousarray(found.q),
            np.concatenate([[0], np.cumsum(count)]),
            branch,
            side,
            np.where(count > 0, np.uint8(0), np.uint8(3)),
            continuum,
            np.zeros(len(T), np.int64),
            np.zeros(len(found.q), np.bool_),
        )

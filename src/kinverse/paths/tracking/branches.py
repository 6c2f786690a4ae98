"""Where the solutions of a path's samples come from: closed forms, a grid of them, or searches."""

from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError, NoClosedForm
from kinverse.paths.tracking.layers import Layers
from kinverse.paths.tracking.measured import MeasuredBranches, is_measured
from kinverse.paths.tracking.redundancy import RedundantBranches
from kinverse.paths.tracking.searched import SearchedBranches, follower, sides
from kinverse.solvers import Solver, make_solver
from kinverse.solvers.analytic import Analytic
from kinverse.solvers.closed_form.families import Family
from kinverse.solvers.numerical import Numerical
from kinverse.status import Status

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Branches", "branches_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

NEAR_LIMIT = 1e-2
"""How far beyond a limit [rad or m] a solution may lie for joint values on it to be tried."""


class Branches(Protocol):
    """What a path's samples are solved with."""

    robot: "Robot"
    task: str
    branch_labels: tuple[str, ...]
    is_complete: bool
    """Nothing is missed, but for the members of a continuum."""
    is_exhaustive: bool
    """Of a sample that is not singular every solution is looked at."""

    def fk(self, q: Array) -> Array:
        """Poses (K, 4, 4) of the tool at joint values (K, n), as the solutions are verified."""

    def layers(self, T: Array) -> Layers:
        """The solutions of poses (N, 4, 4)."""

    def near(self, T: Array, q: Array) -> Layers:
        """The solutions of poses (N, 4, 4), at least those near joint values q (N, n)."""

    def finer(self, T: Array, q: Array, level: int) -> Layers | None:
        """More of a continuum about q (N, n), closer at each level; None where that is all."""

    def between(self, T: Array, level: int) -> Layers | None:
        """Solutions between those of ``layers``, closer at each level; None where that is all."""

    def on(self, robot: "Robot") -> "Branches":
        """The same for another robot."""


def branches_of(robot: "Robot", solver: str | Solver, task: str) -> Branches:
    """What solves a robot's paths: every branch in closed form if it can be.

    Raises:
        InputError: an unknown solver or task.
        NoClosedForm: "analytic" knows no family for this robot.
    """
    if isinstance(solver, str):
        if solver == "auto":
            try:
                return _closed(Analytic(task=task).fit(robot))
            except NoClosedForm:
                return SearchedBranches(Numerical(task=task).fit(robot))
        return _chosen(make_solver(solver, robot, task), robot)
    if not isinstance(solver, Solver):
        raise InputError(f"solver must be a name or a solver object, got {solver!r}")
    if solver._trains and solver.is_fitted:
        ready = solver._ready(robot)
        if ready.settings_.limits != "hold":
            raise InputError("track holds the limits: train the solver with limits='hold'")
        return SearchedBranches(ready)
    return _chosen(solver.clone(), robot)


def _chosen(solver: Solver, robot: "Robot") -> Branches:
    # windings are chosen along the path, and limits are held
    common = {"windings": "nearest", "limits": "hold"}
    solver.set_params(**{k: v for k, v in common.items() if k in solver.get_params()})
    if is_measured(solver):
        inner = solver.get_params()["solver"].clone()
        inner.set_params(**{k: v for k, v in common.items() if k in inner.get_params()})
        solver.set_params(solver=inner)
        solver.fit(robot)
        return MeasuredBranches(solver, _chosen(inner, robot))
    solver.fit(robot)
    return _closed(solver) if isinstance(solver, Analytic) else SearchedBranches(solver)


def _closed(solver: Analytic) -> Branches:
    if solver.redundancy_ is not None:
        return RedundantBranches(solver)
    return ClosedBranches(solver)


class ClosedBranches:
    """Every branch of arms without a joint to spare."""

    def __init__(self, solver: Analytic) -> None:
        self.solver = solver
        self.robot = solver.robot_
        self.task = solver.settings_.task
        self.branch_labels = solver.branch_labels_
        is_general = solver.parallel_arm_ is None and solver.spec_.family is Family.GENERAL_6R
        self.is_complete = self.is_exhaustive = not is_general
        self.has_lasting_branches = not is_general
        self.follower = follower(solver)

    def fk(self, q: Array) -> Array:
        """Forward kinematics."""
        return self.robot.fk(q)

    def layers(self, T: Array) -> Layers:
        """The solutions of poses (N, 4, 4)."""
        found = self.solver.solve(T)
        side = found.branch if self.has_lasting_branches else sides(self.robot, self.task, found.q)
        continuum = found.stats.continuum
        if continuum.any():
            side = np.where(continuum[found.pose_index], np.int32(-1), side)
        layers = Layers(
            found.q,
            np.concatenate([[0], np.cumsum(found.count)]),
            found.branch if self.has_lasting_branches else np.full(len(found.q), -1, np.int32),
            side,
            found.status.copy(),
            continuum,
            np.zeros(len(T), np.int64),
            np.zeros(len(found.q), np.bool_),
        )
        return self._with_near_misses(T, layers)

    def _with_near_misses(self, T: Array, layers: Layers) -> Layers:
        """Where nothing is exact: joint values at a limit that reach the pose to the tolerances."""
        open_ = np.flatnonzero(layers.status == Status.NOT_FOUND)
        if not len(open_):
            return layers
        beyond = self._free.solve(T[open_])
        low, high = self.robot.limits.T
        at_limit = np.clip(beyond.q, low, high)
        near = np.flatnonzero(np.abs(at_limit - beyond.q).max(axis=1, initial=0.0) < NEAR_LIMIT)
        sample, start = open_[beyond.pose_index[near]], at_limit[near]
        found = self.follower.solve(T[sample], start)
        rows = found.pose_index
        same = np.abs(found.q - start[rows]).max(axis=1, initial=0.0) < NEAR_LIMIT
        rows, q = rows[same], found.q[same]
        branch = beyond.branch[near][rows] if self.has_lasting_branches else np.int32(-1)
        layers.status[sample[rows]] = Status.SOLVED
        return layers.with_rows(sample[rows], q, branch, branch)

    @cached_property
    def _free(self) -> Analytic:
        solver: Analytic = self.solver.clone()
        return solver.set_params(limits="ignore").fit(self.robot)

    def near(self, T: Array, q: Array) -> Layers:
        """All of them, of a continuum those nearest q too; and what a search adds to roots."""
        layers = self.layers(T)
        if not self.is_complete:
            known = np.flatnonzero(~np.isnan(q).any(axis=1))
            searched = self.follower.solve(T[known], q[known])
            at = known[searched.pose_index]
            side = sides(self.robot, self.task, searched.q)
            layers = layers.with_rows(at, searched.q, -1, side)
        at = np.flatnonzero(layers.continuum & ~np.isnan(q).any(axis=1))
        if not len(at):
            return layers
        found = self.solver.solve(T[at], q[at])
        return layers.with_rows(at[found.pose_index], found.q, found.branch)

    def finer(self, T: Array, q: Array, level: int) -> Layers | None:
        """Nothing is between the branches."""
        return None

    def between(self, T: Array, level: int) -> Layers | None:
        """There is no grid."""
        return None

    def on(self, robot: "Robot") -> "ClosedBranches":
        """The same for another robot."""
        return ClosedBranches(self.solver.clone().fit(robot))

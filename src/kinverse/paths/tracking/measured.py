"""Arms whose tool is not where their forward kinematics say: nominal solutions, each corrected."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.layers import Layers, wound
from kinverse.solvers import Solver
from kinverse.solvers.numerical import Numerical

if TYPE_CHECKING:
    from kinverse.paths.tracking.branches import Branches
    from kinverse.robot import Robot

__all__ = ["MeasuredBranches", "is_measured"]

Array = NDArray[np.float64]


def is_measured(solver: Solver) -> bool:
    """Whether a solver verifies by another tool than the robot's, as ``Compensated`` does."""
    return hasattr(solver, "real_fk")


class MeasuredBranches:
    """The solutions of a ``Compensated``: those of its inner solver, corrected one by one.

    Every winding is corrected for itself, since errors need not repeat with the turns of a joint.
    Branches and sides are those of the nominal solutions.

    Args:
        solver: the fitted solver; its ``solver`` answers for the nominal arm.
        nominal: what gives the nominal arm's solutions.
    """

    def __init__(self, solver: Any, nominal: "Branches") -> None:
        self.solver = solver
        self.nominal = nominal
        self.robot: Robot = solver.robot_
        self.task: str = solver.settings_.task
        self.branch_labels = nominal.branch_labels
        self.is_complete = nominal.is_complete
        self.is_exhaustive = nominal.is_exhaustive
        settings = solver.settings_
        # from a nominal solution this inner solver answers with that solution, not with all others
        inner = Numerical(
            task=settings.task,
            tol_position=settings.tol_position,
            tol_rotation=settings.tol_rotation,
            max_starts=1,
        )
        self.correct: Solver = solver.clone().set_params(solver=inner).fit(self.robot)

    @property
    def step(self) -> float:
        """Of the nominal grid of a free parameter; 0 without one."""
        return float(getattr(self.nominal, "step", 0.0))

    def fk(self, q: Array) -> Array:
        """The real tool's poses, as far as the model tells."""
        T: Array = self.solver.real_fk(q)
        return T

    def layers(self, T: Array) -> Layers:
        """The nominal solutions, corrected; of poses without one, what the solver itself finds."""
        layers = self._corrected(T, self.nominal.layers(T))
        empty = np.flatnonzero(np.diff(layers.start) == 0)
        if not len(empty):
            return layers
        found = self.solver.solve(T[empty])
        layers.status[empty] = found.status
        return layers.with_rows(empty[found.pose_index], found.q, found.branch, -1, True)

    def near(self, T: Array, q: Array) -> Layers:
        """Nominal solutions near q, corrected."""
        return self._corrected(T, self.nominal.near(T, q))

    def finer(self, T: Array, q: Array, level: int) -> Layers | None:
        """More of a nominal continuum, corrected."""
        more = self.nominal.finer(T, q, level)
        return None if more is None else self._corrected(T, more)

    def between(self, T: Array, level: int) -> Layers | None:
        """More of a nominal grid, corrected."""
        more = self.nominal.between(T, level)
        return None if more is None else self._corrected(T, more)

    def on(self, robot: "Robot") -> "MeasuredBranches":
        """The same for another robot; for one without its limits nothing is trained again."""
        search = self.correct if self.solver.solver_._trains else self.solver
        return MeasuredBranches(search.clone().fit(robot), self.nominal.on(robot))

    def _corrected(self, T: Array, layers: Layers) -> Layers:
        layers = wound(self.robot, layers)
        found = self.correct.solve(T[layers.sample], q_seed=layers.q)
        mask = np.zeros(len(layers.q), np.bool_)
        mask[found.pose_index] = True
        return replace(layers.only(mask), q=np.ascontiguousarray(found.q))

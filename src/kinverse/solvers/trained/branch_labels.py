"""Which branch of the closed form a configuration lies on."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError, NoClosedForm
from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.solvers.closed_form.families import Family
from kinverse.solvers.descent import moved
from kinverse.task import as_task

__all__ = ["BranchLabels", "branch_labels"]

Array = NDArray[np.float64]


class BranchLabels:
    """Names of branches, and the branch of a configuration.

    A configuration lies on the branch of that closed-form solution of the pose it reaches that it
    equals, limits ignored. It is told no joint values by that.

    Args:
        robot: whose branches they are.
        solver: a fitted ``Analytic``.
    """

    def __init__(self, robot: Robot, solver: Any) -> None:
        self.names = tuple(solver.branch_labels_)
        self.solver = solver
        self._all = solver.clone().set_params(limits="ignore").fit(robot)
        self._robot, self._turns = robot, turning(robot)

    def of(self, q: Array) -> NDArray[np.int64]:
        """Branch numbers (K,) of configurations (K, n); -1 where the closed form has none."""
        numbers = np.full(len(q), -1)
        answers = self._all.solve(self._robot.fk(q))
        distance = moved(answers.q, q[answers.pose_index], self._turns)
        # the nearest of a configuration's solutions is the first in the order of distance
        order = np.lexsort((distance, answers.pose_index))
        rows, first = np.unique(answers.pose_index[order], return_index=True)
        numbers[rows] = answers.branch[order[first]]
        return numbers


def branch_labels(robot: Robot, task: str) -> BranchLabels | None:
    """The labels of a robot that has finitely many branches with names, else None.

    What has joints to spare has no end of solutions, and what is found by elimination is numbered
    in the order in which it is found.

    Example:
        >>> branch_labels(kv.load("kr16"), "pose").names[0]
        'shoulder+ elbow+ wrist+'
    """
    from kinverse.solvers.analytic import Analytic

    if robot.dof > as_task(task).size:
        return None
    try:
        solver = Analytic(task=task).fit(robot)
    except (NoClosedForm, InputError):
        return None
    spec = getattr(solver, "spec_", None)
    if spec is not None and spec.family is Family.GENERAL_6R:
        return None
    return BranchLabels(robot, solver) if len(solver.branch_labels_) > 1 else None

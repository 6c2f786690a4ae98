"""Which solver --solver means: a name, or a file that ``kinverse train`` wrote."""

from pathlib import Path
from typing import TYPE_CHECKING

from kinverse.errors import InputError
from kinverse.solvers import make_solver
from kinverse.solvers.trained.model_file import solver_name

if TYPE_CHECKING:
    from kinverse.robot import Robot
    from kinverse.solvers import Solver

__all__ = ["fitted"]


def fitted(given: str, robot: "Robot", task: str | None) -> "Solver":
    """The solver, fitted to a robot.

    Args:
        given: a solver's name, or a path that ends in .npz.
        robot: whose poses are to be solved.
        task: None: "pose", or what the file was trained for.

    Raises:
        InputError: an unknown name, or a file that is none, was trained for another robot (both
            are named) or for another task.
        FileNotFoundError: no such file.
    """
    if not given.endswith(".npz"):
        return make_solver(given, robot, task or "pose").fit(robot)
    from kinverse.solvers.fusion import Fusion
    from kinverse.solvers.learned import Learned

    name = solver_name(given)
    kinds = {kind.__name__: kind for kind in (Learned, Fusion)}
    if name not in kinds:
        raise InputError(f"{given}: holds a {name}, which is no solver: {', '.join(kinds)}")
    solver = kinds[name].load(Path(given), robot)
    trained = solver.settings_.task
    if task not in (None, trained):
        raise InputError(f"{given}: trained for task {trained!r}, --task is {task!r}")
    return solver

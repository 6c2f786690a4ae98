"""Which solver --solver and --error-model mean: a name or a file, for the arm as it is or real."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from kinverse.errors import InputError, NoClosedForm
from kinverse.solvers import make_solver
from kinverse.solvers.trained.model_file import solver_name

if TYPE_CHECKING:
    from kinverse.robot import Robot
    from kinverse.solvers import Solver

__all__ = ["fitted", "for_path"]

SAME = 1e-9
"""Frames that differ by less [m, and in the entries of the rotation] are one."""


def fitted(
    given: str, robot: "Robot", task: str | None, error_model: Path | None = None
) -> "Solver":
    """The solver, fitted to a robot.

    Args:
        given: a solver's name, or a path that ends in .npz.
        robot: whose poses are to be solved.
        task: None: "pose", or what the file was trained for.
        error_model: what ``kinverse calibrate`` wrote; the solver is for the real tool then.

    Raises:
        InputError: an unknown name, or a file that is none, was trained or measured for another
            robot (both are named) or for another task; a trained solver with an error model.
        FileNotFoundError: no such file.
    """
    trained_before = given.endswith(".npz")
    if error_model is not None:
        if trained_before:
            raise InputError(
                "--error-model goes with the name of a solver, not with a trained file"
            )
        return _compensated(make_solver(given, robot, task or "pose"), error_model, robot)
    if not trained_before:
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


def for_path(
    given: str, robot: "Robot", task: str, error_model: Path | None = None
) -> "str | Solver":
    """The same for ``kinverse.paths.track``, which knows names and finds every branch of "auto".

    Raises:
        InputError, FileNotFoundError: as :func:`fitted`.
    """
    if error_model is None and not given.endswith(".npz"):
        return given
    if error_model is not None and given == "auto":
        with suppress(NoClosedForm):
            return fitted("analytic", robot, task, error_model)
        return fitted("numerical", robot, task, error_model)
    return fitted(given, robot, task, error_model)


def _compensated(solver: "Solver", file: Path, robot: "Robot") -> "Solver":
    import numpy as np

    from kinverse import calibration

    measured = calibration.measured_robot(file)
    same = measured is None or (
        measured.frames.shape == robot.frames.shape
        and np.allclose(measured.frames, robot.frames, rtol=0.0, atol=SAME)
    )
    if not same:
        raise InputError(
            f"{file}: measured on {measured.name!r} with a geometry or tool that is not that of"
            f" {robot.name!r} here; give the --tool it was calibrated with"
        )
    made: Solver = calibration.Compensated(solver, calibration.load(file)).fit(robot)
    return made

"""``kinverse solve``: poses in, every verified solution out."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kinverse.cli._args import (
    Base,
    Degrees,
    ErrorModel,
    Json,
    RobotName,
    Tip,
    Tool,
    check_plot,
    numbers,
    pose_numbers,
)
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.cli._poses import Poses

__all__ = ["solve"]


class OnError(StrEnum):
    """What to do with a row that cannot be read."""

    STOP = "stop"
    SKIP = "skip"


def solve(
    robot: RobotName,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X Y Z ROLL PITCH YAW", help="One pose [m, rad]; x y z do for --task position."
        ),
    ] = None,
    matrix: Annotated[Path | None, typer.Option(help="File of 4 x 4 matrices.")] = None,
    poses: Annotated[Path | None, typer.Option(help="CSV file of poses, with a header.")] = None,
    solver: Annotated[
        str, typer.Option(help="auto, analytic, numerical, swarm:gwo ... or a .npz file of train.")
    ] = "auto",
    task: Annotated[
        str | None,
        typer.Option(help="pose (or the file's), position, position_axis, planar, schoenflies."),
    ] = None,
    q_seed: Annotated[
        str | None, typer.Option("--q-seed", help="Joint values to start from or stay near.")
    ] = None,
    rng: Annotated[int | None, typer.Option(help="Seed of whatever a solver draws.")] = None,
    degrees: Degrees = False,
    json: Json = False,
    out: Annotated[Path | None, typer.Option(help="Write to this .csv or .json file.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw a swarm solver's search to this .png, .svg or .pdf.")
    ] = None,
    on_error: Annotated[OnError, typer.Option(help="A broken row of the CSV file.")] = OnError.STOP,
    error_model: ErrorModel = None,
    tool: Tool = None,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Inverse kinematics of one pose or a file of poses; R = Rz(yaw) Ry(pitch) Rx(roll)."""
    import numpy as np

    import kinverse as kv
    from kinverse.cli import _answers, _solver
    from kinverse.cli._show import joint_kinds, note, note_turns, write_atomically
    from kinverse.cli._tool import with_tool

    if out is not None and out.suffix not in (".csv", ".json"):
        raise InputError(f"--out must end in .csv or .json, got {out.name!r}")
    if out is not None and not out.parent.is_dir():
        raise InputError(f"--out: there is no folder {out.parent}")
    if plot is not None:
        check_plot(plot)
    arm = with_tool(kv.load(robot, base=base, tip=tip), tool, degrees)
    made = _solver.fitted(solver, arm, task, error_model)
    if task is None and made.settings_.task != "pose":
        note(f"{solver} was trained for --task {made.settings_.task}: the rest of a pose is free")
    task = made.settings_.task
    given = _read(pose, matrix, poses, degrees, skip=on_error is OnError.SKIP, task=task)
    note_turns([given.largest], degrees)
    seed = None
    if q_seed is not None:
        seed = np.array(numbers(q_seed, arm.dof, "--q-seed", " ".join(arm.joint_names)))
        turns = np.array([kind == "R" for kind in joint_kinds(arm)])
        note_turns(seed[turns].tolist(), degrees)
        if degrees:
            seed = np.where(turns, np.radians(seed), seed)
    for line in given.problems:
        print("kinverse: skipped:", line, file=sys.stderr)
    if given.ignored:
        print("kinverse: columns not read:", ", ".join(given.ignored), file=sys.stderr)
    if not len(given.T):
        note(f"0 poses in {poses or matrix}")

    if plot is not None:
        from kinverse.cli import _plot

        _plot.search(plot, made, given.T, solver, rng)
    done = _answers.run(made, given, q_seed=seed, rng=rng)
    answers = _answers.Answers(arm, solver, task, degrees, given, done)
    if out is not None:
        write_atomically(out, answers.csv() if out.suffix == ".csv" else answers.json())
    if json:
        print(answers.json())
    elif out is None:
        answers.show()
    else:
        answers.summary()
    answers.remark()
    return 0 if answers.all_solved else 1


def _read(
    pose: str | None, matrix: Path | None, poses: Path | None, degrees: bool, skip: bool, task: str
) -> "Poses":
    from kinverse.cli import _poses

    if pose is not None and matrix is None and poses is None:
        return _poses.from_numbers(pose_numbers(pose, task), degrees)
    if matrix is not None and pose is None and poses is None:
        return _poses.from_matrix(matrix)
    if poses is not None and pose is None and matrix is None:
        return _poses.from_csv(poses, degrees, skip, task)
    raise InputError("give one of --pose, --matrix and --poses")

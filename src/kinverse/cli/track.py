"""``kinverse track``: a path of poses in, joint values along it and the reasons of gaps out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinverse.cli._args import (
    Base,
    Degrees,
    ErrorModel,
    Json,
    PathName,
    RobotName,
    Task,
    Tip,
    Tool,
    all_numbers,
    check_plot,
    numbers,
)
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["track"]

LEAST_SAMPLES = 20
"""Samples of a path, at first, where a tolerance is asked for and the file has fewer poses."""


def track(
    robot: RobotName,
    path: PathName,
    solver: Annotated[
        str, typer.Option(help="auto, analytic, numerical ... or a .npz file of train.")
    ] = "auto",
    error_model: ErrorModel = None,
    tool: Tool = None,
    task: Task = "pose",
    metric: Annotated[str, typer.Option(help="What a step costs: max, l2 or time.")] = "max",
    max_velocity: Annotated[
        str | None,
        typer.Option(
            help="Of the joints, one or n numbers [rad/s or m/s]; with --degrees [deg/s]. For"
            " --metric time."
        ),
    ] = None,
    max_step: Annotated[
        float | None, typer.Option(help="Largest step of a joint [rad or m]; with --degrees [deg].")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Add samples until the tool stays so near the path between them [m]."),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(help="Sample the path in so many places (at first), not as it is given."),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option(help="Links are capsules of this radius [m], and must not meet each other."),
    ] = None,
    floor: Annotated[
        float | None, typer.Option(help="Height z [m] that the links stay above.")
    ] = None,
    spheres: Annotated[
        Path | None, typer.Option(help="A .csv file of obstacles: columns x y z radius [m].")
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="A .xml (MJCF) or .urdf file of the arm and its cell, to keep clear."),
    ] = None,
    margin: Annotated[
        float | None, typer.Option(help="Distance [m] to keep beyond touching.")
    ] = None,
    q_start: Annotated[
        str | None, typer.Option("--q-start", help="Joint values before the path.")
    ] = None,
    degrees: Degrees = False,
    json: Json = False,
    out: Annotated[Path | None, typer.Option(help="Write to this .csv or .json file.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the joints to this .png, .svg or .pdf.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Follow a path of poses on one branch; exit status 1 if it has gaps.

    Between the poses of a file the path is straight. Collision is tested at the samples.
    """
    import numpy as np

    import kinverse as kv
    from kinverse.cli import _joint_path, _path, _solver
    from kinverse.cli._collision import keep_of
    from kinverse.cli._show import joint_kinds, note, write_atomically
    from kinverse.cli._tool import with_tool
    from kinverse.paths import track as tracked

    if out is not None and out.suffix not in (".csv", ".json"):
        raise InputError(f"--out must end in .csv or .json, got {out.name!r}")
    if out is not None and not out.parent.is_dir():
        raise InputError(f"--out: there is no folder {out.parent}")
    if plot is not None:
        check_plot(plot)
    if (metric == "time") != (max_velocity is not None):
        raise InputError("--max-velocity goes with --metric time, and the other way round")
    least = None if tolerance is None else LEAST_SAMPLES
    given = _path.given_path(path, degrees, task, samples, least)
    arm = kv.load(robot, base=base, tip=tip)
    turns = np.array([kind == "R" for kind in joint_kinds(arm)])
    scale = np.where(turns & degrees, np.pi / 180.0, 1.0)
    start = None
    if q_start is not None:
        start = numbers(q_start, arm.dof, "--q-start", " ".join(arm.joint_names)) * scale
    arm = with_tool(arm, tool, degrees)
    found = tracked(
        arm,
        given.T if tolerance is None else given.path,
        solver=_solver.for_path(solver, arm, task, error_model),
        metric=metric,
        q_start=start,
        keep=keep_of(arm, radius, floor, spheres, model, margin),
        max_step=None if max_step is None else max_step * scale,
        max_velocity=None if max_velocity is None else _speeds(arm, max_velocity) * scale,
        task=task,
        tolerance=tolerance,
        samples=len(given.T),
    )
    s = found.s if found.s is not None else given.s
    unit = None if given.path is None else given.path.unit
    told = _joint_path.Told(found, degrees, metric, s, unit)
    if out is not None:
        write_atomically(out, told.csv() if out.suffix == ".csv" else told.json())
    if plot is not None:
        from kinverse import plots

        plots.joint_path_figure(found).savefig(plot, dpi=120)
        note(f"drawn: {plot}")
    if json:
        print(told.json())
    else:
        told.show()
    return 0 if found.is_whole else 1


def _speeds(arm: "Robot", text: str) -> Any:
    """Largest speeds (n,) of all joints, from one number or n."""
    import numpy as np

    values = all_numbers(text, "--max-velocity")
    if len(values) not in (1, arm.dof):
        raise InputError(f"--max-velocity needs 1 number or {arm.dof}, got {len(values)}")
    if min(values) <= 0.0:
        raise InputError(f"--max-velocity must be positive, got {text}")
    return np.broadcast_to(np.array(values), (arm.dof,))

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
            " --metric time, and with --max-acceleration."
        ),
    ] = None,
    max_acceleration: Annotated[
        str | None,
        typer.Option(
            help="Likewise [rad/s^2 or m/s^2]; with --degrees [deg/s^2]. The path is timed, as fast"
            " as both let it, and --out FILE.csv is for a controller: t, joint values, speeds and"
            " accelerations."
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Rows of that file a second; 250 if left out.")
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
    closed: Annotated[
        bool, typer.Option("--closed", help="The joints are to end where they begin.")
    ] = False,
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

    Between the poses of a file the path is straight. Collision is tested at the samples. Exit
    status 1 too where a tolerance, or in time the joint limits, are not kept.
    """
    import numpy as np

    import kinverse as kv
    from kinverse.cli import _joint_path, _path, _solver
    from kinverse.cli._collision import keep_of
    from kinverse.cli._show import joint_kinds, note, write_atomically
    from kinverse.cli._tool import with_tool
    from kinverse.paths import track as tracked
    from kinverse.paths.motion_file import RATE

    if out is not None and out.suffix not in (".csv", ".json"):
        raise InputError(f"--out must end in .csv or .json, got {out.name!r}")
    if out is not None and not out.parent.is_dir():
        raise InputError(f"--out: there is no folder {out.parent}")
    if plot is not None:
        check_plot(plot)
    _check_limits(metric, max_velocity, max_acceleration, rate, out)
    if error_model is not None and max_acceleration is not None:
        raise InputError(
            "--error-model does not go with --max-acceleration: the spline of a motion in time is"
            " made for the arm without errors"
        )
    least = None if tolerance is None else LEAST_SAMPLES
    given = _path.given_path(path, degrees, task, samples, least)
    arm = kv.load(robot, base=base, tip=tip)
    _path.remark_unit(arm, given.T)
    turns = np.array([kind == "R" for kind in joint_kinds(arm)])
    scale = np.where(turns & degrees, np.pi / 180.0, 1.0)
    speeds = _per_joint(arm, "--max-velocity", max_velocity, scale)
    accelerations = _per_joint(arm, "--max-acceleration", max_acceleration, scale)
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
        max_velocity=speeds if metric == "time" else None,
        task=task,
        tolerance=tolerance,
        samples=len(given.T),
        closed=closed,
    )
    s = found.s if found.s is not None else given.s
    unit = None if given.path is None else given.path.unit
    told = _joint_path.Told(found, degrees, metric, s, unit)
    motion = None
    if speeds is not None and accelerations is not None:
        if found.is_whole:
            from kinverse.cli._motion import timed

            limits = (speeds, accelerations)
            per_second = RATE if rate is None else rate
            motion = timed(found, given, limits, task, tolerance, per_second, degrees)
        else:
            note("a path with gaps is no one motion: nothing is timed or written to --out")
    if out is not None and motion is not None:
        write_atomically(out, motion.csv())
    elif out is not None and accelerations is None:
        write_atomically(out, told.csv() if out.suffix == ".csv" else told.json())
    if plot is not None:
        from kinverse import plots

        plots.joint_path_figure(found).savefig(plot, dpi=120)
        note(f"drawn: {plot}")
    if json:
        print(told.json(motion.record() if motion is not None else None))
    else:
        told.show(motion.lines() if motion is not None else [])
    is_near = tolerance is None or not found.deviation > tolerance
    return 0 if found.is_whole and is_near and (motion is None or motion.ok) else 1


def _check_limits(
    metric: str, velocity: str | None, acceleration: str | None, rate: float | None, out: Any
) -> None:
    if metric == "time" and velocity is None:
        raise InputError("--metric time needs --max-velocity")
    if velocity is not None and metric != "time" and acceleration is None:
        raise InputError("--max-velocity goes with --metric time or with --max-acceleration")
    if acceleration is not None and velocity is None:
        raise InputError("--max-acceleration goes with --max-velocity")
    if rate is not None and (acceleration is None or out is None):
        raise InputError("--rate goes with --max-acceleration and --out FILE.csv")
    if acceleration is not None and out is not None and out.suffix != ".csv":
        raise InputError(f"with --max-acceleration --out must end in .csv, got {out.name!r}")


def _per_joint(arm: "Robot", option: str, text: str | None, scale: Any) -> Any:
    """Limits (n,) of all joints, from one number or n; None where there are none."""
    import numpy as np

    if text is None:
        return None
    values = all_numbers(text, option)
    if len(values) not in (1, arm.dof):
        raise InputError(f"{option} needs 1 number or {arm.dof}, got {len(values)}")
    if min(values) <= 0.0:
        raise InputError(f"{option} must be positive, got {text}")
    return np.broadcast_to(np.array(values), (arm.dof,)) * scale

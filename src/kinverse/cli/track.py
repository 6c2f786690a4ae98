"""``kinverse track``: a path of poses in, joint values along it and the reasons of gaps out."""

from pathlib import Path
from typing import Annotated

import typer

from kinverse.cli._args import (
    Base,
    Degrees,
    Json,
    PathName,
    RobotName,
    Task,
    Tip,
    check_plot,
    numbers,
)
from kinverse.errors import InputError

__all__ = ["track"]


def track(
    robot: RobotName,
    path: PathName,
    solver: Annotated[str, typer.Option(help="auto, analytic, numerical ...")] = "auto",
    task: Task = "pose",
    metric: Annotated[str, typer.Option(help="What a step costs: max or l2.")] = "max",
    max_step: Annotated[
        float | None, typer.Option(help="Largest step of a joint [rad or m]; with --degrees [deg].")
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
    """Follow a path of poses on one branch; exit status 1 if it has gaps."""
    import numpy as np

    import kinverse as kv
    from kinverse.cli import _joint_path, _path
    from kinverse.cli._show import joint_kinds, note, write_atomically
    from kinverse.paths import track as tracked

    if out is not None and out.suffix not in (".csv", ".json"):
        raise InputError(f"--out must end in .csv or .json, got {out.name!r}")
    if out is not None and not out.parent.is_dir():
        raise InputError(f"--out: there is no folder {out.parent}")
    if plot is not None:
        check_plot(plot)
    given = _path.given_path(path, degrees, task)
    arm = kv.load(robot, base=base, tip=tip)
    turns = np.array([kind == "R" for kind in joint_kinds(arm)])
    scale = np.where(turns & degrees, np.pi / 180.0, 1.0)
    start = None
    if q_start is not None:
        start = numbers(q_start, arm.dof, "--q-start", " ".join(arm.joint_names)) * scale
    found = tracked(
        arm,
        given.T,
        solver=solver,
        metric=metric,
        q_start=start,
        max_step=None if max_step is None else max_step * scale,
        task=task,
    )
    told = _joint_path.Told(found, degrees)
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

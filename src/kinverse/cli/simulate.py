"""``kinverse simulate``: a path tracked, timed and run in a multibody simulator."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinverse.cli._args import (
    Base,
    Degrees,
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
from kinverse.errors import InputError, NoSolution

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["simulate"]

VELOCITY, ACCELERATION = 1.0, 4.0
"""Limits of every joint where neither they nor a duration are given [rad/s or m/s, and per s^2]."""


def simulate(
    robot: RobotName,
    path: PathName,
    drive: Annotated[str, typer.Option(help="What is driven: joints or tool.")] = "joints",
    control: Annotated[
        str | None,
        typer.Option(help="Of driven joints: computed_torque (if left out), servo or prescribed."),
    ] = None,
    velocity: Annotated[
        str | None,
        typer.Option(
            help="Limit of the joints' speed, one or n numbers [rad/s or m/s]; with --degrees"
            " [deg/s]. Left out, with --degrees too: 1 rad/s (57.3 deg/s) or 1 m/s."
        ),
    ] = None,
    acceleration: Annotated[
        str | None,
        typer.Option(
            help="Likewise [rad/s^2 or m/s^2]; with --degrees [deg/s^2]. Left out, with --degrees"
            " too: 4 rad/s^2 (229 deg/s^2) or 4 m/s^2."
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Instead of both: seconds, from rest to rest.")
    ] = None,
    mass_error: Annotated[
        float, typer.Option(help="Links weigh 1 + this times what the controller believes.")
    ] = 0.0,
    friction: Annotated[
        float, typer.Option(help="Dry friction of each joint, unknown to the controller [Nm or N].")
    ] = 0.0,
    damping: Annotated[float, typer.Option(help="Viscous friction, likewise.")] = 0.0,
    bandwidth: Annotated[
        float | None, typer.Option(help="Of the controller [rad/s]; 300 if left out.")
    ] = None,
    gravity: Annotated[
        str, typer.Option(metavar="X Y Z", help="In the base frame [m/s^2].")
    ] = "0,0,-9.81",
    step: Annotated[float, typer.Option(help="Of the integration [s].")] = 5e-4,
    solver: Annotated[
        str, typer.Option(help="auto, analytic, numerical ... or a .npz file of train.")
    ] = "auto",
    tool: Tool = None,
    task: Task = "pose",
    q_start: Annotated[
        str | None, typer.Option("--q-start", help="Joint values before the path.")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(help="Sample the path in so many places, not as it is given.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="How far the tool may stray from the path between samples [m], straight from pose"
            " to pose if it is a file; samples are added. A tenth of their distance if left out."
        ),
    ] = None,
    degrees: Degrees = False,
    json: Json = False,
    out: Annotated[Path | None, typer.Option(help="Write every instant to this .csv file.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw loads and errors to this .png, .svg or .pdf.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Follow a path in a multibody simulator: errors of the tool, loads of the drives.

    Of a path with gaps its longest run is simulated. Exit status 1 if there are gaps, the
    tolerance or the joint limits are not kept between samples, or the simulation becomes unstable;
    what was measured before is kept.
    """
    import numpy as np

    import kinverse as kv
    from kinverse.cli import _path, _simulation, _solver
    from kinverse.cli._joint_curve import joined
    from kinverse.cli._joint_path import Told as ToldPath
    from kinverse.cli._show import joint_kinds, note, write_atomically
    from kinverse.cli._tool import with_tool
    from kinverse.paths import minimum_jerk, retime, wanted
    from kinverse.paths import simulate as simulated
    from kinverse.paths import track as tracked
    from kinverse.paths.mujoco_model import mujoco_or_extra
    from kinverse.paths.simulate import check_drive

    check_drive(drive, control, bandwidth)
    if out is not None and (out.suffix != ".csv" or not out.parent.is_dir()):
        raise InputError(f"--out must be a .csv file in a folder that is there, got {out}")
    if plot is not None:
        check_plot(plot)
    if duration is not None and (velocity is not None or acceleration is not None):
        raise InputError("give either --duration or --velocity and --acceleration")
    if duration is not None and not 0.0 < duration < np.inf:
        raise InputError(f"--duration must be positive and finite [s], got {duration}")
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"--tolerance must be positive and finite [m], got {tolerance}")
    mujoco_or_extra()
    pull = numbers(gravity, 3, "--gravity", "x y z")
    arm = kv.load(robot, base=base, tip=tip)
    given = _path.given_path(path, degrees, task, samples)
    _path.remark_unit(arm, given.T)
    turns = np.array([kind == "R" for kind in joint_kinds(arm)])
    scale = np.where(turns & degrees, np.pi / 180.0, 1.0)
    limits = [
        _per_joint(arm, told, usual, name, scale)
        for told, usual, name in (
            (velocity, VELOCITY, "--velocity"),
            (acceleration, ACCELERATION, "--acceleration"),
        )
    ]
    start = None
    if q_start is not None:
        start = numbers(q_start, arm.dof, "--q-start", " ".join(arm.joint_names)) * scale
    arm = with_tool(arm, tool, degrees)
    chosen = _solver.for_path(solver, arm, task)
    found = tracked(arm, given.T, solver=chosen, q_start=start, task=task)
    if found.gaps and not json:
        ToldPath(found, degrees).show()
    if not found.intervals:
        raise NoSolution(f"no pose of {path} was tracked: {found.gaps[0].told(degrees, rows=True)}")
    part = max(found.intervals, key=lambda ends: ends[1] - ends[0])
    spline = joined(found, given, part, task, tolerance)
    if spline.beyond is not None and spline.beyond.amount > wanted.BEYOND:
        note(f"not simulated: between the samples {spline.beyond.text}")
        return 1
    curve = spline.curve
    motion = retime(curve, *limits) if duration is None else minimum_jerk(curve, duration)
    run = simulated(
        arm,
        motion,
        drive=drive,
        control=control,
        mass_error=mass_error,
        friction=friction,
        damping=damping,
        bandwidth=bandwidth,
        gravity=pull,
        step=step,
    )
    told = _simulation.Told(found, part, run, spline, given.path is not None, degrees)
    if out is not None:
        write_atomically(out, told.csv())
    if plot is not None:
        from kinverse import simulation_plots

        name = run.control or "tool driven"
        title = f"{arm.name}, {Path(path).name}"
        simulation_plots.simulation_figure({name: run}, title).savefig(plot, dpi=120)
        note(f"drawn: {plot}")
    if json:
        print(told.json())
    else:
        told.show()
    near = tolerance is None or spline.position <= tolerance
    return 0 if found.is_whole and run.ok and near and spline.beyond is None else 1


def _per_joint(arm: "Robot", told: str | None, usual: float, option: str, scale: Any) -> Any:
    """Limits of all joints from one number or n; the usual one is not in degrees."""
    import numpy as np

    if told is None:
        return np.full(arm.dof, usual)
    values = all_numbers(told, option)
    if len(values) not in (1, arm.dof):
        raise InputError(f"{option} needs 1 number or {arm.dof}, got {len(values)}")
    if min(values) <= 0.0:
        raise InputError(f"{option} must be positive, got {told}")
    return np.broadcast_to(np.array(values), (arm.dof,)) * scale

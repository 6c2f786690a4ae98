"""``kinverse fk``: joint values in, pose out."""

from typing import Annotated

import typer

from kinverse.cli._args import Base, Degrees, Json, RobotName, Tip, Tool, numbers

__all__ = ["fk"]


def fk(
    robot: RobotName,
    q: Annotated[str, typer.Option("--q", help="One number for each free joint.")],
    degrees: Degrees = False,
    json: Json = False,
    tool: Tool = None,
    base: Base = None,
    tip: Tip = None,
) -> None:
    """Forward kinematics: the pose of the tool for given joint values."""
    import json as text

    import numpy as np

    import kinverse as kv
    from kinverse import se3
    from kinverse.cli._show import (
        console,
        joint_kinds,
        note,
        note_turns,
        outside_limits,
        show_table,
        table,
    )
    from kinverse.cli._tool import with_tool

    arm = with_tool(kv.load(robot, base=base, tip=tip), tool, degrees)
    values = np.array(numbers(q, arm.dof, "--q", " ".join(arm.joint_names)))
    turns = np.array([kind == "R" for kind in joint_kinds(arm)])
    note_turns(values[turns].tolist(), degrees)
    if degrees:
        values = np.where(turns, np.radians(values), values)
    for line in outside_limits(arm, values, degrees):
        note(line)
    T = arm.fk(values)
    rpy = se3.rpy_from_rotation(T[:3, :3])
    angles = np.degrees(rpy) if degrees else rpy
    quat = se3.quat_from_rotation(T[:3, :3])
    unit = "deg" if degrees else "rad"
    if json:
        answer = {
            "robot": arm.name,
            "angle": unit,
            "matrix": T.tolist(),
            "xyz": T[:3, 3].tolist(),
            "rpy": angles.tolist(),
            "quat_wxyz": quat.tolist(),
        }
        print(text.dumps(answer))
        return
    shown = table(">x m", ">y m", ">z m", f">roll {unit}", f">pitch {unit}", f">yaw {unit}")
    shown.add_row(*(f"{v + 0.0:.6f}" for v in (*T[:3, 3], *angles)))
    out = console()
    show_table(shown)
    out.print("quaternion wxyz:", " ".join(f"{v:.9f}" for v in quat))
    out.print("matrix:")
    for row in T:
        out.print(" ".join(f"{v + 0.0:13.9f}" for v in row))

"""``kinverse info``: one robot's joints, limits and source, and what kind of arm it is."""

from typing import TYPE_CHECKING, Any

from kinverse.cli._args import Base, Degrees, Json, RobotName, Tip

if TYPE_CHECKING:
    from kinverse.robot_class import RobotClass

__all__ = ["info"]


def info(
    robot: RobotName,
    degrees: Degrees = False,
    json: Json = False,
    base: Base = None,
    tip: Tip = None,
) -> None:
    """Show a robot: joints, limits, sources, its class, how it can be solved."""
    import json as text
    from dataclasses import asdict

    import kinverse as kv
    from kinverse.cli._show import console, joint_kinds, joint_values, show_table, table
    from kinverse.robot_class import robot_class

    arm = kv.load(robot, base=base, tip=tip)
    low = joint_values(arm, arm.limits[:, 0], degrees)
    high = joint_values(arm, arm.limits[:, 1], degrees)
    kind = robot_class(arm)
    closed_form = f"yes: {kind.family}" if kind.family else f"no: {kind.why_no_family}"
    if kind.free_parameter:
        closed_form = f"yes, at a value of {kind.free_parameter}"
    if json:
        answer: dict[str, Any] = {
            "name": arm.name,
            "dof": arm.dof,
            "joints": arm.kinds,
            "joint_names": list(arm.joint_names),
            "angle": "deg" if degrees else "rad",
            "limits": [list(pair) for pair in zip(low, high, strict=True)],
            "closed_form": closed_form,
            "source": arm.source_note,
            "unverified": list(arm.unverified),
            "class": asdict(kind),
        }
        print(text.dumps(answer))
        return
    out = console()
    shown = table(
        "joint", "kind", ">low", ">high", "unit", title=f"{arm.name}: {arm.dof} free joints"
    )
    unit = "deg" if degrees else "rad"
    for name, letter, a, b in zip(arm.joint_names, joint_kinds(arm), low, high, strict=True):
        word = "turns" if letter == "R" else "slides"
        shown.add_row(name, word, f"{a:.4f}", f"{b:.4f}", unit if letter == "R" else "m")
    show_table(shown)
    _show_axes(kind, degrees)
    for line in _class_lines(kind):
        out.print(line, markup=False)
    out.print(f"closed form: {closed_form}", markup=False)
    if arm.source_note:
        out.print(f"source: {arm.source_note}", markup=False)
    for line in arm.unverified:
        out.print(f"unverified: {line}", markup=False)


def _show_axes(kind: "RobotClass", degrees: bool) -> None:
    """How neighbouring axes lie to each other."""
    import math

    from kinverse.cli._show import show_table, table

    if not kind.pairs:
        return
    unit = "deg" if degrees else "rad"
    shown = table("axes", "relation", f">angle ({unit})", ">distance (m)")
    for pair in kind.pairs:
        angle = math.degrees(pair.angle) if degrees else pair.angle
        apart = "-" if pair.distance is None else f"{pair.distance:.6g}"
        shown.add_row(_axes(pair.joints), pair.relation, f"{angle:.6g}", apart)
    show_table(shown)


def _axes(joints: tuple[int, ...]) -> str:
    return ", ".join(str(joint + 1) for joint in joints)


def _class_lines(kind: "RobotClass") -> list[str]:
    """The class of an arm, a line for each thing to know."""
    lines = []
    for meeting in kind.meetings:
        x, y, z = meeting.point
        where = f"({x:.4g}, {y:.4g}, {z:.4g}) m at zero"
        lines.append(f"one point: axes {_axes(meeting.joints)} meet at {where}")
    lines += [f"parallel in every posture: axes {_axes(run)}" for run in kind.parallel]
    first = kind.regional
    most = "no bound" if kind.max_branches is None else str(kind.max_branches)
    lines += [
        f"class: {kind.redundancy}, {kind.motion}; mobility {kind.mobility}, rank {kind.rank}",
        f"regional structure: {first.structure} ({first.axes}), {first.name}",
        f"workspace: {first.workspace}",
        f"wrist: {kind.wrist}",
        f"greatest number of branches: {most}",
    ]
    lines += [f"singular ({s.name}): {s.condition}" for s in kind.singularities]
    if kind.singularities_text:
        lines.append(f"singular: {kind.singularities_text}")
    lines.append(f"solver auto takes: {kind.auto}")
    return lines

"""``kinverse info``: one robot's joints, limits, source and closed form."""

from typing import Any

from kinverse.cli._args import Base, Degrees, Json, RobotName, Tip

__all__ = ["info"]


def info(
    robot: RobotName,
    degrees: Degrees = False,
    json: Json = False,
    base: Base = None,
    tip: Tip = None,
) -> None:
    """Show a robot: joints, limits, where its numbers come from, how it can be solved."""
    import json as text

    import kinverse as kv
    from kinverse.cli._show import console, joint_kinds, joint_values, table

    arm = kv.load(robot, base=base, tip=tip)
    low = joint_values(arm, arm.limits[:, 0], degrees)
    high = joint_values(arm, arm.limits[:, 1], degrees)
    try:
        kv.Analytic().fit(arm)
        closed_form = "yes"
    except kv.NoClosedForm as error:
        closed_form = f"no: {error}"
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
        }
        print(text.dumps(answer))
        return
    out = console()
    shown = table(
        "joint", "kind", ">low", ">high", "unit", title=f"{arm.name}: {arm.dof} free joints"
    )
    unit = "deg" if degrees else "rad"
    for name, kind, a, b in zip(arm.joint_names, joint_kinds(arm), low, high, strict=True):
        word = "turns" if kind == "R" else "slides"
        shown.add_row(name, word, f"{a:.4f}", f"{b:.4f}", unit if kind == "R" else "m")
    out.print(shown)
    out.print(f"closed form: {closed_form}", markup=False)
    if arm.source_note:
        out.print(f"source: {arm.source_note}", markup=False)
    for line in arm.unverified:
        out.print(f"unverified: {line}", markup=False)

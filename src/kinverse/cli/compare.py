"""``kinverse compare``: the solvers side by side on the same reachable poses."""

from pathlib import Path
from typing import Annotated, Any

import typer

from kinverse.cli._args import Base, Json, RobotName, Task, Tip, check_plot
from kinverse.errors import InputError

__all__ = ["compare"]


def compare(
    robot: RobotName,
    poses: Annotated[int, typer.Option(help="How many random reachable poses.")] = 1000,
    solvers: Annotated[
        str, typer.Option(help="Comma separated, or all; one of each kind if left out.")
    ] = "",
    task: Task = "pose",
    rng: Annotated[int, typer.Option(help="Seed of the poses.")] = 1,
    alone: Annotated[
        bool, typer.Option("--alone", help="Swarm solvers without polish: 20,000 evaluations.")
    ] = False,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw how swarm solvers converge to this .png, .svg or .pdf."),
    ] = None,
    json: Json = False,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Compare solvers: solved, branches, worst error, time; exit status 1 if one fell short."""
    import json as text

    import kinverse as kv
    from kinverse.cli import _race
    from kinverse.cli._show import show_table, table, tiny

    if poses < 1:
        raise InputError(f"--poses must be at least 1, got {poses}")
    if plot is not None:
        check_plot(plot)
    arm = kv.load(robot, base=base, tip=tip)
    chosen = [name.strip() for name in solvers.split(",") if name.strip()]
    if plot is not None:
        from kinverse.cli import _plot

        _plot.convergence(plot, arm, _race.targets(arm, poses, rng), chosen, task)
    rows = _race.race(arm, poses, chosen, task, rng, alone)
    if json:
        answer: dict[str, Any] = {"robot": arm.name, "task": task, "poses": poses, "rows": rows}
        print(text.dumps(answer))
    else:
        shown = table(
            "solver", ">solved %", ">branches", ">worst m", ">worst rad", ">one pose us",
            ">in a batch us", title=f"{arm.name}, {poses} random reachable poses",
        )  # fmt: skip
        for row in rows:
            if row["note"]:
                shown.add_row(row["solver"], row["note"])
                continue
            shown.add_row(
                row["solver"],
                f"{row['solved']:.2f}",
                f"{row['branches']:.2f}",
                tiny(row["worst_position_error"]),
                tiny(row["worst_rotation_error"]),
                f"{row['one_us']:.1f}",
                f"{row['batch_us']:.2f}",
            )
        show_table(shown)
    return 0 if all(row["note"] or row["solved"] == 100.0 for row in rows) else 1

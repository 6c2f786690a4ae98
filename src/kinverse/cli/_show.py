"""What the commands share in printing: consoles, tables, numbers, atomic files."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

from kinverse import files
from kinverse.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from kinverse.robot import Robot

__all__ = [
    "arm_size",
    "console",
    "joint_header",
    "joint_values",
    "note",
    "note_turns",
    "notes",
    "outside_limits",
    "show_table",
    "table",
    "tiny",
    "write_atomically",
]


def console() -> Console:
    """Standard output, looked up at the time of the call."""
    return Console(highlight=False, soft_wrap=False)


def notes() -> Console:
    """Standard error: progress and remarks, so that standard output stays clean."""
    return Console(stderr=True, highlight=False)


def note(text: str) -> None:
    """One remark on standard error."""
    print("kinverse: note:", text, file=sys.stderr)


def note_turns(angles: Sequence[float], degrees: bool) -> None:
    """Remark on angles that are more than a turn where radians are read."""
    import math

    largest = max(angles, key=abs, default=0.0)
    if not degrees and abs(largest) > 2.0 * math.pi:
        note(f"angles are read as radians; {largest:g} is more than a turn: --degrees?")


def outside_limits(robot: "Robot", q: "np.ndarray", degrees: bool) -> list[str]:
    """A line for each joint value that is outside its joint's limits."""
    from kinverse.robot import LIMIT_SLACK

    wrong = (q < robot.limits[:, 0] - LIMIT_SLACK) | (q > robot.limits[:, 1] + LIMIT_SLACK)
    columns = (q, *robot.limits.T)
    rows = zip(*(joint_values(robot, column, degrees) for column in columns), strict=True)
    lines = []
    for name, kind, bad, row in zip(
        robot.joint_names, joint_kinds(robot), wrong.tolist(), rows, strict=True
    ):
        if bad:
            unit = "m" if kind == "P" else "deg" if degrees else "rad"
            value, low, high = (f"{v + 0.0:.6g}" for v in row)
            lines.append(f"{name} at {value} {unit} is outside its limits {low} to {high}")
    return lines


def show_table(made: Table) -> None:
    """Print a table; where the terminal is too narrow the table is wider: no digit is ever cut."""
    out = console()
    needed = Measurement.get(out, out.options.update(width=10_000), made).maximum
    if needed > out.width:
        out = Console(highlight=False, soft_wrap=False, width=needed)
    out.print(made)


def table(*columns: str, title: str | None = None) -> Table:
    """A table of whole cells; columns that start with ">" are set to the right."""
    made = Table(box=SIMPLE_HEAD, title=title, title_justify="left", pad_edge=False)
    made.padding = (0, 1, 0, 0)
    for column in columns:
        right = column.startswith(">")
        made.add_column(column.lstrip(">"), justify="right" if right else "left", no_wrap=True)
    return made


def joint_values(robot: "Robot", q: "np.ndarray", degrees: bool) -> list[float]:
    """Joint values of one solution as the user asked for them: slides stay in metres."""
    import math

    turns = joint_kinds(robot)
    return [
        math.degrees(v) if degrees and kind == "R" else v
        for v, kind in zip(q.tolist(), turns, strict=True)
    ]


def joint_kinds(robot: "Robot") -> str:
    """One letter for each free joint: that of the first moving joint that it drives."""
    source = robot.source.tolist()
    return "".join(robot.kinds[source.index(j)] for j in range(robot.dof))


def arm_size(robot: "Robot") -> float:
    """No pose farther from the base frame is reached [m]: the links and slides end to end."""
    import numpy as np

    slides = [kind == "P" for kind in joint_kinds(robot)]
    links = np.linalg.norm(robot.frames[:, :3, 3], axis=1).sum()
    return float(links + np.abs(robot.limits).max(axis=1)[slides].sum())


def joint_header(robot: "Robot") -> list[str]:
    """Column heads for joint values, short enough for seven of them in a line."""
    return [
        ">" + (name if len(name) <= 8 else f"q{k}")
        for k, name in enumerate(robot.joint_names, start=1)
    ]


def tiny(value: float) -> str:
    """An error in two digits."""
    return "-" if value != value else "0" if value == 0.0 else f"{value:.1e}"


def write_atomically(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    if not path.parent.is_dir():
        raise InputError(f"--out: there is no folder {path.parent}")
    files.write_atomically(path, text)

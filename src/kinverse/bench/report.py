"""What the bench says: one line a figure, with its target and whether it was reached."""

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from kinverse import kernels
from kinverse.bench.peers import installed
from kinverse.bench.run import Spread

__all__ = ["Line", "machine", "show", "to_json"]


@dataclass(frozen=True)
class Line:
    """One figure.

    ``bound`` is the target, ``least`` says on which side of it the figure must lie; without a
    bound the line only informs. ``note`` holds what a reader needs to judge it.
    """

    section: str
    subject: str
    what: str
    figure: Spread
    bound: float | None = None
    least: bool = True
    note: str = ""

    @property
    def verdict(self) -> str:
        """PASS, MISS, or nothing where there is no target."""
        if self.bound is None:
            return ""
        value = self.figure.median
        return "PASS" if (value >= self.bound if self.least else value <= self.bound) else "MISS"

    @property
    def target(self) -> str:
        """The target in words."""
        if self.bound is None:
            return ""
        bound = Spread.exact(self.bound)
        if self.bound == 0.0 and not self.least:
            return "0"
        return f">= {bound}" if self.least else f"<= {bound}"


def machine() -> dict[str, object]:
    """What the figures were measured on."""
    return {
        "system": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "kinverse": version("kinverse"),
        "instruction_set": kernels.instruction_set(),
        "threads": kernels.threads(),
        "peers": installed(),
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if "model name" in line), "")


def show(lines: Sequence[Line], console: Console) -> None:
    """Print the lines of one section."""
    table = Table(box=SIMPLE_HEAD, title=lines[0].section, title_justify="left", expand=True)
    table.add_column("robot", no_wrap=True)
    table.add_column("what", ratio=1)
    table.add_column("figure", justify="right")
    table.add_column("target", justify="right", no_wrap=True)
    table.add_column("")
    for line in lines:
        colour = {"PASS": "green", "MISS": "bold red"}.get(line.verdict, "")
        table.add_row(
            line.subject,
            f"{line.what} [dim]{line.note}[/dim]" if line.note else line.what,
            str(line.figure),
            line.target,
            f"[{colour}]{line.verdict}[/{colour}]" if colour else "",
        )
    console.print(table)


def to_json(lines: Sequence[Line], settings: dict[str, object]) -> str:
    """Everything as JSON: machine, settings, figures as median, low, high."""
    rows = [asdict(line) | {"target": line.target, "verdict": line.verdict} for line in lines]
    return json.dumps({"machine": machine(), "settings": settings, "lines": rows}, indent=1)

"""Pictures of the motion along the curved path: figures 7 to 9."""

from typing import TYPE_CHECKING

import numpy as np

import kinverse as kv
from kinverse import judge
from kinverse.paths import JointCurve, named_path, named_samples
from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.masajedi2013.bees_tables import PATHS, SHOWN
from kinverse.studies.masajedi2013.branches import ROBOT, branches_along
from kinverse.studies.masajedi2013.motion import DEGREES
from kinverse.studies.rows import select

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["figure_7", "figure_8", "figure_9"]

COLOURS = ("tab:red", "tab:blue")


def figure_7() -> "Figure":
    """The tool's coordinates along the curved path, and how far splines stray from it."""
    robot, line = kv.load(ROBOT), named_path(PATHS[1])
    T, s = named_samples(PATHS[1])
    known, labels = branches_along(T)
    dense = np.linspace(0.0, line.length, 1001)
    wanted = line(dense)[:, :3, 3]
    figure = new_figure((10.0, 5.4))
    axes = figure.subplots(2, 3, sharex=True)
    for degree, style in zip(DEGREES, ("-", "--", ":"), strict=True):
        curve = JointCurve(s, known[labels.index(SHOWN[0])], degree=degree)
        strays = 1e3 * (judge.pose(robot, curve(dense))[:, :3, 3] - wanted)
        for k in range(3):
            axes[1, k].plot(dense / line.length, strays[:, k], style, label=f"degree {degree}")
    for k, name in enumerate("xyz"):
        axes[0, k].plot(dense / line.length, wanted[:, k], color="tab:red", label="path")
        axes[0, k].plot(s / line.length, T[:, k, 3], "ko", ms=4, label="accuracy points")
        axes[0, k].set_title(name, fontsize=10)
        axes[1, k].set_xlabel("share of the path")
        for row in axes:
            row[k].grid(alpha=0.3)
    axes[0, 0].set_ylabel("coordinate [m]")
    axes[1, 0].set_ylabel("off the path [mm]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    axes[1, 0].legend(frameon=False, fontsize=8)
    return figure


def figure_8(runs: dict[str, list[Row]]) -> "Figure":
    """Distance from the curved path over time; rows of ``moved`` by the kind of joint values."""
    figure = new_figure((9.0, 4.8))
    axes = figure.subplots()
    colours = (*COLOURS, *COLOURS, "tab:orange", "0.5")
    for (source, cell), colour in zip(runs.items(), colours, strict=True):
        if not select(cell, kind="instant", drive="joints"):
            continue
        away = np.maximum(_instants(cell, "joints", "away"), 1e-4)
        name = f"closed form, {source}" if source in SHOWN else source
        style = "-" if source in SHOWN else "--"
        axes.semilogy(_instants(cell, "joints", "t"), away, style, color=colour, label=name)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("distance from the path [mm]")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper", fontsize=8, frameon=False)
    return figure


def figure_9(runs: dict[str, list[Row]]) -> "Figure":
    """Force of each joint over time; rows of ``moved`` by the kind of joint values."""
    figure = new_figure((10.0, 6.0))
    for joint, axes in enumerate(figure.subplots(2, 3, sharex=True).ravel(), start=1):
        for label, colour in zip(SHOWN, COLOURS, strict=True):
            cell = runs[label]
            for drive, style in (("joints", "-"), ("tool", "--")):
                force = _instants(cell, drive, f"force {joint}") / 1e3
                name = f"{label}, {'tool held' if drive == 'tool' else 'joints driven'}"
                axes.plot(_instants(cell, drive, "t"), force, style, color=colour, label=name)
        axes.set_title(f"joint {joint}", fontsize=10)
        axes.grid(alpha=0.3)
        axes.set_ylim(bottom=0.0)
        if joint in (1, 4):
            axes.set_ylabel("force [kN]")
        if joint > 3:
            axes.set_xlabel("time [s]")
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def _instants(cell: list[Row], drive: str, column: str) -> np.ndarray:
    rows = select(cell, kind="instant", drive=drive)
    return np.array([row[column] for row in rows], dtype=np.float64)

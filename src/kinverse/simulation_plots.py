"""Pictures of simulations: loads and errors over time, side by side. Needs the extra "plot"."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from kinverse.errors import InputError
from kinverse.paths.simulate import Simulation
from kinverse.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["errors", "simulation_figure", "torques"]

LEAST = 1e-9
"""Errors are drawn on a logarithmic scale from here [m]."""


def simulation_figure(runs: Mapping[str, Simulation], title: str = "") -> "Figure":
    """What each run asked of its drives, one beneath the other, and the tool's errors.

    Args:
        runs: up to three simulations by name: drives, controllers or branches to compare.
        title: over all.

    Raises:
        InputError: no run, or more than three.
        MissingExtra: Matplotlib is not installed.

    Example:
        >>> simulation_figure({"elbow up": one, "elbow down": two}).savefig("torques.png")
    """
    if not 1 <= len(runs) <= 3:
        raise InputError(f"one to three runs can be drawn beside one another, got {len(runs)}")
    figure = new_figure((4.2 * len(runs) + 1.0, 6.4))
    axes = figure.subplots(2, len(runs), squeeze=False, sharey="row")
    for column, (name, run) in enumerate(runs.items()):
        torques(axes[0, column], run)
        axes[0, column].set_title(name, fontsize=10)
        errors(axes[1, column], run)
        if column:
            axes[0, column].set_ylabel("")
            axes[1, column].set_ylabel("")
    if title:
        figure.suptitle(title)
    return figure


def torques(axes: "Axes", run: Simulation) -> None:
    """Torque of each joint, or what holds the tool, over time."""
    driven = run.drive == "joints"
    values = run.torque if driven else run.constraint_force
    names = run.joint_names if driven else ("x", "y", "z", "about x", "about y", "about z")
    for name, column in zip(names, values.T, strict=True):
        axes.plot(run.t, column, label=name, linewidth=1.2)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("torque [Nm], force [N]")
    # below the axes: a legend among the curves would cover some
    axes.legend(fontsize=7, ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.22))
    axes.grid(alpha=0.3)


def errors(axes: "Axes", run: Simulation) -> None:
    """Distance of the tool from its path over time, in millimetres."""
    axes.plot(run.t, 1e3 * np.maximum(run.position_error, LEAST), color="tab:red", linewidth=1.2)
    axes.set_yscale("log")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("position error [mm]")
    axes.set_title(f"rms {1e3 * run.rms_position_error:.3g} mm", fontsize=9)
    axes.grid(alpha=0.3)

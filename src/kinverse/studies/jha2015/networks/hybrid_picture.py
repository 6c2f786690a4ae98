"""Test errors of the hybrid networks against the number of hidden units."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.table import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["errors_picture"]

MOST = 1.7
"""Errors are drawn up to so many times that of the mean joint."""


def errors_picture(arm: str, rows: list[Row], floor: float, constant: float) -> Picture:
    """Median with quartiles for each network, between the floor and the mean joint.

    Args:
        arm: whose.
        rows: of the summary table.
        floor: error of the best function of the position [rad].
        constant: error of the mean joint [rad].
    """
    return Picture(
        f"Test errors of the turning joints, {arm}",
        "Root mean square error on test rows against hidden units, a line with quartiles for each"
        f" network. The best function of the position has {floor:.2f} rad, the mean joint"
        f" {constant:.2f} rad; errors above {MOST * constant:.1f} rad are cut off.",
        partial(_figure, rows, floor, constant),
    )


def _figure(rows: list[Row], floor: float, constant: float) -> "Figure":
    figure = new_figure((6.5, 3.8))
    ax = figure.subplots()
    known = [row for row in rows if row["test RMS, median [rad]"] is not None]
    for network in dict.fromkeys(row["network"] for row in known):
        mine = [row for row in known if row["network"] == network]
        low, middle, high = (
            np.array([row[column] for row in mine], dtype=np.float64)
            for column in (
                "lower quartile [rad]",
                "test RMS, median [rad]",
                "upper quartile [rad]",
            )
        )
        if mine[0]["hidden"] is None:
            ax.axhline(middle[0], color="0.4", ls="-.", lw=1.0, label=f"{network}, no hidden units")
            continue
        hidden = np.array([row["hidden"] for row in mine], dtype=np.float64)
        (line,) = ax.plot(hidden, middle, marker=".", label=network)
        ax.fill_between(hidden, low, high, color=line.get_color(), alpha=0.15, linewidth=0)
    ax.axhline(constant, color="black", ls=":", lw=1.0, label="mean joint")
    ax.axhline(floor, color="black", lw=1.0, label="best function of the position")
    # trainings that go astray would press the others together
    ax.set_ylim(top=min(float(ax.get_ylim()[1]), MOST * constant))
    ax.set_xlabel("hidden units")
    ax.set_ylabel("test RMS of turning joints [rad]")
    ax.legend(frameon=False, fontsize="x-small", ncols=2)
    return figure

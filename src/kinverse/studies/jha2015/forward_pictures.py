"""Pictures of what fits the printed positions."""

from typing import TYPE_CHECKING

import numpy as np

from kinverse.studies.cell import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["fits_figure"]


def fits_figure(rows: list[Row]) -> "Figure":
    """Relative residuals of tables beside those of their shuffled copies.

    Raises:
        MissingExtra: Matplotlib is not installed.
    """
    from kinverse.plots import new_figure

    figure = new_figure((7.5, 3.6))
    axes = figure.subplots()
    names = [f"{row['table']}" for row in rows]
    for column, marker, label in (
        ("shuffled, median", "|", "shuffled copies, median"),
        ("shuffled, least", "x", "shuffled copies, least"),
        ("residual", "o", "as printed"),
        ("residual, one row left out", "D", "as printed, one row left out"),
    ):
        values = np.array([row[column] for row in rows], dtype=np.float64)
        axes.plot(values, names, marker, label=label, markersize=7)
    axes.set_xscale("log")
    axes.set_xlim(1e-7, 2.0)
    axes.invert_yaxis()
    axes.set_xlabel("residual of the best lengths, relative to the spread of the positions")
    axes.set_ylabel("table")
    axes.grid(True, axis="y", alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure

"""Figures 21 and 22: the links along trajectories 2 and 4, and how stretched the arm is."""

from typing import TYPE_CHECKING

import numpy as np

from kinverse.paths.collision import Capsules
from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.habibkhah2021.arm import IN_RANGES, arm, trajectory
from kinverse.studies.habibkhah2021.network import BANDS
from kinverse.studies.habibkhah2021.plan import first, main_cells
from kinverse.studies.rows import as_number, select, spread
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LINKS"]

FIGURES = {2: "figure 21", 4: "figure 22"}
EVERY = 6
"""Of the samples kept, those whose links are drawn."""


def _build(found: dict[str, list[Row]]) -> Table:
    every = [row for rows in found.values() for row in rows]
    rows: list[Row] = []
    for number in FIGURES:
        for low, high in zip(BANDS[:-1], BANDS[1:], strict=True):
            if seen := select(every, part="band", trajectory=number, from_deg=low):
                row: Row = {"trajectory": number, "elbow |theta2| from [deg]": low}
                row |= {"to [deg]": high, "samples": seen[0]["points"]}
                row |= spread(seen, "median").columns("tool off, median [m]")
                row |= spread(seen, "largest").columns("tool off, largest [m]")
                rows.append(row)
    least = {
        number: as_number(select(every, part="band", trajectory=number)[0], "least_deg")
        for number in FIGURES
    }
    off = {
        number: spread(
            select(every, part="class", trajectory=number, kind=IN_RANGES), "median"
        ).median
        for number in FIGURES
    }
    near, far = (
        spread(select(every, part="band", trajectory=2, from_deg=low), "median").median
        for low in (BANDS[0], BANDS[2])
    )
    shown = first(found)
    return Table(
        title="Figures 21 and 22: the links along trajectories 2 and 4",
        rows=rows,
        verdict=Verdict.CANNOT_CHECK,
        residual=(
            "no error is printed; on trajectory 2 the tool is"
            f" {near / far:.2g} times as far off with the elbow within {BANDS[1]:.0f} deg of"
            f" stretched as between {BANDS[2]:.0f} and {BANDS[3]:.0f} deg"
        ),
        note=(
            "The document says that near the stretched arm no accuracy is lost. With the tool"
            " pointing by atan2(y, x) the elbow of the exact answer stays"
            f" {least[2]:.1f} deg (trajectory 2) and {least[4]:.1f} deg (trajectory 4) or more"
            " from stretched. Rows are of samples with an answer inside the ranges (4)."
        ),
        pictures=tuple(
            Picture(
                f"Links along trajectory {number} ({name})",
                f"The arm drawn at samples along trajectory {number}, three links from the origin"
                f" to the tool as the network turns them; the tool is {off[number]:.2g} m from the"
                " target in the median where the ranges allow an answer, whose elbow is"
                f" {least[number]:.0f} deg or more from stretched.",
                lambda number=number: _draw(shown, number),  # type: ignore[misc]
            )
            for number, name in FIGURES.items()
        ),
    )


def _draw(rows: list[Row], number: int) -> "Figure":
    figure = new_figure((7.0, 6.0))
    ax = figure.subplots()
    seen = select(rows, part="sample", trajectory=number)[::EVERY]
    q = np.array([[row["q1"], row["q2"], row["q3"]] for row in seen], dtype=np.float64)
    points = Capsules(arm(), 0.0).points(q)[:, 1:]
    for row, line in zip(seen, points, strict=True):
        inside = row["kind"] == IN_RANGES
        colour = "tab:blue" if inside else "tab:orange"
        ax.plot(line[:, 0], line[:, 1], "-o", color=colour, ms=2.5, lw=0.8, alpha=0.6)
    T = trajectory(number).T
    ax.plot(T[:, 0, 3], T[:, 1, 3], color="k", lw=1.5, label="target")
    ax.plot([], [], color="tab:blue", label="links, an answer inside the ranges (4) exists")
    ax.plot([], [], color="tab:orange", label="links, none exists")
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize="small")
    return figure


LINKS = TableSpec(
    "figs-21-22", "Links along the path (section 4.2, figures 21 and 22)", main_cells, _build
)

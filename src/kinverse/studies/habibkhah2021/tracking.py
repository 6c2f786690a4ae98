"""Figures 17 to 20: the four trajectories as the network follows them."""

from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.habibkhah2021.arm import (
    CLASSES,
    IN_RANGES,
    NOT_FEASIBLE,
    TRAJECTORIES,
    arm,
    trajectory,
)
from kinverse.studies.habibkhah2021.plan import first, main_cells
from kinverse.studies.rows import select, spread
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TRACKING"]

COLOURS = dict(zip(CLASSES, ("tab:blue", "tab:orange", "tab:red"), strict=True))
PARTLY = (1, 3)
"""Trajectories of which parts do not meet the conditions."""
FARTHER = 2.0
"""How many times as far off a part has to be in the median to count as not tracked."""


def _build(found: dict[str, list[Row]]) -> Table:
    every = [row for rows in found.values() for row in rows]
    rows = []
    for number in TRAJECTORIES:
        for kind in CLASSES:
            if seen := select(every, part="class", trajectory=number, kind=kind):
                row: Row = {"trajectory": number, "poses": kind, "samples": seen[0]["points"]}
                row |= spread(seen, "median").columns("tool off, median [m]")
                row |= spread(seen, "95 %").columns("tool off, 95 % [m]")
                row |= spread(seen, "largest").columns("tool off, largest [m]")
                row["brought to the pose by Newton steps"] = spread(seen, "finished").median
                rows.append(row)
    off = {
        kind: spread(select(every, part="class", trajectory=1, kind=kind), "median").median
        for kind in (IN_RANGES, NOT_FEASIBLE)
    }
    ratio = off[NOT_FEASIBLE] / off[IN_RANGES]
    shown = first(found)
    runs = len(select(every, part="run"))
    return Table(
        title="Figures 17 to 20: the trajectories tracked",
        rows=rows,
        verdict=Verdict.CANNOT_CHECK,
        residual=(
            f"no error is printed; on trajectory 1 the tool is {off[IN_RANGES]:.3g} m off where"
            f" pose and ranges (4) allow an answer, {off[NOT_FEASIBLE]:.3g} m ({ratio:.3g} times"
            " as far) where condition (5) fails"
        ),
        note=(
            "The document: parts of trajectories 1 and 3 are not tracked, those which do not meet"
            f" the conditions. {_seen(every)} Predictions as they come, neither"
            f" refined nor verified, {runs} seed{'s' * (runs > 1)}; the last column counts those"
            " from which full Newton steps arrive at the pose, joint ranges left out."
        ),
        pictures=(
            Picture(
                "Target and tracked (figures 17 to 20)",
                "Four graphs in the plane: grey targets, and dots where the tool gets. Blue dots"
                f" (possible inside the ranges) lie {off[IN_RANGES]:.2g} m from the target in the"
                f" median, red ones (condition 5 fails) {off[NOT_FEASIBLE]:.2g} m.",
                lambda: _draw(shown),
            ),
        ),
    )


def _seen(every: list[Row]) -> str:
    """What our figures say of the parts that the document calls not tracked."""
    parts = []
    for number in PARTLY:
        off, finished = (
            {
                kind: spread(select(every, part="class", trajectory=number, kind=kind), column)
                for kind in (IN_RANGES, NOT_FEASIBLE)
            }
            for column in ("median", "finished")
        )
        ratio = off[NOT_FEASIBLE].median / off[IN_RANGES].median
        seen = ratio >= FARTHER and finished[NOT_FEASIBLE].median == 0.0
        parts.append(
            f"on trajectory {number} {'so' if seen else 'not so'} ({ratio:.3g} times as far off;"
            f" Newton steps arrive from {finished[NOT_FEASIBLE].median:g} of those that fail (5))"
        )
    return f"Ours: {', '.join(parts)}."


def _draw(rows: list[Row]) -> "Figure":
    figure = new_figure((10.0, 9.6))
    robot = arm()
    for ax, number in zip(figure.subplots(2, 2).ravel(), TRAJECTORIES, strict=True):
        T = trajectory(number).T
        ax.plot(T[:, 0, 3], T[:, 1, 3], color="0.6", lw=2.5, label="target", zorder=1)
        for kind in CLASSES:
            seen = select(rows, part="sample", trajectory=number, kind=kind)
            q = np.array([[row["q1"], row["q2"], row["q3"]] for row in seen], dtype=np.float64)
            if len(q):
                tool = robot.fk(q)[:, :2, 3]
                ax.plot(tool[:, 0], tool[:, 1], ".", ms=4, color=COLOURS[kind], label=kind)
        ax.set_aspect("equal")
        ax.set_title(f"trajectory {number}", fontsize=10)
        ax.set_xlabel("x [m]")
        ax.set_ylabel("y [m]")
        if number == 1:
            handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


TRACKING = TableSpec(
    "figs-17-20", "Trajectories tracked (section 4.2, figures 17 to 20)", main_cells, _build
)

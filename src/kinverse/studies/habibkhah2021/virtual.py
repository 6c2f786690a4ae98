"""Section 2.1: what a virtual vector is good for, kind by kind."""

from typing import TYPE_CHECKING

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.habibkhah2021.arm import IN_RANGES
from kinverse.studies.habibkhah2021.network import POSITION_ONLY
from kinverse.studies.habibkhah2021.plan import VIRTUALS, cells
from kinverse.studies.rows import as_number, select, spread
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["VIRTUAL"]

TOLD = {
    POSITION_ONLY: "x, y",
    "cos": "x, y, cos of the sum",
    "angle_sum": "x, y, the sum",
    "cos_sin": "x, y, cos and sin of the sum",
}
RMS, TOOL = "test rms [deg]", "tool off, test [m]"


def _build(found: dict[str, list[Row]]) -> Table:
    rows: list[Row] = []
    trainers = dict.fromkeys(name.split("-")[0] for name in found)
    for trainer in trainers:
        for virtual in VIRTUALS:
            of_kind = [v for name, v in found.items() if name.startswith(f"{trainer}-{virtual}-")]
            if of_kind:
                rows.append(_row(trainer, virtual, of_kind))
    by_kind = {row["told"]: row for row in rows if row["trainer"] == "varpro"}
    alone, both = (by_kind[TOLD[virtual]] for virtual in ("cos", "cos_sin"))
    nothing = by_kind[TOLD[POSITION_ONLY]]
    ratio = as_number(alone, RMS) / as_number(both, RMS)
    gain = as_number(nothing, RMS) / as_number(both, RMS)
    holds = gain > 1.0 and ratio > 1.0
    return Table(
        title="Section 2.1: the network without a virtual vector and with three kinds of it",
        rows=rows,
        verdict=Verdict.REPRODUCED if holds else Verdict.NOT_REPRODUCED,
        residual=(
            f"test rms of the joints {gain:.3g} times as large without a virtual vector, and"
            f" {ratio:.3g} times as large with the cosine alone, as with cosine and sine"
        ),
        note=(
            "The document says, without numbers, that position alone leads to inaccurate answers"
            " and that the cosine alone serves a limited range of the joints. The sum of the"
            " angles as a number is the form of its reference 28; along a trajectory it is known"
            " but for whole turns."
        ),
        pictures=(
            Picture(
                "Test error of the joints by what the network is told",
                "Bars of the joints' rms error on test samples, longest for x and y alone"
                f" ({as_number(nothing, RMS):.3g} deg), then with the cosine"
                f" ({as_number(alone, RMS):.3g} deg); {as_number(both, RMS):.3g} deg with cosine"
                " and sine.",
                lambda: _draw(list(by_kind.values())),
            ),
        ),
    )


def _row(trainer: str, virtual: str, of_kind: list[list[Row]]) -> Row:
    every = [row for rows in of_kind for row in rows]
    runs = select(every, part="run")
    row: Row = {"told": TOLD[virtual], "trainer": trainer, "epochs": runs[0]["epochs"]}
    row |= {"seeds": len(runs), "processor time [s]": spread(runs, "seconds").median}
    row |= spread(runs, "test_rms_deg").columns(RMS)
    row |= spread(runs, "tool_median").columns(TOOL)
    for number in (2, 4):
        inside = select(every, part="class", trajectory=number, kind=IN_RANGES)
        row[f"tool off, trajectory {number} inside (4) [m]"] = spread(inside, "median").median
    return row


def _draw(rows: list[Row]) -> "Figure":
    figure = new_figure((7.5, 2.8))
    ax = figure.subplots()
    told, values = [str(row["told"]) for row in rows], [as_number(row, RMS) for row in rows]
    bars = ax.barh(told, values, color="tab:blue", height=0.6)
    ax.bar_label(bars, fmt="%.3g", padding=3)
    ax.set_xlim(0.0, 1.15 * max(values))
    ax.invert_yaxis()
    ax.set_xlabel("rms error of the joints, test samples [deg]")
    return figure


VIRTUAL = TableSpec("virtual", "Virtual vectors compared (section 2.1)", cells, _build)

"""Table 4: processor time to train, test and predict, and of the iterative method."""

from typing import TYPE_CHECKING

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.networks import AS_PRINTED, CONSTANT, FAMILY
from kinverse.studies.chiddarwar2010.plan import MAIN, all_cells
from kinverse.studies.chiddarwar2010.regions import grouped
from kinverse.studies.chiddarwar2010.source import STUDY_NAME
from kinverse.studies.data import printed
from kinverse.studies.rows import Spread, as_number, select, spread, spread_of
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TABLE_4"]

TOTAL, SAID = "all of it [s]", "printed [min]"


def _build(found: dict[str, list[Row]]) -> Table:
    every = [row for rows in found.values() for row in select(rows, robot=MAIN)]
    path = select(every, part="path")
    rows: list[Row] = []
    networks = [row for row in every if row.get("network") != CONSTANT]
    trained = [row for row in networks if row.get("joint") == 1 and row["split"] != "pose"]
    for (method, network), group in grouped(trained, "method", "network").items():
        asked = "the loop" if "fusion" in str(method) else "directly"
        asking = select(path, method=method, network=network, asked=asked)
        training, testing = spread(group, "training_s"), spread(group, "testing_s")
        predicting = spread(asking, "prediction_s")
        row: Row = {"method": method, "network": network}
        row |= training.columns("training [s]") | testing.columns("testing [s]")
        row |= predicting.columns("prediction of five poses [s]")
        row[TOTAL] = training.median + testing.median + predicting.median
        row[SAID] = _minutes(FAMILY[str(network)])
        rows.append(row)
    iterated = [row for row in select(every, part="iterative") if row["solved"] == row["poses"]]
    first, rest = spread(iterated, "first_s"), spread(iterated, "rest_s")
    row = {"method": "iterative", "network": None}
    row |= first.columns("first solution [s]") | rest.columns("the other four [s]")
    row |= {TOTAL: first.median + rest.median, SAID: _minutes("iterative")}
    rows.append(row)
    share = _share(iterated, "s")
    of_work = _share(iterated, "evaluations")
    said = float(
        printed(STUDY_NAME, "times").where("method", "iterative").text("first_solution_%")[0]
    )
    said_minutes = [as_number(row, SAID) for row in rows]
    ours = {(row["method"], row["network"]): as_number(row, TOTAL) for row in rows}
    ratios = [
        ours[f"MLP {form}", AS_PRINTED["MLP"]] / ours[f"RBF {form}", AS_PRINTED["RBF"]]
        for form in ("fusion", "absolute")
    ]
    return Table(
        title="Table 4: processor time, split up",
        rows=rows,
        verdict=Verdict.CANNOT_CHECK,
        residual=(
            "times are of another machine and program; MLP over RBF: printed"
            f" {_minutes('MLP') / _minutes('RBF'):.2g}, ours"
            f" {ratios[0]:.2g} (fusion) and {ratios[1]:.2g} (absolute); first solution of the"
            f" iterative method: printed {said:g} % of its time, ours {share.median:.0f} %"
            f" ({of_work.median:.0f} % of its evaluations)"
        ),
        note=(
            f"Seconds of one processor on {MAIN}, medians over regions and seeds; the document's"
            " minutes are of a 2.4 GHz Pentium 4. The first iterative solution starts without a"
            " guess and restarts until it converges, the others start at the pose before"
            f" ({len(iterated)} paths where all five were solved; quartiles of the share"
            f" {share.low:.0f} to {share.high:.0f} %). The MLP is stopped after the epochs we give"
            " it, in the document after about 26 hours."
        ),
        pictures=(
            Picture(
                "Processor time, ours and printed",
                "Dots on a logarithmic scale: ours from"
                f" {min(as_number(row, TOTAL) for row in rows):.1g} s (iterative, five poses) to"
                f" {max(as_number(row, TOTAL) for row in rows):.1g} s; printed"
                f" {60 * min(said_minutes):.0f} to {60 * max(said_minutes):.0f} s.",
                lambda: _draw(rows),
            ),
        ),
    )


def _minutes(method: str) -> float:
    return float(printed(STUDY_NAME, "times").where("method", method).text("minutes")[0])


def _share(rows: list[Row], unit: str) -> Spread:
    first, rest = f"first_{unit}", f"rest_{unit}"
    return spread_of(
        100.0 * as_number(row, first) / (as_number(row, first) + as_number(row, rest))
        for row in rows
    )


def _draw(rows: list[Row]) -> "Figure":
    figure = new_figure((8.0, 4.0))
    ax = figure.subplots()
    names = [
        f"{row['method']}, {row['network']}" if row["network"] else "iterative" for row in rows
    ]
    places = range(len(rows))
    ax.plot([as_number(row, TOTAL) for row in rows], places, "o", color="tab:blue", label="ours")
    said = [60.0 * as_number(row, SAID) for row in rows]
    ax.plot(said, places, "s", color="tab:orange", label="printed (another machine)")
    ax.set_yticks(places, names)
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.grid(axis="x", color="0.9")
    ax.set_xlabel("processor time [s]")
    ax.legend(loc="center left", frameon=False)
    return figure


TABLE_4 = TableSpec("table-4", "Processor time (section 4, table 4)", all_cells, _build)

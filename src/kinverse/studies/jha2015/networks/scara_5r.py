"""Tables 7.4, 7.6 and 7.10: perceptrons and ANFIS on the SCARA and the 5R arm."""

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.networks.sets import (
    CONFIGURATIONS,
    Configuration,
    Floor,
    floor_cell,
    floor_of,
    known_quartiles,
    output_names,
    squared_units,
)
from kinverse.studies.jha2015.networks.training import train_network
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SWEPT", "TABLES", "errors_of", "scara_5r_cells"]

HIDDEN = "10-10"
"""Two hidden layers are printed, their units are not."""
EPOCHS, QUICK_EPOCHS = 10_000, 500
SEEDS, QUICK_SEEDS = 5, 2
SETS, QUICK_SETS = "7", "3"
ANFIS_ROWS = (700, 300)
ANFIS_EPOCHS = 10
SWEPT = "MLP, joints swept"
REGRESSION = ("MLP", "MLP, rows exchanged", SWEPT)


class Reading(NamedTuple):
    """A network, and how its rows are drawn and split."""

    network: str
    as_text: bool = True
    """Split as in the text, else as in the table."""
    swept: bool = False
    """All joints go through their ranges together, as the grids of table 7.3 would have it."""


NETWORKS = {
    "MLP": Reading("gdm"),
    "MLP, rows exchanged": Reading("gdm", as_text=False),
    SWEPT: Reading("gdm", swept=True),
    "ANFIS, bells, order 0": Reading("anfis-gbell-0:1e-8"),
    "ANFIS, bells, order 0, ridge": Reading("anfis-gbell-0:1e-2"),
    "ANFIS, Gaussians, order 1, ridge": Reading("anfis-gauss-1:1e-2"),
    "ANFIS, joints swept": Reading("anfis-gbell-0:1e-2", swept=True),
}


def _name(arm: str, label: str) -> str:
    network, as_text, swept = NETWORKS[label]
    drawn = "swept-" * swept + ("text" if as_text else "table")
    return f"network-{arm}-{network.replace(':', '-')}-{drawn}"


def scara_5r_cells(arm: str, labels: tuple[str, ...], quick: bool) -> list[Cell]:
    """The trainings of an arm's networks, and the least errors of any function."""
    each = CONFIGURATIONS[arm]
    cells = []
    for label in labels:
        network, as_text, swept = NETWORKS[label]
        fuzzy = network.startswith("anfis")
        train, test = ANFIS_ROWS if fuzzy else each.sizes if as_text else each.sizes[::-1]
        cells.append(
            Cell(
                _name(arm, label),
                train_network,
                {
                    "geometry_name": each.geometry,
                    "network": network,
                    "hidden": (QUICK_SETS if quick else SETS) if fuzzy else HIDDEN,
                    "train": train,
                    "test": test,
                    "seeds": QUICK_SEEDS if quick else SEEDS,
                    "budget": ANFIS_EPOCHS if fuzzy else QUICK_EPOCHS if quick else EPOCHS,
                    "rate": each.value("Learning rate", 0.1),
                    "momentum": each.value("Momentum parameter", 0.9),
                    "keep": label == "MLP",
                    "swept": swept,
                },
            )
        )
    return [*cells, floor_cell(each.geometry, quick)]


def errors_of(cells: dict[str, list[Row]], arm: str, label: str, output: str) -> list[Row]:
    """The errors of an output, a row for each seed."""
    rows = cells[_name(arm, label)]
    return [row for row in rows if row["kind"] == "error" and row["output"] == output]


# --------------------------------------------------------------------- regression, table 7.4
def _regression(cells: dict[str, list[Row]]) -> Table:
    arm, labels = "SCARA", REGRESSION
    each = CONFIGURATIONS[arm]
    told = printed("jha2015", "table_7_4").numbers(["regression_R", "mse"])
    floors = floor_of(cells, each.geometry)
    factors, units = squared_units(each.geometry)
    rows: list[Row] = []
    above, reached = 0, 0
    for label in labels:
        for k, name in enumerate(output_names(each.geometry)):
            mine = errors_of(cells, arm, label, name)
            r, trained = known_quartiles(mine, "r_test"), known_quartiles(mine, "r_training")
            mse = known_quartiles(mine, "test")
            most = None if label == SWEPT else _best_r(floors[name])
            above += label == "MLP" and most is not None and bool(told[k, 0] > most)
            reached += label == SWEPT and r is not None and bool(r[1] >= told[k, 0])
            rows.append(
                {
                    "network": label,
                    "joint": name,
                    "R on test rows, median": r and r[1],
                    "lower quartile": r and r[0],
                    "upper quartile": r and r[2],
                    "R on training rows, median": trained and trained[1],
                    "R, printed": float(told[k, 0]),
                    "R of the best function of X, Y, Z": most,
                    "test mse [unit]": mse and mse[1] * float(factors[k]),
                    "mse, printed": float(told[k, 1]),
                    "unit": units[k],
                }
            )
    return Table(
        "Table 7.4 and figure 7.10: regression of the perceptron, SCARA",
        rows,
        Verdict.OTHER_READING if reached == len(told) else Verdict.CANNOT_CHECK,
        f"joints swept together: the printed R or more for {reached} of {len(told)} joints; drawn"
        f" one by one: {above} of 3 printed R of turning joints are above that of the best"
        " function of the position",
        f"Two hidden layers of {HIDDEN.split('-')[0]} units, rate, momentum and epochs as printed;"
        f" {each.conflicts}. How the joints are drawn is not told. Drawn one by one, evenly in the"
        " printed limits, a position leaves two elbows and joint 4 open. Swept together, all"
        " through their ranges at once, it determines them: table 7.3 has d3, and the fractions of"
        " the angles, on even grids (see flags).",
        (_regression_picture(cells),),
    )


def _best_r(floor: Floor) -> float | None:
    """Correlation of predictions that have the least error possible."""
    if floor.least is None:
        return None
    return float(np.sqrt(max(0.0, 1.0 - floor.least / floor.constant)))


def _regression_picture(cells: dict[str, list[Row]]) -> Picture:
    found = [row for row in cells[_name("SCARA", "MLP")] if row["kind"] == "pair"]
    names = output_names(CONFIGURATIONS["SCARA"].geometry)
    r = []
    for name in names:
        wanted, guess = _pairs(found, name)
        r.append(f"{name} {np.corrcoef(wanted, guess)[0, 1]:.2f}")
    return Picture(
        "Figure 7.10: wanted and predicted joints on test rows, SCARA",
        "Four scatter plots of predictions against wanted joint values with the diagonal;"
        f" correlations {', '.join(r)}.",
        partial(_regression_figure, found, names),
    )


def _pairs(rows: list[Row], name: str) -> "tuple[np.ndarray, np.ndarray]":
    mine = [row for row in rows if row["output"] == name]
    wanted, guess = (
        np.array([row[part] for row in mine], dtype=np.float64) for part in ("wanted", "predicted")
    )
    return wanted, guess


def _regression_figure(rows: list[Row], names: list[str]) -> "Figure":
    figure = new_figure((11.0, 3.0))
    for ax, name in zip(figure.subplots(1, len(names)), names, strict=True):
        wanted, guess = _pairs(rows, name)
        unit, factor = ("mm", 1e3) if name.startswith("d") else ("deg", np.degrees(1.0))
        ends = np.array([wanted.min(), wanted.max()]) * factor
        ax.plot(ends, ends, color="0.6", lw=0.8)
        ax.plot(wanted * factor, guess * factor, ls="", marker=".", ms=4)
        ax.set_title(name)
        ax.set_xlabel(f"wanted [{unit}]")
        ax.set_ylabel(f"predicted [{unit}]")
    return figure


# --------------------------------------------------------------------- tables 7.6 and 7.10
PRINTED = {
    "7.6": ("SCARA", {"MLP": "mse_mlpnn", "ANFIS": "mse_anfis"}),
    "7.10": ("Pioneer2_5R", {"MLP": "avg_test_error_mlpnn", "ANFIS": "avg_test_error_anfis"}),
}


def _compare(table: str, cells: dict[str, list[Row]]) -> Table:
    arm, columns = PRINTED[table]
    each: Configuration = CONFIGURATIONS[arm]
    told = printed("jha2015", "table_" + table.replace(".", "_"))
    floors = floor_of(cells, each.geometry)
    factors, units = squared_units(each.geometry)
    rows: list[Row] = []
    below, compared, reached, tried = 0, 0, 0, 0
    for label, reading in NETWORKS.items():
        kind = label.split(",")[0]
        values = told.numbers([columns[kind]])[:, 0].tolist()
        for k, name in enumerate(output_names(each.geometry)):
            floor = floors[name]
            mse = known_quartiles(errors_of(cells, arm, label, name), "test")
            trained = known_quartiles(errors_of(cells, arm, label, name), "training")
            turns = floor.scaled is not None
            if label in ("MLP", "ANFIS, bells, order 0") and floor.scaled is not None:
                compared += 1
                below += values[k] < floor.scaled
            if reading.swept and turns:
                tried += 1
                reached += mse is not None and mse[1] <= values[k]
            factor = float(factors[k])
            rows.append(
                {
                    "network": label,
                    "joint": name,
                    "test mse, median [unit]": mse and mse[1] * factor,
                    "lower quartile [unit]": mse and mse[0] * factor,
                    "upper quartile [unit]": mse and mse[2] * factor,
                    "training mse, median [unit]": trained and trained[1] * factor,
                    "printed": values[k],
                    "least of any function of X, Y, Z [unit]": (
                        None if reading.swept else floor.least
                    ),
                    "the same, ranges scaled to 0..1": None if reading.swept else floor.scaled,
                    "mse of the mean [unit]": floor.constant * factor,
                    "unit": units[k],
                }
            )
    return Table(
        f"Table {table}: perceptron and ANFIS, {arm}",
        rows,
        Verdict.OTHER_READING if reached == tried else Verdict.CANNOT_CHECK,
        f"joints swept together: the printed error [rad^2] or less for {reached} of {tried} turning"
        f" joints; drawn one by one: {below} of {compared} printed errors are below the least of"
        " any function of the position, even if ranges were scaled to 0..1",
        "How the joints are drawn is not told: one by one, evenly in the printed limits, or swept"
        " through their ranges together (see 7.4)."
        f" {each.conflicts}. ANFIS: {ANFIS_ROWS[0]} training and {ANFIS_ROWS[1]} test rows, seven"
        " sets an input (quick: three); 63 nonlinear parameters are those of bells, the text says"
        " Gaussian: both. With a ridge, rules that few rows reach are held down. The unit of the"
        " printed errors is not told.",
    )


_ALL = tuple(NETWORKS)
TABLES: tuple[TableSpec, ...] = (
    TableSpec(
        "7.4",
        "Regression of the perceptron on the SCARA arm, table 7.4",
        partial(scara_5r_cells, "SCARA", REGRESSION),
        _regression,
        covers=("fig-7.10",),
    ),
    TableSpec(
        "7.6",
        "Perceptron and ANFIS on the SCARA arm, table 7.6",
        partial(scara_5r_cells, "SCARA", _ALL),
        partial(_compare, "7.6"),
    ),
    TableSpec(
        "7.10",
        "Perceptron and ANFIS on the 5R arm, table 7.10",
        partial(scara_5r_cells, "Pioneer2_5R", _ALL),
        partial(_compare, "7.10"),
    ),
)

"""Tables 7.11 to 7.24: networks whose weights a swarm finds, on the six spatial arms."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.networks.hybrid_picture import errors_picture
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
from kinverse.studies.jha2015.networks.training import SWARM_METHODS, train_network
from kinverse.studies.jha2015.printed_values import ROUNDING
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = [
    "ANFIS",
    "METHODS",
    "TABLES",
    "hidden_of",
    "hybrid_cells",
    "hybrid_rows",
    "printed_errors",
]

Array = NDArray[np.float64]
CellRows = dict[str, list[Row]]

METHODS = {"gdm": "MLPBP", **{name: f"MLP{name.upper()}" for name in SWARM_METHODS}}
"""What trains a network, and its printed name."""
LBFGS, LBFGS_TITLE = "lbfgs", "MLP L-BFGS (ours)"
"""A trainer of another kind beside them."""
ANFIS, ANFIS_PRINTED = "anfis-gbell-0:1e-2", "ANFIS"
SEEDS, QUICK_SEEDS = 5, 2
TRIED, QUICK_TRIED = 15_000, 500
"""Networks that a swarm of 100 tries; the thesis does not say how many."""
EPOCHS = 1_000
"""Of back-propagation, where none are printed."""
TWO_LAYERS = (
    " The printed configuration has two hidden layers, the errors stand beside one number of nodes:"
    " one layer here."
)


def hidden_of(each: Configuration) -> list[int]:
    """Hidden units that an arm's table has columns for."""
    rows = printed("jha2015", "table_" + each.errors.replace(".", "_"))
    return sorted({int(value) for value in rows.text("hidden_nodes")})


def hybrid_cells(arm: str, quick: bool) -> list[Cell]:
    """Every method with every number of hidden units (quick: the least and the most), and ANFIS."""
    each = CONFIGURATIONS[arm]
    train, test = each.sizes
    units = hidden_of(each)
    wanted = [
        (method, str(hidden))
        for hidden in ([units[0], units[-1]] if quick else units)
        for method in (*METHODS, LBFGS)
    ]
    wanted.append((ANFIS, "3" if quick else "7"))
    cells = [
        Cell(
            _name(arm, method, hidden),
            train_network,
            {
                "geometry_name": each.geometry,
                "network": method,
                "hidden": hidden,
                "train": train,
                "test": test,
                "seeds": QUICK_SEEDS if quick else SEEDS,
                "budget": _budget(each, method, quick),
                "rate": each.value("Learning rate", 0.1),
                "momentum": each.value("Momentum parameter", 0.9),
            },
        )
        for method, hidden in wanted
    ]
    return [*cells, floor_cell(each.geometry, quick)]


def _budget(each: Configuration, method: str, quick: bool) -> int:
    if method == ANFIS:
        return 10
    if method == LBFGS:
        return 100 if quick else 300
    if method == "gdm":
        return 100 if quick else int(each.value("Number of epochs", EPOCHS))
    return QUICK_TRIED if quick else TRIED


def _name(arm: str, method: str, hidden: str) -> str:
    return f"network-hybrid-{arm}-{method.replace(':', '-')}-{hidden}"


def hybrid_rows(cells: CellRows, arm: str, method: str, output: str | None) -> dict[int, list[Row]]:
    """Rows of a method by hidden units, for one joint or all; of ANFIS under its sets."""
    head = _name(arm, method, "")
    return {
        int(name[len(head) :]): [row for row in rows if output in (None, row["output"])]
        for name, rows in cells.items()
        if name.startswith(head)
    }


# ------------------------------------------------------------------------ joint by joint
def _by_joint(arm: str, part: str, cells: CellRows) -> Table:
    each = CONFIGURATIONS[arm]
    floors, told = floor_of(cells, each.geometry), printed_errors(each)
    factors, units = squared_units(each.geometry)
    titles = {title for _, title, _ in told}
    rows: list[Row] = []
    for k, output in enumerate(output_names(each.geometry)):
        factor = float(factors[k])
        found = {method: hybrid_rows(cells, arm, method, output) for method in METHODS}
        fuzzy = hybrid_rows(cells, arm, ANFIS, output)
        for hidden in sorted(found["gdm"]):
            row: Row = {"joint": output, "unit": units[k], "hidden": hidden}
            row["seeds"] = len(found["gdm"][hidden])
            for method, title in METHODS.items():
                row |= _with_quartiles(title, found[method][hidden], part, factor)
                if title in titles:
                    row[f"{title} printed"] = told.get((output, title, hidden))
            if ANFIS_PRINTED in titles:
                [mine] = fuzzy.values()
                row |= _with_quartiles(ANFIS_PRINTED, mine, part, factor)
                row[f"{ANFIS_PRINTED} printed"] = told.get((output, ANFIS_PRINTED, hidden))
            if part == "test":
                row["least of any function, fresh rows"] = floors[output].least
                row["least, scaled to 0..1"] = floors[output].scaled
            rows.append(row)
    values = np.array(list(told.values()))
    small = (
        f"{int((values == 0).sum())} of {len(values)} printed errors are zero,"
        f" {int(((values > 0) & (values < ROUNDING)).sum())} others below {ROUNDING:g}"
    )
    if part == "test":
        below, compared = _below(told, floors)
        small += (
            f"; {below} of {compared} of turning joints are below what any function of the position"
            " has on fresh rows, ranges scaled to 0..1, if joints are drawn one by one, evenly in"
            " the printed limits"
        )
    sized = f"{each.sizes[0]} training and {each.sizes[1]} test rows"
    return Table(
        f"Table {each.errors}: mean squared errors on {part} rows, {arm}",
        rows,
        Verdict.CANNOT_CHECK,
        small,
        "How the joints are drawn is not told; ours one by one, evenly."
        f" Medians of the seeds on {part} rows; the printed title says training. Printed"
        f" configuration, table {each.table}: {sized}. {each.conflicts or 'No conflicts'}."
        " ANFIS has no hidden units, though the printed one varies with them: one result."
        " The unit of the printed errors is not told."
        + (TWO_LAYERS if each.value("Number of hidden layers", 1) == 2 else ""),
    )


def _with_quartiles(title: str, rows: list[Row], part: str, factor: float) -> Row:
    """Median and quartiles over the seeds; None where a training diverged."""
    mse = known_quartiles(rows, part)
    names = (f"{title}, lower quartile", title, f"{title}, upper quartile")
    return {names[k]: mse and mse[k] * factor for k in (1, 0, 2)}


def printed_errors(each: Configuration) -> dict[tuple[str, str, int], float]:
    """Printed mean squared errors by joint, algorithm and hidden units."""
    rows = printed("jha2015", "table_" + each.errors.replace(".", "_"))
    keys = zip(
        rows.text("output"),
        rows.text("algorithm"),
        map(int, rows.text("hidden_nodes")),
        strict=True,
    )
    return dict(zip(keys, rows.numbers(["mse_printed"])[:, 0].tolist(), strict=True))


def _below(told: dict[tuple[str, str, int], float], floors: dict[str, Floor]) -> tuple[int, int]:
    """How many printed errors no function of the position has, and of how many."""
    pairs = [
        (value, floors[output].scaled) for (output, _, _), value in told.items() if output in floors
    ]
    known = [(value, least) for value, least in pairs if least is not None]
    return sum(value < least for value, least in known), len(known)


# ------------------------------------------------------------------------ all joints together
def _summary(arm: str, cells: CellRows) -> Table:
    each = CONFIGURATIONS[arm]
    floors = floor_of(cells, each.geometry)
    rows: list[Row] = []
    for method, title in {**METHODS, LBFGS: LBFGS_TITLE, ANFIS: ANFIS_PRINTED}.items():
        for hidden, found in sorted(hybrid_rows(cells, arm, method, None).items()):
            turning = [row for row in found if str(row["output"]).startswith("theta")]
            test, training = (_pooled(turning, part) for part in ("test", "training"))
            seconds = known_quartiles(found, "seconds")
            rows.append(
                {
                    "network": title,
                    "hidden": hidden if method != ANFIS else None,
                    "test RMS, median [rad]": test and test[1],
                    "lower quartile [rad]": test and test[0],
                    "upper quartile [rad]": test and test[2],
                    "training RMS, median [rad]": training and training[1],
                    "CPU, median [s]": seconds and seconds[1],
                }
            )
    leasts = [floor.least for floor in floors.values() if floor.least is not None]
    constants = [floor.constant for floor in floors.values() if floor.least is not None]
    floor, constant = float(np.sqrt(np.mean(leasts))), float(np.sqrt(np.mean(constants)))
    known = [row for row in rows if row["test RMS, median [rad]"] is not None]
    best = min(known, key=lambda row: float(row["test RMS, median [rad]"] or 0.0))
    return Table(
        f"Turning joints together, {arm}",
        rows,
        Verdict.OURS,
        f"lowest: {best['network']} with {best['test RMS, median [rad]']:.3f} rad on test rows;"
        f" the best function of the position {floor:.3f}, the mean joint {constant:.3f}",
        "Root of the mean squared error over turning joints. A dash: the training diverged.",
        (errors_picture(arm, rows, floor, constant),),
    )


def _pooled(rows: list[Row], part: str) -> tuple[float, float, float] | None:
    """Quartiles over the seeds of the root mean square over the joints."""
    if any(row[part] is None for row in rows):
        return None
    squares = np.array([row[part] for row in rows], dtype=np.float64)
    seeds = len({row["seed"] for row in rows})
    each = np.sqrt(squares.reshape(seeds, -1).mean(axis=1))
    return quartiles(each)


def _specs() -> tuple[TableSpec, ...]:
    specs = []
    for arm, each in CONFIGURATIONS.items():
        cells = partial(hybrid_cells, arm)
        head, title = each.errors, f"{arm}, tables {each.table} and {each.errors}"
        specs += [
            TableSpec(
                head, f"Errors on test rows, {title}", cells, partial(_by_joint, arm, "test")
            ),
            TableSpec(
                f"{head}-training",
                f"Errors on training rows, {title}",
                cells,
                partial(_by_joint, arm, "training"),
            ),
            TableSpec(f"{head}-summary", f"Summary, {title}", cells, partial(_summary, arm)),
        ]
    return tuple(specs)


TABLES: tuple[TableSpec, ...] = _specs()

"""Tables of settings, 7.2 to 7.22: each printed value, what is taken, and what contradicts."""

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.geometries import geometry
from kinverse.studies.jha2015.networks.sets import CONFIGURATIONS, Configuration
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES", "configuration_rows"]

FUZZY = {"7.5": "SCARA", "7.9": "Pioneer2_5R"}
"""Tables of the settings of ANFIS, and their arms."""
SETS, INPUTS = 7, 3
COUNTS = {
    "Number of nodes": "n_nodes",
    "Number of linear parameters": "n_linear",
    "Number of nonlinear parameters": "n_nonlinear",
    "Number of fuzzy rules": "n_rules",
}


def configuration_rows() -> list[Row]:
    """Every printed setting: the value, what our networks take, whether they are one."""
    rows = [row for each in CONFIGURATIONS.values() for row in _perceptron(each)]
    return rows + [row for table, arm in FUZZY.items() for row in _fuzzy(table, arm)]


def _perceptron(each: Configuration) -> list[Row]:
    train, test = each.sizes
    joints = geometry(each.geometry).dof
    taken = {
        "Training datasets": train,
        "Testing datasets": test,
        "Target datasets": train + test,
        "Number of output": joints,
    }
    return [
        _row(each.table, each.arm, "MLP", name, value, taken.get(name, value))
        for name, value in _settings(each.table).items()
    ]


def _fuzzy(table: str, arm: str) -> list[Row]:
    from kinverse.networks.fuzzy.rules import Rules

    rules = Rules.of(SETS, INPUTS, "gbell", 0)
    total = {"Total number of parameters": rules.n_linear + rules.n_nonlinear}
    counted = {name: getattr(rules, count) for name, count in COUNTS.items()} | total
    return [
        _row(table, arm, "ANFIS", name, value, counted.get(name, value))
        for name, value in _settings(table).items()
    ]


def _settings(table: str) -> dict[str, float]:
    rows = printed("jha2015", "table_" + table.replace(".", "_"))
    values = rows.numbers(["value"])[:, 0].tolist()
    return dict(zip(rows.text("parameter"), values, strict=True))


def _row(table: str, arm: str, network: str, name: str, told: float, taken: float) -> Row:
    return {
        "table": table,
        "arm": arm,
        "network": network,
        "setting": name,
        "printed": told,
        "taken or counted": taken,
        "the same": told == taken,
    }


CELL = Cell("network-configurations", configuration_rows)


def _build(cells: dict[str, list[Row]]) -> Table:
    rows = cells[CELL.name]
    other = [row for row in rows if not row["the same"]]
    counts = [row for row in rows if row["network"] == "ANFIS" and row["setting"] in COUNTS]
    same = sum(bool(row["the same"]) for row in counts)
    conflicts = "; ".join(each.conflicts for each in CONFIGURATIONS.values() if each.conflicts)
    return Table(
        "Tables 7.2, 7.5, 7.8, 7.9, 7.13, 7.16, 7.19, 7.22: settings of the networks",
        rows,
        Verdict.OTHER_READING if other else Verdict.REPRODUCED,
        f"{len(rows) - len(other)} of {len(rows)} settings are taken as printed; {same} of"
        f" {len(counts)} counts of ANFIS are those of {SETS} bells an input and a constant a rule",
        f"{conflicts}. Gaussians, which the text names, would have two nonlinear parameters a set"
        f" ({2 * SETS * INPUTS}) where the tables print those of bells ({3 * SETS * INPUTS}). Units"
        " of the hidden layers are not printed.",
    )


TABLES: tuple[TableSpec, ...] = (
    TableSpec(
        "7.2",
        "Settings of the networks, tables 7.2, 7.5, 7.8, 7.9, 7.13, 7.16, 7.19, 7.22",
        lambda quick: [CELL],
        _build,
        covers=("7.5", "7.8", "7.9", "7.13", "7.16", "7.19", "7.22"),
    ),
)

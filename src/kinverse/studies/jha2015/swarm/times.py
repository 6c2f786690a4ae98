"""Table 7.41, with 7.29 and 7.32: CPU time of the population methods."""

import numpy as np

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.positions import ALGORITHMS, ARMS
from kinverse.studies.jha2015.swarm.cells import EVALUATIONS, MAIN, QUICK_EVALUATIONS, numbers
from kinverse.studies.jha2015.swarm.search import search_times
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES"]

ALONE = {"Pioneer2_5R": "7.29", "PUMA560": "7.32"}
"""Tables that print the times of one arm once more."""


def _cells(quick: bool) -> list[Cell]:
    budget = QUICK_EVALUATIONS if quick else EVALUATIONS
    return [
        Cell(
            f"swarm-time-{arm}-{algorithm}",
            search_times,
            {"arm": arm, "algorithm": algorithm, "population": MAIN, "evaluations": budget},
        )
        for arm in ARMS
        for algorithm in ALGORITHMS
    ]


def _build(cells: dict[str, list[Row]]) -> Table:
    told = _printed("7.41")
    again = {key: value for table in ALONE.values() for key, value in _printed(table).items()}
    rows: list[Row] = []
    for arm in ARMS:
        for algorithm in ALGORITHMS:
            mine = cells[f"swarm-time-{arm}-{algorithm}"]
            low, middle, high = quartiles(numbers(mine, "seconds"))
            evaluations = int(numbers(mine, "evaluations")[0])
            rows.append(
                {
                    "arm": arm,
                    "algorithm": algorithm,
                    "CPU, median [s]": middle,
                    "lower quartile [s]": low,
                    "upper quartile [s]": high,
                    "an evaluation [us]": 1e6 * middle / evaluations,
                    "printed, 7.41 [s]": told.get((arm, algorithm)),
                    "printed, 7.29 or 7.32 [s]": again.get((arm, algorithm)),
                }
            )
    twice = [key for key in again if key in told]
    apart = max(abs(again[key] - told[key]) for key in twice)
    quickest = {min(ALGORITHMS, key=lambda a: told[arm, a]) for arm in ARMS if (arm, "ga") in told}
    ours = {min(ALGORITHMS, key=lambda a: _median(cells[f"swarm-time-{arm}-{a}"])) for arm in ARMS}
    return Table(
        "Table 7.41: CPU time of a search",
        rows,
        Verdict.CANNOT_CHECK,
        f"the {len(twice)} times that 7.29 and 7.32 print again agree within {apart:.3f} s",
        f"One search of one position, alone, population {MAIN}, {evaluations:,}"
        " evaluations. The printed evaluations, and what one printed time covers, are not told,"
        f" so times cannot be compared. Quickest printed: {', '.join(sorted(quickest))};"
        f" ours: {', '.join(sorted(ours))}.",
    )


def _median(rows: list[Row]) -> float:
    return float(np.median(numbers(rows, "seconds")))


def _printed(table: str) -> dict[tuple[str, str], float]:
    """Printed seconds by arm and algorithm."""
    rows = printed("jha2015", "table_" + table.replace(".", "_"))
    arms = {name: arm for arm, name in ALONE.items()}
    names = rows.text("robot") if "robot" in rows.columns else [arms[table]] * len(rows)
    algorithms = [name.lower() for name in rows.text("algorithm")]
    seconds = rows.numbers(["time_s"])[:, 0].tolist()
    return dict(zip(zip(names, algorithms, strict=True), seconds, strict=True))


TABLES: tuple[TableSpec, ...] = (
    TableSpec(
        "7.41",
        "CPU time of the population methods, tables 7.29, 7.32, 7.41",
        _cells,
        _build,
        covers=tuple(ALONE.values()),
    ),
)

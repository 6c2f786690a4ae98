"""Table 7.40: CPU time of training a network."""

import numpy as np

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.networks.hybrid import ANFIS, METHODS, hybrid_cells, hybrid_rows
from kinverse.studies.jha2015.networks.planar import NETWORKS, planar_cells
from kinverse.studies.jha2015.networks.sets import CONFIGURATIONS
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES"]

PLANAR = {"MLP": "MLP 2-5-5-3, back-propagation", "Pi-Sigma": "Pi-Sigma, order 3"}


def _cells(quick: bool) -> list[Cell]:
    every = [cell for arm in CONFIGURATIONS for cell in hybrid_cells(arm, quick)]
    return [*planar_cells(quick), *every]


def _build(cells: dict[str, list[Row]]) -> Table:
    rows: list[Row] = []
    titles = {title: method for method, title in METHODS.items()}
    told = printed("jha2015", "table_7_40")
    for line, printed_time in zip(told.rows, told.numbers(["time_s"])[:, 0].tolist(), strict=True):
        arm, network = line["robot"], line["method"]
        if network in PLANAR:
            kind, hidden = NETWORKS[PLANAR[network]]
            found = cells[f"network-planar-{kind}-{hidden}"]
            units = hidden
        else:
            by_units = hybrid_rows(cells, arm, titles.get(network, ANFIS), None)
            most = max(by_units)
            found, units = by_units[most], str(most)
        seconds = [row["seconds"] for row in found if row["kind"] == "error"]
        low, middle, high = quartiles(np.array(seconds, dtype=np.float64))
        rows.append(
            {
                "arm": arm,
                "network": network,
                "hidden units, of ANFIS sets": units,
                "CPU, median [s]": middle,
                "lower quartile [s]": low,
                "upper quartile [s]": high,
                "printed [s]": printed_time if np.isfinite(printed_time) else None,
                "legibility of the printed": line["ocr_note"] or None,
            }
        )
    lost = sum(1 for row in rows if row["printed [s]"] is None)
    return Table(
        "Table 7.40: CPU time of the networks",
        rows,
        Verdict.CANNOT_CHECK,
        f"{lost} of {len(rows)} printed times are not legible in our copy; what one covers is not"
        " told",
        "Ours: one training of all outputs with the most hidden units.",
    )


TABLES: tuple[TableSpec, ...] = (
    TableSpec("7.40", "CPU time of the networks, table 7.40", _cells, _build),
)

"""What section 6 prints, and what is read into it."""

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.masajedi2013.bees import colony
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES", "points_a_step"]


def points_a_step() -> int:
    """The n of equation 28, with one number of recruits for all selected patches."""
    bees = colony()
    recruits = bees.elites * bees.elite_recruits + (bees.sites - bees.elites) * bees.recruits
    return int(recruits + bees.population)


def _cells(quick: bool) -> list[Cell]:
    return []


def _table(rows: dict[str, list[Row]]) -> Table:
    table: list[Row] = [dict(row) for row in printed("masajedi2013", "parameters").rows]
    table.append(
        {
            "parameter": "eq. 28 with these numbers",
            "value": str(points_a_step()),
            "unit": "points a step",
            "note": "computed: e ne + (m - e) ns + s",
        }
    )
    return Table(
        title="Section 6: parameters of the bees algorithm",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=f"equation 28 gives n = {points_a_step()}; n is not printed",
        note="Read from section 6. The number of steps, the factor of equation 30 and the unit of"
        " the patch radius are not printed.",
    )


TABLES = (TableSpec("parameters", "Section 6: parameters", _cells, _table),)

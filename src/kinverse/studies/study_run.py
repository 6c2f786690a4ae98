"""What came of a study that was run."""

from dataclasses import dataclass

from kinverse.studies.cell import Cell
from kinverse.studies.cell_file import Finished
from kinverse.studies.study import Study
from kinverse.studies.table import Table

__all__ = ["Failure", "StudyRun"]


@dataclass(frozen=True)
class Failure:
    """A cell or a table that raised.

    Attributes:
        what: "cell swarm-3" or "table 7.7".
        error: type and message.
        trace: where it was raised; empty if nobody knows.
    """

    what: str
    error: str
    trace: str = ""


@dataclass(frozen=True)
class StudyRun:
    """Tables of a study, and what they were made from.

    Attributes:
        study: what was run.
        quick: few repetitions.
        asked: names of the tables asked for; empty: all of the study.
        tables: by name, in the order of the document; those that failed are missing.
        cells: finished cells by name.
        failures: cells and tables that raised.
        computed: how many cells were computed now, not read from files.
    """

    study: Study
    quick: bool
    asked: tuple[str, ...]
    tables: dict[str, Table]
    cells: dict[str, tuple[Cell, Finished]]
    failures: tuple[Failure, ...]
    computed: int

    @property
    def ok(self) -> bool:
        """Nothing failed."""
        return not self.failures

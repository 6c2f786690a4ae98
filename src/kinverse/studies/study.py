"""A study: a source document run again, table by table."""

from dataclasses import dataclass

from kinverse.studies.table import TableSpec

__all__ = ["Study"]


@dataclass(frozen=True)
class Study:
    """What there is to run of a document.

    Args:
        name: "jha2015".
        title: one line.
        source: the document: authors, title, year.
        tables: in the order of the document.
    """

    name: str
    title: str
    source: str
    tables: tuple[TableSpec, ...]

"""A study: a source document run again, table by table."""

from collections.abc import Mapping
from dataclasses import dataclass, field

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
        seeds: of what the cells draw, in words, by what is drawn, where they are no arguments.
    """

    name: str
    title: str
    source: str
    tables: tuple[TableSpec, ...]
    seeds: Mapping[str, str] = field(default_factory=dict)

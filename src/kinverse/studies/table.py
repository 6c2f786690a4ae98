"""A table of a study: our figures beside the printed ones, and what holds."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from kinverse.studies.cell import Cell, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CAUTION", "Picture", "Table", "TableSpec", "Verdict"]

CAUTION = "quick run, not for conclusions"
"""Beside every verdict of a quick run."""


class Verdict(StrEnum):
    """What our run says of printed numbers; properties of the numbers, never of their cause."""

    REPRODUCED = "reproduced"
    OTHER_READING = "reproduced under another reading"
    NOT_REPRODUCED = "not reproduced"
    CANNOT_CHECK = "cannot be checked"
    OURS = "ours, nothing printed"


@dataclass(frozen=True)
class Picture:
    """A figure of a table.

    Args:
        title: one line.
        alt: what it shows, for readers who cannot see it (one or two sentences, with figures).
        draw: makes the matplotlib figure; called where the report is written.
    """

    title: str
    alt: str
    draw: Callable[[], "Figure"]


@dataclass(frozen=True)
class Table:
    """Rows with units in their column names, a verdict and the residual it rests on."""

    title: str
    rows: list[Row]
    verdict: Verdict
    residual: str
    """The number the verdict rests on, with its unit: "0.0003 mm at most"."""
    note: str = ""
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True)
class TableSpec:
    """How a table comes to be: its cells, and the table that their rows make.

    Args:
        name: as it is asked for: "7.17", "fig-4", "fusion".
        title: one line, with the source (document, table or figure).
        cells: the cells for ``quick`` or not; those of several tables may be equal.
        build: rows of each cell, by the cell's name, to the table; cheap.
        covers: other tables and figures of the document that are in it; it answers to these too.
    """

    name: str
    title: str
    cells: Callable[[bool], list[Cell]]
    build: Callable[[dict[str, list[Row]]], Table]
    covers: tuple[str, ...] = ()

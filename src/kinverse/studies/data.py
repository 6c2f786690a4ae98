"""Printed numbers that come with a study, read from its CSV files."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["Printed", "printed"]


@dataclass(frozen=True)
class Printed:
    """A printed table: every entry as its text, and as a number where it is one.

    Attributes:
        name: of the file.
        columns: in the order of the file.
        rows: text of each entry by column.
    """

    name: str
    columns: tuple[str, ...]
    rows: tuple[dict[str, str], ...]

    def text(self, column: str) -> list[str]:
        """A column as printed.

        Raises:
            InputError: no such column.
        """
        self._check((column,))
        return [row[column] for row in self.rows]

    def numbers(self, columns: Sequence[str]) -> NDArray[np.float64]:
        """(rows, columns) as numbers; NaN where an entry is none.

        Raises:
            InputError: no such column.
        """
        self._check(columns)
        values = [[_number(row[column]) for column in columns] for row in self.rows]
        return np.array(values, dtype=np.float64).reshape(len(values), len(columns))

    def where(self, column: str, value: str) -> "Printed":
        """The rows whose entry in a column is this text."""
        self._check((column,))
        chosen = tuple(row for row in self.rows if row[column] == value)
        return Printed(self.name, self.columns, chosen)

    def __len__(self) -> int:
        return len(self.rows)

    def _check(self, columns: Sequence[str]) -> None:
        for column in columns:
            if column not in self.columns:
                known = ", ".join(self.columns)
                raise InputError(f"{self.name} has no column {column!r}; it has {known}")


def printed(study: str, name: str) -> Printed:
    """A CSV file of ``kinverse/studies/STUDY/data``.

    Args:
        study: "jha2015".
        name: the file's, without ``.csv``.

    Raises:
        InputError: no such file, or a row with too many or too few entries.

    Example:
        >>> printed("jha2015", "table_7_7").numbers(["X_mm", "Y_mm"]).shape
        (11, 2)
    """
    folder = resources.files(f"kinverse.studies.{study}") / "data"
    file = folder / f"{name}.csv"
    if not file.is_file():
        known = sorted(each.name[:-4] for each in folder.iterdir() if each.name.endswith(".csv"))
        raise InputError(f"{study} has no data {name!r}; it has {', '.join(known)}")
    lines = list(csv.reader(file.read_text(encoding="utf-8").splitlines()))
    columns = tuple(lines[0])
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(columns):
            raise InputError(
                f"{study}, {name}.csv, line {number}: {len(line)} entries, not {len(columns)}"
            )
    rows = tuple(dict(zip(columns, line, strict=True)) for line in lines[1:])
    return Printed(name, columns, rows)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")

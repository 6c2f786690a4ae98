"""Rows of a table as text: for the page, the terminal and the CSV file."""

import csv
import io
from collections.abc import Sequence

from kinverse.studies.cell import Row, Value

__all__ = ["as_csv", "columns", "is_numeric", "shown"]


def columns(rows: Sequence[Row]) -> list[str]:
    """All columns, in the order in which they come first."""
    return list(dict.fromkeys(column for row in rows for column in row))


def is_numeric(rows: Sequence[Row], column: str) -> bool:
    """Every value that is there is a number."""
    values = [row[column] for row in rows if row.get(column) is not None]
    return bool(values) and all(
        isinstance(value, (int, float)) and not isinstance(value, bool) for value in values
    )


def shown(value: Value) -> str:
    """A value whole if it is short, else in five digits; a dash for what is not known.

    Example:
        >>> shown(-186.6903), shown(0.000188477), shown(None), shown(True)
        ('-186.6903', '0.00018848', '-', 'yes')
    """
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        whole = f"{value:.15g}"
        return whole if len(whole) <= len("-186.6903") else f"{value:.5g}"
    return str(value)


def as_csv(rows: Sequence[Row]) -> str:
    """All rows with all their digits; what is not known is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns(rows), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()

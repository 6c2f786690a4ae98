"""Rows of cells, picked and summed up: what tables are built from."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kinverse.studies.cell import Row, Value

__all__ = ["Spread", "as_number", "quartiles", "select", "spread", "spread_of"]


class Spread(NamedTuple):
    """Median and quartiles over seeds."""

    median: float
    low: float
    high: float
    size: int

    def columns(self, name: str) -> Row:
        """As columns of a row; the quartiles where there is more than one value."""
        row: Row = {name: self.median}
        if self.size > 1:
            row |= {f"{name}, lower quartile": self.low, f"{name}, upper quartile": self.high}
        return row


def as_number(row: Row, column: str) -> float:
    """A column of a row that holds a number.

    Raises:
        TypeError: it holds none.

    Example:
        >>> as_number({"seconds": 2}, "seconds")
        2.0
    """
    value = row[column]
    if value is None or isinstance(value, str):
        raise TypeError(f"column {column!r} holds {value!r}, not a number")
    return float(value)


def select(rows: Iterable[Row], **equal: Value) -> list[Row]:
    """Rows whose columns have these values.

    Example:
        >>> select([{"part": "run"}, {"part": "joint"}], part="run")
        [{'part': 'run'}]
    """
    return [row for row in rows if all(row.get(k) == v for k, v in equal.items())]


def spread(rows: Iterable[Row], column: str) -> Spread:
    """Median and quartiles of a column over rows, one of each seed.

    Raises:
        TypeError: a row holds no number there.
        ValueError: no rows.
    """
    return spread_of(as_number(row, column) for row in rows)


def spread_of(values: Iterable[float]) -> Spread:
    """Median and quartiles of numbers.

    Raises:
        ValueError: there are none.
    """
    given = list(values)
    if not given:
        raise ValueError("no values to take a median of")
    low, middle, high = quartiles(given)
    return Spread(middle, low, high, len(given))


def quartiles(values: ArrayLike) -> tuple[float, float, float]:
    """Lower quartile, median, upper quartile of numbers.

    Example:
        >>> quartiles([1, 2, 3, 4, 9])
        (2.0, 3.0, 4.0)
    """
    low, middle, high = np.quantile(np.asarray(values, dtype=np.float64), (0.25, 0.5, 0.75))
    return float(low), float(middle), float(high)

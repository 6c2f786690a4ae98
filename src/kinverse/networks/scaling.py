"""Scaling of columns to [-1, 1], with constants taken from the training rows only."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["SCALINGS", "Scaling", "check_scaling"]

Array = NDArray[np.float64]

SCALINGS = ("minmax", None)
"""What ``scaling=`` of a network may be."""

SMALLEST = 1e-150
"""Half a range below which a column counts as constant: its square would vanish."""


class Scaling(NamedTuple):
    """x' = (x - middle) / unit, column by column.

    A constant column says nothing: its unit is 0, it goes to 0 whatever it holds later, and comes
    back as the constant.

    Example:
        >>> Scaling.fitted(np.array([[0.0], [4.0]]), "minmax").forward(np.array([[1.0]]))
        array([[-0.5]])
    """

    middle: Array  # (k,)
    unit: Array  # (k,) half the range

    @classmethod
    def fitted(cls, rows: Array, kind: str | None) -> Self:
        """The scaling of rows (N, k): "minmax" to [-1, 1], None leaves them as they are."""
        columns = rows.shape[1]
        if kind is None:
            return cls(np.zeros(columns), np.ones(columns))
        low, high = rows.min(axis=0), rows.max(axis=0)
        half = 0.5 * (high - low)
        # a range of a few roundings is noise: blown up to [-1, 1] it would be learned
        noise = 8.0 * np.finfo(np.float64).eps * np.maximum(np.abs(low), np.abs(high))
        noise = np.maximum(noise, SMALLEST)
        return cls(low + half, np.where(half <= noise, 0.0, half))

    def from_zero(self) -> Self:
        """The same range onto [0, 1], the range of logsig; a constant stays one."""
        return type(self)(self.middle - self.unit, 2.0 * self.unit)

    def forward(self, rows: Array) -> Array:
        """Scaled rows (N, k)."""
        factor = np.divide(1.0, self.unit, out=np.zeros_like(self.unit), where=self.unit > 0.0)
        scaled: Array = (rows - self.middle) * factor
        return scaled

    def inverse(self, rows: Array) -> Array:
        """Rows (N, k) in the units they came in."""
        restored: Array = rows * self.unit + self.middle
        return restored


def check_scaling(kind: object) -> None:
    """Refuse what is no scaling.

    Raises:
        InputError: names the valid ones.
    """
    if kind not in SCALINGS:
        raise InputError(f"scaling must be 'minmax' or None, got {kind!r}")

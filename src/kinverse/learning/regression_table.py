"""How well predictions follow the truth, column by column: document 004, tables 7.4 and 7.10."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

__all__ = ["RegressionTable", "regression_table"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RegressionTable:
    """Correlation, mean squared error and epochs of each joint or other column.

    Attributes:
        names: of the columns.
        r: correlation of prediction and truth; NaN where one of them is constant.
        mse: mean squared error [rad^2 or m^2].
        epochs: how many its network was trained for; 0 where it was not told.
    """

    names: tuple[str, ...]
    r: tuple[float, ...]
    mse: tuple[float, ...]
    epochs: tuple[int, ...]

    @property
    def mean_r(self) -> float:
        """Mean of ``r``."""
        return float(np.mean(self.r))

    @property
    def mean_mse(self) -> float:
        """Mean of ``mse``; of turning and sliding joints together it has no unit."""
        return float(np.mean(self.mse))

    @property
    def mean_epochs(self) -> float:
        """Mean of ``epochs``."""
        return float(np.mean(self.epochs))


def regression_table(
    y_true: ArrayLike,
    y_pred: ArrayLike,
    names: Sequence[str] | None = None,
    epochs: ArrayLike = 0,
) -> RegressionTable:
    """The table of predictions (N, m) beside the truth (N, m).

    Args:
        y_true: (N,) or (N, m).
        y_pred: the same shape.
        names: of the columns; None: "1", "2", ...
        epochs: (m,) of each column's network, or one number for all.

    Raises:
        InputError: shapes that do not belong together, no rows, or NaN.

    Example:
        >>> regression_table(y, net.predict(X), epochs=net.n_iter_).mean_r
    """
    true, pred = columns(y_true, "y_true"), columns(y_pred, "y_pred")
    if true.shape != pred.shape:
        raise InputError(f"y_true and y_pred must have one shape, got {true.shape}, {pred.shape}")
    m = true.shape[1]
    titles = tuple(str(k + 1) for k in range(m)) if names is None else tuple(map(str, names))
    told = np.asarray(epochs, dtype=np.int64)
    counts = tuple((np.full(m, told) if told.ndim == 0 else told).tolist())
    for what, given in (("names", titles), ("epochs", counts)):
        if len(given) != m:
            raise InputError(f"{what} must be one for each of {m} columns, got {len(given)}")
    return RegressionTable(
        titles,
        tuple(_correlation(a, b) for a, b in zip(true.T, pred.T, strict=True)),
        tuple(((true - pred) ** 2).mean(axis=0).tolist()),
        counts,
    )


def columns(values: ArrayLike, name: str) -> Array:
    """Values as (N, m), finite and with at least one row (InputError)."""
    rows = se3.as_real(values, name)
    if rows.ndim == 1:
        rows = rows[:, None]
    if rows.ndim != 2 or not rows.size:
        raise InputError(f"{name} must have shape (N,) or (N, m) with rows, got {rows.shape}")
    if not np.isfinite(rows).all():
        bad = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise InputError(f"{name} is not finite in row {bad}")
    return rows


def _correlation(a: Array, b: Array) -> float:
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])

"""Gaussian hidden units and the linear layer behind them.

A unit is exp(-ln(2) d^2 / spread^2), d the distance of a row from its centre: 1/2 at d = spread,
which is 1.17741 times the standard deviation sigma of exp(-d^2 / (2 sigma^2)).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["gaussian_units", "output_layer", "responses"]

Array = NDArray[np.float64]

SURE = 100.0
"""Rounding of an exponent, about eps |centre|^2 ln(2) / spread^2, stays below 1e-13 up to here."""


def gaussian_units(centers: Array, spread: ArrayLike) -> Array:
    """Units (..., M, n + 2) such that [x, |x|^2, 1] times a unit is its exponent at x.

    Args:
        centers: (..., M, n).
        spread: a number, or (..., M) one for each unit: the distance at which it answers 1/2.

    Example:
        >>> gaussian_units(np.zeros((1, 2)), 1.0)
        array([[ 0.        ,  0.        , -0.69314718, -0.        ]])
    """
    rate = np.log(2.0) / np.square(np.asarray(spread, dtype=np.float64))
    inputs = centers.shape[-1]
    units = np.empty((*centers.shape[:-1], inputs + 2))
    units[..., :inputs] = 2.0 * np.multiply(rate[..., None], centers)
    units[..., inputs] = -rate
    units[..., inputs + 1] = -rate * np.einsum("...i,...i->...", centers, centers)
    return units


def responses(X: Array, units: Array) -> Array:
    """What units (M, n + 2) answer to rows X (N, n): (N, M) in [0, 1].

    Example:
        >>> responses(np.array([[0.0], [1.0]]), gaussian_units(np.zeros((1, 1)), 1.0))
        array([[1. ],
               [0.5]])
    """
    inputs = X.shape[1]
    rows = np.empty((len(X), inputs + 2))
    rows[:, :inputs] = X
    np.einsum("ij,ij->i", X, X, out=rows[:, inputs])
    rows[:, inputs + 1] = 1.0
    exponents: Array = rows @ units.T
    if len(units) and units[:, -1].min() < -SURE:
        _subtract_first(exponents, X, units)
    np.minimum(exponents, 0.0, out=exponents)
    return np.exp(exponents, out=exponents)


def output_layer(phi: Array, T: Array) -> tuple[Array, Array]:
    """Weights (M, m) and bias (m,) for phi (N, M): least squares, of least norm if many are."""
    rows = np.column_stack([phi, np.ones(len(phi))])
    weights = np.asarray(np.linalg.lstsq(rows, T, rcond=None)[0], dtype=np.float64)
    return weights[:-1], weights[-1]


def _subtract_first(exponents: Array, X: Array, units: Array) -> None:
    """Exponents near 0 once more as squares of differences: the product loses digits there.

    Centres are then far from the origin in spreads, as with inputs in mm that are not scaled.
    """
    rate = -units[:, -2]
    centers = units[:, :-2] / (2.0 * rate[:, None])
    lowest = -50.0 + 1e-13 * units[:, -1]  # further below, the answer is 0 to 1e-21 in any case
    step = max(1, 2**20 // units.size)
    for k in range(0, len(X), step):
        row, unit = np.nonzero(exponents[k : k + step] > lowest)
        apart = X[k + row] - centers[unit]
        exponents[k + row, unit] = -rate[unit] * np.einsum("ij,ij->i", apart, apart)

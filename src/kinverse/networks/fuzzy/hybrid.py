"""Hybrid learning of fuzzy rules (Jang 1993): consequents by least squares, premises by descent."""

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.fuzzy.rules import Rules

__all__ = ["StepSize", "least_squares"]

Array = NDArray[np.float64]

ROUNDING = 1e-13
"""The least ridge, in traces of the matrix: it must be above what rounding does to the matrix."""


def least_squares(rules: Rules, premises: Array, X: Array, y: Array, ridge: float) -> Array:
    """Consequents (R, 1) or (R, n + 1) with the least sum of squares of error and sqrt(ridge) them.

    A grid has more rules than the rows reach, so without the ridge they were not determined. Jang's
    recursive least squares that begins with the covariance 1/ridge ends at the same numbers.

    Args:
        rules: the form of the grid.
        premises: (M, p) of its sets.
        X: (N, n) rows.
        y: (N,) targets.
        ridge: the weight of the squared consequents, >= 0.
    """
    solve = _by_rows if len(X) < rules.n_linear else _by_parameters
    return solve(rules, premises, X, y, ridge)


def _by_rows(rules: Rules, premises: Array, X: Array, y: Array, ridge: float) -> Array:
    """One unknown a row: regressors of two rows multiply input by input, as rules do."""
    parts, terms = rules.shares(premises, X).parts, rules.terms(X)
    products = terms @ terms.T
    for part in parts:
        products *= part @ part.T
    weighted = _solve(products, y, ridge)[:, None] * terms
    out = np.zeros((rules.n_rules, terms.shape[1]))
    for rows in rules.blocks(len(X)):
        out += rules.strengths([part[rows] for part in parts])[-1].T @ weighted[rows]
    return out


def _by_parameters(rules: Rules, premises: Array, X: Array, y: Array, ridge: float) -> Array:
    """The normal equations."""
    parts, terms = rules.shares(premises, X).parts, rules.terms(X)
    products, right = np.zeros((rules.n_linear, rules.n_linear)), np.zeros(rules.n_linear)
    for rows in rules.blocks(len(X), terms.shape[1]):
        strengths = rules.strengths([part[rows] for part in parts])[-1]
        regressors = (strengths[:, :, None] * terms[rows, None, :]).reshape(len(strengths), -1)
        products += regressors.T @ regressors
        right += regressors.T @ y[rows]
    return _solve(products, right, ridge).reshape(rules.n_rules, -1)


def _solve(products: Array, right: Array, ridge: float) -> Array:
    from scipy.linalg import cho_factor, cho_solve

    products[np.diag_indices_from(products)] += ridge + ROUNDING * np.trace(products)
    factor = cho_factor(products, lower=True, overwrite_a=True, check_finite=False)
    solved: Array = cho_solve(factor, right, check_finite=False)
    return solved


class StepSize:
    """The length of a step through the premises, by Jang's two rules.

    After four reductions of the error in a row it grows; after two combinations of one increase
    and one reduction in a row it shrinks. Errors that led to a change do not count again.

    Args:
        size: the first length.
        increase, decrease: factors.

    Example:
        >>> step = StepSize(0.01, 1.1, 0.9)
        >>> [step.after(error) for error in (5.0, 4.0, 3.0, 2.0, 1.0)][-1]
        0.011
    """

    def __init__(self, size: float, increase: float, decrease: float) -> None:
        self.size = size
        self._increase, self._decrease = increase, decrease
        self._last: list[float] = []

    def after(self, error: float) -> float:
        """The length of the step that follows an epoch with this error."""
        self._last = [*self._last, error][-5:]
        signs = tuple(np.sign(np.diff(self._last)))
        factor = 1.0
        if signs == (-1, -1, -1, -1):
            factor = self._increase
        elif signs == (1, -1, 1, -1):
            factor = self._decrease
        if factor != 1.0:
            self._last = self._last[-1:]
        self.size *= factor
        return self.size

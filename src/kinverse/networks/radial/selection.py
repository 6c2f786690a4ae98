"""Which training rows become centres, one after the other.

Each function yields (row, left): the row chosen next, and what the units chosen so far and a bias
leave unexplained of the targets, (N, m), as a refit by least squares would. It ends when no row is
left that would lower the error.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.radial.gaussian_units import gaussian_units, responses

__all__ = ["in_order", "largest_residual", "orthogonal_least_squares"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Choice = tuple[int, Array]

DEPENDENT = 1e-8
"""A unit is left out if of its squared norm less than this is new."""
ROUNDING = 1e-28
"""Squared error, as a share of that of the bias alone, below which there is only rounding."""


def orthogonal_least_squares(
    X: Array, T: Array, spread: float, candidates: Ints
) -> Iterator[Choice]:
    """The row whose unit lowers the squared error most (Chen, Cowan & Grant 1991).

    T is orthogonal to the units chosen already, so a candidate's gain is (phi . T)^2 over the
    squared norm of its new part: the N x C matrix of candidates itself is never deflated, and a
    unit costs one product with it, O(N C m).

    Args:
        X: (N, n) rows, scaled.
        T: (N, m) targets, scaled.
        spread: of all units.
        candidates: (C,) rows that may become centres.
    """
    phi = responses(X, gaussian_units(X[candidates], spread))
    explained = _Explained(T)
    whole = np.einsum("ij,ij->j", phi, phi)
    new = whole - phi.sum(axis=0) ** 2 / len(X)
    along = phi.T @ explained.left
    while not explained.all:
        open_ = new > DEPENDENT * whole
        if not open_.any():
            return
        gain = np.divide(
            np.einsum("ij,ij->i", along, along), new, out=np.full(len(new), -1.0), where=open_
        )
        best = int(np.argmax(gain))
        direction = explained.add(phi[:, best])
        if direction is None:
            new[best] = 0.0
            continue
        product = phi.T @ np.column_stack([explained.left, direction])
        along = product[:, :-1]
        new -= product[:, -1] ** 2
        new[best] = 0.0
        yield int(candidates[best]), explained.left


def largest_residual(X: Array, T: Array, spread: float, candidates: Ints) -> Iterator[Choice]:
    """The row with the largest error, summed over outputs; one that adds nothing is passed over.

    Arguments as for ``orthogonal_least_squares``.
    """
    explained = _Explained(T)
    open_ = np.ones(len(candidates), np.bool_)
    while open_.any() and not explained.all:
        left = explained.left[candidates]
        worst = int(np.argmax(np.where(open_, np.einsum("ij,ij->i", left, left), -1.0)))
        open_[worst] = False
        row = candidates[worst]
        unit = gaussian_units(X[row : row + 1], spread)
        if explained.add(responses(X, unit)[:, 0]) is not None:
            yield int(row), explained.left


def in_order(X: Array, T: Array, spread: float, rows: Sequence[int]) -> Iterator[Choice]:
    """The rows given, in their order."""
    explained = _Explained(T)
    for row in rows:
        explained.add(responses(X, gaussian_units(X[row : row + 1], spread))[:, 0])
        yield int(row), explained.left


class _Explained:
    """What a bias and some units explain of the targets T (N, m): their orthonormal basis.

    Attributes:
        left: (N, m) what they do not.
    """

    def __init__(self, T: Array) -> None:
        rows = len(T)
        self.left = T - T.mean(axis=0)
        self._first = float(np.sum(self.left**2))
        self._basis = np.empty((min(rows, 64), rows))
        self._basis[0] = 1.0 / np.sqrt(rows)
        self._count = 1

    @property
    def all(self) -> bool:
        """Whether nothing but rounding is left."""
        return float(np.sum(self.left**2)) <= ROUNDING * self._first

    def add(self, phi: Array) -> Array | None:
        """Take a unit (N,) in; its new direction (N,), None if it has none."""
        basis = self._basis[: self._count]
        direction = phi
        for _ in range(2):  # once is not enough for a unit that is nearly dependent
            direction = direction - (basis @ direction) @ basis
        square = float(direction @ direction)
        if square <= DEPENDENT * float(phi @ phi):
            return None
        direction /= np.sqrt(square)
        self.left = self.left - np.outer(direction, direction @ self.left)
        if self._count == len(self._basis):
            self._basis = np.concatenate([self._basis, np.empty_like(self._basis)])
        self._basis[self._count] = direction
        self._count += 1
        return direction

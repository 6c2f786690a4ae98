"""Fuzzy rules on a grid: one for every choice of a fuzzy set for each input (Jang 1993).

A rule fires by the product of its sets' values. Over a whole grid the sum of all products is the
product of the inputs' sums, so the strengths are normalised input by input: an input's values,
divided by their sum, are its shares (N, k), and a rule's normalised strength is the product of
shares. Rules are in C order, the last input's sets run fastest.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks.fuzzy.membership import Membership, find_membership

__all__ = ["Rules", "Shares"]

Array = NDArray[np.float64]

MOST_RULES = 100_000
SILENT = 1e-150
"""Of an input with less than this in all its sets none fires."""
NARROWEST = 1e-3
"""The least width of a set, in spacings of the first grid."""
ENTRIES = 2**20
"""Strengths held at a time."""


class Shares(NamedTuple):
    """How much of each input belongs to each of its sets."""

    parts: list[Array]  # (N, k_i) for each input, rows sum to 1
    totals: list[Array]  # (N, 1) what the values were divided by, inf where no set fired


@dataclass(frozen=True)
class Rules:
    """The form of a grid of rules.

    Args:
        counts: (k_1, ..., k_n) fuzzy sets of each input.
        mf: the kind of membership function.
        order: of the consequents: 0 a constant, 1 linear in the inputs.

    Example:
        >>> Rules((7, 7, 7), "gbell", 0).n_nodes
        734
    """

    counts: tuple[int, ...]
    mf: str
    order: int

    @classmethod
    def of(cls, n_mfs: Any, inputs: int, mf: str, order: int) -> "Rules":
        """The grid for so many inputs; ``n_mfs`` is one number or one for each input.

        Raises:
            InputError: not one for each input, or more rules than can be handled.
        """
        counts = (n_mfs,) * inputs if isinstance(n_mfs, (int, np.integer)) else tuple(n_mfs)
        if len(counts) != inputs:
            raise InputError(
                f"n_mfs must be one number or one for each of {inputs} inputs, got {n_mfs!r}"
            )
        rules = cls(tuple(int(count) for count in counts), mf, order)
        if rules.n_rules > MOST_RULES:
            raise InputError(
                f"{inputs} inputs with n_mfs={n_mfs!r} make {rules.n_rules:,} rules, more than"
                f" {MOST_RULES:,}: take fewer fuzzy sets or fewer inputs"
            )
        return rules

    @property
    def kind(self) -> Membership:
        """The membership function."""
        return find_membership(self.mf)

    @property
    def n_rules(self) -> int:
        """R, the product of the counts."""
        return math.prod(self.counts)

    @property
    def n_linear(self) -> int:
        """Numbers in the consequents."""
        return self.n_rules * (1 + len(self.counts) * self.order)

    @property
    def n_nonlinear(self) -> int:
        """Numbers in the premises."""
        return sum(self.counts) * len(self.kind.parameters)

    @property
    def n_nodes(self) -> int:
        """Nodes of the network as the documents' program counts them."""
        return len(self.counts) + 2 * sum(self.counts) + 2 * self.n_rules + 3

    def first(self, X: Array) -> tuple[Array, Array]:
        """Premises (M, p) evenly over the range of rows X (N, n), and least widths (M,)."""
        centres, spacing = [], []
        for low, high, count in zip(X.min(axis=0), X.max(axis=0), self.counts, strict=True):
            if low == high:  # a constant: any width will do
                low, high = low - 1.0, high + 1.0
            step = (high - low) / max(count - 1, 1)
            even = low + step * np.arange(count)
            centres.append(even if count > 1 else np.array([0.5 * (low + high)]))
            spacing.append(np.full(count, step))
        steps = np.concatenate(spacing)
        return self.kind.start(np.concatenate(centres), steps), NARROWEST * steps

    def values(self, premises: Array, X: Array) -> Array:
        """Membership (N, M) of rows X (N, n) in all sets, the first input's first."""
        return self.kind.of(self._spread(X), premises)

    def shares(self, premises: Array, X: Array) -> Shares:
        """Normalised memberships; where no set of an input fires the one nearest by does."""
        values, spread = self.values(premises, X), self._spread(X)
        parts, totals = [], []
        for at in self._slices():
            part = values[:, at]
            total = part.sum(axis=1, keepdims=True)
            silent = np.flatnonzero(total[:, 0] < SILENT)
            if len(silent):
                away = np.abs(spread[silent, at] - premises[at, self.kind.centre])
                part[silent] = 0.0
                part[silent, away.argmin(axis=1)] = 1.0
                total[silent] = 1.0
            parts.append(part / total)
            total[silent] = np.inf  # the share no longer depends on the premises
            totals.append(total)
        return Shares(parts, totals)

    def terms(self, X: Array) -> Array:
        """What a consequent multiplies: rows (N, n + 1) of x and 1, or of 1 alone (N, 1)."""
        ones = np.ones((len(X), 1))
        return np.hstack([X, ones]) if self.order else ones

    def strengths(self, parts: list[Array]) -> list[Array]:
        """(N, k_1 ... k_i), products over the first i inputs, i = 0 ... n; the last the rules'."""
        out = [np.ones((len(parts[0]), 1))]
        for part in parts:
            out.append((out[-1][:, :, None] * part[:, None, :]).reshape(len(part), -1))
        return out

    def output(self, premises: Array, consequents: Array, X: Array) -> Array:
        """Outputs (N,) of rows X (N, n) by consequents (R, 1) or (R, n + 1)."""
        out = np.empty(len(X))
        for rows in self.blocks(len(X)):
            strengths = self.strengths(self.shares(premises, X[rows]).parts)[-1]
            out[rows] = ((strengths @ consequents) * self.terms(X[rows])).sum(axis=1)
        return out

    def gradient(self, premises: Array, consequents: Array, X: Array, error: Array) -> Array:
        """Derivatives (M, p) by the premises of sum(error * output) for a fixed error (N,).

        With error = output - target it is half the gradient of the sum of squared errors. The
        products of the other inputs' shares are made by multiplication, never by dividing.
        """
        out = np.zeros_like(premises)
        for rows in self.blocks(len(X)):
            shares = self.shares(premises, X[rows])
            partial = self.strengths(shares.parts)
            back = error[rows, None] * (self.terms(X[rows]) @ consequents.T)
            by_value = []
            for before, part, total in zip(
                partial[-2::-1], shares.parts[::-1], shares.totals[::-1], strict=True
            ):
                grid = back.reshape(len(part), before.shape[1], part.shape[1])
                by_share = (before[:, None, :] @ grid)[:, 0]
                by_value.append((by_share - (by_share * part).sum(axis=1, keepdims=True)) / total)
                back = (grid @ part[:, :, None])[:, :, 0]
            slopes = self.kind.slopes(self._spread(X[rows]), premises)
            out += np.einsum("pnm,nm->mp", slopes, np.hstack(by_value[::-1]))
        return out

    def blocks(self, rows: int, columns: int = 1) -> Iterator[slice]:
        """Slices of so many rows that few enough strengths are held, each ``columns`` times."""
        step = max(1, ENTRIES // (self.n_rules * columns))
        return (slice(k, k + step) for k in range(0, rows, step))

    def _spread(self, X: Array) -> Array:
        return np.repeat(X, self.counts, axis=1)

    def _slices(self) -> Iterator[slice]:
        ends = np.cumsum(self.counts).tolist()
        return (slice(end - count, end) for end, count in zip(ends, self.counts, strict=True))

"""A cubic spline through points, by arc length."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Spline", "spline"]

Array = NDArray[np.float64]

EXACT = 1e-13
"""A piece is cut in half to measure its length until that changes by less than this share."""

MOST_HALVINGS = 40
"""Where a spline turns on the spot, its speed has a kink that halving only approaches."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True, eq=False)
class Spline:
    """Cubic pieces in a parameter u, known by arc length; a ``Curve``.

    Args:
        knots: (K,) values of u at the points that the spline was made through.
        coefficients: (4, K - 1, 3) of the powers 3, 2, 1, 0 of u past the knot before.
    """

    knots: Array
    coefficients: Array
    cuts: Array = field(init=False)
    lengths: Array = field(init=False)

    def __post_init__(self) -> None:
        cuts = self._cuts()
        object.__setattr__(self, "cuts", cuts)
        parts = self._between(cuts[:-1], cuts[1:])
        object.__setattr__(self, "lengths", np.concatenate([[0.0], np.cumsum(parts)]))

    @property
    def length(self) -> float:
        """See ``Curve``."""
        return float(self.lengths[-1])

    @property
    def breaks(self) -> Array:
        """See ``Curve``: the arc length at each knot."""
        return np.asarray(self.lengths[np.searchsorted(self.cuts, self.knots)])

    def points(self, s: Array) -> Array:
        """See ``Curve``."""
        return self._at(self._parameter(s), 0)

    def tangents(self, s: Array) -> Array:
        """See ``Curve``; zeros where the spline stands still and turns back."""
        velocity = self._at(self._parameter(s), 1)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        still = speed == 0.0
        return np.asarray(np.where(still, 0.0, velocity / np.where(still, 1.0, speed)))

    def steps(self, chord: float) -> Array:
        """See ``Curve``.

        A step h of u errs by at most ``h^2 / 8`` times the largest second derivative, which on a
        cubic piece stands at one of its ends.
        """
        widths = np.diff(self.knots)
        a, b = self.coefficients[0], self.coefficients[1]
        left = np.linalg.norm(2.0 * b, axis=1)
        right = np.linalg.norm(2.0 * b + 6.0 * a * widths[:, None], axis=1)
        counts = np.ceil(widths * np.sqrt(np.maximum(left, right) / (8.0 * chord)))
        counts = np.maximum(counts, 1.0).astype(np.int64)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        share = (np.arange(counts.sum()) - first) / np.repeat(counts, counts)
        u = np.append(
            np.repeat(self.knots[:-1], counts) + share * np.repeat(widths, counts), self.knots[-1]
        )
        part = self._part(u)
        s = self.lengths[part] + self._between(self.cuts[part], u)
        s[-1] = self.length
        return np.asarray(s)

    def _cuts(self) -> Array:
        """The knots, and between them values of u that lie close where the speed has a kink."""
        cuts = self.knots
        for _ in range(MOST_HALVINGS):
            low, high = cuts[:-1], cuts[1:]
            middle = (low + high) / 2.0
            whole = self._between(low, high)
            off = np.abs(self._between(low, middle) + self._between(middle, high) - whole)
            rough = off > EXACT * whole.sum()
            if not rough.any():
                break
            cuts = np.sort(np.concatenate([cuts, middle[rough]]))
        return cuts

    def _at(self, u: Array, order: int) -> Array:
        """The spline, or its derivative, at u (N,)."""
        i = self._piece(u)
        return self._cubic(self.coefficients[:, i], u - self.knots[i], order)

    def _cubic(self, coefficients: Array, w: Array, order: int) -> Array:
        (a, b, c, d), w = coefficients, w[..., None]
        if order == 0:
            return np.asarray(((a * w + b) * w + c) * w + d)
        return np.asarray((3.0 * a * w + 2.0 * b) * w + c)

    def _between(self, low: Array, high: Array) -> Array:
        """Arc lengths from low to high (N,), each pair within one piece."""
        half = (high - low) / 2.0
        i = self._piece(low + half)
        w = (low - self.knots[i])[:, None] + half[:, None] * (1.0 + NODES)
        velocity = self._cubic(self.coefficients[:, i, None], w, 1)
        return np.asarray(half * (np.sqrt((velocity**2).sum(axis=-1)) @ WEIGHTS))

    def _piece(self, u: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.knots, u, side="right") - 1, 0, len(self.knots) - 2)

    def _part(self, u: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.cuts, u, side="right") - 1, 0, len(self.cuts) - 2)

    def _parameter(self, s: Array) -> Array:
        """The u at arc length s, by Newton's method between brackets that close in."""
        part = np.clip(np.searchsorted(self.lengths, s, side="right") - 1, 0, len(self.lengths) - 2)
        start, high = self.cuts[part], self.cuts[part + 1]
        low = start.copy()
        begun = self.lengths[part]
        share = (s - begun) / np.maximum(self.lengths[part + 1] - begun, 1e-300)
        u = low + np.clip(share, 0.0, 1.0) * (high - low)
        left = np.arange(len(s))  # those not there yet
        for _ in range(60):
            off = begun[left] + self._between(start[left], u[left]) - s[left]
            far = np.abs(off) > 1e-14 * self.length
            left, off = left[far], off[far]
            if not len(left):
                break
            at = u[left]
            low[left] = np.where(off < 0.0, at, low[left])
            high[left] = np.where(off > 0.0, at, high[left])
            speed = np.linalg.norm(self._at(at, 1), axis=-1)
            better = at - off / np.maximum(speed, 1e-300)
            # where Newton leaves the bracket, halve it
            inside = (better >= low[left]) & (better <= high[left])
            u[left] = np.where(inside, better, (low[left] + high[left]) / 2.0)
        return np.asarray(u)


def spline(points: Array, closed: bool = False) -> Spline:
    """The C2 cubic through points (K, 3), u the chord length; closed: periodic, back to the first.

    Open ends are not-a-knot (two points: a line, three: a parabola).
    """
    from scipy.interpolate import CubicSpline

    ring = np.concatenate([points, points[:1]]) if closed else points
    chords = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    knots = np.concatenate([[0.0], np.cumsum(chords)])
    made = CubicSpline(knots, ring, bc_type="periodic" if closed else "not-a-knot")
    return Spline(knots, np.ascontiguousarray(made.c))

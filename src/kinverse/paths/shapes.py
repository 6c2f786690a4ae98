"""Curves in space by arc length: straight pieces, arcs, chains of both, and a point that stays.

A curve has a ``length``, its ``breaks`` (where its pieces meet, from 0 to the length), and three
methods: ``points(s)``, ``tangents(s)`` and ``steps(chord)``. Nothing is checked here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Arc", "Chain", "Curve", "Polyline", "Still", "rounded"]

Array = NDArray[np.float64]


class Curve(Protocol):
    """What a path asks of a curve; lengths in metres."""

    @property
    def length(self) -> float:
        """Arc length from start to end [m]."""

    @property
    def breaks(self) -> Array:
        """(K,) ascending, 0 first and the length last: where pieces meet."""

    def points(self, s: Array) -> Array:
        """Points (N, 3) at arc lengths s (N,)."""

    def tangents(self, s: Array) -> Array:
        """Unit tangents (N, 3); at a corner that of the piece that begins there."""

    def steps(self, chord: float) -> Array:
        """Arc lengths (K,), breaks included, between which no chord errs by more than that [m]."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Straight pieces between corners (K, 3), no two neighbours alike."""

    corners: Array
    breaks: Array = field(init=False)

    def __post_init__(self) -> None:
        pieces = np.linalg.norm(np.diff(self.corners, axis=0), axis=1)
        object.__setattr__(self, "breaks", np.concatenate([[0.0], np.cumsum(pieces)]))

    @property
    def length(self) -> float:
        """See :class:`Curve`."""
        return float(self.breaks[-1])

    def points(self, s: Array) -> Array:
        """See :class:`Curve`."""
        i = _piece(self.breaks, s)
        share = (s - self.breaks[i]) / (self.breaks[i + 1] - self.breaks[i])
        start, end = self.corners[i], self.corners[i + 1]
        # from the nearer end, so that both ends are met to the last bit
        forward = start + share[:, None] * (end - start)
        back = end - (1.0 - share)[:, None] * (end - start)
        return np.where((share < 0.5)[:, None], forward, back)

    def tangents(self, s: Array) -> Array:
        """See :class:`Curve`."""
        i = _piece(self.breaks, s)
        along = self.corners[i + 1] - self.corners[i]
        return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))

    def steps(self, chord: float) -> Array:
        """See :class:`Curve`: straight pieces need their ends only."""
        return self.breaks


@dataclass(frozen=True, eq=False)
class Arc:
    """Part of a circle: ``center + radius (cos(t) x + sin(t) y)`` with t from start to end.

    Args:
        center: (3,) [m].
        x: (3,) unit vector to where t is 0.
        y: (3,) unit vector to where t is a quarter turn.
        radius: [m].
        start: first t [rad].
        end: last t [rad], less than start to go round the other way.
    """

    center: Array
    x: Array
    y: Array
    radius: float
    start: float
    end: float

    @property
    def length(self) -> float:
        """See :class:`Curve`."""
        return self.radius * abs(self.end - self.start)

    @property
    def breaks(self) -> Array:
        """See :class:`Curve`."""
        return np.array([0.0, self.length])

    def points(self, s: Array) -> Array:
        """See :class:`Curve`."""
        t = self._angle(s)
        return self.center + self.radius * (np.cos(t) * self.x + np.sin(t) * self.y)

    def tangents(self, s: Array) -> Array:
        """See :class:`Curve`."""
        t = self._angle(s)
        way = np.sign(self.end - self.start)
        return np.asarray(way * (np.cos(t) * self.y - np.sin(t) * self.x))

    def steps(self, chord: float) -> Array:
        """See :class:`Curve`: the sagitta of a step by angle a is ``radius (1 - cos(a / 2))``."""
        # 1 - cos(a / 2) = 2 sin(a / 4)^2, which does not cancel
        most = 4.0 * np.arcsin(np.sqrt(min(chord / (2.0 * self.radius), 0.5)))
        count = max(1, int(np.ceil(abs(self.end - self.start) / most * (1.0 - 1e-12))))
        return np.linspace(0.0, self.length, count + 1)

    def _angle(self, s: Array) -> Array:
        t = self.start + np.sign(self.end - self.start) * (s / self.radius)
        return np.asarray(t[:, None])


@dataclass(frozen=True, eq=False)
class Still:
    """One point that a path turns about; its length is the path's turn [rad]."""

    point: Array
    breaks: Array

    @property
    def length(self) -> float:
        """The turn [rad]."""
        return float(self.breaks[-1])

    def points(self, s: Array) -> Array:
        """See :class:`Curve`."""
        return np.tile(self.point, (len(s), 1))

    def tangents(self, s: Array) -> Array:
        """No direction: zeros (N, 3)."""
        return np.zeros((len(s), 3))

    def steps(self, chord: float) -> Array:
        """See :class:`Curve`."""
        return self.breaks


@dataclass(frozen=True, eq=False)
class Chain:
    """Curves one behind the other."""

    pieces: Sequence[Curve]
    starts: Array = field(init=False)
    breaks: Array = field(init=False)

    def __post_init__(self) -> None:
        ends = np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])
        object.__setattr__(self, "starts", ends)
        object.__setattr__(self, "breaks", self._joined([piece.breaks for piece in self.pieces]))

    @property
    def length(self) -> float:
        """See :class:`Curve`."""
        return float(self.starts[-1])

    def points(self, s: Array) -> Array:
        """See :class:`Curve`."""
        return self._each("points", s)

    def tangents(self, s: Array) -> Array:
        """See :class:`Curve`."""
        return self._each("tangents", s)

    def steps(self, chord: float) -> Array:
        """See :class:`Curve`."""
        return self._joined([piece.steps(chord) for piece in self.pieces])

    def _each(self, what: str, s: Array) -> Array:
        index = _piece(self.starts, s)
        order = np.argsort(index, kind="stable")
        first = np.searchsorted(index[order], np.arange(len(self.pieces) + 1))
        out = np.empty((len(s), 3))
        for k in np.unique(index).tolist():
            rows, piece = order[first[k] : first[k + 1]], self.pieces[k]
            inside = np.clip(s[rows] - self.starts[k], 0.0, piece.length)
            out[rows] = getattr(piece, what)(inside)
        return out

    def _joined(self, parts: list[Array]) -> Array:
        moved = [start + part[1:] for start, part in zip(self.starts, parts, strict=False)]
        joined = np.concatenate([[0.0], *moved])
        joined[-1] = self.starts[-1]
        return joined


def rounded(corners: Array, blend: float, closed: bool = False) -> tuple[Chain, Array]:
    """Straight pieces with corners cut by arcs that touch both sides ``blend`` [m] from the corner.

    Args:
        corners: (K, 3); pieces long enough for the arcs at their ends, none doubling back.
        blend: distance from a corner to where its arc begins and ends [m].
        closed: from behind the first corner round to it; else from the first to the last.

    Returns:
        The chain, and the arc length (K,) at which it passes each corner: the middle of the arc.
    """
    count = len(corners)
    ring = np.concatenate([corners, corners[:1]]) if closed else corners
    along = np.diff(ring, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    pieces: list[Curve] = []
    passed = np.zeros(count)
    at = ring[0] + blend * along[0] if closed else ring[0]
    done = 0.0
    for k in range(1, len(ring) - (not closed)):
        before, after = along[k - 1], along[k % len(along)]
        arc = _corner(ring[k], before, after, blend)
        to = ring[k] if arc is None else ring[k] - blend * before
        line = Polyline(np.stack([at, to]))
        if line.length > 1e-12 * (1.0 + blend):
            pieces.append(line)
            done += line.length
        at = to
        if arc is not None:
            pieces.append(arc)
            passed[k % count] = done + arc.length / 2.0
            done += arc.length
            at = ring[k] + blend * after
        else:
            passed[k % count] = done
    if not closed:
        line = Polyline(np.stack([at, ring[-1]]))
        if line.length > 1e-12 * (1.0 + blend):
            pieces.append(line)
        passed[-1] = done + line.length
    return Chain(tuple(pieces)), passed


def _corner(corner: Array, before: Array, after: Array, blend: float) -> Arc | None:
    """The arc that cuts a corner between two unit directions; None where there is no corner."""
    across = after - (after @ before) * before
    turn = float(np.arctan2(np.linalg.norm(across), after @ before))
    if turn < 1e-9:
        return None
    inward = across / np.linalg.norm(across)
    radius = blend / np.tan(turn / 2.0)
    center = corner - blend * before + radius * inward
    return Arc(center, -inward, before, radius, 0.0, turn)


def _piece(breaks: Array, s: Array) -> NDArray[np.intp]:
    """The piece each s lies in; a break belongs to the piece that begins there."""
    return np.clip(np.searchsorted(breaks, s, side="right") - 1, 0, len(breaks) - 2)

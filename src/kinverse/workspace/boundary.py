"""The exact edge of what planar links reach, as arcs of circles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.workspace.links import FULL_TURN, Links, aligned, reaches

__all__ = ["BoundaryArc", "boundary", "enclosed_area"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SIDE = 1e-7
"""How far beside an arc its two sides are looked at, as a share of the arm's reach."""

TOUCH = 1e-9
"""Circles that miss each other by less, as a share of the arm's reach, touch."""


class BoundaryArc(NamedTuple):
    """An arc of the edge in the plane of the arm.

    Attributes:
        center: (x, y) [m].
        radius: [m].
        start: first angle [rad], from the x axis towards the y axis.
        end: last angle [rad], greater than start.
        reached: which side of it is reached, "inside" the circle or "outside".
    """

    center: tuple[float, float]
    radius: float
    start: float
    end: float
    reached: str

    def points(self, count: int = 100) -> Array:
        """Points (count, 2) along the arc, its ends included."""
        t = np.linspace(self.start, self.end, count)
        return np.asarray(self.center) + self.radius * np.stack([np.cos(t), np.sin(t)], axis=1)


class _Arc(NamedTuple):
    center: complex
    radius: float
    start: float
    turn: float


def boundary(links: Links, first: complex) -> tuple[BoundaryArc, ...]:
    """The edge of what links reach whose first joint is at a place in the plane.

    On the edge an arm stands with each joint at a limit or in line with the end: the end is on one
    of finitely many arcs. They are cut where they cross; a piece belongs to the edge if one side
    of it is reached and the other is not.
    """
    size = links.annulus[1]
    arcs = _critical(links, size)
    pieces = [piece for k in range(len(arcs)) for piece in _cut(arcs, k, size)]
    if not pieces:
        return ()
    middle = np.array([piece.start + piece.turn / 2.0 for piece in pieces])
    ray: Complex = np.exp(1j * middle)
    on: Complex = np.array([piece.center for piece in pieces])
    on = on + np.array([piece.radius for piece in pieces]) * ray
    inside, outside = (reaches(links, on + side * SIDE * size * ray) for side in (-1.0, 1.0))
    kept = [
        (piece, "inside" if within else "outside")
        for piece, within, without in zip(pieces, inside, outside, strict=True)
        if within != without
    ]
    return tuple(_joined(kept, first))


def enclosed_area(arcs: tuple[BoundaryArc, ...]) -> float:
    """Area that the arcs of a whole edge enclose [m^2] (Green's theorem)."""
    total = 0.0
    for (x, y), r, start, end, reached in arcs:
        sine, cosine = np.sin(end) - np.sin(start), np.cos(end) - np.cos(start)
        part = 0.5 * (r * r * (end - start) + r * (x * sine - y * cosine))
        total += part if reached == "inside" else -part
    return float(total)


def _critical(links: Links, size: float) -> list[_Arc]:
    """The arcs that the postures on the edge sweep, each once."""
    arcs: dict[tuple[float, ...], _Arc] = {}
    for posture in aligned(links, 0):
        radius = abs(posture.beyond)
        if radius <= 1e-12 * size:
            continue
        low, high = links.low[posture.first], links.high[posture.first]
        whole = high - low >= FULL_TURN
        turn = 2.0 * np.pi if whole else float(high - low)
        start = 0.0 if whole else float(np.angle(posture.beyond) + posture.turned + low)
        start = float(np.mod(start, 2.0 * np.pi))
        arc = _Arc(posture.before, float(radius), start, turn)
        values = (arc.center.real / size, arc.center.imag / size, radius / size, start, turn)
        arcs.setdefault(tuple(np.round(values, 10).tolist()), arc)
    return list(arcs.values())


def _cut(arcs: list[_Arc], k: int, size: float) -> list[_Arc]:
    """The pieces of one arc between where the others' circles meet it."""
    arc = arcs[k]
    center = np.array([other.center for other in arcs])
    radius = np.array([other.radius for other in arcs])
    apart = np.abs(center - arc.center)
    same = (apart <= TOUCH * size) & (np.abs(radius - arc.radius) <= TOUCH * size)
    ends = [angle for i in np.flatnonzero(same) for angle in (arcs[i].start, _end(arcs[i]))]
    meet = (apart > TOUCH * size) & (apart <= arc.radius + radius + TOUCH * size)
    meet &= np.abs(arc.radius - radius) <= apart + TOUCH * size
    way, apart, radius = np.angle(center - arc.center)[meet], apart[meet], radius[meet]
    cosine = (arc.radius**2 + apart**2 - radius**2) / (2.0 * arc.radius * apart)
    half = np.arccos(np.clip(cosine, -1.0, 1.0))
    past = np.mod(np.concatenate([ends, way - half, way + half]) - arc.start, 2.0 * np.pi)
    cuts = np.unique(np.concatenate([[0.0], past[past < arc.turn], [arc.turn]]))
    # pieces shorter than the rounding of the cuts are none
    long = np.diff(cuts) > TOUCH
    low, high = cuts[:-1][long], cuts[1:][long]
    spans = zip(low.tolist(), high.tolist(), strict=True)
    return [_Arc(arc.center, arc.radius, arc.start + a, b - a) for a, b in spans]


def _joined(kept: list[tuple[_Arc, str]], first: complex) -> list[BoundaryArc]:
    """Pieces put together again, each piece once."""
    out: list[BoundaryArc] = []
    seen: set[tuple[float, ...]] = set()
    for piece, side in kept:
        center = complex(piece.center + first)
        middle = np.mod(piece.start + piece.turn / 2.0, 2.0 * np.pi)
        key = (center.real, center.imag, piece.radius, np.cos(middle), np.sin(middle))
        near = tuple(np.round(np.array(key) / max(abs(center), piece.radius), 7).tolist())
        if near in seen:
            continue
        seen.add(near)
        last = out[-1] if out else None
        end = piece.start + piece.turn
        if (
            last is not None
            and last.center == (center.real, center.imag)
            and (last.radius, last.reached) == (piece.radius, side)
            and abs(last.end - piece.start) <= TOUCH
        ):
            out[-1] = last._replace(end=end)
        else:
            place = (center.real, center.imag)
            out.append(BoundaryArc(place, piece.radius, piece.start, end, side))
    return out


def _end(arc: _Arc) -> float:
    return arc.start + arc.turn

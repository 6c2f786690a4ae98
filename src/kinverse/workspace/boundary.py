"""The exact edge of what planar links reach, as arcs of circles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import NoSolution
from kinverse.workspace.links import FULL_TURN, SHORT, Links, aligned, reaches

__all__ = ["BoundaryArc", "boundary", "enclosed_area"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SIDE = 1e-4
"""How far beside an arc its two sides are looked at, at most, as a share of the arm's reach."""

SAME = 1e-10
"""Arcs nearer to each other, as a share of the arm's reach, are one: rounding and the slack of
joint limits decide what lies between them."""

CLOSED = 1e-4
"""How far apart, as a share of the arm's reach, the ends of joined arcs may be: arcs that touch are
one (SAME) over some multiple of the square root of that."""


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
    of it is reached and the other is not. Each side is looked at no further away than half way to
    the next arc.

    Raises:
        NoSolution: the pieces found do not close.
    """
    size = links.annulus[1]
    arcs = _critical(links, size)
    found = [_pieces(arcs, k, size) for k in range(len(arcs))]
    pieces = [piece for some, _ in found for piece in some]
    if not pieces:
        return ()
    sides: Complex = np.concatenate([beside for _, beside in found])
    inside, outside = (reaches(links, sides[:, side]) for side in (0, 1))
    kept = [
        (piece, "inside" if within else "outside")
        for piece, within, without in zip(pieces, inside, outside, strict=True)
        if within != without
    ]
    edge = tuple(_joined(kept, first))
    _check_closed(edge, size)
    return edge


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
        if radius <= SAME * size:
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


def _pieces(arcs: list[_Arc], k: int, size: float) -> tuple[list[_Arc], Complex]:
    """The pieces of one arc that no earlier arc holds too, and a point (P, 2) on each side of each.

    Of arcs that are one in the middle of a piece, the first holds it.
    """
    cuts = _cuts(arcs, k, size)
    arc = arcs[k]
    # pieces shorter than what tells two arcs apart are none
    long = np.diff(cuts) * arc.radius > SAME * size
    low, high = cuts[:-1][long], cuts[1:][long]
    ray: Complex = np.exp(1j * (arc.start + 0.5 * (low + high)))
    middle: Complex = arc.center + arc.radius * ray
    way = _crossings(arcs, middle, ray)
    inner, outer = (_next(sign * way, SAME * size) for sign in (-1.0, 1.0))
    one = (way >= -inner[0][:, None]) & (way <= outer[0][:, None])
    holds = np.argmax(one.reshape(len(one), 2, -1).any(axis=1), axis=1) == k
    step = [near + np.minimum(0.5 * (far - near), SIDE * size) for near, far in (inner, outer)]
    beside = np.stack([middle - step[0] * ray, middle + step[1] * ray], axis=1)
    spans = zip(low[holds].tolist(), high[holds].tolist(), strict=True)
    return [_Arc(arc.center, arc.radius, arc.start + a, b - a) for a, b in spans], beside[holds]


def _cuts(arcs: list[_Arc], k: int, size: float) -> Array:
    """Angles from the start of an arc, ascending from 0 to its turn: where others meet it."""
    # wider than what makes two arcs one: in the middle of a piece a gap may be a quarter of that at
    # its end, and arcs that are one there must be cut at the same places
    arc, near = arcs[k], 10.0 * SAME * size
    center = np.array([other.center for other in arcs])
    radius = np.array([other.radius for other in arcs])
    tip: Complex = np.array([[other.start, _end(other)] for other in arcs])
    tip = (center[:, None] + radius[:, None] * np.exp(1j * tip)).ravel() - arc.center
    ends = np.angle(tip[np.abs(np.abs(tip) - arc.radius) <= near])
    apart = np.abs(center - arc.center)
    meet = (apart > SHORT * size) & (apart <= arc.radius + radius + near)
    meet &= np.abs(arc.radius - radius) <= apart + near
    way, apart, radius = np.angle(center - arc.center)[meet], apart[meet], radius[meet]
    cosine = (arc.radius**2 + apart**2 - radius**2) / (2.0 * arc.radius * apart)
    half = np.arccos(np.clip(cosine, -1.0, 1.0))
    past = np.mod(np.concatenate([ends, way - half, way + half]) - arc.start, 2.0 * np.pi)
    return np.unique(np.concatenate([[0.0], past[past < arc.turn], [arc.turn]]))


def _crossings(arcs: list[_Arc], points: Complex, ray: Complex) -> Array:
    """How far (P, 2 A) from points (P,) along a ray each arc is crossed; inf where it is not."""
    center = np.array([arc.center for arc in arcs])
    radius = np.array([arc.radius for arc in arcs])
    start, turn = np.array([arc.start for arc in arcs]), np.array([arc.turn for arc in arcs])
    out = np.full((len(points), 2, len(arcs)), np.inf)
    # seen from each point along its ray
    seen = (center - points[:, None]) * ray.conj()[:, None]
    with np.errstate(invalid="ignore"):
        half = np.sqrt(radius**2 - seen.imag**2)
    for side, sign in enumerate((-1.0, 1.0)):
        way = seen.real + sign * half
        angle = np.angle((way - seen) * ray[:, None])
        on = np.mod(angle - start, 2.0 * np.pi) <= turn
        out[:, side] = np.where(on & np.isfinite(way), way, np.inf)
    return out.reshape(len(points), -1)


def _next(way: Array, near: float) -> tuple[Array, Array]:
    """Last of the crossings (P,) that are one with that at zero, and the first behind them."""
    ahead = np.sort(np.where((way >= 0.0) & np.isfinite(way), way, np.inf), axis=1)
    ahead = np.hstack([np.zeros((len(way), 1)), ahead, np.full((len(way), 1), np.inf)])
    with np.errstate(invalid="ignore"):
        last = np.argmax(~(np.diff(ahead, axis=1) <= near), axis=1)
    row = np.arange(len(way))
    return ahead[row, last], ahead[row, last + 1]


def _joined(kept: list[tuple[_Arc, str]], first: complex) -> list[BoundaryArc]:
    """Pieces put together again."""
    out: list[BoundaryArc] = []
    for piece, side in kept:
        center = complex(piece.center + first)
        place, last = (center.real, center.imag), out[-1] if out else None
        end = piece.start + piece.turn
        if (
            last is not None
            and last.center == place
            and (last.radius, last.reached) == (piece.radius, side)
            and abs(last.end - piece.start) <= 1e-9
        ):
            out[-1] = last._replace(end=end)
        else:
            out.append(BoundaryArc(place, piece.radius, piece.start, end, side))
    return out


def _check_closed(edge: tuple[BoundaryArc, ...], size: float) -> None:
    """Refuse an edge with loose ends.

    Gone along with what is reached on the left, as many arcs begin in a place as end there.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not edge:
        return
    ends = np.concatenate([arc.points(2) for arc in edge])
    leaves = np.array(
        [s for arc in edge for s in ((1, -1) if arc.reached == "inside" else (-1, 1))]
    )
    pairs = cKDTree(ends).query_pairs(CLOSED * size, output_type="ndarray")
    shape = (len(ends), len(ends))
    near = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape)
    count, place = connected_components(near, directed=False)
    loose = np.bincount(place, leaves, count) != 0
    if loose.any():
        x, y = ends[np.argmax(loose[place])].tolist()
        raise NoSolution(
            f"the edge found does not close at ({x:.9g}, {y:.9g}) m: too many of its arcs nearly"
            " touch; take points or reaches"
        )


def _end(arc: _Arc) -> float:
    return arc.start + arc.turn

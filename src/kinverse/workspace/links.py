"""Links in a plane: the postures on the edge of what they reach, and whether they reach a point."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

__all__ = ["FULL_TURN", "SHORT", "Aligned", "Links", "aligned", "reaches"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Complex = NDArray[np.complex128]

FULL_TURN = 2.0 * np.pi - 1e-9
"""A joint of at least this range [rad] reaches every angle."""

SHORT = 1e-12
"""Lengths below this share of the arm's reach count as none."""

SLACK = 1e-12
"""How far outside its limits an angle [rad] counts as inside."""


@dataclass(frozen=True, eq=False)
class Links:
    """Links in a plane: ``p = sum_i d[i] exp(i (t[0] + ... + t[i]))``, points as complex numbers.

    Attributes:
        d: (n,) links at zero angles [m], none without length.
        low: (n,) least angles [rad].
        high: (n,) greatest angles [rad].
    """

    d: Complex
    low: Array
    high: Array

    @property
    def full(self) -> Bools:
        """(n,) which joints reach every angle."""
        return np.asarray(self.high - self.low >= FULL_TURN)

    @property
    def annulus(self) -> tuple[float, float]:
        """Least and greatest distance of the end from the first joint, limits left out [m]."""
        lengths = np.abs(self.d)
        most = float(lengths.sum())
        return max(0.0, 2.0 * float(lengths.max(initial=0.0)) - most), most

    def behind(self) -> "Links":
        """The links behind the first."""
        return Links(self.d[1:], self.low[1:], self.high[1:])

    def has(self, joint: int, angle: float | Array) -> Bools:
        """Whether a joint can stand at angles (...) [rad], whole turns aside."""
        past = np.mod(np.asarray(angle) - self.low[joint] + SLACK, 2.0 * np.pi)
        return np.asarray(past <= self.high[joint] - self.low[joint] + 2.0 * SLACK)


@dataclass(frozen=True)
class Aligned:
    """Some joints at limits; the others free, and their axes in line with the end of the arm.

    Attributes:
        first: index of the first free joint.
        before: from the first joint to that one, the first joint at zero unless it is held.
        turned: angle of the link that leads to it [rad].
        beyond: from the first free joint, at zero, to the end.
    """

    first: int
    before: complex
    turned: float
    beyond: complex


def aligned(links: Links, start: int) -> list[Aligned]:
    """Every such posture; joints before ``start`` stand at zero, at least one behind it is free.

    Two free joints move the end in every direction unless both are in line with it. So on the edge
    of what an arm reaches it stands in one of these (Haug, Luh, Adkins & Wang 1996, Journal of
    Mechanical Design 118, for mechanisms in general).
    """
    full = links.full.tolist()
    size = float(np.abs(links.d).sum())
    choices = [("free",) if turns else ("free", "low", "high") for turns in full[start:]]
    found = []
    for held in product(*choices):
        free = [start + k for k, how in enumerate(held) if how == "free"]
        if not free:
            continue
        fixed = np.zeros(len(full))
        for k, how in enumerate(held):
            if how != "free":
                fixed[start + k] = (links.low if how == "low" else links.high)[start + k]
        found.extend(_lined_up(links, free, fixed, SHORT * size))
    return found


def _lined_up(links: Links, free: list[int], fixed: Array, short: float) -> list[Aligned]:
    angle = np.cumsum(fixed)
    turned = links.d * np.exp(1j * angle)
    first, bounds = free[0], [*free, len(fixed)]
    parts = [
        turned[a:b].sum() * np.exp(-1j * angle[a]) for a, b in zip(free, bounds[1:], strict=True)
    ]
    full = links.full
    for k, part in enumerate(parts):
        # a free joint on the axis of the next can be moved to a limit: another of the postures
        if abs(part) <= short and not full[free[k : k + 2]].all():
            return []
    along = parts[0] / abs(parts[0]) if abs(parts[0]) > 0.0 else 1.0
    before, lead = complex(turned[:first].sum()), float(angle[first])
    found = []
    for signs in product((1.0, -1.0), repeat=len(parts) - 1):
        beyond = complex(parts[0])
        way = np.angle(parts[0])  # direction of the part before, from its own joint's zero
        fits = True
        for k, sign in enumerate(signs, start=1):
            between = angle[free[k]] - angle[free[k - 1]]
            there = way - np.angle(parts[k]) - between + (0.0 if sign > 0 else np.pi)
            fits &= bool(links.has(free[k], there))
            beyond += float(np.prod(signs[:k])) * along * abs(parts[k])
            way = np.angle(parts[k])
        if fits:
            found.append(Aligned(first, before, lead, beyond))
    return found


def reaches(links: Links, points: Complex) -> Bools:
    """Whether the end reaches points (N,), counted from the first joint.

    Of all postures that reach a point take one with the least angle of the first joint. Either
    that joint is at its limit, and the links behind it have to do the rest; or the others are in
    one of the postures of :func:`aligned`, and two angles are left, which a triangle gives. A
    first joint without limits may reach it at every angle: then at that of the point, too. This
    is exact but for points on the arcs that those postures sweep, where rounding decides.
    """
    size = float(np.abs(links.d).sum())
    if links.full.all():
        # without limits: everything between two circles, or what no links reach, the first joint
        low, high = links.annulus
        far, slack = np.abs(points), SLACK * (size or 1.0)
        return np.asarray((far >= low - slack) & (far <= high + slack))
    if len(links.d) == 1:
        near = np.abs(np.abs(points) - size) <= SLACK * size
        return near & links.has(0, np.angle(points) - np.angle(links.d[0]))
    found = np.zeros(len(points), dtype=np.bool_)
    for posture in aligned(links, 1):
        left = np.flatnonzero(~found)
        found[left] = _closes(links, posture, points[left])
    for angle in _turned_away(links, points):
        left = np.flatnonzero(~found)
        behind = points[left] * np.exp(-1j * angle[left]) - links.d[0]
        found[left] = reaches(links.behind(), behind)
    return found


def _turned_away(links: Links, points: Complex) -> list[Array]:
    """Angles (N,) of the first joint to look at: its limits, or the way to the point."""
    if links.full[0]:
        return [np.angle(points)]
    return [np.full(len(points), bound) for bound in (links.low[0], links.high[0])]


def _closes(links: Links, posture: Aligned, points: Complex) -> Bools:
    """Whether two angles, of the first and of one free joint, bring a posture to points (N,)."""
    a, b = posture.before, posture.beyond
    if abs(a) <= SHORT * abs(links.d).sum() or abs(b) <= SHORT * abs(links.d).sum():
        return np.zeros(len(points), dtype=np.bool_)
    cosine = (np.abs(points) ** 2 - abs(a) ** 2 - abs(b) ** 2) / (2.0 * abs(a) * abs(b))
    bend = np.arccos(np.clip(cosine, -1.0, 1.0))
    found = np.zeros(len(points), dtype=np.bool_)
    for psi in (bend, -bend):
        end = a + abs(b) * np.exp(1j * (np.angle(a) + psi))
        first = np.angle(points) - np.angle(end)
        other = psi + np.angle(a) - np.angle(b) - posture.turned
        found |= links.has(0, first) & links.has(posture.first, other)
    return found & (np.abs(cosine) <= 1.0 + 1e-12)

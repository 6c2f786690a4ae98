"""Which joint axes meet, are parallel or coincide, and by how much they miss it.

A revolute joint's axis is a line; a slide has a direction and no place.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.geometry import PARALLEL, AxisLines

__all__ = [
    "AxisMeeting",
    "AxisPair",
    "axis_pairs",
    "meeting_triples",
    "nearest_point",
    "parallel_runs",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisPair:
    """Two neighbouring axes; both numbers hold in every posture.

    Attributes:
        joints: their indices, from 0.
        relation: "coincide", "parallel", "meet" or "skew" for two revolute joints; "parallel",
            "square" or "oblique" where one of them slides.
        angle: between the two lines, 0 to pi/2 [rad].
        distance: shortest, along the common normal [m]; None where one of them slides.
    """

    joints: tuple[int, int]
    relation: str
    angle: float
    distance: float | None


@dataclass(frozen=True)
class AxisMeeting:
    """Three neighbouring revolute axes through one point, in every posture.

    Attributes:
        joints: their indices, from 0.
        point: where, while the joints stand at zero [m, base frame].
        distance: largest distance of an axis from that point [m].
    """

    joints: tuple[int, int, int]
    point: tuple[float, float, float]
    distance: float


def axis_pairs(lines: AxisLines, kinds: str) -> tuple[AxisPair, ...]:
    """Every joint with the next one.

    Example:
        >>> [pair.relation for pair in axis_pairs(axis_lines(puma.frames, puma.kinds), puma.kinds)]
        ['meet', 'parallel', 'skew', 'meet', 'meet']
    """
    return tuple(_pair(lines, kinds, i) for i in range(len(kinds) - 1))


def _pair(lines: AxisLines, kinds: str, i: int) -> AxisPair:
    (z, w), between = lines.direction[i : i + 2], lines.point[i + 1] - lines.point[i]
    across = np.cross(z, w)
    sine, cosine = float(np.linalg.norm(across)), float(abs(z @ w))
    angle = float(np.arctan2(sine, cosine))
    parallel = sine < PARALLEL
    if "P" in kinds[i : i + 2]:
        relation = "parallel" if parallel else "square" if cosine < PARALLEL else "oblique"
        return AxisPair((i, i + 1), relation, angle, None)
    if parallel:
        distance = float(np.linalg.norm(between - (between @ z) * z))
    else:
        distance = float(abs(between @ across)) / sine
    touching = distance < PARALLEL * lines.size
    names = {(True, True): "coincide", (True, False): "parallel", (False, True): "meet"}
    return AxisPair((i, i + 1), names.get((parallel, touching), "skew"), angle, distance)


def meeting_triples(lines: AxisLines, kinds: str) -> tuple[AxisMeeting, ...]:
    """Every three neighbouring revolute axes that have a point in common.

    Example:
        >>> [triple.joints for triple in meeting_triples(lines, "RRRRRR")]
        [(3, 4, 5)]
    """
    found = []
    for i in range(len(kinds) - 2):
        if kinds[i : i + 3] != "RRR":
            continue
        point, distance = nearest_point(lines.direction[i : i + 3], lines.point[i : i + 3])
        if distance < PARALLEL * lines.size:
            x, y, z = (float(c) for c in np.where(np.abs(point) < 1e-12 * lines.size, 0.0, point))
            found.append(AxisMeeting((i, i + 1, i + 2), (x, y, z), distance))
    return tuple(found)


def nearest_point(direction: Array, point: Array) -> tuple[Array, float]:
    """The point nearest to lines (least squares) and its largest distance from one [m].

    Infinitely far off for parallel lines.
    """
    square = np.eye(3) - direction[:, :, None] * direction[:, None, :]
    normal = square.sum(axis=0)
    if np.linalg.eigvalsh(normal)[0] < PARALLEL**2:
        return point[0], np.inf
    origin = point[0]  # lines far from the base frame must not lose digits
    right = np.einsum("kij,kj->i", square, point - origin)
    found = origin + np.linalg.solve(normal, right)
    misses = np.einsum("kij,kj->ki", square, found - point)
    return found, float(np.linalg.norm(misses, axis=1).max())


def parallel_runs(lines: AxisLines, kinds: str) -> tuple[tuple[int, ...], ...]:
    """Groups of three or more revolute joints that stay parallel; slides between do not part them.

    Example:
        >>> parallel_runs(lines, "RRRRRR")  # Universal Robots
        ((1, 2, 3),)
    """
    turning = [i for i, kind in enumerate(kinds) if kind == "R"]
    runs: list[list[int]] = []
    for i in turning:
        same = (
            runs
            and np.linalg.norm(np.cross(lines.direction[runs[-1][-1]], lines.direction[i]))
            < PARALLEL
        )
        if same:
            runs[-1].append(i)
        else:
            runs.append([i])
    return tuple(tuple(run) for run in runs if len(run) > 2)

"""Document 002: how far the KR16's tool strays between accuracy points, joined by splines.

The curved path is itself a cubic spline with three knots between its ends, where its third
derivative jumps: there a higher degree gains less. Branches that differ in the wrist's turn only
move the tool alike, so of eight figures four differ.
"""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.paths import JointCurve, Path, ToolCurve, named_path, refined, track

__all__ = ["accuracy_points"]

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]

Made = tuple[list[Line], dict[int, int]]

PATHS = ("masajedi_straight", "masajedi_curved")
DEGREES, COUNTS = (3, 4, 5, 6), (21, 41, 81)
POINTS = 21
"""Accuracy points of the document; refinement begins with these."""
BRANCHES = 8
TOLERANCE = 1e-5
PLACES = 100
"""Looked at between two points; the library itself looks at 15, or 31."""
FLOOR = 1e-8
"""Deviations below this are rounding [mm]."""
WASTE = 1.5
"""Points that refinement may need beside those of even spacing, as a factor."""
HONEST = 1.03
"""What the deviation told may miss of the true one, as a factor."""


def accuracy_points(quick: bool) -> list[Line]:
    """Deviation by degree and number of points on all branches, and refinement to 0.01 mm."""
    robot = kv.load("kr16")
    lines = []
    for name in PATHS:
        path = named_path(name)
        starts = kv.solve(robot, path(0.0)).q
        section = f"accuracy points, {name}, {path.length:.3g} m, the tool's deviation in mm"
        whole = [track(robot, path, q_start=row, samples=POINTS) for row in starts]
        count = Spread.exact(sum(it.is_whole and len(set(it.branch)) == 1 for it in whole))
        what = f"branches followed from start to end, {POINTS} points"
        lines.append(Line(section, "kr16", what, count, BRANCHES))
        chosen = starts[:2] if quick else starts
        splined, enough = _splines(section, robot, path, chosen)
        lines += splined + _refinement(section, robot, path, chosen, enough)
    return lines


def _splines(section: str, robot: kv.Robot, path: Path, starts: Array) -> Made:
    """Lines, and of each degree how few even points keep the tolerance.

    Splines must do better than joints in straight lines: through the same points, and with twice
    the points, which bring these a quarter of the deviation.
    """
    samples = {count: path.sample(count) for count in COUNTS}
    followed = {
        count: [_followed(robot, T, start) for start in starts] for count, (T, _) in samples.items()
    }
    lines: list[Line] = []
    enough: dict[int, int] = {}
    chords = 1e3 * _chords(robot, path, starts)
    for degree in DEGREES:
        bound = chords
        for count, (T, s) in samples.items():
            away = [
                1e3 * _deviation(robot, path, s, JointCurve(s, q, degree)) for q in followed[count]
            ]
            place = ToolCurve(s, T[:, :3, 3], degree)
            at = _between(s)
            tool = 1e3 * float(np.linalg.norm(place(at) - path(at)[:, :3, 3], axis=1).max())
            what = f"joint splines of degree {degree}, {count} points: the worst branch"
            note = f"{len(starts)} branches; x, y, z splines {tool:.2g} mm"
            worst = max(away)
            lines.append(Line(section, "kr16", what, Spread.exact(worst), bound, False, note))
            bound = max(worst / 4.0, FLOOR)
            if worst <= 1e3 * TOLERANCE:
                enough.setdefault(degree, count)
    return lines, enough


def _refinement(
    section: str, robot: kv.Robot, path: Path, starts: Array, enough: dict[int, int]
) -> list[Line]:
    lines = []

    def follow(T: Array, q_start: Array) -> Array:
        return _followed(robot, T, q_start)

    for degree in DEGREES:
        start = time.process_time()
        made = [
            refined(robot, path, follow, row, TOLERANCE, degree=degree, count=POINTS).curve
            for row in starts
        ]
        spent = time.process_time() - start
        away = [_deviation(robot, path, curve.s, curve) for curve in made]
        points = [len(curve.s) for curve in made]
        how = f"splines of degree {degree}"
        lines += _reached(section, how, points, away, spent, enough.get(degree))
    start = time.process_time()
    found = [track(robot, path, q_start=row, tolerance=TOLERANCE, samples=POINTS) for row in starts]
    spent = time.process_time() - start
    away, told = [], []
    for joint_path in found:
        assert joint_path.s is not None
        away.append(_deviation(robot, path, joint_path.s, _straight(joint_path.s, joint_path.q)))
        told.append(away[-1] / joint_path.deviation)
    points = [len(joint_path) for joint_path in found]
    # chords err with the square of their length
    even = (POINTS - 1) * float(np.sqrt(_chords(robot, path, starts) / TOLERANCE))
    how = "joints in straight lines (track)"
    lines += _reached(section, how, points, away, spent, WASTE * even)
    what = f"refined to 0.01 mm, {how}: deviation over that told"
    note = "the worst branch; by the oracle"
    lines.append(Line(section, "kr16", what, Spread.exact(max(told)), HONEST, False, note))
    return lines


def _reached(
    section: str,
    how: str,
    points: list[int],
    away: list[float],
    spent: float,
    most: float | None,
) -> list[Line]:
    head = (section, "kr16")
    how = f"refined to 0.01 mm, {how}"
    count = Spread.exact(max(points))
    note = f"begun with {POINTS}; {1e3 * spent / len(away):.3g} ms of CPU a branch"
    # the worst branch must keep it, not the median one
    worst = Spread.exact(1e3 * max(away))
    note_2 = f"{PLACES} places between two points, by the oracle; least {1e3 * min(away):.2g} mm"
    return [
        Line(*head, f"{how}: most points needed", count, most, False, note),
        Line(*head, f"{how}: the worst branch", worst, 1e3 * TOLERANCE, False, note_2),
    ]


def _followed(robot: kv.Robot, T: Array, q_start: Array) -> Array:
    return track(robot, T, q_start=q_start).q


def _chords(robot: kv.Robot, path: Path, starts: Array) -> float:
    """Deviation [m] of joints in straight lines between the document's points, worst branch."""
    T, s = path.sample(POINTS)
    ways = [_straight(s, _followed(robot, T, row)) for row in starts]
    return max(_deviation(robot, path, s, way) for way in ways)


def _straight(s: Array, q: Array) -> Curve:
    return lambda at: np.stack([np.interp(at, s, column) for column in q.T], axis=1)


def _deviation(robot: kv.Robot, path: Path, s: Array, curve: Curve) -> float:
    """Largest distance [m] of the tool from the path at the same parameter, by the oracle."""
    at = _between(s)
    reached = oracle.pose(robot, curve(at))[:, :3, 3]
    return float(np.linalg.norm(reached - path(at)[:, :3, 3], axis=1).max())


def _between(s: Array) -> Array:
    share = np.linspace(0.0, 1.0, PLACES + 2)[1:-1]
    return np.asarray((s[:-1, None] + share * np.diff(s)[:, None]).ravel())

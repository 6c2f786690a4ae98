"""Is every closed-form answer true and complete, near singularities and beyond the workspace?"""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.load import names

__all__ = ["complete", "general", "singular", "unreachable"]

Array = NDArray[np.float64]
CHUNK = 10_000
GENERAL_SLIDES = ["RRPRRR", "PRRRRR", "RRRRPR", "RPRRPR", "PRRPRR"]
SAME = 1e-6
"""Joint difference below which two configurations are one, as in ``Solutions``."""


Arms = list[tuple[kv.Robot, kv.Analytic]]


def arms(general: bool = False) -> Arms:
    """The catalogue's robots up to six joints that a special family, or elimination, solves."""
    found = []
    for name in names():
        robot = kv.load(name)
        try:
            solver = kv.Analytic().fit(robot)
        except kv.NoClosedForm:
            continue
        if robot.dof <= 6 and (solver.spec_.family.name == "GENERAL_6R") == general:
            found.append((robot, solver))
    return found


def complete(quick: bool) -> list[Line]:
    """Random configurations: the one that made the pose is among the answers, and none is wrong."""
    return _complete("closed form", arms(), 5_000 if quick else 100_000, 100.0)


def general(quick: bool) -> list[Line]:
    """The same for arms without a special family: elimination, and its time."""
    some = arms(general=True)
    rng = cases.stream(61)
    for kinds in ["RRRRRR"] * (2 if quick else 10) + GENERAL_SLIDES:
        robot = _random_arm(kinds, rng)
        some.append((robot, kv.Analytic().fit(robot)))
    return _complete("general arms", some, 1_000 if quick else 10_000, 99.99, time_bound=40.0)


def _random_arm(kinds: str, rng: np.random.Generator) -> kv.Robot:
    """No two axes meet or are parallel; limits wide enough for all of a turn."""
    n = len(kinds)
    limits = [(-np.pi, np.pi) if kind == "R" else (0.1, 0.8) for kind in kinds]
    return kv.Robot.from_dh(
        a=rng.uniform(0.1, 0.5, n),
        d=rng.uniform(0.1, 0.4, n),
        alpha=rng.uniform(0.5, 1.3, n) * rng.choice([-1, 1], n),
        theta=rng.uniform(-1, 1, n),
        joints=kinds,
        limits=limits,
        name=f"random {kinds}",
    )


def _complete(
    section: str, some: Arms, count: int, least_found: float, time_bound: float | None = None
) -> list[Line]:
    lines = []
    for robot, solver in some:
        q, T = cases.reachable(robot, count)
        found = wrong = unreachable = 0
        worst, spent = np.zeros(2), []
        for start in range(0, count, CHUNK):
            part = slice(start, start + CHUNK)
            began = time.perf_counter()
            s = solver.solve(T[part])
            spent.append((time.perf_counter() - began) / len(s) * 1e6)
            far, turned = _judged(robot, T[part], s)
            wrong += int(((far > 1e-6) | (turned > 1e-6) | ~oracle.inside(robot, s.q)).sum())
            worst = np.maximum(worst, [far.max(initial=0.0), turned.max(initial=0.0)])
            off = oracle.wrapped(robot, s.q - q[part][s.pose_index])
            hit = np.zeros(len(s), dtype=bool)
            hit[s.pose_index[off <= SAME]] = True
            found += int(hit.sum())
            unreachable += int((s.status == kv.Status.UNREACHABLE).sum())
        head = (section, robot.name)
        share, note = _share(found, count), f"of {count:,}"
        lines += [
            Line(*head, "generating configuration found, %", share, least_found, note=note),
            Line(*head, "wrong answers", Spread.exact(wrong), 0.0, least=False),
            Line(*head, "worst error m", Spread.exact(worst[0]), 1e-9, least=False),
            Line(*head, "worst error rad", Spread.exact(worst[1]), 1e-9, least=False),
            Line(
                *head, "reachable called UNREACHABLE", Spread.exact(unreachable), 0.0, least=False
            ),
            Line(*head, "time per pose, batch us", Spread.of(spent), time_bound, least=False),
        ]
    return lines


def singular(quick: bool) -> list[Line]:
    """Singular poses and special joint values: each has at least one true answer."""
    count = 200 if quick else 1_000
    lines = []
    for robot, solver in arms():
        for what, make in cases.SPECIAL.items():
            q = make(robot, count)
            if q is None:
                continue
            T = oracle.pose(robot, q)
            s = solver.solve(T)
            far, turned = _judged(robot, T, s)
            good = (far <= 1e-6) & (turned <= 1e-6) & oracle.inside(robot, s.q)
            solved = np.zeros(count, dtype=bool)
            solved[s.pose_index[good]] = True
            lost = int((s.status == kv.Status.UNREACHABLE).sum())
            note = f"of {count:,}" + (f", {lost} called UNREACHABLE" if lost else "")
            lines.append(
                Line(
                    "singular and special",
                    robot.name,
                    f"{what}: solved, %",
                    _share(int((solved & s.ok).sum()), count),
                    100.0,
                    note=note,
                )
            )
            if not good.all():
                figure = Spread.exact(int((~good).sum()))
                lines.append(
                    Line("singular and special", robot.name, f"{what}: wrong", figure, 0.0, False)
                )
    return lines


def unreachable(quick: bool) -> list[Line]:
    """Poses 1-50 mm outside the workspace: all of them UNREACHABLE."""
    count = 1_000 if quick else 10_000
    lines = []
    for robot, solver in arms():
        for side, T in cases.beyond(robot, count).items():
            status = solver.solve(T).status
            share = _share(int((status == kv.Status.UNREACHABLE).sum()), count)
            what = f"beyond the {side} boundary: UNREACHABLE, %"
            lines.append(Line("out of reach", robot.name, what, share, 100.0, note=f"of {count:,}"))
    return lines


def _judged(robot: kv.Robot, T: Array, s: kv.Solutions) -> tuple[Array, Array]:
    return oracle.errors(T[s.pose_index], oracle.pose(robot, s.q))


def _share(part: int, whole: int) -> Spread:
    return Spread.exact(100.0 * part / whole)

"""Is every closed-form answer true and complete, near singularities and beyond the workspace?"""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.load import names
from kinverse.solvers.closed_form.families import Family

__all__ = ["complete", "singular", "special", "unreachable"]

Array = NDArray[np.float64]
CHUNK = 10_000
SAME = 1e-6
"""Joint difference below which two configurations are one, as in ``Solutions``."""


def special() -> list[tuple[kv.Robot, kv.Analytic]]:
    """The catalogue's robots up to six joints that a special family solves."""
    found = []
    for name in names():
        robot = kv.load(name)
        try:
            solver = kv.Analytic().fit(robot)
        except kv.NoClosedForm:
            continue
        if robot.dof <= 6 and solver.spec_.family is not Family.GENERAL_6R:
            found.append((robot, solver))
    return found


def complete(quick: bool) -> list[Line]:
    """Random configurations: the one that made the pose is among the answers, and none is wrong."""
    count = 5_000 if quick else 100_000
    lines = []
    for robot, solver in special():
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
        head = ("closed form", robot.name)
        share, note = _share(found, count), f"of {count:,}"
        lines += [
            Line(*head, "generating configuration found, %", share, 100.0, note=note),
            Line(*head, "wrong answers", Spread.exact(wrong), 0.0, least=False),
            Line(*head, "worst error m", Spread.exact(worst[0]), 1e-9, least=False),
            Line(*head, "worst error rad", Spread.exact(worst[1]), 1e-9, least=False),
            Line(
                *head, "reachable called UNREACHABLE", Spread.exact(unreachable), 0.0, least=False
            ),
            Line(*head, "time per pose, batch us", Spread.of(spent)),
        ]
    return lines


def singular(quick: bool) -> list[Line]:
    """Singular poses and special joint values: each has at least one true answer."""
    count = 200 if quick else 1_000
    lines = []
    for robot, solver in special():
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
    for robot, solver in special():
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

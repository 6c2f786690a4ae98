"""Seven joints: every branch at a value of the free parameter, and every range that has one."""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import arms, cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread, alternate
from kinverse.bench.search import search
from kinverse.solvers.closed_form.redundant import ARM_ANGLE

__all__ = ["at_values", "sweeps"]

Array = NDArray[np.float64]

SAME = 1e-6
"""Joint difference below which two configurations are one, as in ``Solutions``."""
EDGE = 1e-6
"""A value this near to an interval's end may lie on either side of it [rad]."""
TURN = 2 * np.pi


class Case(NamedTuple):
    """An arm, its free parameter, and the targets: us a value, ms a sweep."""

    arm: str
    redundancy: int | None
    value_us: float
    sweep_ms: float


CASES = {
    "iiwa14, arm angle": Case("iiwa14", None, 1.0, 2.0),
    "iiwa14, joint 1": Case("iiwa14", 0, 1.0, 2.0),
    "iiwa14, joint 7": Case("iiwa14", 6, 1.0, 2.0),
    "panda, joint 7": Case("panda", None, 30.0, 20.0),
}
INNER = {"iiwa14, joint 3": ("iiwa14", 2), "panda, joint 4": ("panda", 3)}
"""Inner joints leave another arm at each value."""


def at_values(quick: bool) -> list[Line]:
    """Random configurations: found again at their own value, and all branches a search finds."""
    count, rounds = (1_000, 3) if quick else (10_000, 7)
    lines = []
    for name, case in CASES.items():
        robot = arms.SEVEN[case.arm]()
        solver = kv.Analytic(redundancy=case.redundancy).fit(robot)
        lines += _at_values(name, robot, solver, count, rounds, case.value_us)
        if solver.redundancy_ != ARM_ANGLE:
            lines.append(_against_search(name, robot, solver, 3 if quick else 30))
        lines += _search_solutions(name, robot, solver, 3 if quick else 30)
    for name, (arm, joint) in INNER.items():
        robot = arms.SEVEN[arm]()
        solver = kv.Analytic(redundancy=joint).fit(robot)
        lines += _at_values(name, robot, solver, 10 if quick else 200, 2, None)
    return lines


def _at_values(
    name: str, robot: kv.Robot, solver: kv.Analytic, count: int, rounds: int, bound: float | None
) -> list[Line]:
    q, T = cases.reachable(robot, count, seed=7)
    value = solver.redundancy_at(q)

    def solve() -> kv.Solutions:
        # a target is for all the values of one arm; without, each value's own arm is made anew
        fresh = solver if bound is not None else solver.clone().fit(robot)
        return fresh.solve_at(T, value)

    spent = alternate({"at": solve}, rounds)["at"]
    s = solve()
    hit = np.zeros(count, dtype=bool)
    hit[s.pose_index[oracle.wrapped(robot, s.q - q[s.pose_index]) <= SAME]] = True
    head = ("seven joints, at a value", name)
    found = Spread.exact(100.0 * float(hit.mean()))
    time = Spread.of([1e6 * seconds / count for seconds in spent])
    return [
        Line(*head, "generating configuration found, %", found, 100.0, note=f"of {count:,}"),
        *_wrong(head, robot, T, s),
        Line(*head, "time per value, batch us", time, bound, False),
    ]


def _against_search(name: str, robot: kv.Robot, solver: kv.Analytic, count: int) -> Line:
    """Poses at whose value the branches inside the limits are those of 300 random starts."""
    joint = int(solver.redundancy_ or 0)
    q, T = cases.reachable(robot, count, seed=8)
    middle = robot.limits.mean(axis=1)
    equal = 0
    for i in range(count):
        rest = robot.locked({joint: float(q[i, joint])})
        (found,) = search(rest, T[i : i + 1], 300, cases.stream(81, i))
        found = np.insert(found, joint, q[i, joint], axis=1)
        found = middle + (found - middle + np.pi) % TURN - np.pi
        found = found[oracle.inside(robot, found)]
        ours = solver.solve_at(T[i], q[i, joint]).q
        gaps = np.array([oracle.wrapped(robot, found - row) for row in ours])
        equal += gaps.shape == (len(found), len(found)) and bool(
            (gaps.min(axis=0, initial=np.inf) < SAME).all()
        )
    what = "same branches as 300 random starts, % of poses"
    share = Spread.exact(100.0 * equal / count)
    return Line("seven joints, at a value", name, what, share, 100.0, note=f"of {count}")


def _search_solutions(name: str, robot: kv.Robot, solver: kv.Analytic, count: int) -> list[Line]:
    """Solutions of 100 random starts: each comes back at its own value, inside an interval."""
    _, T = cases.reachable(robot, count, seed=10)
    s = solver.solve(T)
    iv = s.intervals
    middle = robot.limits.mean(axis=1)
    total = back = held = 0
    for i, found in enumerate(search(robot, T, 100, cases.stream(82))):
        q = middle + (found - middle + np.pi) % TURN - np.pi
        q = q[oracle.inside(robot, q)]
        if not len(q):
            continue
        value = solver.redundancy_at(q)
        at = solver.solve_at(np.repeat(T[i : i + 1], len(q), axis=0), value)
        rows = iv.pose_index == i
        for k, row in enumerate(q):
            again = at.q[at.pose_index == k]
            back += bool(len(again) and oracle.wrapped(robot, again - row).min() < 1e-5)
            low, high = iv.low[rows] - EDGE, iv.high[rows] + EDGE
            held += bool(_within(value[k : k + 1], low, high)[0])
        total += len(q)
    head, note = ("seven joints, at a value", name), f"of {total} solutions of a search"
    return [
        Line(*head, "a search's solutions found at their values, %",
             Spread.exact(100.0 * back / total), 100.0, note=note),
        Line(*head, "and inside an interval of the sweep, %",
             Spread.exact(100.0 * held / total), 100.0, note=note),
    ]  # fmt: skip


def sweeps(quick: bool) -> list[Line]:
    """No value given: a solution of every reachable pose, and where all others are."""
    count, timed, scanned = (200, 20, 2) if quick else (10_000, 200, 20)
    lines = []
    for name, case in CASES.items():
        robot = arms.SEVEN[case.arm]()
        solver = kv.Analytic(redundancy=case.redundancy).fit(robot)
        _, T = cases.reachable(robot, count, seed=9)
        spent = alternate({"solve": partial(solver.solve, T[:timed])}, 5)["solve"]
        s = solver.solve(T)
        head = ("seven joints, swept", name)
        time = Spread.of([1e3 * seconds / timed for seconds in spent])
        solved = Spread.exact(100.0 * float(s.ok.mean()))
        lost = Spread.exact(int((s.status == kv.Status.UNREACHABLE).sum()))
        lines += [
            Line(*head, "solved, %", solved, 100.0, note=f"of {count:,} reachable poses"),
            *_wrong(head, robot, T, s),
            Line(*head, "reachable called UNREACHABLE", lost, 0.0, False),
            Line(*head, "time per sweep with intervals, ms", time, case.sweep_ms, False),
            *_scanned(head, robot, solver, T[:scanned]),
        ]
    return lines


def _scanned(head: tuple[str, str], robot: kv.Robot, solver: kv.Analytic, T: Array) -> list[Line]:
    """Intervals against 2,001 values across the range, each answer judged by the oracle."""
    # tight: just beyond an end a near miss is within the usual tolerances
    free = kv.Analytic(
        redundancy=solver.redundancy_, limits="ignore", tol_position=1e-9, tol_rotation=1e-9
    ).fit(robot)
    s = solver.solve(T)
    iv = s.intervals
    if solver.redundancy_ == ARM_ANGLE:
        grid = np.linspace(-np.pi, np.pi, 2_001)
    else:
        low, high = robot.limits[int(solver.redundancy_ or 0)]
        grid = np.linspace(low, high, 2_001)
    middle = robot.limits.mean(axis=1)
    unheld = empty = 0
    for i, pose in enumerate(T):
        at = free.solve_at(pose, grid)
        q = middle + (at.q - middle + np.pi) % TURN - np.pi
        far, turned = oracle.errors(np.broadcast_to(pose, (len(q), 4, 4)), oracle.pose(robot, q))
        good = oracle.inside(robot, q) & (far <= 1e-8) & (turned <= 1e-8)
        for branch in range(8):
            has = np.zeros(len(grid), dtype=bool)
            has[at.pose_index[good & (at.branch == branch)]] = True
            rows = (iv.pose_index == i) & (iv.branch == branch)
            held = _within(grid, iv.low[rows] - EDGE, iv.high[rows] + EDGE)
            surely = _within(grid, iv.low[rows] + EDGE, iv.high[rows] - EDGE)
            unheld += int((has & ~held).sum())
            empty += int((surely & ~has).sum())
    note = f"{len(T)} poses, {len(iv.low)} intervals, 2,001 values and 8 branches each"
    return [
        Line(*head, "values with a branch outside all intervals", Spread.exact(unheld), 0.0, False),
        Line(*head, "values inside one without it", Spread.exact(empty), 0.0, False, note),
    ]


def _within(grid: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    inside = np.zeros(len(grid), dtype=bool)
    for a, b in zip(low, high, strict=True):
        for turn in (-TURN, 0.0, TURN):
            inside |= (a <= grid + turn) & (grid + turn <= b)
    return inside


def _wrong(head: tuple[str, str], robot: kv.Robot, T: Array, s: kv.Solutions) -> list[Line]:
    far, turned = oracle.errors(T[s.pose_index], oracle.pose(robot, s.q))
    wrong = int(((far > 1e-6) | (turned > 1e-6) | ~oracle.inside(robot, s.q)).sum())
    worst = float(max(far.max(initial=0.0), turned.max(initial=0.0)))
    return [
        Line(*head, "wrong answers", Spread.exact(wrong), 0.0, False, f"of {len(s.q):,}"),
        Line(*head, "worst error m or rad", Spread.exact(worst), 1e-9, False),
    ]

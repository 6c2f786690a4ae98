"""What ``Swarm`` answers: alone, polished, and every branch of an arm that has eight."""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.optimizers import NAMES

__all__ = ["eight", "polished"]

Array = NDArray[np.float64]

ARMS = ("puma560", "kr16", "irb1400", "rx160l", "pioneer2", "irb6")
"""The six-axis arms of the documents and their two with five joints."""
SEEDS = (7_001, 7_002, 7_003)
"""Of the solvers; targets come from streams of the bench's own."""
SAME = 1e-6
"""Joint difference below which a branch is the closed form's [rad]."""


def polished(quick: bool) -> list[Line]:
    """1,000 reachable targets an arm, full pose, polished, and what that owes to the population.

    From one population's members alone, and with further populations where none of them led to a
    solution; beside a population that has not searched at all, and ``Numerical``.
    """
    count = 50 if quick else 1_000
    lines = []
    for name in ARMS:
        robot = kv.load(name)
        _, T = cases.reachable(robot, count, seed=41)
        for method in NAMES:
            once = kv.Swarm(optimizer=method, max_searches=1).fit(robot)
            lines += _polished(name, robot, T, method, once, "from one population, %", None)
            solver = kv.Swarm(optimizer=method).fit(robot)
            lines += _polished(name, robot, T, method, solver, "solved to 1e-6, %", 100.0)
        idle = kv.Swarm(max_evals=100).fit(robot)
        lines += _polished(name, robot, T, "no search", idle, "solved to 1e-6, %", None)
        numerical = kv.Numerical().fit(robot)
        lines += _polished(name, robot, T, "Numerical", numerical, "solved to 1e-6, %", None)
    return lines


def _polished(
    name: str,
    robot: kv.Robot,
    T: Array,
    method: str,
    solver: kv.Swarm | kv.Numerical,
    what: str,
    bound: float | None,
) -> list[Line]:
    start = time.process_time()
    answers = [solver.solve(T, rng=seed) for seed in SEEDS]
    spent = 1e3 * (time.process_time() - start) / (len(T) * len(SEEDS))
    solved = [100.0 * float(_solved(robot, T, s).mean()) for s in answers]
    starts = np.stack([s.stats.starts for s in answers])
    cost = np.stack([s.stats.cost for s in answers])
    more = 100.0 * float((starts > 1).mean())
    before = "" if np.isnan(cost).all() else f"; objective before them {np.median(cost):.3g}"
    note = (
        f"of {len(T):,} x {len(SEEDS)} seeds; {more:.1f} % took more than one descent, mean"
        f" {starts.mean():.1f}, most {int(starts.max())}{before}; {spent:.2f} ms"
    )
    head = ("swarm, polished", f"{name}, {method}")
    return [Line(*head, what, Spread.of(solved), bound, note=note)]


def _solved(robot: kv.Robot, T: Array, s: kv.Solutions) -> NDArray[np.bool_]:
    """Which poses have an answer that the oracle accepts; a wrong one spoils its pose."""
    far, turned = oracle.errors(T[s.pose_index], oracle.pose(robot, s.q))
    good = (far <= 1e-6) & (turned <= 1e-6) & oracle.inside(robot, s.q)
    solved = np.zeros(len(T), dtype=bool)
    solved[s.pose_index] = True
    solved[s.pose_index[~good]] = False
    return solved


def eight(quick: bool) -> list[Line]:
    """All eight branches of the KR16, beside the closed form's; and document 002 as printed."""
    count = 10 if quick else 200
    robot = kv.load("kr16")
    _, T = cases.reachable(robot, 20 * count, seed=42)
    known = kv.Analytic().fit(robot).solve(T)
    chosen = np.flatnonzero(known.count == 8)[:count]
    T = T[chosen]
    branches = [known[int(i)].q for i in chosen]
    lines = []
    searches = {
        "bees": kv.Swarm(optimizer="bees", all_branches=True),
        "pso": kv.Swarm(optimizer="pso", all_branches=True),
        "bees, no search": kv.Swarm(optimizer="bees", max_evals=50, all_branches=True),
    }
    for method, given in searches.items():
        solver = given.fit(robot)
        start = time.process_time()
        answers = [solver.solve(T, rng=seed) for seed in SEEDS]
        spent = 1e3 * (time.process_time() - start) / (len(T) * len(SEEDS))
        shares, apart = [], 0.0
        for s in answers:
            gaps = [_gap(robot, branches[i], s[i].q) for i in range(len(T))]
            shares.append(100.0 * float(np.mean([gap < SAME for gap in gaps])))
            apart = max(apart, max((gap for gap in gaps if gap < SAME), default=0.0))
        head = ("swarm, every branch", f"kr16, {method}")
        bound = None if "no search" in method else 99.0
        note = f"of {len(T)} poses x {len(SEEDS)} seeds; at most {apart:.1e} rad from it"
        lines += [
            Line(*head, "the eight of the closed form, %", Spread.of(shares), bound, note=note),
            Line(*head, "time per pose, ms CPU", Spread.exact(spent)),
        ]
    return [*lines, _as_printed(robot, T)]


def _gap(robot: kv.Robot, exact: Array, found: Array) -> float:
    """How far the closed form's branches are from the nearest found, or infinite if not eight."""
    if len(found) != len(exact):
        return np.inf
    return max(float(oracle.wrapped(robot, found - row).min()) for row in exact)


def _as_printed(robot: kv.Robot, T: Array) -> Line:
    """Document 002's objective: squared distance, no orientation, no polish, its 62 bees."""
    solver = kv.Swarm(
        optimizer="bees", norm="squared", task="position", polish=False, tol_position=1e-3
    ).fit(robot)
    s = solver.solve(T, rng=SEEDS[0])
    _, turned = oracle.errors(T, oracle.pose(robot, s.stats.best_q))
    away = float(np.degrees(np.median(turned)))
    share = Spread.exact(100.0 * float(s.ok.mean()))
    distance = float(np.median(np.sqrt(s.stats.cost)))
    note = (
        f"of {len(T)}; median distance {1e3 * distance:.3g} mm, and the orientation, which the"
        f" objective does not hold, is {away:.0f} degrees off: a continuum, not eight"
    )
    return Line(
        "swarm, every branch", "kr16, as printed in 002", "position to 1 mm, %", share, note=note
    )

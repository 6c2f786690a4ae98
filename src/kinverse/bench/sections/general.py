"""Six joints of any kind: found, true, quick, and no branch more or less than a search finds."""

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import arms, cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread, alternate
from kinverse.bench.search import merge, search

__all__ = ["branch_sets", "complete"]

Array = NDArray[np.float64]

SAME = 1e-6
"""Joint difference below which two configurations are one, as in ``Solutions``."""
CLOSE = 1e-4
"""Solutions nearer than this are about to merge: such poses are reported apart."""
STARTS = 300
"""Of the independent search, for each pose."""
FURTHER = 6
"""More rounds, each of twice the starts, where ours has more: a search may overlook branches."""
SPECIAL = ("puma560", "ur5", "irb1400")
"""Arms of special families beside them."""


def complete(quick: bool) -> list[Line]:
    """Random configurations: the one that made the pose is among the answers, and none is wrong."""
    count, rounds = (1_000, 2) if quick else (10_000, 5)
    return [line for name in arms.GENERAL for line in _complete(name, count, rounds)]


def _complete(name: str, count: int, rounds: int) -> list[Line]:
    robot = arms.GENERAL[name]()
    solver = kv.Analytic().fit(robot)
    q, T = cases.reachable(robot, count)
    spent = alternate({"solve": lambda: solver.solve(T)}, rounds)["solve"]
    s = solver.solve(T)
    far, turned = oracle.errors(T[s.pose_index], oracle.pose(robot, s.q))
    wrong = int(((far > 1e-6) | (turned > 1e-6) | ~oracle.inside(robot, s.q)).sum())
    hit = np.zeros(count, dtype=bool)
    hit[s.pose_index[oracle.wrapped(robot, s.q - q[s.pose_index]) <= SAME]] = True
    close = oracle.twin(robot, q) < CLOSE
    lost = int((s.status == kv.Status.UNREACHABLE).sum())
    sure = int((~hit & ~close & ~s.stats.evidence.weak).sum())
    head = ("general arms", name)
    lines = [
        Line(
            *head,
            "generating configuration found, %",
            Spread.exact(100.0 * float(hit[~close].mean())),
            99.99,
            note=f"of {int((~close).sum()):,}",
        ),
        Line(*head, "wrong answers", Spread.exact(wrong), 0.0, False, f"of {len(s.q):,}"),
        Line(*head, "worst error m", Spread.exact(far.max()), 1e-9, False),
        Line(*head, "worst error rad", Spread.exact(turned.max()), 1e-9, False),
        Line(*head, "reachable called UNREACHABLE", Spread.exact(lost), 0.0, False),
        Line(*head, "missed, and the evidence not weak", Spread.exact(sure), 0.0, False),
        Line(
            *head,
            "time per pose, batch us",
            Spread.of([1e6 * seconds / count for seconds in spent]),
            40.0,
            False,
            "aim 20",
        ),
    ]
    if close.any():
        what = "the same where two roots are closer than 1e-4, %"
        share = Spread.exact(100.0 * float(hit[close].mean()))
        lines.insert(1, Line(*head, what, share, note=f"of {int(close.sum())}"))
    return lines


def branch_sets(quick: bool) -> list[Line]:
    """The branches of 50 poses an arm, against those of an independent search."""
    count = 5 if quick else 50
    made = [(name, make()) for name, make in arms.GENERAL.items()]
    made += [(name, kv.load(name)) for name in SPECIAL]
    return [line for name, robot in made for line in _branch_sets(name, robot, count)]


def _branch_sets(name: str, robot: kv.Robot, count: int) -> list[Line]:
    slides = oracle.slides(robot)
    low, high = np.where(slides, robot.limits.T, np.array([[-np.pi], [np.pi]]))
    q = cases.stream(62).uniform(low, high, (count, robot.dof))
    T = oracle.pose(robot, q)
    solved = kv.Analytic(limits="ignore").fit(robot).solve(T)
    ours = [solved.q[solved.pose_index == i] for i in range(count)]
    far, turned = oracle.errors(T[solved.pose_index], oracle.pose(robot, solved.q))
    rng = cases.stream(63)
    theirs = search(robot, T, STARTS, rng)
    at_first = sum(len(found) for found in theirs)
    for k in range(1, FURTHER + 1):
        short = [i for i in range(count) if len(_without(robot, ours[i], theirs[i]))]
        if not short:
            break
        for i, more in zip(short, search(robot, T[short], STARTS * 2**k, rng), strict=True):
            theirs[i] = merge(robot, np.concatenate([theirs[i], more]))
    close = np.array([_closest(robot, found) < CLOSE for found in theirs])
    missing = np.array([len(_without(robot, theirs[i], ours[i])) for i in range(count)])
    extra = np.array([len(_without(robot, ours[i], theirs[i])) for i in range(count)])
    twice = sum(len(found) - len(merge(robot, found)) for found in ours)
    equal = (missing == 0) & (extra == 0)
    head = ("branch sets", name)
    note = (
        f"of {int((~close).sum())} poses, {len(solved.q)} branches; the search's {STARTS} starts "
        f"found {at_first}"
    )
    lines = [
        Line(
            *head,
            "same set as the search, % of poses",
            Spread.exact(100.0 * float(equal[~close].mean())),
            100.0,
            note=note,
        ),
        Line(*head, "branches missing", Spread.exact(int(missing[~close].sum())), 0.0, False),
        Line(
            *head,
            "branches invented",
            Spread.exact(int(((far > 1e-9) | (turned > 1e-9)).sum())),
            0.0,
            False,
            note="off by more than 1e-9",
        ),
        Line(*head, "branches told twice", Spread.exact(twice), 0.0, False),
    ]
    if close.any():
        what = "the same where two roots are closer than 1e-4, %"
        share = Spread.exact(100.0 * float(equal[close].mean()))
        lines.append(Line(*head, what, share, note=f"of {int(close.sum())}"))
    return lines


def _without(robot: kv.Robot, some: Array, others: Array) -> Array:
    """The rows of some (K, n) that are not among others, whole turns not counted."""
    if not len(others):
        return some
    return some[[bool(oracle.wrapped(robot, others - row).min() > SAME) for row in some]]


def _closest(robot: kv.Robot, q: Array) -> float:
    """The least distance between two rows."""
    gaps = [oracle.wrapped(robot, q[i + 1 :] - q[i]).min() for i in range(len(q) - 1)]
    return float(min(gaps, default=np.inf))

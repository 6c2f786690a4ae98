"""Where no arm reaches, and where it has lost a direction: what is said of such poses is true."""

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import arms, cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.bench.search import closest
from kinverse.bench.sections.closed_form import special

__all__ = ["around", "rank_deficient"]

Array = NDArray[np.float64]

STARTS = 300
"""Of each numerical search."""
SAMPLE = 20
"""Poses of each arm that the bench's own, slower search looks at too."""
TOLERANCE = 1e-6


def _every_arm() -> dict[str, kv.Robot]:
    made = {robot.name: robot for robot, _ in special()}
    return made | {name: make() for name, make in (arms.GENERAL | arms.SHORT | arms.SEVEN).items()}


def around(quick: bool) -> list[Line]:
    """Poses in and around each workspace: UNREACHABLE is confirmed, and no reachable pose is it."""
    count, sample = (400, 2) if quick else (20_000, SAMPLE)
    return [
        line for name, robot in _every_arm().items() for line in _around(name, robot, count, sample)
    ]


def _around(name: str, robot: kv.Robot, count: int, sample: int) -> list[Line]:
    T, inside = cases.around(robot, count)
    status = kv.Analytic(limits="ignore").fit(robot).solve(T).status
    search = kv.Numerical(limits="ignore", max_starts=STARTS).fit(robot)
    denied = np.flatnonzero(status == kv.Status.UNREACHABLE)
    open_ = np.flatnonzero(status == kv.Status.NOT_FOUND)
    refuted = int(search.solve(T[denied]).ok.sum())
    # what a search that finds nothing is worth
    power = 100.0 * float(search.solve(T[:inside]).ok.mean())
    some = denied[:: max(1, len(denied) // sample)][:sample]
    nearest = closest(robot, T[some], STARTS, cases.stream(23)) if len(some) else np.empty(0)
    found = int(search.solve(T[open_]).ok.sum())
    head = ("in and around the workspace", name)
    shares = ", ".join(
        f"{which.name} {100.0 * float((status == which).mean()):.2f}"
        for which in (kv.Status.SOLVED, kv.Status.UNREACHABLE, kv.Status.NOT_FOUND)
    )
    lost = int((status[:inside] == kv.Status.UNREACHABLE).sum())
    solved = 100.0 * float((status[:inside] == kv.Status.SOLVED).mean())
    return [
        Line(*head, "reachable solved, %", Spread.exact(solved), 99.99, note=f"of {inside:,}"),
        Line(
            *head,
            "reachable called UNREACHABLE",
            Spread.exact(lost),
            0.0,
            False,
            f"of {inside:,}",
        ),
        Line(
            *head,
            "UNREACHABLE that a search solves",
            Spread.exact(refuted),
            0.0,
            False,
            f"of {len(denied):,}; it solves {power:.2f} % of the reachable",
        ),
        Line(
            *head,
            "UNREACHABLE that the bench's search solves",
            Spread.exact(int((nearest <= TOLERANCE).sum())),
            0.0,
            False,
            f"of {len(some)}, {STARTS} starts",
        ),
        Line(
            *head,
            "NOT_FOUND that a search solves",
            Spread.exact(found),
            note=f"of {len(open_):,}; % {shares}",
        ),
    ]


def rank_deficient(quick: bool) -> list[Line]:
    """Poses at which the Jacobian has lost rank: each has a true answer, and is flagged."""
    count = 100 if quick else 1_000
    lines = []
    for name, robot in _every_arm().items():
        q = cases.rank_deficient(robot, count)
        if q is None:
            continue  # few joints: no such place
        T = oracle.pose(robot, q)
        s = kv.Analytic().fit(robot).solve(T)
        far, turned = oracle.errors(T[s.pose_index], oracle.pose(robot, s.q))
        good = (far <= TOLERANCE) & (turned <= TOLERANCE) & oracle.inside(robot, s.q)
        solved = np.zeros(count, dtype=bool)
        solved[s.pose_index[good]] = True
        what, right = "flagged singular, %", s.stats.singular
        if robot.dof > 6:
            # a posture is singular, not a pose that has others: the flag must fit the answers
            what, right = "flagged as its answers are, %", _fits(robot, s)
        flagged = 100.0 * float(right.mean())
        head = ("rank deficient", name)
        share = Spread.exact(100.0 * float((solved & s.ok).mean()))
        wrong = Spread.exact(int((~good).sum()))
        lines += [
            Line(*head, "solved, %", share, 100.0, note=f"of {count:,}"),
            Line(*head, "wrong answers", wrong, 0.0, False, f"of {len(s.q):,}"),
            Line(*head, what, Spread.exact(flagged), 100.0),
        ]
    return lines


def _fits(robot: kv.Robot, s: kv.Solutions) -> NDArray[np.bool_]:
    """Which poses' flags agree with the answered postures; what is neither here nor there does."""
    least = np.full(len(s), np.inf)
    np.minimum.at(least, s.pose_index, oracle.conditioning(robot, s.q))
    flag = s.stats.singular
    return np.where(least < 1e-7, flag, np.where(least > 1e-5, ~flag | s.stats.continuum, True))

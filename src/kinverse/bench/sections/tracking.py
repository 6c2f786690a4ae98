"""Paths: how fast they are tracked, whether at least cost, and whether gaps are what they say."""

import itertools
import time
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import cases, oracle
from kinverse.bench.continuation import continued
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.bench.splines import AT_ONCE, PIECES, Follower, Nodes, Spline
from kinverse.load import load
from kinverse.paths import Gap, JointPath, Reason, track
from kinverse.solvers.analytic import Analytic
from kinverse.solvers.numerical import Numerical

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["tracking"]

Array = NDArray[np.float64]

ARMS = ("puma560", "ur5", "kr16", "iiwa14")
LIMIT = 0.5
"""Largest joint step [rad], the default."""
SHORT = 7
"""Samples of paths whose every sequence is written out."""
SAMPLES = 60
FINER = 32
"""Samples in the place of one where a break is looked at again."""
LED = 8, 128
"""Steps from one sample to the next where Newton's method follows a path; what few of them lead,
perhaps past a singularity onto another branch, is asked again with more."""
MOST_LED = 10_000
"""Postures that it leads at once."""
POSTURES = 64
"""Starts for the postures of an arm with a joint to spare."""
FREE = 2.5
"""How far limits are put out to see whether they are what stops a joint [rad]."""


def tracking(quick: bool) -> list[Line]:
    """Speed on the KR16, brute force on short paths, random splines in four workspaces."""
    lines = _speed(5_000 if quick else 100_000, 3 if quick else 7)
    for name in ARMS[:3]:
        lines.append(_exhaustive(name, 10 if quick else 200))
    for name in ARMS:
        lines += _splines(name, (2 if name == "iiwa14" else 10) if quick else 1_000)
    return lines


def _speed(count: int, rounds: int) -> list[Line]:
    robot = load("kr16")
    coarse = cases.path(robot, 1000)
    at = np.linspace(0.0, 999.0, count)
    q = np.column_stack([np.interp(at, np.arange(1000), column) for column in coarse.T])
    T = oracle.pose(robot, q)
    seconds, whole = [], True
    for _ in range(rounds):
        start = time.process_time()
        found = track(robot, T)
        seconds.append(time.process_time() - start)
        whole = whole and found.is_whole
    section = f"a path of {count:,} samples, all branches and windings"
    note = f"solving, dynamic programming and all else; {len(seconds)} rounds"
    cost = np.abs(np.diff(q, axis=0)).max(axis=1).sum()
    return [
        Line(section, "kr16", "CPU seconds", Spread.of(seconds), 1.0, False, note),
        Line(section, "kr16", "tracked without a break", Spread.exact(float(whole)), 1.0),
        Line(
            section,
            "kr16",
            "cost over that of the joint motion the poses are from",
            Spread.exact(found.cost / cost),
            1.0 + 1e-9,
            False,
        ),
    ]


def _exhaustive(name: str, paths: int) -> Line:
    """Short random paths against every sequence of branches."""
    robot = load(name)
    low, high = robot.limits.T
    # one winding a solution, so that all sequences can be written out
    turn = np.column_stack([np.maximum(low, -np.pi), np.minimum(high, np.pi)])
    follower = Follower(robot.with_limits(turn))
    section = f"{SHORT} samples: every sequence of branches written out"
    same = whole = most = singular = 0
    for seed in range(paths):
        path = Spline(robot, 10_000 + seed)
        found = track(follower.robot, path, samples=SHORT)
        breaks, cost, written = _cheapest(follower, path, passing=False)
        if breaks:
            breaks, cost, _ = _cheapest(follower, path, passing=True)
        ours = max(len(found.intervals) - 1, 0)
        agrees = ours == breaks and abs(found.cost - cost) < 1e-9
        if not agrees and follower.solver.solve(found.T).stats.continuum.any():
            # members of a continuum, of which the sequences hold one a branch, can only help
            singular += 1
            agrees = (ours, found.cost) < (breaks, cost)
        same += agrees
        whole += found.is_whole
        most = max(most, written)
    note = f"fewest breaks, then least cost; {whole} paths without a gap; up to {most:,} sequences"
    if singular:
        note += f"; {singular} paths with singular samples: better than all of these"
    return Line(section, name, "paths with the same answer", Spread.exact(same), paths, note=note)


def _cheapest(follower: Follower, path: Spline, passing: bool) -> tuple[int, float, int]:
    """Fewest breaks and least cost of all sequences, and how many there are.

    ``passing``: steps may change branches where the path passes a singularity.
    """
    s = np.linspace(0.0, 1.0, SHORT)
    found = follower.solver.solve(path(s))
    ends = np.cumsum(found.count)
    live = np.flatnonzero(found.count)
    if not len(live):
        return 0, 0.0, 0
    layers = [slice(ends[i] - found.count[i], ends[i]) for i in live]
    last = np.arange(found.count[live[0]])
    breaks, cost = np.zeros(len(last), np.int64), np.zeros(len(last))
    for (i, one), (j, other) in itertools.pairwise(zip(live, layers, strict=True)):
        before = found.q[one], found.branch[one]
        behind = found.q[other], found.branch[other]
        joined = follower.joined(before, behind, LIMIT) & (j == i + 1)
        if passing:
            joined &= follower.same_side(path, s[[i, j]], before, behind, joined, LIMIT)
        else:
            joined &= behind[1][:, None] == before[1]
        step = np.abs(behind[0][:, None] - before[0]).max(axis=2)
        # every sequence so far with every node behind it
        way = joined.T[last]
        breaks = (breaks[:, None] + ~way).ravel()
        cost = (cost[:, None] + np.where(way, step.T[last], 0.0)).ravel()
        last = np.tile(np.arange(len(behind[0])), len(last))
    fewest = breaks.min()
    return int(fewest), float(cost[breaks == fewest].min()), len(cost)


def _splines(name: str, paths: int) -> list[Line]:
    robot = load(name)
    section = f"{paths:,} random splines in the workspace, {SAMPLES} samples"
    over = wrong = outside = 0
    told: Counter[Reason] = Counter()
    held: Counter[Reason] = Counter()
    judge = _Judge(robot)
    start = time.process_time()
    found = [track(robot, Spline(robot, seed), samples=SAMPLES) for seed in range(paths)]
    seconds = (time.process_time() - start) / paths
    low, high = robot.limits.T
    for seed, joint_path in enumerate(found):
        over += joint_path.largest_step > LIMIT + 1e-12
        q = joint_path.q[joint_path.ok]
        far, turned = oracle.errors(oracle.pose(robot, q), joint_path.T[joint_path.ok])
        wrong += bool((far > 1e-6).any() or (turned > 1e-6).any())
        outside += bool(((q < low) | (q > high)).any())
        for gap in joint_path.gaps:
            told[gap.code] += 1
            held[gap.code] += judge.agrees(gap, joint_path, seed)
    counts = ", ".join(f"{reason.name} {told[reason]}" for reason in Reason if told[reason])
    lines = [
        Line(section, name, f"paths with {what}", Spread.exact(count), 0.0, False)
        for what, count in (
            ("a step over the limit", over),
            ("a wrong pose", wrong),
            ("joint values outside the limits", outside),
        )
    ]
    lines += _followed(section, robot, found, seconds)
    lines += _changes(section, robot, judge.held, found)
    confirmed = Spread.exact(held.total())
    note = f"gaps by reason: {counts or 'none, nothing to confirm'}; {judge.how}"
    bound = told.total() or None
    lines.append(Line(section, name, "reasons confirmed", confirmed, bound, note=note))
    return lines


def _followed(section: str, robot: "Robot", found: list[JointPath], seconds: float) -> list[Line]:
    """Paths followed to the end, against those that Newton's method in small steps follows."""
    lost = [seed for seed, joint_path in enumerate(found) if not joint_path.is_whole]
    whole = len(found) - len(lost)
    more = _led_to_the_end(robot, lost)
    note = (
        f"target: and those of the other {len(lost)} that Newton's method follows in {LED[-1]}"
        f" steps a sample from any start; {1e3 * seconds:.3g} ms of CPU each"
    )
    what = "paths followed to the end"
    return [Line(section, robot.name, what, Spread.exact(whole), whole + more, note=note)]


def _led_to_the_end(robot: "Robot", seeds: list[int]) -> int:
    """How many of these paths lead joint values from start to end, no step over the limit."""
    for pieces in LED:
        seeds = _led(robot, seeds, pieces)
    return len(seeds)


def _led(robot: "Robot", seeds: list[int], pieces: int) -> list[int]:
    """Those of the paths, in so many steps from one sample to the next."""
    s = np.linspace(0.0, 1.0, pieces * (SAMPLES - 1) + 1)
    poses = [Spline(robot, seed)(s) for seed in seeds]
    starts = [_postures(robot, T[0]) for T in poses]
    path = np.repeat(np.arange(len(seeds)), [len(q) for q in starts])
    led: set[int] = set()
    for part in np.array_split(np.arange(len(path)), max(1, len(path) // MOST_LED)):
        if not len(part):
            continue
        live, q = part, np.concatenate(starts)[part]
        for k in range(SAMPLES - 1):
            first = pieces * k + 1
            T = np.stack([poses[i][first : first + pieces] for i in path[live]], axis=1)
            end = continued(robot, T, q, 2.0 * LIMIT / pieces)[-1]
            near = np.abs(end - q).max(axis=1) <= LIMIT
            live, q = live[near], end[near]
            if not len(live):
                break
        led |= set(path[live].tolist())
    return [seeds[i] for i in sorted(led)]


def _postures(robot: "Robot", T: Array) -> Array:
    """Joint values (K, n) that reach a pose: all, or of a continuum those from many starts."""
    if robot.dof <= 6:
        return Analytic(windings="all").fit(robot).solve(T).q
    low, high = robot.limits.T
    seeds = cases.stream(62, 0).uniform(low, high, (POSTURES, robot.dof))
    return Numerical(max_starts=1).fit(robot).solve(np.repeat(T[None], POSTURES, 0), seeds).q


def _changes(
    section: str, robot: "Robot", follower: Follower, found: list[JointPath]
) -> list[Line]:
    """Steps that change branches: those that the path itself leads over."""
    count = led = 0
    asked = np.ones((1, 1), np.bool_)
    for seed, joint_path in enumerate(found):
        path, s = Spline(robot, seed), np.linspace(0.0, 1.0, SAMPLES)
        for first, last in joint_path.intervals:
            branch = joint_path.branch[first:last]
            for k in first + np.flatnonzero(branch[1:] != branch[:-1]):
                before, behind = (
                    (joint_path.q[i : i + 1], joint_path.branch[i : i + 1]) for i in (k, k + 1)
                )
                count += 1
                led += int(
                    follower.same_side(path, s[k : k + 2], before, behind, asked, LIMIT)[0, 0]
                )
    if not count:
        return []
    what = "steps that change branches: the path itself leads over"
    note = f"Newton's method in {PIECES[-1]} steps, at most {AT_ONCE:g} times the even part each"
    return [Line(section, robot.name, what, Spread.exact(led), count, note=note)]


class _Judge:
    """Looks at gaps again with other means than ``track``."""

    def __init__(self, robot: "Robot") -> None:
        self.robot = robot
        self.held = Follower(robot)
        low, high = robot.limits.T
        self.free = Follower(robot.with_limits(np.column_stack([low - FREE, high + FREE])))
        nodes = f"{POSTURES} postures led on by Newton's method" if robot.dof > 6 else "all nodes"
        self.how = f"searched from 300 starts; breaks: {nodes} with {FINER} times the samples"

    def agrees(self, gap: Gap, joint_path: JointPath, seed: int) -> bool:
        """Whether a gap is what it says."""
        if not gap.is_break:
            T = joint_path.T[gap.start : gap.end]
            if gap.code is Reason.OUT_OF_REACH:
                return self.held.has_none(T)
            if gap.code is Reason.NOT_FOUND:
                return not self.held.inside.solve(T).ok.any()
            return self._are_outside(T)
        path = Spline(self.robot, seed)
        behind = (gap.barrier + np.linspace(0.0, 1.0, FINER + 1)) / (SAMPLES - 1)
        if self.robot.dof > 6:
            held, free = (self._leads(follower.robot, path(behind)) for follower in self.both)
        else:
            nodes = self._nodes(gap, joint_path, path)
            held, free = (
                len(follower.reached(path, behind, LIMIT, nodes)[0]) > 0 for follower in self.both
            )
        if gap.code is Reason.STEP:
            return held
        return not held and free == (gap.code is Reason.OUT_OF_LIMITS)

    @property
    def both(self) -> tuple[Follower, Follower]:
        """Inside the limits, and beyond them."""
        return self.held, self.free

    def _nodes(self, gap: Gap, joint_path: JointPath, path: Spline) -> Nodes:
        """The nodes at the barrier that the run before the break can come to."""
        before = [
            g.barrier + 1 if g.is_break else g.end for g in joint_path.gaps if g.start < gap.start
        ]
        samples = np.arange(max(before, default=0), gap.barrier + 1) / (SAMPLES - 1)
        return self.held.reached(path, samples, LIMIT)

    @staticmethod
    def _leads(robot: "Robot", T: Array) -> bool:
        """Whether poses (K, 4, 4) lead any of many postures to their end."""
        way = continued(robot, T[1:, None], _postures(robot, T[0]), LIMIT)
        return bool(np.isfinite(way[-1]).any())

    def _are_outside(self, T: Array) -> bool:
        """Every pose has a solution, none inside the limits."""
        inside, anywhere = self.held.inside, self.held.anywhere
        return not inside.solve(T).ok.any() and bool(anywhere.solve(T).ok.all())

"""The population methods beside those of other libraries: same targets, same cost, same budget."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.bench.swarm_peers import PEERS, Peer
from kinverse.optimizers import NAMES, BeesAlgorithm, Optimizer, make_optimizer

__all__ = ["VARIANTS", "against_peers", "ratio_of_medians"]

Array = NDArray[np.float64]
Factory = Callable[[], Optimizer]

EVALUATIONS, POPULATION = 20_000, 100
TOGETHER = 64
"""Problems that run side by side."""
SOLVER_SEED = 777
"""Of ours; targets and peers draw from the bench's own streams."""
GOOD = 1e-3
CPU_MS = {"pso": 8.0}
"""Target of a solve among many [ms]; 15 for the others."""
TIMES = {"mealpy": 50.0, "pymoo": 10.0}
"""How many times the CPU time of ours."""

_own = partial(partial, make_optimizer, population=POPULATION)
VARIANTS: dict[str, Factory] = {
    **{name: _own(name) for name in NAMES},
    "pso constricted": _own("pso", inertia=(0.7298, 0.7298), cognitive=1.49618, social=1.49618),
    "pso ring of 8": _own("pso", neighbours=8),
    "pso ring of 4, social": _own("pso", neighbours=4, cognitive=0.3, social=2.2),
    "ga binary": _own("ga", variant="binary"),
    "ga simulated binary": _own("ga", variant="simulated_binary"),
    "ga simulated binary, wide": _own(
        "ga", variant="simulated_binary", mutation=0.5, spread_index=(2.0, 40.0)
    ),
    "gwo elitist": _own("gwo", elitist=True),
    "tlbo factor 1": _own("tlbo", teaching_factors=(1,)),
    "bees": partial(make_optimizer, "bees"),  # 50 scouts, as published
    "bees of Pham": BeesAlgorithm.pham,
    "cibo literal": _own("cibo", reading="literal"),
    "firefly greedy": _own("firefly", greedy=True),
    "bbo greedy": _own("bbo", greedy=True),
    "de crossover 1": _own("de", crossover=1.0),
    "de as SciPy's": _own("de", strategy="best1bin", mutation=(0.5, 1.0), crossover=0.7),
    "de adaptive": _own("de", adaptive=True),
}
"""Rows of the comparison; the first word names the method."""


@dataclass(frozen=True)
class Amount:
    """How much is measured; of a peer, as many targets as its CPU seconds allow."""

    targets: int
    seeds: int
    alone: int
    peer_seconds: float
    peer_targets: int = 5


FULL = Amount(targets=200, seeds=10, alone=20, peer_seconds=8.0)
QUICK = Amount(targets=32, seeds=2, alone=3, peer_seconds=3.0)


@dataclass(frozen=True)
class Result:
    """Errors (targets, seeds) [m + rad], CPU seconds a solve, evaluations of each solve."""

    error: Array
    seconds: list[float]
    evaluations: list[int]

    @property
    def median(self) -> float:
        """Over all targets and seeds."""
        return float(np.median(self.error))

    def told(self) -> str:
        """What a line of it notes."""
        shape = " x ".join(f"{count}" for count in self.error.shape if count > 1)
        least, most = min(self.evaluations), max(self.evaluations)
        spent = f"{least:,}" if least == most else f"{least:,}..{most:,}"
        return f"{shape} targets, {spent} evaluations"


def against_peers(quick: bool) -> list[Line]:
    """PUMA 560, full pose: median errors, and CPU time, method by method."""
    return compare(QUICK if quick else FULL, VARIANTS, PEERS)


def compare(
    amount: Amount, variants: dict[str, Factory], peers: dict[str, tuple[Peer, ...]]
) -> list[Line]:
    """One group of lines a method: ours, its peers, ours against the best of them.

    Raises:
        ModuleNotFoundError: a peer is not installed.
    """
    for package in {peer.package for group in peers.values() for peer in group}:
        if find_spec(package) is None:
            raise ModuleNotFoundError(f"No module named {package!r}", name=package)
    robot = kv.load("puma560")
    _, T = cases.reachable(robot, amount.targets, seed=8)
    lines = []
    for method in dict.fromkeys([*(name.split()[0] for name in variants), *peers]):
        rows = {name: factory() for name, factory in variants.items() if name.split()[0] == method}
        ours = {name: _ours(robot, T, optimizer, amount) for name, optimizer in rows.items()}
        alone = {name: _alone(robot, T, optimizer, amount) for name, optimizer in rows.items()}
        for name, result in ours.items():
            lines += _own_lines(name, result, alone[name])
        theirs = {peer: _theirs(robot, T, peer, amount) for peer in peers.get(method, ())}
        for peer, result in theirs.items():
            lines.append(_peer_line(method, peer, result))
        if ours and theirs:
            lines += _ratio_lines(method, ours, alone, theirs)
    return lines


# ---------------------------------------------------------------------------- measuring
def _drive(
    robot: kv.Robot, T: Array, optimizer: Optimizer, keys: Sequence[tuple[int, ...]]
) -> tuple[Array, int]:
    """Best joint values (N, n) for poses (N, 4, 4), and the evaluations of each."""
    run = optimizer.start(
        robot.limits, max_evals=EVALUATIONS, rng=SOLVER_SEED, problems=len(T), keys=keys
    )
    weight = np.ones(len(T))
    spent = 0
    while not run.done:
        points = run.ask()
        spent += points.shape[1]
        active = run.active
        run.tell(robot.chain.pose_costs(0, 0, 0, T[active], weight[active], points))
    return run.x_best, spent


def _error(robot: kv.Robot, T: Array, q: Array) -> Array:
    """Position [m] and rotation error [rad] together, as the oracle has them."""
    far, turned = oracle.errors(T, oracle.pose(robot, q))
    return np.where(oracle.inside(robot, q), far + turned, np.inf)


def _ours(robot: kv.Robot, T: Array, optimizer: Optimizer, amount: Amount) -> Result:
    """All targets and seeds, in blocks."""
    keys = [(i, k) for i in range(len(T)) for k in range(amount.seeds)]
    error: list[Array] = []
    seconds, evaluations = [], []
    for start in range(0, len(keys), TOGETHER):
        block = keys[start : start + TOGETHER]
        poses = T[[i for i, _ in block]]
        before = time.process_time()
        q, spent = _drive(robot, poses, optimizer, block)
        seconds.append((time.process_time() - before) / len(block))
        evaluations.append(spent)
        error.append(_error(robot, poses, q))
    return Result(np.concatenate(error).reshape(len(T), -1), seconds, evaluations)


def _alone(robot: kv.Robot, T: Array, optimizer: Optimizer, amount: Amount) -> list[float]:
    """CPU seconds of solves one at a time."""
    seconds = []
    for i in range(min(amount.alone, len(T))):
        before = time.process_time()
        _drive(robot, T[i : i + 1], optimizer, [(i, 0)])
        seconds.append(time.process_time() - before)
    return seconds


def _theirs(robot: kv.Robot, T: Array, peer: Peer, amount: Amount) -> Result:
    """The first targets, one solve each, while the seconds last."""
    low, high = (np.ascontiguousarray(side) for side in robot.limits.T)
    costs, weight = robot.chain.pose_costs, np.ones(1)
    seeds = cases.stream(81).integers(2**31, size=len(T))
    peer.prepare(robot.dof, EVALUATIONS, POPULATION)
    error, seconds, evaluations = [], [], []
    for pose, seed in zip(T[:, None], seeds, strict=True):
        target = np.ascontiguousarray(pose)

        def cost(q: Array, target: Array = target) -> Array:
            return np.asarray(costs(0, 0, 0, target, weight, q[None])[0])

        before = time.process_time()
        answer = peer.solve(cost, low, high, EVALUATIONS, POPULATION, int(seed))
        seconds.append(time.process_time() - before)
        evaluations.append(answer.evaluations)
        error.append(_error(robot, target, answer.x[None])[0])
        if sum(seconds) > amount.peer_seconds and len(error) >= amount.peer_targets:
            break
    return Result(np.array(error)[:, None], seconds, evaluations)


def ratio_of_medians(ours: Array, theirs: Array, draws: int = 2_000) -> Spread:
    """median(ours) / median(theirs) on the targets both have, with its 95 % interval.

    Args:
        ours: (targets, seeds) errors.
        theirs: (targets, seeds) errors; the first targets of ours, or more.
        draws: bootstrap samples of targets, the same for both.
    """
    count = min(len(ours), len(theirs))
    picked = cases.stream(82).integers(count, size=(draws, count))
    above, below = (
        np.array([np.median(error[rows]) for rows in picked]) for error in (ours, theirs)
    )
    low, high = np.percentile(above / below, [2.5, 97.5])
    middle = np.median(ours[:count]) / np.median(theirs[:count])
    return Spread(float(middle), float(low), float(high))


# ---------------------------------------------------------------------------- telling
TITLE = "swarm, PUMA 560 full pose"


def _quartiles(values: Array) -> Spread:
    low, middle, high = np.percentile(values, [25, 50, 75])
    return Spread(float(middle), float(low), float(high))


def _ms(seconds: list[float]) -> Spread:
    return Spread.of([1e3 * s for s in seconds])


def _own_lines(name: str, result: Result, alone: list[float]) -> list[Line]:
    head = (TITLE, name)
    solved = Spread.exact(100.0 * float((result.error < GOOD).mean()))
    off = max(abs(spent - EVALUATIONS) for spent in result.evaluations)
    bound = CPU_MS.get(name.split()[0], 15.0)
    together = f"{TOGETHER} together"
    return [
        Line(*head, "median error m + rad", _quartiles(result.error), note=result.told()),
        Line(*head, f"error < {GOOD:g}, %", solved),
        Line(*head, "evaluations off the budget", Spread.exact(off), 0.0, False),
        Line(*head, "CPU ms a solve, alone", _ms(alone)),
        Line(*head, f"CPU ms a solve, {together}", _ms(result.seconds), bound, False),
    ]


def _peer_line(method: str, peer: Peer, result: Result) -> Line:
    solved = 100.0 * float((result.error < GOOD).mean())
    cpu = 1e3 * float(np.median(result.seconds))
    note = f"{result.told()}, {solved:.0f} % < {GOOD:g}, {cpu:.0f} ms CPU"
    if peer.note:
        note += f"; {peer.note}"
    return Line(TITLE, method, f"{peer.name}: median error", _quartiles(result.error), note=note)


def _ratio_lines(
    method: str,
    ours: dict[str, Result],
    alone: dict[str, list[float]],
    theirs: dict[Peer, Result],
) -> list[Line]:
    """Each of ours against the best peer; the best of ours is held to the target.

    It must stand against every peer: one that afforded few targets may have the lowest median by
    luck, and its wide interval would let anything pass.
    """
    best = min(theirs, key=lambda peer: theirs[peer].median)
    lines, hardest = [], {}
    for name, mine in ours.items():
        ratios = {peer: ratio_of_medians(mine.error, theirs[peer].error) for peer in theirs}
        hardest[name] = max((ratio.low, peer.name) for peer, ratio in ratios.items())
        note = f"{best.name}, {len(theirs[best].error)} targets, 95 %"
        lines.append(Line(TITLE, name, "median error / the best peer's", ratios[best], note=note))
        lines += _cpu_lines(name, mine, alone[name], theirs)
    name = min(hardest, key=lambda row: hardest[row])
    figure, peer = hardest[name]
    what = "lower bound of the ratio, the highest of all peers"
    held = Line(TITLE, method, what, Spread.exact(figure), 1.1, False, f"{name} / {peer}")
    return [*lines, held]


def _cpu_lines(
    name: str, mine: Result, alone: list[float], theirs: dict[Peer, Result]
) -> list[Line]:
    """CPU time of the quickest peer of each package over ours, one solve and one of many."""
    lines = []
    for package in dict.fromkeys(peer.package for peer in theirs):
        spent = {
            peer.name: float(np.median(result.seconds))
            for peer, result in theirs.items()
            if peer.package == package
        }
        quickest = min(spent, key=lambda peer: spent[peer])
        ours = {"alone": alone, f"{TOGETHER} together": mine.seconds}
        for how, seconds in ours.items():
            figure = Spread.exact(spent[quickest] / float(np.median(seconds)))
            what = f"CPU: {package} / ours, {how}"
            lines.append(Line(TITLE, name, what, figure, TIMES.get(package), note=quickest))
    return lines

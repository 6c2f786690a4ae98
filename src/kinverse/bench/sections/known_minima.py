"""The population methods on functions with a known minimum, beside their peers."""

import time

import numpy as np
from numpy.typing import NDArray

from kinverse.bench.functions import FUNCTIONS, Function, moved, off_centre, shifted
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.bench.swarm_peers import PEERS, Peer
from kinverse.optimizers import NAMES, Optimizer, make_optimizer
from kinverse.optimizers.methods.bees_algorithm import BeesAlgorithm

__all__ = ["known_minima"]

Array = NDArray[np.float64]
Ends = dict[str, Array]

RUNS = 31
"""Runs of ours, all in one loop; a peer has as many as fit into its CPU seconds, at least one."""
SEED, PEER_SEED = 31, 7_000
POPULATION = 100
SHOWN = {
    "pso": ("mealpy OriginalPSO", "mealpy LDW_PSO", "pymoo PSO", "pygmo pso_gen neighb_type=2"),
    "ga": ("mealpy BaseGA", "pymoo GA", "pygmo sga"),
    "gwo": ("mealpy OriginalGWO", "pygmo gwo"),
    "tlbo": ("mealpy OriginalTLO",),
    "bees": ("mealpy OriginalBeesA", "mealpy CleverBookBeesA"),
    "abc": ("mealpy OriginalABC", "pygmo bee_colony"),
    "firefly": ("mealpy OriginalFFA",),
    "bbo": ("mealpy OriginalBBO",),
    "de": ("scipy best1bin", "pymoo DE", "pygmo sade variant_adptv=1", "mealpy OriginalDE"),
}
"""The peers beside each method; nobody has crab intelligence."""
RESOLVED = 1e-8
"""Lower values count as this one where gains are told: they are exact for any purpose."""
LEAST_GAIN = 1.5
"""Who does better by less than this, as a geometric mean over the functions, gains nothing."""
MIDDLE_GAIN = 2.0
"""The same for a minimum in the middle of the box: far from its edges it is easier to all."""
DRAWN = {
    "gwo": "drawn to the origin as published: |C X_leader - X|",
    "tlbo": "drawn to the origin as published: best - 2 mean",
    "cibo, literal": "drawn to the origin as published: its centre",
}
"""Methods that gain where the minimum is at the origin, and why."""
GATHERED = DRAWN | {
    "cibo": "crabs gather about their leaders early, and so in the middle of what they fill",
    "firefly": "every firefly is drawn to all brighter ones, and so to the middle of the swarm",
}
"""Methods that gain where the minimum is in the middle of the box, and why."""


def known_minima(quick: bool) -> list[Line]:
    """Lowest values with the minimum off the middle; what each method gains with it at the origin.

    The origin is told from the middle of the box: the search with the minimum in both is set
    beside the same search moved elsewhere with its box, which is no harder for a method that
    does not know where zero is.
    """
    # variables, evaluations for each of them, CPU seconds for each peer on each function
    sizes, each, seconds = ((10,), 200, 0.2) if quick else ((10, 30), 1000, 2.0)
    lines = []
    for dimensions in sizes:
        budget = each * dimensions
        section = f"functions of {dimensions} variables, lowest value in {budget:,} evaluations"
        for name, optimizer in _methods().items():
            off: Ends = {}
            centred: Ends = {}
            elsewhere: Ends = {}
            for key, function in FUNCTIONS.items():
                hard = shifted(function, off_centre(function, dimensions))
                middle = shifted(function, -function.best(dimensions))
                far = moved(middle, 2.0 * np.asarray(function.high))
                off[key], taken = _solve(optimizer, hard, dimensions, budget)
                centred[key], _ = _solve(optimizer, middle, dimensions, budget)
                elsewhere[key], _ = _solve(optimizer, far, dimensions, budget)
                lines.append(_lowest(section, name, key, "kinverse", off[key], taken))
                for label in SHOWN.get(name, ()):
                    values, taken = _peer(_named(name, label), hard, dimensions, budget, seconds)
                    lines.append(_lowest(section, name, key, label, values, taken))
            lines += _gains(section, name, off, centred, elsewhere)
    return lines


def _methods() -> dict[str, Optimizer]:
    """Every method with its defaults, and two with options that make another method of them."""
    return {name: make_optimizer(name) for name in NAMES} | {
        "bees, Pham": BeesAlgorithm.pham(),
        "cibo, literal": make_optimizer("cibo", reading="literal"),
    }


def _solve(
    optimizer: Optimizer, function: Function, dimensions: int, budget: int
) -> tuple[Array, float]:
    """Lowest value of each run, and CPU seconds of one run."""
    start = time.process_time()
    box = function.bounds(dimensions)
    run = optimizer.start(box, max_evals=budget, rng=SEED, problems=RUNS)
    while not run.done:
        run.tell(function(run.ask()))
    return run.f_best, (time.process_time() - start) / RUNS


def _named(method: str, label: str) -> Peer:
    return next(peer for peer in PEERS[method] if peer.name == label)


def _peer(
    peer: Peer, function: Function, dimensions: int, budget: int, seconds: float
) -> tuple[Array, float]:
    """Lowest value of each run that fits into the CPU seconds, and CPU seconds of one run."""
    values: list[float] = []
    low, high = function.bounds(dimensions).T
    peer.prepare(dimensions, budget, POPULATION)
    start = time.process_time()
    while len(values) < RUNS:
        seed = PEER_SEED + len(values)
        values.append(peer.solve(function, low, high, budget, POPULATION, seed).f)
        taken = time.process_time() - start
        if taken * (1 + 1 / len(values)) > seconds:
            break
    return np.array(values), taken / len(values)


def _lowest(
    section: str, name: str, function: str, who: str, values: Array, seconds: float
) -> Line:
    low, middle, high = (float(v) for v in np.quantile(values, (0.25, 0.5, 0.75)))
    note = f"{len(values)} runs, {1e3 * seconds:.2g} ms of CPU each; quartiles"
    return Line(section, name, f"{function}, {who}", Spread(middle, low, high), note=note)


def _gains(section: str, name: str, off: Ends, centred: Ends, elsewhere: Ends) -> list[Line]:
    single = {
        key: Spread.exact(float(np.median(_told(off[key])) / np.median(_told(centred[key]))))
        for key in centred
    }
    note = ", ".join(f"{key} {ratio}" for key, ratio in single.items())
    drawn, gathered = DRAWN.get(name), GATHERED.get(name)
    return [
        Line(
            section,
            name,
            "minimum off the middle / in the middle of the box, medians",
            _geometric(off, centred),
            None if gathered else MIDDLE_GAIN,
            False,
            f"{gathered}; {note}" if gathered else note,
        ),
        Line(
            section,
            name,
            "elsewhere with its box / minimum at the origin, medians",
            _geometric(elsewhere, centred),
            None if drawn else LEAST_GAIN,
            False,
            drawn or "",
        ),
    ]


def _told(values: Array) -> Array:
    return np.maximum(values, RESOLVED)


def _geometric(above: Ends, below: Ends) -> Spread:
    """Ratio of medians, its geometric mean over the functions, and 95 % of its resamples."""
    rng = np.random.default_rng(9)
    logs = np.zeros(1001)
    for ends, sign in ((above, 1.0), (below, -1.0)):
        for values in ends.values():
            told = _told(values)
            again = told[rng.integers(len(told), size=(1000, len(told)))]
            logs[0] += sign * np.log(np.median(told))
            logs[1:] += sign * np.log(np.median(again, axis=1))
    ratios = np.exp(logs / len(above))
    low, high = np.quantile(ratios[1:], (0.025, 0.975))
    return Spread(float(ratios[0]), float(low), float(high))

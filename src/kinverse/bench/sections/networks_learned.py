"""``Learned``: every branch of the KR16, and its predictions as starts on redundant arms."""

import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.ranking import turning
from kinverse.solvers.descent import Descent, moved

__all__ = ["branches", "starts"]

Array = NDArray[np.float64]

SEEDS = (4_101, 4_102, 4_103)
"""Of examples and networks; targets come from a stream of the bench's own."""
TARGETS = 56
SAME = 1e-6
"""Joint difference below which a solution is the closed form's [rad]."""
REDUNDANT = ("panda", "iiwa14")


def branches(quick: bool) -> list[Line]:
    """One network for each branch of the KR16 against the closed form, pose by pose."""
    count, seeds = (200, SEEDS[:1]) if quick else (10_000, SEEDS)
    robot = kv.load("kr16")
    _, T = cases.reachable(robot, count, seed=TARGETS)
    known = kv.Analytic().fit(robot)
    closed = known.solve(T)
    wanted = _sets(closed)
    told: dict[str, list[float]] = {}
    for seed in seeds:
        solver = kv.Learned(n_samples=800 if quick else 5000, random_state=seed)
        start = time.process_time()
        solver.fit(robot)
        told.setdefault("fit", []).append(time.process_time() - start)
        solver.solve(T[:100])  # the examples' search trees are made at the first call
        start = time.process_time()
        answers = solver.solve(T)
        spent = time.process_time() - start
        told.setdefault("time", []).append(1e6 * spent / (len(T) * len(solver.experts_)))
        same = (_sets(answers) == wanted).all(axis=1)
        told.setdefault("same", []).append(100.0 * float(same.mean()))
        told.setdefault("missing", []).append(float((wanted & ~_sets(answers)).sum()))
        errors = oracle.errors(oracle.pose(robot, answers.q), T[answers.pose_index])
        wrong = (errors[0] > 1e-6) | (errors[1] > 1e-6)
        told.setdefault("wrong", []).append(float(wrong.sum()))
        steps, first = _steps(solver, T, closed)
        told.setdefault("steps", []).append(float(np.median(steps)))
        told.setdefault("first", []).append(100.0 * first)
        told.setdefault("evaluations", []).append(float(np.median(answers.stats.evaluations)))
    note = f"{len(seeds)} seeds of examples and networks, {count:,} poses, 8 networks"
    section = "learned branches"

    def line(what: str, key: str, bound: float | None = None, least: bool = True) -> Line:
        return Line(section, "kr16", what, Spread.of(told[key]), bound, least, note)

    for key, (network, neighbors) in _without(quick).items():
        solver = kv.Learned(
            network, neighbors=neighbors, n_samples=800 if quick else 5000, random_state=seeds[0]
        ).fit(robot)
        answers = solver.solve(T)
        same = (_sets(answers) == wanted).all(axis=1)
        told[f"{key} same"] = [100.0 * float(same.mean())]
        told[f"{key} first"] = [100.0 * _steps(solver, T, closed)[1]]
        told[f"{key} evaluations"] = [float(np.median(answers.stats.evaluations))]
    return [
        line("poses with the closed form's set of branches, %", "same", 99.9),
        line("the same without the nearest examples, %", "alone same"),
        line("the same with the mean joint values in place of a network, %", "mean same"),
        line("branches missing in all poses", "missing"),
        line("answers that the oracle refuses", "wrong", 0.0, False),
        line("steps of predictions that arrive, median", "steps", 6.0, False),
        line("branches found from the prediction alone, %", "first"),
        line("branches found from the mean joint values alone, %", "mean first"),
        line("CPU per pose and branch in a batch, us", "time", 30.0, False),
        line("evaluations a pose, all branches, median", "evaluations"),
        line("the same with the mean joint values in place of a network", "mean evaluations"),
        line("CPU to draw examples and train, s", "fit"),
    ]


def _without(quick: bool) -> dict[str, tuple[Any, int]]:
    """What is left without a part: the network alone, and neighbours with no network."""
    from sklearn.dummy import DummyRegressor

    return {"alone": (None, 0), "mean": (DummyRegressor(), 8)}


def _sets(answers: kv.Solutions) -> NDArray[np.bool_]:
    """(N, 8) which branches a pose has."""
    found = np.zeros((len(answers), 8), np.bool_)
    found[answers.pose_index, answers.branch] = True
    return found


def _steps(solver: Any, T: Array, closed: kv.Solutions) -> tuple[Array, float]:
    """Steps from predictions to the solution of their branch, and the share that lead there."""
    descent = Descent(solver.robot_, solver.settings_, "newton_raphson")
    predicted = solver.predict(T)
    turns = turning(solver.robot_)
    steps, led = [], 0
    for k, branch in enumerate(solver.branches_):
        mine = closed.branch == branch
        rows = closed.pose_index[mine]
        done = descent.each(np.ascontiguousarray(T[rows]), predicted[rows, k])
        there = done.found & (moved(done.q, closed.q[mine], turns) < SAME)
        steps.append(done.iterations[there])
        led += int(there.sum())
    return np.concatenate(steps), led / len(closed.q)


def starts(quick: bool) -> list[Line]:
    """What a learned start saves ``Numerical`` on arms with joints to spare, and what it costs."""
    count, seeds = (200, SEEDS[:1]) if quick else (10_000, SEEDS)
    return [line for name in REDUNDANT for line in _starts(name, count, seeds, quick)]


def _starts(name: str, count: int, seeds: tuple[int, ...], quick: bool) -> list[Line]:
    robot = kv.load(name)
    _, T = cases.reachable(robot, count, seed=TARGETS)
    numerical = kv.Numerical().fit(robot)
    plain, time_plain = _timed(lambda seed: numerical.solve(T, rng=seed), seeds)
    told: dict[str, list[float]] = {}
    for seed in seeds:
        samples = 800 if quick else 5000
        learned = kv.Learned(
            n_samples=samples, refine="lm", fallback="numerical", random_state=seed
        ).fit(robot)
        learned.solve(T[:100])
        got, spent = _timed(partial(learned.solve, T, None), [seed])
        start = time.process_time()
        q_start = np.clip(learned.predict(T)[:, 0], *robot.limits.T)
        predicting = 1e6 * (time.process_time() - start) / count
        seeded, time_seeded = _timed(partial(numerical.solve, T, q_start), [seed])
        for key, answers in (("learned", got[0]), ("seeded", seeded[0])):
            cost = answers.stats.evaluations
            told.setdefault(f"{key} median", []).append(float(np.median(cost)))
            told.setdefault(f"{key} p99", []).append(float(np.percentile(cost, 99)))
            told.setdefault(f"{key} solved", []).append(100.0 * float(answers.ok.mean()))
        told.setdefault("learned time", []).append(spent)
        for key, (network, neighbors) in _without(quick).items():
            other = kv.Learned(
                network,
                neighbors=neighbors,
                n_samples=samples,
                refine="lm",
                fallback="numerical",
                random_state=seed,
            ).fit(robot)
            cost = other.solve(T).stats.evaluations
            told.setdefault(f"{key} p99", []).append(float(np.percentile(cost, 99)))
            told.setdefault(f"{key} median", []).append(float(np.median(cost)))
        told.setdefault("seeded time", []).append(predicting + time_seeded)
    base = [float(np.percentile(answers.stats.evaluations, 99)) for answers in plain]
    middle = [float(np.median(answers.stats.evaluations)) for answers in plain]
    return _told(name, told, base, middle, time_plain, len(seeds))


def _told(
    name: str,
    told: dict[str, list[float]],
    base: list[float],
    middle: list[float],
    time_plain: float,
    seeds: int,
) -> list[Line]:
    section = "learned starts"
    plain = float(np.median(base))
    mean = "the same, the mean joint values in place of a network"
    note = (
        f"{seeds} seeds; learned starts: the prediction, then the 8 nearest examples, then"
        f" Numerical's own; Numerical alone: median {np.median(middle):g}, 99th percentile"
        f" {plain:g} evaluations, {time_plain:.2g} us of CPU a pose in a batch"
    )

    def ratio(key: str) -> Spread:
        return Spread.of([value / plain for value in told[key]])

    def line(what: str, figure: Spread, bound: float | None = None, least: bool = False) -> Line:
        return Line(section, name, what, figure, bound, least, note)

    return [
        line(
            "99th percentile of evaluations, learned starts first / Numerical alone",
            ratio("learned p99"),
            0.7,
        ),
        line("the same, the prediction alone as q_seed of Numerical", ratio("seeded p99")),
        line("the same, prediction and fall-back, no nearest examples", ratio("alone p99")),
        line(mean, ratio("mean p99")),
        line("evaluations a pose, median", Spread.of(told["learned median"])),
        line("the same, the prediction alone as q_seed", Spread.of(told["seeded median"])),
        line(
            "the same, the mean joint values in place of a network", Spread.of(told["mean median"])
        ),
        line("solved, %", Spread.of(told["learned solved"]), 100.0, True),
        line("CPU a pose with the network, us", Spread.of(told["learned time"])),
        line("the same, the prediction alone as q_seed", Spread.of(told["seeded time"])),
    ]


def _timed(call: Any, seeds: Any) -> tuple[list[Any], float]:
    """Answers for each seed, and CPU microseconds a pose."""
    start = time.process_time()
    answers = [call(seed) for seed in seeds]
    total = sum(len(each) for each in answers)
    return answers, 1e6 * (time.process_time() - start) / total

"""One family of methods on one arm and task: judged by plain NumPy, timed on the processor."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import judge
from kinverse.errors import NoClosedForm
from kinverse.robot import Robot
from kinverse.solutions import Solutions
from kinverse.studies.cell import Row
from kinverse.studies.summary.arms import reach_of, situation_of
from kinverse.studies.summary.methods import METHODS, NETWORK, TOLERANCE, Method

__all__ = ["race", "targets_of"]

Array = NDArray[np.float64]

TARGET_STREAM = 0x7A6B
"""First word of the targets' seeds: no solver draws from that stream."""
TIMED_TOGETHER = 1000
"""Poses of one timed call of the quick methods: the targets over and over."""


def targets_of(robot: Robot, seed: int, count: int) -> Array:
    """Poses (count, 4, 4) of joint values drawn uniformly inside the limits."""
    rng = np.random.default_rng([TARGET_STREAM, seed])
    low, high = robot.limits.T
    return judge.pose(robot, rng.uniform(low, high, (count, robot.dof)))


def race(
    arm: str, task: str, family: str, target_seed: int, solver_seed: int, targets: int, quick: bool
) -> list[Row]:
    """A row for each method of a family; what does not apply says why."""
    robot = kv.load(arm)
    T = targets_of(robot, target_seed, targets)
    head: Row = {
        "arm": arm,
        "task": task,
        "situation": situation_of(robot, task),
        "seed of targets": target_seed,
        "targets": targets,
        "reach, m": reach_of(robot),
    }
    rows: list[Row] = []
    for method in METHODS:
        if method.family == family and task in method.tasks:
            entries = _entries(method, robot, T, task, solver_seed, quick)
            rows += [{**head, "family": family, **entry} for entry in entries]
    return rows


def _entries(
    method: Method, robot: Robot, T: Array, task: str, seed: int, quick: bool
) -> list[Row]:
    start = time.process_time()
    try:
        solver = method.make(task, seed, quick).fit(robot)
    except NoClosedForm as error:
        return [{"method": method.name, "reason": str(error)}]
    fitting = time.process_time() - start
    start = time.process_time()
    answers = solver.solve(T, rng=seed)
    seconds = (time.process_time() - start) / len(T)
    if "swarm" not in method.family:  # quick: once more in a batch, when all is loaded
        many = np.resize(T, (TIMED_TOGETHER, 4, 4))
        seconds = _seconds(lambda: solver.solve(many, rng=seed)) / len(many)
    stats = answers.stats
    failed = np.flatnonzero(~answers.ok)  # judged by the best that was met
    q = np.concatenate([answers.q, stats.best_q[failed]])
    index = np.concatenate([answers.pose_index, failed])
    row: Row = {
        "method": method.name,
        **_judged(robot, T, task, q, index, answered=len(answers.q)),
        "solutions a pose": len(answers.q) / len(T),
        "evaluations, median": float(np.median(stats.evaluations)),
        "evaluations, most": int(np.max(stats.evaluations)),
        "seconds a pose": seconds,
        "seconds to fit": fitting,
    }
    rows = [row]
    if isinstance(solver, kv.Learned):
        rows.append(_network_alone(solver, robot, T, task, fitting))
    return rows


def _network_alone(solver: Any, robot: Robot, T: Array, task: str, fitting: float) -> Row:
    """What is predicted, the best of all networks' answers to each pose."""
    predicted = solver.predict(T)
    N, networks = predicted.shape[:2]
    many = np.resize(T, (TIMED_TOGETHER, 4, 4))
    q = predicted.reshape(N * networks, -1)
    return {
        "method": NETWORK,
        **_judged(robot, T, task, q, np.arange(N).repeat(networks), answered=len(q)),
        "solutions a pose": 0.0,
        "evaluations, median": 0.0,
        "evaluations, most": 0,
        "seconds a pose": _seconds(lambda: solver.predict(many)) / len(many),
        "seconds to fit": fitting,
    }


def _judged(
    robot: Robot, T: Array, task: str, q: Array, index: NDArray[np.int64], answered: int
) -> Row:
    """Candidates q (M, n) of the poses ``index``; the first ``answered`` claim to be solutions.

    A pose is solved if it has an answer and all its answers hold. Its errors are those of its best
    candidate (the least sum of position error by reach and rotation error), infinite if there is
    none.
    """
    far, turned = judge.errors(T[index], judge.pose(robot, q))
    if task == "position":
        turned = np.zeros_like(far)
    claims = np.arange(len(q)) < answered
    good = (far <= TOLERANCE) & (turned <= TOLERANCE) & judge.inside(robot, q)
    solved = np.zeros(len(T), dtype=bool)
    solved[index[claims]] = True
    solved[index[claims & ~good]] = False
    both = far / reach_of(robot) + turned
    order = np.argsort(np.nan_to_num(both, nan=np.inf), kind="stable")[::-1]
    best = np.full((2, len(T)), np.inf)
    best[:, index[order]] = far[order], turned[order]  # the least comes last and stays
    best[np.isnan(best)] = np.inf
    return {
        "solved, %": 100.0 * float(solved.mean()),
        "position error, median": _finite(np.median(best[0])),
        "position error, 95 %": _finite(np.percentile(best[0], 95, method="higher")),
        "rotation error, median": _finite(np.median(best[1])) if task == "pose" else None,
        "rotation error, 95 %": (
            _finite(np.percentile(best[1], 95, method="higher")) if task == "pose" else None
        ),
    }


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def _seconds(call: Callable[[], Solutions | Array], least: float = 0.02) -> float:
    """Of the processor, one call; as many calls as it takes to measure."""
    calls, start = 0, time.process_time()
    while True:
        call()
        calls += 1
        spent = time.process_time() - start
        if spent >= least:
            return spent / calls

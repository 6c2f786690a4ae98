"""Document 004, section 7.4: a spline of the 5R arm by each population method, and closed form.

The document joins points by a "4th order spline" and has each method find joint angles for it. Five
axes reach few of all poses, so the spline here is one of joint values: every pose of it is reached.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.optimizers import NAMES
from kinverse.paths import JointCurve

__all__ = ["spline_5r"]

Array = NDArray[np.float64]

SEEDS = (8_401, 8_402, 8_403)
"""Of the methods; trajectories come from streams of the bench's own."""
TRAJECTORIES = 3
KNOTS, DEGREE = 5, 4
MIDDLE, SPREAD = 0.6, 0.6
"""Knots lie within this [rad] of joint values in this part of the ranges."""
WEIGHT = 0.4
"""Of the orientation's error [m/rad]: about the arm's reach."""


@dataclass
class Run:
    """The joint values (N, 5) that one method found along one trajectory."""

    q: Array
    evaluations: float
    milliseconds: float


@dataclass
class Trajectory:
    """Poses (N, 4, 4), and what the closed form says of them."""

    T: Array
    known: kv.Solutions


def spline_5r(quick: bool) -> list[Line]:
    """Each method alone, from scratch and from the last sample, and polished."""
    robot = kv.load("pioneer2")
    seeds: tuple[int, ...] = SEEDS
    count, evaluations = 41, 20_000
    if quick:
        seeds, count, evaluations = SEEDS[:1], 9, 500
    made = [_trajectory(robot, k, count) for k in range(1 if quick else TRAJECTORIES)]
    section = (
        f"5R arm along a spline of degree {DEGREE}, {count} samples, {len(made)} of them x"
        f" {len(seeds)} seeds"
    )
    lines = _closed(section, robot, made)
    for method in NAMES:
        head = (section, method)
        alone = kv.Swarm(optimizer=method, max_evals=evaluations, polish=False, weight=WEIGHT).fit(
            robot
        )
        for chained, how in ((False, "alone, from scratch"), (True, "alone, from the last sample")):
            runs = [
                [(_chained if chained else _at_once)(alone, it.T, seed) for it in made]
                for seed in seeds
            ]
            lines += _told(head, how, robot, made, runs)
        polished = kv.Swarm(optimizer=method, weight=WEIGHT).fit(robot)
        runs = [[_at_once(polished, it.T, seed) for it in made] for seed in seeds]
        lines += _told(head, "polished, from scratch", robot, made, runs, 100.0)
    return lines


def _trajectory(robot: kv.Robot, number: int, count: int) -> Trajectory:
    rng = cases.stream(81, number)
    low, high = MIDDLE * robot.limits.T
    knots = rng.uniform(low, high) + rng.uniform(-SPREAD, SPREAD, (KNOTS, robot.dof))
    curve = JointCurve(np.linspace(0.0, 1.0, KNOTS), knots, DEGREE)
    T = oracle.pose(robot, curve(np.linspace(0.0, 1.0, count)))
    return Trajectory(T, kv.Analytic().fit(robot).solve(T))


def _at_once(solver: kv.Swarm, T: Array, seed: int) -> Run:
    start = time.process_time()
    found = solver.solve(T, rng=seed)
    spent = 1e3 * (time.process_time() - start) / len(T)
    return Run(found.stats.best_q, float(np.median(found.stats.evaluations)), spent)


def _chained(solver: kv.Swarm, T: Array, seed: int) -> Run:
    start = time.process_time()
    q, evaluations, near = [], [], None
    for pose in T:
        found = solver.solve(pose, q_seed=near, rng=seed)
        near = found.stats.best_q[0]
        q.append(near)
        evaluations.append(float(found.stats.evaluations[0]))
    spent = 1e3 * (time.process_time() - start) / len(T)
    return Run(np.array(q), float(np.median(evaluations)), spent)


def _closed(section: str, robot: kv.Robot, made: list[Trajectory]) -> list[Line]:
    head = (section, "closed form")
    one = [bool((it.known.count == 1).all()) for it in made]
    far = [
        np.max(oracle.errors(it.T[it.known.pose_index], oracle.pose(robot, it.known.q)))
        for it in made
    ]
    steps = [_largest_step(robot, it.known.q) for it in made]
    note = "of all poses, position m and angle rad"
    return [
        Line(*head, "trajectories with one solution a pose", Spread.exact(sum(one)), len(made)),
        Line(*head, "largest error", Spread.exact(float(max(far))), 1e-6, False, note),
        Line(*head, "largest joint step, deg", Spread.of(steps), None, False),
    ]


def _told(
    head: tuple[str, str],
    how: str,
    robot: kv.Robot,
    made: list[Trajectory],
    runs: list[list[Run]],
    bound: float | None = None,
) -> list[Line]:
    """Medians over the samples of each run; of them the median and range over all runs."""
    far, turned, worst, solved, gaps, steps = [], [], [], [], [], []
    for of_seed in runs:
        for it, run in zip(made, of_seed, strict=True):
            distance, angle = oracle.errors(it.T, oracle.pose(robot, run.q))
            good = (distance <= 1e-6) & (angle <= 1e-6) & oracle.inside(robot, run.q)
            far.append(1e3 * float(np.median(distance)))
            worst.append(1e3 * float(distance.max()))
            turned.append(float(np.degrees(np.median(angle))))
            solved.append(100.0 * float(good.mean()))
            gaps.append(float(np.degrees(np.median(_gaps(robot, it.known, run.q)))))
            steps.append(_largest_step(robot, run.q))
    flat = [run for of_seed in runs for run in of_seed]
    note = f"{np.median([run.evaluations for run in flat]):,.0f} evaluations,"
    note += f" {np.median([run.milliseconds for run in flat]):.2g} ms of CPU a sample"
    share = Line(*head, f"{how}: solved to 1e-6, %", Spread.of(solved), bound, note=note)
    note = f"worst {max(worst):.3g} mm; angle {np.median(turned):.2g} deg"
    return [
        share,
        Line(*head, f"{how}: position error, mm", Spread.of(far), None, False, note),
        Line(*head, f"{how}: from the closed form, deg", Spread.of(gaps), None, False),
        Line(*head, f"{how}: largest joint step, deg", Spread.of(steps), None, False),
    ]


def _gaps(robot: kv.Robot, known: kv.Solutions, q: Array) -> Array:
    """(N,) joint distance [rad] of q (N, n) from the closed form's nearest branch."""
    least = np.full(len(q), np.inf)
    np.minimum.at(least, known.pose_index, oracle.wrapped(robot, known.q - q[known.pose_index]))
    return least


def _largest_step(robot: kv.Robot, q: Array) -> float:
    return float(np.degrees(oracle.wrapped(robot, np.diff(q, axis=0)).max()))

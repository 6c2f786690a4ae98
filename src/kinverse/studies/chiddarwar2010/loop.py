"""The fusion process at work on fresh poses and on a path, and the iterative method beside it."""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.held_out import POSES, START
from kinverse.studies.chiddarwar2010.networks import CONSTANT, FAMILY, NETWORKS, make_network
from kinverse.studies.chiddarwar2010.path import Way, answer_rows, pose_rows, timed, way_of
from kinverse.studies.chiddarwar2010.poses import arm, draw, predicates, region
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["run_fusion"]

Array = NDArray[np.float64]

FRESH = 45_000
"""First seed of poses to solve."""
SAME = 1e-3
"""Largest joint difference [rad] of one answer found twice."""


def run_fusion(robot: str, half: float, seed: int, epochs: int, fresh: int) -> list[Row]:
    """Train on all 70 poses of a region; solve fresh poses of it, and a path in it.

    Args:
        robot: its name.
        half: of the region [deg].
        seed: numbers region, poses, networks and path.
        epochs: of the MLPs.
        fresh: how many poses to solve beside the path.

    Returns:
        Rows told apart by "part": "loop" for each network; "path" for each network and way to ask
        it; "pose" for each of these and pose of the path; one "iterative".
    """
    given = arm(robot)
    way = way_of(given, half, seed)
    targets = draw(given, fresh, half, seed, FRESH + seed).T
    rows = [_iterative_row(given, way), *pose_rows("iterative", None, None, way.q)]
    for name in (*NETWORKS, CONSTANT):
        solver = kv.Fusion(
            make_network(name, epochs, START + seed),
            n_poses=int(parameter("poses")),
            region=region(given, half, seed),
            keep=predicates(given),
            tol_position=1e-3 * parameter("pose tolerance"),
            fallback=None,
            random_state=POSES + seed,
        ).fit(given)
        family = FAMILY[name]
        rows.append({"method": f"{family} fusion", "network": name, **_loop(solver, targets)})
        if name == CONSTANT:
            continue
        followed, spent = _followed(solver, way)
        step = solver.predict(way.T)[:, 0]
        rows += answer_rows(way, f"{family} fusion", name, "the loop", followed, spent)
        rows += answer_rows(way, f"{family} fusion", name, "one step", step, None)
    return [{"robot": robot, "half_deg": half, "seed": seed, **row} for row in rows]


def _iterative_row(robot: kv.Robot, way: Way) -> Row:
    """Times and evaluations: a first answer from no guess by restarts, then one after the other."""
    search = kv.Numerical(method="newton_raphson", max_starts=1000).fit(robot)
    first, first_s = timed(lambda: search.solve(way.T[0]))
    guess = first.q[0] if first.ok[0] else way.start
    rest_s, rest_evaluations, solved = 0.0, 0, int(first.ok[0])
    for T in way.T[1:]:
        found, spent = timed(lambda: search.solve(T, q_seed=guess))  # noqa: B023
        rest_s += spent
        rest_evaluations += int(found.stats.evaluations[0])
        solved += int(found.ok[0])
        guess = found.q[0] if found.ok[0] else guess
    same = bool(first.ok[0]) and bool(np.abs(first.q[0] - way.q[0]).max() < SAME)
    return {
        "part": "iterative",
        "solved": solved,
        "poses": len(way.T),
        "first_s": first_s,
        "rest_s": rest_s,
        "first_evaluations": int(first.stats.evaluations[0]),
        "rest_evaluations": rest_evaluations,
        "first_is_that_of_the_path": same,
    }


def _loop(solver: Any, T: Array) -> Row:
    start = time.process_time()
    found = solver.solve(T)
    spent = time.process_time() - start
    arrived = found.ok
    rounds = found.stats.evaluations[arrived] - 1
    return {
        "part": "loop",
        "poses": len(T),
        "arrived": int(arrived.sum()),
        "rounds": float(np.median(rounds)) if arrived.any() else None,
        "position_error_mm": float(1e3 * np.median(found.stats.best_position_error)),
        "pose_us": 1e6 * spent / len(T),
    }


def _followed(solver: Any, way: Way) -> tuple[Array, float]:
    """What the loop says along a path (K, n), arrived or not, and how long it takes [s]."""
    q = np.empty_like(way.q)
    last, total = way.start, 0.0
    for k, T in enumerate(way.T):
        found, spent = timed(lambda: solver.solve(T, q_seed=last))  # noqa: B023
        last = found.q[0] if found.ok[0] else found.stats.best_q[0]
        q[k], total = last, total + spent
    return q, total

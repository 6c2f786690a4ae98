"""The fusion process at work: on fresh poses, and on five poses of a path beside the others."""

import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.held_out import POSES, START, absolute_patterns
from kinverse.studies.chiddarwar2010.networks import FAMILY, NETWORKS, make_network
from kinverse.studies.chiddarwar2010.poses import arm, draw, path_joints, predicates, region
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["run_fusion"]

Array = NDArray[np.float64]

FRESH, PATH = 45_000, 46_000
"""First seeds of poses to solve and of paths."""
SMALL = np.radians(1.0)
"""Angles below are left out of percent errors."""
REPEATS = 20
"""Of what takes microseconds."""
SAME = 1e-3
"""Largest joint difference [rad] of one answer found twice."""


class Way(NamedTuple):
    """A path: joint values at its start (n,), poses T (K, 4, 4), the iterative answers q (K, n).

    Rows of q are NaN where the iteration fails.
    """

    start: Array
    T: Array
    q: Array


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
    q = path_joints(given, half, seed, PATH + seed)
    T = given.fk(q[1:])
    way = Way(q[0], T, _iterated(given, q[0], T))
    targets = draw(given, fresh, half, seed, FRESH + seed).T
    rows = [_iterative_row(given, way), *_angles("iterative", None, None, way.q)]
    features, train, _ = absolute_patterns(robot, half, seed)
    for name in NETWORKS:
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
        followed, spent = _followed(solver, way)
        step = solver.predict(way.T)[:, 0]
        network = make_network(name, epochs, START + seed).fit(*train.inverse(features))
        inputs = features.transform(way.T)
        absolute, asking = _timed(lambda: network.predict(inputs))  # noqa: B023
        for method, asked, answer, seconds in (
            ("fusion", "the loop", followed, spent),
            ("fusion", "one step", step, None),
            ("absolute", "directly", absolute, asking),
        ):
            row: Row = {"part": "path", "method": f"{family} {method}", "network": name}
            row |= {"asked": asked, "prediction_s": seconds, **_percent(answer, way.q)}
            rows.append(row)
            rows += _angles(f"{family} {method}", name, asked, answer)
    return [{"robot": robot, "half_deg": half, "seed": seed, **row} for row in rows]


def _iterated(robot: kv.Robot, start: Array, T: Array) -> Array:
    """Newton-Raphson (K, n), each pose from the answer before it."""
    solver = kv.Numerical(method="newton_raphson").fit(robot)
    found = np.full((len(T), robot.dof), np.nan)
    last = start
    for k in range(len(T)):
        found[k] = solver.solve(T[k], q_seed=last).nearest(last)[0]
        last = np.where(np.isnan(found[k]), last, found[k])
    return found


def _iterative_row(robot: kv.Robot, way: Way) -> Row:
    """Times and evaluations: a first answer from no guess by restarts, then one after the other."""
    search = kv.Numerical(method="newton_raphson", max_starts=1000).fit(robot)
    first, first_s = _timed(lambda: search.solve(way.T[0]))
    guess = first.q[0] if first.ok[0] else way.start
    rest_s, rest_evaluations, solved = 0.0, 0, int(first.ok[0])
    for T in way.T[1:]:
        found, spent = _timed(lambda: search.solve(T, q_seed=guess))  # noqa: B023
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
        found, spent = _timed(lambda: solver.solve(T, q_seed=last))  # noqa: B023
        last = found.q[0] if found.ok[0] else found.stats.best_q[0]
        q[k], total = last, total + spent
    return q, total


def _timed(work: Any) -> tuple[Any, float]:
    """What it returns, and the seconds of processor time of one of several repetitions."""
    start = time.process_time()
    for _ in range(REPEATS):
        result = work()
    return result, (time.process_time() - start) / REPEATS


def _angles(method: str, network: str | None, asked: str | None, q: Array) -> list[Row]:
    """Joint angles of each pose; None where there is no answer."""
    rows: list[Row] = []
    for pose, values in enumerate(np.degrees(q).tolist(), start=1):
        row: Row = {"part": "pose", "pose": pose, "method": method, "network": network}
        row["asked"] = asked
        for joint, value in enumerate(values, start=1):
            row[f"joint {joint} [deg]"] = round(value, 4) if np.isfinite(value) else None
        rows.append(row)
    return rows


def _percent(answer: Array, iterative: Array) -> Row:
    """Mean of 100 abs(q - q_iterative) / abs(q_iterative), small angles left out and counted."""
    known = ~np.isnan(iterative)
    counted = known & (np.abs(iterative) >= SMALL)
    off = np.abs(answer - iterative)
    share = 100.0 * off[counted] / np.abs(iterative[counted])
    return {
        "percent_error": float(share.mean()) if counted.any() else None,
        "largest_off_deg": float(np.degrees(off[known].max())) if known.any() else None,
        "angles": int(counted.sum()),
        "small_angles": int((known & ~counted).sum()),
        "poses_without_iterative": int((~known[:, 0]).sum()),
    }

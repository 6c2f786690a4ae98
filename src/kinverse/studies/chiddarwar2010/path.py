"""The five poses of a path, and how far answers are from the iterative method's."""

import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.poses import path_joints

__all__ = ["Way", "answer_rows", "percent_row", "pose_rows", "timed", "way_of"]

Array = NDArray[np.float64]
Result = TypeVar("Result")

PATH = 46_000
"""First seed of paths."""
SMALL = np.radians(1.0)
"""Angles below are left out of percent errors."""
REPEATS = 20
"""Of what takes microseconds."""


class Way(NamedTuple):
    """A path: joint values at its start (n,), poses T (K, 4, 4), the iterative answers q (K, n).

    Rows of q are NaN where the iteration fails.
    """

    start: Array
    T: Array
    q: Array


def way_of(robot: kv.Robot, half: float, seed: int) -> Way:
    """The path of a region [deg] and seed, with the iterative answers."""
    q = path_joints(robot, half, seed, PATH + seed)
    T = robot.fk(q[1:])
    return Way(q[0], T, _iterated(robot, q[0], T))


def answer_rows(
    way: Way, method: str, network: str, asked: str, answer: Array, seconds: float | None
) -> list[Row]:
    """What a network says (K, n) of a path: a row "path" of its errors, rows "pose" of angles.

    Args:
        way: the path.
        method: "RBF fusion".
        network: its name.
        asked: how it was asked.
        answer: joint values.
        seconds: of processor time for all of them.
    """
    row: Row = {"part": "path", "method": method, "network": network, "asked": asked}
    row |= {"prediction_s": seconds, **percent_row(answer, way.q)}
    return [row, *pose_rows(method, network, asked, answer)]


def pose_rows(method: str, network: str | None, asked: str | None, q: Array) -> list[Row]:
    """Rows "pose": joint angles, None where there is no answer."""
    rows: list[Row] = []
    for pose, values in enumerate(np.degrees(q).tolist(), start=1):
        row: Row = {"part": "pose", "pose": pose, "method": method, "network": network}
        row["asked"] = asked
        for joint, value in enumerate(values, start=1):
            row[f"joint {joint} [deg]"] = round(value, 4) if np.isfinite(value) else None
        rows.append(row)
    return rows


def percent_row(answer: Array, iterative: Array) -> Row:
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


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What it returns, and the seconds of processor time of one of several repetitions."""
    start = time.process_time()
    for _ in range(REPEATS):
        result = work()
    return result, (time.process_time() - start) / REPEATS


def _iterated(robot: kv.Robot, start: Array, T: Array) -> Array:
    """Newton-Raphson (K, n), each pose from the answer before it."""
    solver = kv.Numerical(method="newton_raphson").fit(robot)
    found = np.full((len(T), robot.dof), np.nan)
    last = start
    for k in range(len(T)):
        found[k] = solver.solve(T[k], q_seed=last).nearest(last)[0]
        last = np.where(np.isnan(found[k]), last, found[k])
    return found

"""Cells: population methods on five positions, each answer with what it really reaches."""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import se3
from kinverse.optimizers import History, Run, make_optimizer
from kinverse.studies.cell import Row
from kinverse.studies.jha2015.geometries import geometry
from kinverse.studies.jha2015.positions import ARMS, ArmTask
from kinverse.studies.jha2015.units import METRES

__all__ = ["REFERENCE_SEED", "SEARCH_SEED", "search", "search_times"]

Array = NDArray[np.float64]

KEEP = 64
"""Records of a convergence curve at most."""
SEARCH_SEED = 7_260
"""Of all searches; position and seed are the key of a stream of their own."""
REFERENCE_SEED = 20_417
"""Of the descent that says how near a position the arm can come."""


def search(
    arm: str, geometry_name: str, algorithm: str, population: int, seeds: int, evaluations: int
) -> list[Row]:
    """Searches for each of the five positions with each seed.

    Args:
        arm: of ``ARMS``.
        geometry_name: see ``geometry``.
        algorithm: short name of an optimizer.
        population: members.
        seeds: searches of a position.
        evaluations: of the function value, exactly.

    Returns:
        Rows with ``kind`` "answer": the position (0 to 4), the seed, the function value f, the
        position reached x, y, z and, in ``least``, the least f that a descent from many starts
        finds, all in the printed unit; joints q1, q2, ... [rad or m]; ``off``: the largest joint
        difference to a solution [rad or m], None where there is none (see ``_off``). Rows with
        ``kind`` "curve": quartiles of f at a number of evaluations, over the positions that can
        be reached, or over all where none can.
    """
    task, robot = ARMS[arm], geometry(geometry_name)
    unit = METRES[task.unit]
    keys = [(position, seed) for position in range(5) for seed in range(seeds)]
    T = _poses(task)[[position for position, _ in keys]]
    history = History(most=KEEP)
    run = _start(robot, algorithm, population, evaluations, keys)
    _drive(run, robot, T, history)
    near = kv.Numerical(task="position").fit(robot).solve(_poses(task), rng=REFERENCE_SEED)
    reached = robot.fk(run.x_best)[:, :3, 3] / unit
    off = _off(robot, T, run.x_best)
    rows: list[Row] = []
    for k, (position, seed) in enumerate(keys):
        least = 0.0 if near.ok[position] else near.stats.best_position_error[position] / unit
        row: Row = {"kind": "answer", "position": position, "seed": seed}
        row |= {"f": float(run.f_best[k] / unit), "least": float(least)}
        row |= {"off": float(off[k]) if np.isfinite(off[k]) else None}
        row |= dict(zip("xyz", reached[k].tolist(), strict=True))
        row |= {f"q{j}": value for j, value in enumerate(run.x_best[k].tolist(), start=1)}
        rows.append(row)
    shown = np.array([near.ok[position] or not near.ok.any() for position, _ in keys])
    quartiles = np.quantile(history.best[:, shown] / unit, (0.25, 0.5, 0.75), axis=1).T
    for spent, (low, middle, high) in zip(
        history.evaluations[:, 0].tolist(), quartiles.tolist(), strict=True
    ):
        rows.append(
            {"kind": "curve", "evaluations": spent, "low": low, "median": middle, "high": high}
        )
    return rows


def search_times(arm: str, algorithm: str, population: int, evaluations: int) -> list[Row]:
    """CPU seconds of one search for each position, alone, on the printed geometry."""
    task = ARMS[arm]
    robot = geometry(task.geometries[0])
    T = _poses(task)
    rows: list[Row] = []
    for position in range(5):
        start = time.process_time()
        run = _start(robot, algorithm, population, evaluations, [(position, 0)])
        _drive(run, robot, T[position : position + 1], None)
        spent = time.process_time() - start
        rows.append({"position": position, "evaluations": evaluations, "seconds": spent})
    return rows


def _poses(task: ArmTask) -> Array:
    return np.stack([se3.transform(xyz=position) for position in task.targets])


def _start(
    robot: kv.Robot, algorithm: str, population: int, evaluations: int, keys: list[tuple[int, int]]
) -> Run:
    optimizer = make_optimizer(algorithm, population=population)
    return optimizer.start(
        robot.limits, max_evals=evaluations, rng=SEARCH_SEED, problems=len(keys), keys=keys
    )


def _drive(run: Run, robot: kv.Robot, T: Array, history: History | None) -> None:
    """Equation 6.28 with 6.29 [m]: position error, no weight on the rotation."""
    weight = np.zeros(len(T))
    while not run.done:
        points = run.ask()
        on = run.active
        run.tell(robot.chain.pose_costs(0, 0, 0, T[on], weight[on], points))
        if history is not None:
            history(run)


def _off(robot: kv.Robot, T: Array, q: Array) -> Array:
    """(K,) largest joint difference [rad or m] to a solution of the position; NaN without one.

    A SCARA arm has two closed-form solutions, whatever its last joint: the nearer of them. Of other
    arms a position leaves joints free, and the solutions are no points but surfaces: the one that
    a descent from q ends at, so the nearest is not farther away than that.
    """
    if robot.kinds == "RRPR":
        arm = robot.locked({robot.joint_names[3]: 0.0})
        near = kv.Analytic(task="position").fit(arm).solve(T).nearest(q[:, :3])
        return np.asarray(np.abs(near - q[:, :3]).max(axis=1))
    found = (
        kv.Numerical(task="position", tol_position=1e-9)
        .fit(robot)
        .solve(T, q_seed=q, rng=REFERENCE_SEED)
    )
    return np.asarray(np.abs(found.nearest(q) - q).max(axis=1))

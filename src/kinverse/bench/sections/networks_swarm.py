"""The hybrid networks of document 004: their real test errors, and what no network can undercut."""

import time
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.load import load
from kinverse.robot import Robot

__all__ = ["hybrid_mlps"]

Array = NDArray[np.float64]

ROBOTS = ("adept_one", "pioneer2")
HIDDEN = (4, 5, 8, 11, 14, 17, 20, 23, 27, 30)
METHODS = ("pso", "ga", "gwo", "tlbo", "cibo")
TRAIN, TEST = 700, 300
POPULATION, GENERATIONS = 100, 150
"""The document says 100 members and does not say how many generations: these take 3 minutes."""
DATA_SEED, NETWORK_SEED, FLOOR_SEED = 4_100, 59, 880_000
NEIGHBOURS = 50


class Rows(NamedTuple):
    """Positions [m] and joint values [rad, m] of one draw."""

    X: Array  # (N, 3)
    q: Array  # (N, n)


def hybrid_mlps(quick: bool) -> list[Line]:
    """RMS test errors of one-hidden-layer networks, positions to joints, by what trained them.

    Joints are drawn uniformly in their limits, 700 rows train and 300 others test; a fresh draw
    and another network for each seed. The floor is what the position leaves open: the spread of
    the joints among many configurations that put the tool at nearly the same point.
    """
    seeds, hidden, generations = (2, HIDDEN[:1], 5) if quick else (3, HIDDEN, GENERATIONS)
    lines = []
    for name in ROBOTS:
        robot = load(name)
        draws = [_draw(robot, TRAIN + TEST, DATA_SEED + k) for k in range(seeds)]
        many = _draw(robot, 20_000 if quick else 200_000, FLOOR_SEED)
        lines += _limits(robot, draws, many)
        for units in hidden:
            for method in (*METHODS, "back-propagation"):
                lines.append(_trained(robot, draws, method, units, generations))
    return lines


def _draw(robot: Robot, count: int, seed: int) -> Rows:
    q = robot.random(count, rng=seed)
    return Rows(robot.fk(q)[:, :3, 3], q)


def _limits(robot: Robot, draws: list[Rows], many: Rows) -> list[Line]:
    """Beside what the networks are judged: knowing nothing, and knowing all that can be known."""
    from scipy.spatial import cKDTree

    tree = cKDTree(many.X)
    constant, floor = [], []
    for rows in draws:
        wanted = rows.q[TRAIN:]
        constant.append(_rms(wanted - rows.q[:TRAIN].mean(axis=0)))
        near = tree.query(rows.X[TRAIN:], NEIGHBOURS)[1]
        floor.append(_rms(wanted - many.q[near].mean(axis=1)))
    return [
        _line(robot, "mean of the training joints", constant, ""),
        _line(
            robot,
            "floor: mean of the joints at the same position",
            floor,
            f"{NEIGHBOURS} nearest of {len(many.X):,} others: for the angles about 1 % above the"
            " least error of any function of X, Y, Z, for a slide how far apart the neighbours"
            " are; so mean squared errors of 0.00 to 1e-111, as document 004 prints them for each"
            " joint, are impossible for such data",
        ),
    ]


def _trained(robot: Robot, draws: list[Rows], method: str, units: int, generations: int) -> Line:
    errors, seconds = [], []
    for k, rows in enumerate(draws):
        network = _network(method, units, generations, NETWORK_SEED + k)
        start = time.process_time()
        with warnings.catch_warnings():
            # few rows for many weights: the document's own numbers
            warnings.simplefilter("ignore", UserWarning)
            network.fit(rows.X[:TRAIN], rows.q[:TRAIN])
        seconds.append(time.process_time() - start)
        errors.append(_rms(network.predict(rows.X[TRAIN:]) - rows.q[TRAIN:]))
    spent = "L-BFGS, 300 iterations at most"
    if method in METHODS:
        spent = f"{generations * POPULATION:,} networks tried"
    note = f"{spent}, {float(np.median(seconds)):.2g} s of CPU"
    return _line(robot, f"{units} hidden, {method}", errors, note)


def _network(method: str, units: int, generations: int, seed: int) -> Any:
    from kinverse.networks import MLP, SwarmMLP
    from kinverse.optimizers import make_optimizer

    if method not in METHODS:
        return MLP((units,), activation="logsig", trainer="lbfgs", max_iter=300, random_state=seed)
    return SwarmMLP(
        (units,),
        optimizer=make_optimizer(method, population=POPULATION),
        encoding="matrix",
        max_evals=generations * POPULATION,
        random_state=seed,
    )


def _rms(error: Array) -> Array:
    """(n,) of each joint; an angle is compared as it is, as the networks learned it."""
    rms: Array = np.sqrt(np.mean(error * error, axis=0))
    return rms


def _line(robot: Robot, what: str, errors: list[Array], note: str) -> Line:
    """Turns in one figure [rad]; each joint's median, slides in metres, beside it."""
    turns = np.array([kind == "R" for kind in robot.kinds])
    each = np.median(errors, axis=0)
    joints = ", ".join(
        f"{name} {value:.3g} {'rad' if turn else 'm'}"
        for name, value, turn in zip(robot.joint_names, each, turns, strict=True)
    )
    pooled = Spread.of([float(np.sqrt(np.mean(error[turns] ** 2))) for error in errors])
    section = "positions to joints, RMS test error of the turning joints [rad], range over seeds"
    return Line(section, robot.name, what, pooled, note="; ".join(filter(None, (joints, note))))

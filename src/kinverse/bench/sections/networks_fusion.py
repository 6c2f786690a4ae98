"""Document 000: networks of increments on its KUKA and a PUMA 560, and the loop around them."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread

__all__ = ["fusion"]

Array = NDArray[np.float64]

ROBOTS = ("ir361", "puma560")
POSES, NEURONS, SEEDS = 70, 68, 5
HELD_OUT, FRESH, NETWORK = 9_100, 9_500, 60
"""First seeds of the training poses, of the fresh poses that the loop solves, of the networks."""
WHOLE = 180.0
REGIONS = (2.0, 5.0, 10.0, 30.0, WHOLE)
"""Half widths of the boxes of joint values [deg]; the last stands for all inside the limits."""
NEEDED = {2.0: 100.0, 5.0: 100.0, 10.0: 90.0}
"""Shares [%] of fresh poses that the loop alone shall bring to 0.02 mm."""
PRINTED = "the document prints 0.02 to 0.11 deg"


class Variant(NamedTuple):
    """A network and where it is tried."""

    make: Callable[[int], Any]
    splits: tuple[str, ...]
    robots: tuple[str, ...]
    seeds: int


def fusion(quick: bool) -> list[Line]:
    """Held-out errors for each region and split; shares of poses the loop brings to 0.02 mm."""
    seeds = 1 if quick else SEEDS
    regions = REGIONS[1:2] if quick else REGIONS
    lines = []
    for name in ROBOTS:
        robot = kv.load(name)
        for half in regions:
            for label, variant in _variants(quick).items():
                if name in variant.robots:
                    lines += _held_out(robot, half, label, variant, seeds)
            lines += _loop(robot, half, seeds, 20 if quick else 200, quick)
    return lines


def _variants(quick: bool) -> dict[str, Variant]:
    from kinverse.networks import MLP, RBFNetwork

    neurons = 20 if quick else NEURONS
    epochs = 3 if quick else 25
    return {
        "RBF, scaled, spread 3": Variant(
            lambda seed: RBFNetwork(neurons, spread=3.0), ("pose", "pair"), ROBOTS, SEEDS
        ),
        "RBF, not scaled, spread 0.75": Variant(
            lambda seed: RBFNetwork(neurons, spread=0.75, scaling=None), ("pose",), ROBOTS, SEEDS
        ),
        f"MLP, logsig, bayes, {epochs} epochs": Variant(
            lambda seed: MLP(
                (neurons,),
                activation="logsig",
                trainer="bayes",
                max_iter=epochs,
                random_state=NETWORK + seed,
            ),
            ("pose",),
            ROBOTS[:1],
            2,
        ),
    }


def _keep(robot: kv.Robot) -> Any:
    from kinverse.learning import far_from_singularity

    return far_from_singularity(robot, least=0.005)


def _region(robot: kv.Robot, half: float, seed: int) -> tuple[Array, Array] | None:
    """A box of joint values about a centre well inside the limits and far from singularities.

    The centre is the first of 64 drawn in the middle halves of the limits whose inverse condition
    number is among their best quarter.
    """
    from kinverse.learning import sample

    if half == WHOLE:
        return None
    middle, width = robot.limits.mean(axis=1), np.ptp(robot.limits, axis=1)
    drawn = sample(robot, 64, random_state=seed, region=(middle, 0.25 * width))
    J = robot.jacobian(drawn.q)
    J[:, :3] /= np.linalg.norm(drawn.T[:, :3, 3], axis=1).max()
    values = np.linalg.svd(J, compute_uv=False)
    condition = values[:, -1] / values[:, 0]
    best = np.flatnonzero(condition >= np.quantile(condition, 0.75))
    return drawn.q[best[0]], np.full(robot.dof, np.radians(half))


def _held_out(robot: kv.Robot, half: float, label: str, variant: Variant, seeds: int) -> list[Line]:
    from kinverse.learning import IncrementalPairs, PoseFeatures, sample

    lines = []
    for split in variant.splits:
        errors, spent = [], []
        for seed in range(min(seeds, variant.seeds)):
            data = sample(
                robot,
                POSES,
                random_state=HELD_OUT + seed,
                keep=_keep(robot),
                region=_region(robot, half, HELD_OUT + seed),
            )
            pairs = IncrementalPairs(
                PoseFeatures("xyz+rpy"), split=split, random_state=HELD_OUT + seed
            ).make(data.q, data.T)
            start = time.process_time()
            network = variant.make(seed).fit(*pairs.train)
            spent.append(time.process_time() - start)
            X, y = pairs.test
            errors.append(np.degrees(np.sqrt(np.mean((network.predict(X) - y) ** 2, axis=0))))
        joints = np.median(errors, axis=0)
        note = (
            f"joints {' '.join(f'{v:.3g}' for v in joints)}, medians of {len(errors)} seeds;"
            f" {np.median(spent):.2g} s of CPU to train; {PRINTED}"
        )
        worst = Spread.of([float(each.max()) for each in errors])
        what = f"{label}, held out by {split}: worst joint's rms, deg"
        lines.append(Line(_section(half), robot.name, what, worst, note=note))
    return lines


def _loop(robot: kv.Robot, half: float, seeds: int, count: int, quick: bool) -> list[Line]:
    from kinverse.learning import sample

    alone, both, spent = [], [], []
    rounds: list[int] = []
    for seed in range(seeds):
        region = _region(robot, half, HELD_OUT + seed)
        keep = _keep(robot)
        solver = kv.Fusion(region=region, keep=keep, random_state=NETWORK + seed, fallback=None)
        solver.fit(robot)
        T = sample(robot, count, random_state=FRESH + seed, keep=keep, region=region).T
        start = time.process_time()
        answers = solver.solve(T)
        spent.append(1e6 * (time.process_time() - start) / count)
        alone.append(_verified(robot, answers, T, solver))
        rounds.extend((answers.stats.evaluations[answers.ok] - 1).tolist())
        whole = solver.clone().set_params(fallback="numerical").fit(robot)
        both.append(_verified(robot, whole.solve(T), T, whole))
    turns = f"{np.median(rounds):g} rounds of the loop in the median" if rounds else "none arrived"
    turns += ", poses of an inverse condition below 0.005 in neither set"
    note = (
        f"{seeds} seeds, {count} fresh poses each; {turns}, {np.median(spent):.3g} us of CPU a pose"
    )
    section = _section(half)
    needed = None if quick else NEEDED.get(half)
    return [
        Line(
            section,
            robot.name,
            "poses to 0.02 mm and 1 mrad by the loop alone, %",
            Spread.of(alone),
            needed,
            note=note,
        ),
        Line(section, robot.name, "the same with its fall-back, %", Spread.of(both), 100.0),
    ]


def _verified(robot: kv.Robot, answers: kv.Solutions, T: Array, solver: Any) -> float:
    """Share [%] of poses with an answer that the oracle finds within the tolerances."""
    position, rotation = oracle.errors(T[answers.pose_index], oracle.pose(robot, answers.q))
    good = (position <= solver.tol_position) & (rotation <= solver.tol_rotation)
    return 100.0 * len(np.unique(answers.pose_index[good])) / len(T)


def _section(half: float) -> str:
    where = "whole workspace" if half == WHOLE else f"joints within {half:g} deg of a centre"
    return f"document 000: {POSES} poses, {where}"

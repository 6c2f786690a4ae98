"""Document 003: feasible parts of its four trajectories, and tracking error toward the edge."""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.paths import condition_5, condition_6, feasible, named_path, named_samples

__all__ = ["planar_paths"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

LENGTHS = (10.0, 7.0, 5.0)
FREE = [[-np.pi, np.pi]] * 3
RIGHT, LEFT = 7.937253933193772 - 5.0, 31.0 + 10.0 - 6.244997998398398
ENDS = {
    "habibkhah_1": ((0.0, 8 * 2.7830234619155942), (8 * 3.969932243936284, 16 * np.pi)),
    "habibkhah_2": ((0.0, 8 * 1.35 * np.pi),),
    "habibkhah_3": ((RIGHT, LEFT),),
    "habibkhah_4": ((0.0, LEFT - RIGHT),),
}
"""Feasible parts where conditions (5) and (6) are met, recomputed from the document [m]."""
RUNS = {
    "habibkhah_1": (629, ((0, 278), (397, 628)), 405, (0.06987902853166247, 264.5229603683035)),
    "habibkhah_2": (425, ((0, 424),), 405, (40.49251197828096, 264.52489526398784)),
    "habibkhah_3": (4200, ((294, 3475),), 2201, (0.0, 169.72243622680054)),
    "habibkhah_4": (3182, ((0, 3181),), 2201, None),
}
"""Samples, feasible runs, samples inside the joint ranges too, least and greatest of (5) [m^2]."""
CLOSE = 1e-9
"""What ``feasible`` finds ends to by default [m]."""

SEEDS = (5_301, 5_302, 5_303)
"""Of examples and networks: those of the document are 7,000, and 140 neurons."""
EDGE = sum(LENGTHS)
BINS = (7.0, 4.0, 2.0, 1.0, 0.73)
"""Distances from the stretched pose [m]; trajectory 2 comes no nearer than 0.736."""
BEYOND = (0.1, 0.01, 0.001)
"""The same on the straight way from there to the edge, in steps that shrink with the distance."""
TO_EDGE = 100


def planar_paths(quick: bool) -> list[Line]:
    """The four trajectories against the numbers recomputed from the document, then trajectory 2."""
    arm = kv.load("planar3r_003")
    lines = []
    for k, name in enumerate(ENDS, start=1):
        lines += _feasible(arm, k, name)
    return [*lines, *_toward_the_edge(arm, quick)]


def _feasible(arm: kv.Robot, k: int, name: str) -> list[Line]:
    head = ("trajectories of document 003, planar 3R 10/7/5", f"trajectory {k}")
    solver = kv.Analytic(task="planar", tol_position=1e-12, tol_rotation=1e-12)
    found = feasible(arm.with_limits(FREE), named_path(name), solver=solver, tolerance=CLOSE)
    parts = [(part.start, part.end) for part in found.feasible]
    far = np.inf
    if len(parts) == len(ENDS[name]):
        far = float(np.abs(np.array(parts) - ENDS[name]).max())
    note = f"{len(parts)} parts, {100 * found.share:.4g} % of {named_path(name).length:.4g} m"
    lines = [
        Line(
            *head,
            "largest difference of an end of a part, m",
            Spread.exact(far),
            CLOSE,
            False,
            note,
        )
    ]
    count, runs, inside, extremes = RUNS[name]
    T, s = named_samples(name)
    five, six = condition_5(LENGTHS, T), condition_6(LENGTHS, T)
    wanted = np.zeros(count, dtype=bool)
    for first, last in runs:
        wanted[first : last + 1] = True
    reached = {
        "condition (5)": five.holds,
        "condition (6)": six.holds,
        "feasible": found.status_at(s) == kv.Status.SOLVED,
    }
    for how, holds in reached.items():
        differ = Spread.exact(float((holds != wanted).sum()) if len(s) == count else np.inf)
        note = f"{int(holds.sum())} of {len(s)}, wanted {int(wanted.sum())}"
        lines.append(Line(*head, f"samples that differ, {how}", differ, 0.0, False, note))
    held = int((feasible(arm, named_path(name), task="planar").status_at(s) == 0).sum())
    note = f"{held}, wanted {inside}"
    what = "samples that differ in number, feasible with the joint ranges (4)"
    lines.append(Line(*head, what, Spread.exact(abs(held - inside)), 0.0, False, note))
    if extremes is not None:
        off = np.abs([five.value.min() - extremes[0], five.value.max() - extremes[1]]).max()
        what = "largest difference of the extremes of (5), m^2"
        lines.append(Line(*head, what, Spread.exact(float(off)), CLOSE, False))
    return lines


def _toward_the_edge(arm: kv.Robot, quick: bool) -> list[Line]:
    """A network as the document trains it: its own predictions, and what the arm makes of them."""
    T = named_samples("habibkhah_2").T
    outermost = T[np.argmax(np.linalg.norm(T[:, :2, 3], axis=1))]
    way = np.repeat(outermost[None], TO_EDGE, axis=0)
    away = np.geomspace(BINS[-1], BEYOND[-1], TO_EDGE)
    way[:, :2, 3] *= ((EDGE - away) / np.linalg.norm(outermost[:2, 3]))[:, None]
    seeds: tuple[int, ...] = SEEDS
    examples, hidden, epochs = 7_000, 140, 100
    if quick:
        seeds, examples, hidden, epochs = SEEDS[:1], 500, 20, 40
    start = time.process_time()
    networks = [_trained(arm, seed, examples, hidden, epochs) for seed in seeds]
    spent = (time.process_time() - start) / len(seeds)
    section = (
        f"tool's error by distance from the stretched pose, one network 4-{hidden}-3,"
        f" {examples:,} examples, {len(seeds)} seeds, {spent:.2g} s of CPU each"
    )
    lines = []
    for subject, poses, edges in (
        ("trajectory 2", T, (np.inf, *BINS)),
        ("on to the edge", way, (BINS[-1], *BEYOND)),
    ):
        lines += _binned(arm, networks, (section, subject), poses, edges)
    return lines


def _trained(arm: kv.Robot, seed: int, examples: int, hidden: int, epochs: int) -> kv.Learned:
    from kinverse.networks import MLP

    return kv.Learned(
        network=MLP((hidden,), max_iter=epochs, random_state=seed),
        features="xyz",
        virtual="cos_sin",
        n_samples=examples,
        refine=None,
        task="planar",
        random_state=seed,
    ).fit(arm)


def _binned(
    arm: kv.Robot,
    networks: list[kv.Learned],
    head: tuple[str, str],
    T: Array,
    edges: tuple[float, ...],
) -> list[Line]:
    held = kv.Analytic(task="planar").fit(arm).solve(T)
    known = kv.Analytic(task="planar").fit(arm.with_limits(FREE)).solve(T)
    away = EDGE - np.linalg.norm(T[:, :2, 3], axis=1)
    predicted = [solver.solve(T).stats.best_q for solver in networks]
    far, turned = zip(*(oracle.errors(T, oracle.pose(arm, q)) for q in predicted), strict=True)
    joints = [_from_the_nearest(arm, known, q) for q in predicted]
    numerical = kv.Numerical(task="planar").fit(arm)
    searched = numerical.solve(T).nearest(arm.limits.mean(axis=1))
    off = _from_the_nearest(arm, known, searched)
    left = oracle.errors(T, oracle.pose(arm, searched))[0]
    elbow = np.array([known[i].q[np.argmin(known[i].q[:, 1])] for i in range(len(T))])
    gain = 1.0 / np.linalg.svd(_wrist_jacobian(elbow), compute_uv=False)[:, -1]
    step = np.append(oracle.wrapped(arm, np.diff(elbow, axis=0)), 0.0)
    farthest = float(away[held.ok].max())
    bins = {
        f"{near:g} to {min(wide, farthest):.3g} m": held.ok
        & (away >= near * (1.0 - 1e-12))
        & (away < wide)
        for wide, near in zip(edges[:-1], edges[1:], strict=True)
    }
    if not held.ok.all():
        bins["outside the joint ranges"] = ~held.ok
    lines = []
    for name, mask in bins.items():
        note = f"{int(mask.sum())} samples; worst {max(e[mask].max() for e in far):.2g} m,"
        note += f" median angle {np.degrees(np.median([e[mask] for e in turned])):.2g} deg"
        place = Spread.of([float(np.median(e[mask])) for e in far])
        lines.append(Line(*head, f"{name}: network's position error, m", place, None, False, note))
        angle = Spread.of([float(np.degrees(np.median(e[mask]))) for e in joints])
        note = f"worst {np.degrees(max(e[mask].max() for e in joints)):.2g} deg"
        lines.append(Line(*head, f"{name}: its joint error, deg", angle, None, False, note))
        note = f"joint steps of the closed form up to {np.degrees(step[mask].max()):.3g} deg"
        if held.ok[mask].all():
            note += (
                f"; Numerical, asked for 1e-6: at most {left[mask].max():.1g} m off and"
                f" {off[mask].max():.1g} rad from it"
            )
        least = Spread.of([float(value) for value in gain[mask]])
        what = f"{name}: joints for the wrist's way, 1/sigma_min, rad/m"
        lines.append(Line(*head, what, least, None, False, note))
    return lines


def _from_the_nearest(arm: kv.Robot, known: kv.Solutions, q: Array) -> Array:
    """(N,) joint distance [rad] of q (N, n) from the closed form's nearest solution."""
    rows = oracle.wrapped(arm, known.q - q[known.pose_index])
    least = np.full(len(q), np.inf)
    np.minimum.at(least, known.pose_index, np.where(np.isnan(rows), np.inf, rows))
    return least


def _wrist_jacobian(q: Array) -> Array:
    """(N, 2, 2) of the third joint's place [m] by the first two joints, by hand."""
    l1, l2, _ = LENGTHS
    first, both = q[:, 0], q[:, 0] + q[:, 1]
    x, y = l1 * np.cos(first), l1 * np.sin(first)
    u, v = l2 * np.cos(both), l2 * np.sin(both)
    return np.stack([np.stack([-y - v, -v], axis=1), np.stack([x + u, u], axis=1)], axis=1)

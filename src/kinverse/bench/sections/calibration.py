"""Error models of a KR16 that is not what it is said to be, and joint angles for the real arm."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.real_arm import GEARS, TARGET_POINT, RealArm, nominal, real_arm
from kinverse.bench.report import Line
from kinverse.bench.run import Spread

__all__ = ["calibration"]

Array = NDArray[np.float64]

SEED = 6_700
MEASUREMENTS, HELD_OUT, ARMS = 300, 1000, 7
MODELS = (
    "fourier:1",
    "fourier:2",
    "fourier:4",
    "polynomial:2",
    "polynomial:4",
    "polynomial:4:legendre",
    "geometric",
    "geometric+fourier:2",
    "geometric+polynomial:4",
    "geometric:2",
    "geometric:2+fourier:2",
    "geometric:2+polynomial:4",
)
QUICK = ("fourier:2", "geometric", "geometric:2", "geometric+fourier:2")
BOUND = 0.1
"""Target of the issue [mm]."""
SOLVED = 99.8
"""Share of the targets within the real arm's reach to be solved on every arm [%]: none is lost but
some that lie, within what the model leaves, at the end of the reach."""
FOUND = 1e-6
"""Largest error [m and entries of the rotation] of a target that the true arm reaches."""
SAID = {"joint": "gear errors as joint angles", "tool": "gear errors at the tool, eq. 25"}


def calibration(quick: bool) -> list[Line]:
    """Held-out error of each model and of the one chosen, and what compensation leaves.

    Errors are those of 1000 configurations without noise, of as many arms as there are draws; the
    choice sees the 300 measurements only. The targets of the compensation are the poses that the
    nominal arm has at those configurations; which of them lie within the real arm's reach a search
    says that knows its true numbers.
    """
    arms, held, models = (2, 200, QUICK) if quick else (ARMS, HELD_OUT, MODELS)
    lines = []
    for gears in GEARS:
        draws = [_draw(gears, SEED + k, held, models) for k in range(arms)]
        lines += _lines(gears, draws, held)
    return lines


def _draw(gears: str, seed: int, held: int, models: tuple[str, ...]) -> dict[str, Any]:
    """Everything about one arm: errors in mm."""
    from kinverse import calibration

    streams = (np.random.default_rng([seed, k]) for k in range(4))
    arm = real_arm(next(streams), gears)
    robot = kv.load("kr16").with_tool(kv.pose(TARGET_POINT))
    q, unseen = robot.random(MEASUREMENTS, next(streams)), robot.random(held, next(streams))
    error = calibration.tool_error(robot, q, arm.measured(q, next(streams)))
    true = calibration.tool_error(robot, unseen, arm.position(unseen))
    contest = {name: calibration.make_model(name, robot) for name in models}
    chosen = calibration.choose(contest, q, error, random_state=seed)
    fitted = {name: model.fit(q, error) for name, model in contest.items()}
    out: dict[str, Any] = {name: _rms(m.predict(unseen) - true) for name, m in fitted.items()}
    out["none"], out["choice"] = _rms(true), chosen.name
    out["chosen"], out["promised"] = out[chosen.name], 1e3 * chosen.table[0].rms

    T = robot.fk(unseen)
    solver = calibration.Compensated(kv.Analytic(), chosen.model).fit(robot)
    answers = solver.solve(T, q_seed=unseen)
    given_up = np.flatnonzero(~answers.ok)
    starts = kv.solve(robot, T[given_up], solver=kv.Analytic())
    lost = [
        pose
        for k, pose in enumerate(given_up)
        if any(_reaches(arm, T[pose], start) for start in [unseen[pose], *starts[k].q])
    ]
    # what was given up within the true arm's reach counts with the best that was found
    q_sent = np.concatenate([answers.nearest(unseen)[answers.ok], answers.stats.best_q[lost]])
    asked = np.concatenate([T[answers.ok], T[lost]])
    missed = arm.position(q_sent) - asked[:, :3, 3]
    out["compensated"] = _rms(missed)
    out["solved"], out["beyond"] = 100.0 * answers.ok.sum() / len(asked), held - len(asked)
    out["worst"] = 1e3 * np.linalg.norm(missed, axis=1).max()
    return out


def _reaches(arm: RealArm, T: Array, q: Array) -> bool:
    """Whether a search from q finds the target with the true arm, its numbers known.

    The rotation is that of the nominal arm: it is not measured, and compensation leaves it.
    """
    from scipy.optimize import least_squares

    said, (low, high) = nominal(), kv.load("kr16").limits.T

    def missed(q: Array) -> Array:
        turned = said.pose(q[None])[0, :3, :3] - T[:3, :3]
        return np.concatenate([arm.position(q[None])[0] - T[:3, 3], turned.ravel()])

    start = np.clip(q, low + 1e-9, high - 1e-9)
    found = least_squares(missed, start, bounds=(low, high), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return bool(np.abs(found.fun).max() <= FOUND)


def _lines(gears: str, draws: list[dict[str, Any]], held: int) -> list[Line]:
    def line(what: str, key: str, bound: float | None = None, note: str = "") -> Line:
        figure = Spread.of([draw[key] for draw in draws])
        return Line("calibration", "kr16", f"{SAID[gears]}: {what}", figure, bound, False, note)

    def worst(of: Line, choose: Callable[[list[float]], float]) -> Line:
        return replace(of, figure=Spread.exact(choose([of.figure.low, of.figure.high])))

    names = [name for name in draws[0] if name in MODELS]
    picked = Counter(draw["choice"] for draw in draws)
    choices = ", ".join(f"{name} {count}x" for name, count in picked.most_common())
    lines = [line("before, rms mm", "none", note=f"{len(draws)} arms, {held} configurations each")]
    lines += [line(f"{name}, rms mm", name) for name in names]
    solved = line("targets in the real arm's reach solved, worst arm %", "solved", SOLVED)
    beyond = line("targets beyond it or its limits, by search", "beyond")
    return [
        *lines,
        line("chosen by cross-validation, rms mm", "chosen", note=choices),
        line("its own estimate, rms mm", "promised", note="noise of 0.02 mm an axis is in it"),
        line("real tool, compensated, rms mm", "compensated", BOUND),
        worst(line("real tool, compensated, worst arm's rms mm", "compensated", BOUND), max),
        line("real tool, compensated, worst mm", "worst"),
        replace(worst(solved, min), least=True),
        beyond,
    ]


def _rms(error: Array) -> float:
    """Root mean square length [mm]."""
    return float(1e3 * np.sqrt(np.mean(np.sum(error * error, axis=1))))

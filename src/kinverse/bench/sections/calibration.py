"""Error models of a KR16 that is not what it is said to be, and joint angles for the real arm."""

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.real_arm import GEARS, TARGET_POINT, real_arm
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
SAID = {"joint": "gear errors as joint angles", "tool": "gear errors at the tool, eq. 25"}


def calibration(quick: bool) -> list[Line]:
    """Held-out error of each model and of the one chosen, and what compensation leaves.

    Errors are those of 1000 configurations without noise, of as many arms as there are draws; the
    choice sees the 300 measurements only. The targets of the compensation are the poses that the
    nominal arm has at those configurations.
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
    missed = arm.position(answers.nearest(unseen)[answers.ok]) - T[answers.ok, :3, 3]
    out["compensated"], out["solved"] = _rms(missed), 100.0 * answers.ok.mean()
    out["worst"] = 1e3 * np.linalg.norm(missed, axis=1).max()
    return out


def _lines(gears: str, draws: list[dict[str, Any]], held: int) -> list[Line]:
    def line(what: str, key: str, bound: float | None = None, note: str = "") -> Line:
        figure = Spread.of([draw[key] for draw in draws])
        return Line("calibration", "kr16", f"{SAID[gears]}: {what}", figure, bound, False, note)

    names = [name for name in draws[0] if name in MODELS]
    picked = Counter(draw["choice"] for draw in draws)
    choices = ", ".join(f"{name} {count}x" for name, count in picked.most_common())
    lines = [line("before, rms mm", "none", note=f"{len(draws)} arms, {held} configurations each")]
    lines += [line(f"{name}, rms mm", name) for name in names]
    return [
        *lines,
        line("chosen by cross-validation, rms mm", "chosen", note=choices),
        line("its own estimate, rms mm", "promised", note="noise of 0.02 mm an axis is in it"),
        line("real tool, compensated, rms mm", "compensated", BOUND),
        line("real tool, compensated, worst mm", "worst"),
        line(
            "targets solved %",
            "solved",
            note="the rest is out of the real arm's reach (elbow stretched) or limits",
        ),
    ]


def _rms(error: Array) -> float:
    """Root mean square length [mm]."""
    return float(1e3 * np.sqrt(np.mean(np.sum(error * error, axis=1))))

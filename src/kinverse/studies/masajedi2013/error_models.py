"""Section 5: models of the position error, fitted to one set of measurements, tried on another."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Cell, Row
from kinverse.studies.masajedi2013.real_arm import NOISE, POINT, WORLDS, real_arm
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["MODELS", "TABLES", "fitted"]

Array = NDArray[np.float64]

BASES = ("power", "legendre", "chebyshev", "hermite", "laguerre")
MODELS = (
    "none",
    *(f"fourier:{harmonics}" for harmonics in (1, 2, 4)),
    *(f"polynomial:{degree}:{basis}" for degree in (2, 4, 6) for basis in BASES),
    "geometric",
    "geometric:2",
    "geometric+fourier:2",
    "geometric+polynomial:4",
)
SEEDS = (501, 502, 503, 504, 505, 506, 507)
MEASUREMENTS, HELD_OUT = 300, 1_000


def fitted(world: str, seed: int, measurements: int, held_out: int) -> list[Row]:
    """Rms of what each model leaves, of one arm: where it was fitted, and elsewhere [mm].

    The arm, the joint values of both sets and the noise have streams of their own; what is held out
    is the true error, without noise.
    """
    from kinverse import calibration

    arm_rng, q_rng, held_rng, noise_rng = (np.random.default_rng([seed, k]) for k in range(4))
    robot = kv.load("kr16").with_tool(kv.pose(POINT))
    arm = real_arm(world, arm_rng)
    q = robot.random(measurements, q_rng)
    error = calibration.tool_error(robot, q, arm.measured(q, noise_rng))
    unseen = robot.random(held_out, held_rng)
    true = calibration.tool_error(robot, unseen, arm.position(unseen))
    rows: list[Row] = []
    for name in MODELS:
        model = calibration.make_model(name, robot).fit(q, error)
        rows.append(
            {
                "model": name,
                "fitted": _rms(model.predict(q) - error),
                "held out": _rms(model.predict(unseen) - true),
            }
        )
    return rows


def _rms(error: Array) -> float:
    """Root mean square length [mm]."""
    return float(1e3 * np.sqrt(np.mean(np.sum(error * error, axis=1))))


def _cells(quick: bool) -> list[Cell]:
    cells = []
    for k, world in enumerate(WORLDS):
        for seed in SEEDS[:2] if quick else SEEDS:
            arguments: dict[str, str | float | None] = {
                "world": world,
                "seed": seed,
                "measurements": MEASUREMENTS,
                "held_out": HELD_OUT,
            }
            cells.append(Cell(f"errors-{k}-{seed}", fitted, arguments))
    return cells


def _table(rows: dict[str, list[Row]]) -> Table:
    table: list[Row] = []
    for k, world in enumerate(WORLDS):
        arms = [cell for key, cell in rows.items() if key.startswith(f"errors-{k}-")]
        before = _values(arms, "none", "held out")
        for name in MODELS:
            held = _values(arms, name, "held out")
            low, middle, high = quartiles(held)
            table.append(
                {
                    "error of the arm": world,
                    "model": name,
                    "arms": len(arms),
                    "fitted, rms, mm": float(np.median(_values(arms, name, "fitted"))),
                    "held out, rms, mm": middle,
                    "held out, lower quartile, mm": low,
                    "held out, upper quartile, mm": high,
                    "left of the error, %": 100.0 * float(np.median(held / before)),
                }
            )
    left = {
        (str(row["error of the arm"]), str(row["model"])): float(row["left of the error, %"] or 0.0)
        for row in table
    }
    words = "; ".join(f"{world}: {_told(left, world)}" for world in WORLDS)
    picture = Picture(
        "What each model leaves of the position error, held out",
        f"Dots on a logarithmic scale, one a model, for both kinds of arm: {words}.",
        lambda: _figure(table),
    )
    return Table(
        title="Section 5: models of the position error",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=words,
        note="The document proposes Fourier and ordinary polynomials of single joints (equations 24"
        " to 27) and names further families; it prints no measurement and no result. Here they are"
        f" fitted to {MEASUREMENTS} measurements (noise {1e3 * NOISE:g} mm an axis) of arms drawn"
        f" at random and tried on {HELD_OUT} other joint values: arms whose errors are sums of"
        " single joints, as equation 25 assumes, and arms with 0.3 mm and 0.02 deg of error in"
        " every parameter, gears that run out of true, and sag. Bases of one degree span the same"
        " functions. geometric is no model of the document: errors of the links themselves, and"
        " with :2 of the gears.",
        pictures=(picture,),
    )


def _values(arms: list[list[Row]], model: str, column: str) -> Array:
    return np.array([float(r[column] or 0.0) for arm in arms for r in arm if r["model"] == model])


def _told(left: dict[tuple[str, str], float], world: str) -> str:
    """The best of each kind of model, and what it leaves."""
    parts = []
    for kind in ("fourier", "polynomial", "geometric"):
        names = [name for name in MODELS if name.startswith(kind)]
        best = min(names, key=lambda name: round(left[world, name], 6))  # of equals the first
        parts.append(f"{best} {left[world, best]:.3g} %")
    return f"of the error {', '.join(parts)} are left"


def _figure(table: list[Row]) -> "Figure":
    from kinverse.plots import new_figure

    figure = new_figure((9.5, 6.0))
    for axes, world in zip(figure.subplots(1, 2, sharex=True, sharey=True), WORLDS, strict=True):
        mine = [row for row in table if row["error of the arm"] == world]
        names = [str(row["model"]) for row in mine]
        places = np.arange(len(names))[::-1]
        for column, marker, colour in (
            ("fitted, rms, mm", "o", "0.6"),
            ("held out, rms, mm", "D", "tab:blue"),
        ):
            values = [float(row[column] or 0.0) for row in mine]
            axes.plot(values, places, marker, ms=5, color=colour, label=column.split(",")[0])
        axes.set_xscale("log")
        axes.set_yticks(places, names, fontsize=8)
        axes.set_xlabel("rms of what is left [mm]")
        axes.set_title(world, fontsize=10)
        axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=8, loc="upper left")
    return figure


TABLES = (TableSpec("error-models", "Section 5: position-error models", _cells, _table),)

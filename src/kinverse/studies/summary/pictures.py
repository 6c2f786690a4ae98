"""Pictures of the comparison: time against error, and what is solved arm by arm."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.summary.methods import TOLERANCE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["LEAST", "solved_figure", "time_against_error"]

LEAST = 1e-12
"""Errors are drawn from here [reach or rad]: less is rounding."""
NO_BOUND = 5.0
"""Where methods are drawn that leave poses without any answer."""
STYLES = {
    "analytic": ("tab:green", "*"),
    "numerical": ("tab:blue", "o"),
    "learned": ("tab:orange", "s"),
    "swarm": ("tab:red", "^"),
    "swarm and descent": ("tab:purple", "D"),
}
NEAR = (80.0, 70.0)
"""Markers closer than this, across and up, share stairs of names [points]."""
STAIR = 11.0
LEADER = {"arrowstyle": "-", "lw": 0.6, "color": "0.6", "relpos": (0.0, 0.5)}


def time_against_error(rows: list[Row], enough: float) -> "Figure":
    """One marker a method, filled where it solves ``enough`` per cent on every arm."""
    figure = new_figure((9.0, 6.0))
    axes = figure.subplots()
    shown = [row for row in rows if row["time a pose, ms"] is not None]
    points = [(_ms(row), _error(row)) for row in shown]
    for row, (x, y) in zip(shown, points, strict=True):
        colour, marker = STYLES[str(row["family"])]
        sound = _number(row["solved, lowest of an arm, %"], 0.0) >= enough
        axes.loglog(
            x, y, marker, color=colour, mfc=colour if sound else "white", ms=8, mew=1.4, zorder=3
        )
    axes.axhspan(LEAST / 10, TOLERANCE, color="tab:green", alpha=0.07, zorder=0)
    axes.set_ylim(LEAST / 10, 10.0)
    low, high = min(x for x, _ in points), max(x for x, _ in points)
    axes.set_xlim(low / 2, high * 6)
    for x, side, height, text in (
        (low / 1.8, "left", TOLERANCE / 100, f"about the tolerance of {TOLERANCE:g} m and rad"),
        (high * 5, "right", LEAST, f"{LEAST:g} or less"),
    ):
        axes.text(x, height / 2, text, ha=side, va="top", fontsize=8, color="0.4")
    axes.set_xlabel("processor time a pose [ms]")
    axes.set_ylabel("error that 95 % of the poses stay below [reach, rad]")
    for family, (colour, marker) in STYLES.items():
        axes.plot([], [], marker, color=colour, label=family)
    axes.plot([], [], "o", color="0.3", mfc="white", label=f"open: below {enough:g} % on some arm")
    axes.legend(frameon=False, fontsize=8, loc="center", bbox_to_anchor=(0.45, 0.7))
    axes.grid(alpha=0.25)
    figure.draw_without_rendering()  # places on the page are known from here on
    _label(axes, [str(row["method"]) for row in shown], points)
    return figure


def _label(axes: "Axes", names: list[str], points: list[tuple[float, float]]) -> None:
    """Names beside their markers; of neighbours one above or below the other, like stairs."""
    to_points = 72.0 / axes.figure.dpi
    places = axes.transData.transform(points) * to_points
    middle = axes.bbox.y0 * to_points + 0.5 * axes.bbox.height * to_points
    for group in _neighbours(places):
        down = places[group, 1].mean() > middle
        edge = places[group, 1].min() if down else places[group, 1].max()
        # a name runs to the right: those of markers further left stand further out
        for step, k in enumerate(sorted(group, key=lambda k: -places[k, 0]), start=1):
            away = 6 + STAIR * step
            height = (edge - away if down else edge + away) - places[k, 1]
            alone = len(group) == 1
            axes.annotate(
                names[k],
                points[k],
                (8, 0) if alone else (0, height),
                textcoords="offset points",
                va="center",
                fontsize=8,
                arrowprops=None if alone else LEADER,
            )


def _neighbours(places: NDArray[np.float64]) -> list[list[int]]:
    """Points in groups: those whose names would lie on one another, directly or by others."""
    gap = np.abs(places[:, None] - places[None])
    close = (gap[..., 0] < NEAR[0]) & (gap[..., 1] < NEAR[1])
    groups: list[list[int]] = []
    for k in range(len(places)):
        joined = [group for group in groups if close[k, group].any()]
        groups = [group for group in groups if group not in joined]
        groups.append([k, *(member for group in joined for member in group)])
    return groups


def solved_figure(rows: list[Row]) -> "Figure":
    """Share of the targets solved: methods down, arms across."""
    methods = list(dict.fromkeys(str(row["method"]) for row in rows))
    arms = list(dict.fromkeys(_case(row) for row in rows))
    grid = np.full((len(methods), len(arms)), np.nan)
    for row in rows:
        grid[methods.index(str(row["method"])), arms.index(_case(row))] = _number(
            row.get("solved, %"), np.nan
        )
    figure = new_figure((9.5, 6.5))
    axes = figure.subplots()
    image = axes.imshow(grid, cmap="cividis", vmin=0, vmax=100, aspect="auto")
    figure.colorbar(image, ax=axes, label="solved [%]")
    axes.set_xticks(range(len(arms)), arms, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(methods)), methods, fontsize=8)
    for i, j in np.ndindex(*grid.shape):
        text = "-" if np.isnan(grid[i, j]) else f"{grid[i, j]:.0f}"
        colour = "white" if grid[i, j] < 60 else "black"
        axes.text(j, i, text, ha="center", va="center", fontsize=7, color=colour)
    return figure


def _case(row: Row) -> str:
    return f"{row['arm']}, {row['task']}"


def _ms(row: Row) -> float:
    return _number(row["time a pose, ms"], np.nan)


def _error(row: Row) -> float:
    """The greater of position error [reach] and rotation error [rad]; NO_BOUND if there is none."""
    far = row["position error, 95 % below, % of reach"]
    turned = row["rotation error, 95 % below, deg"]
    if far is None or turned is None:
        return NO_BOUND
    return max(float(far) / 100.0, float(turned) * np.pi / 180.0, LEAST)


def _number(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)

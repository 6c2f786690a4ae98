"""Figures 7 to 14: which poses of the four trajectories meet conditions (5) and (6)."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.paths import Feasibility, condition_5, condition_6, feasible, named_path
from kinverse.plots import new_figure
from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.habibkhah2021.arm import (
    STUDY_NAME,
    TRAJECTORIES,
    arm,
    lengths,
    trajectory,
)
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CONDITIONS", "check_conditions"]

SIDES = {"bottom": (0, 1000), "right": (1000, 2100), "top": (2100, 3100), "left": (3100, 4200)}
"""Samples of the sides of trajectory 3, counter-clockwise from (5, -1)."""

BY_DEFINITION = "is the part of trajectory 3 that meets (5)"


def check_conditions() -> list[Row]:
    """Samples of each trajectory, and of each side of the rectangle, that meet the conditions."""
    rows: list[Row] = []
    for number in TRAJECTORIES:
        row = _counted(number, slice(None))
        free = kv.Analytic(task="planar", limits="ignore")
        held = kv.Analytic(task="planar")
        path = named_path(f"habibkhah_{number}")
        without, inside = (feasible(arm(), path, solver=each) for each in (free, held))
        row["feasible length [%]"] = 100.0 * without.share
        row["feasible length inside (4) [%]"] = 100.0 * inside.share
        row["feasible parts [m]"] = _parts(without)
        row["feasible parts inside (4) [m]"] = _parts(inside)
        row[BY_DEFINITION] = _is_part(number, whole=3)
        rows.append(row)
    for side, ends in SIDES.items():
        rows.append({**_counted(3, slice(*ends)), "poses": f"trajectory 3, {side} side"})
    return rows


def _is_part(number: int, whole: int) -> bool:
    """Whether a trajectory is the samples of another that meet condition (5), and no others."""
    T = trajectory(whole).T
    part, other = T[condition_5(lengths(), T).holds, :2, 3], trajectory(number).T[:, :2, 3]
    return number != whole and part.shape == other.shape and np.allclose(part, other, atol=1e-9)


def _counted(number: int, part: slice) -> Row:
    path = trajectory(number)
    T = path.T[part]
    five, six = condition_5(lengths(), T), condition_6(lengths(), T)
    inside = ~np.isnan(path.q[part, 0])
    return {
        "poses": f"trajectory {number}",
        "samples": len(T),
        "meet (5)": int(five.holds.sum()),
        "meet (6)": int(six.holds.sum()),
        "conditions agree": bool((five.holds == six.holds).all()),
        "meet (5) inside (4)": int((five.holds & inside).sum()),
        "least of (5) [m²]": float(five.value.min()),
        "greatest of (5) [m²]": float(five.value.max()),
    }


def _parts(found: Feasibility) -> str:
    return "; ".join(f"{part.start:.4f} to {part.end:.4f}" for part in found.feasible)


def _cells(quick: bool) -> list[Cell]:
    return [Cell("conditions", check_conditions)]


def _build(found: dict[str, list[Row]]) -> Table:
    rows = found["conditions"]
    claims = printed(STUDY_NAME, "trajectories").text("all_feasible")
    shown = [dict(row) for row in rows]
    for row, claim in zip(shown, claims, strict=False):
        row["all meet, printed"] = claim == "1"
        row["all meet, ours"] = row["meet (5)"] == row["samples"] == row["meet (6)"]
        row["all meet inside (4), ours"] = row["meet (5) inside (4)"] == row["samples"]
    checked = [row for row in shown[: len(claims)] if not row[BY_DEFINITION]]
    wrong, wrong_inside = (
        sum(row[ours] != row["all meet, printed"] for row in checked)
        for ours in ("all meet, ours", "all meet inside (4), ours")
    )
    verdict = Verdict.OTHER_READING if wrong_inside else Verdict.REPRODUCED
    differ = sum(not row["conditions agree"] for row in rows)
    second, fourth = rows[1], rows[3]
    return Table(
        title="Figures 7 to 14: samples that meet conditions (5) and (6)",
        rows=shown,
        verdict=Verdict.NOT_REPRODUCED if wrong else verdict,
        residual=(
            f"{wrong} of {len(checked)} statements about whole trajectories differ with conditions"
            f" (5) and (6) alone, {wrong_inside} of {len(checked)} with the ranges (4) held as"
            f" well; {len(claims) - len(checked)} more is true by definition"
        ),
        note=(
            f"Conditions (5) and (6) differ on {differ} rows: both say that the triangle of the"
            " first two links closes. With the joint ranges (4) held as well, trajectory 2 keeps"
            f" {second['meet (5) inside (4)']} of {second['samples']} samples and trajectory 4"
            f" {fourth['meet (5) inside (4)']} of {fourth['samples']}. Trajectory 3 is read as the"
            " rectangle's perimeter in steps of 0.01. Trajectory 4 is defined as its part that"
            " meets (5): that all of it does is true by definition and is not counted."
        ),
        pictures=(
            Picture(
                "Condition (5) along the trajectories (figures 7, 9, 11, 13)",
                _alt(rows, "the squared distance of the third joint between its bounds 9 and 289"),
                lambda: _draw("5"),
            ),
            Picture(
                "Condition (6) along the trajectories (figures 8, 10, 12, 14)",
                _alt(rows, "the squared second link between two bounds that move"),
                lambda: _draw("6"),
            ),
        ),
    )


def _alt(rows: list[Row], what: str) -> str:
    met = ", ".join(f"{row['meet (5)']} of {row['samples']}" for row in rows[:4])
    return f"Four graphs of {what}; met by {met} samples of trajectories 1 to 4, shaded elsewhere."


def _draw(condition: str) -> "Figure":
    figure = new_figure((10.0, 6.4))
    holds = {"5": condition_5, "6": condition_6}[condition]
    for ax, number in zip(figure.subplots(2, 2).ravel(), TRAJECTORIES, strict=True):
        path = trajectory(number)
        bounds = holds(lengths(), path.T)
        ax.plot(path.s, bounds.upper, "--", color="tab:red", lw=1.2, label="upper bound")
        ax.plot(path.s, bounds.value, color="tab:blue", lw=1.6, label="function")
        ax.plot(path.s, bounds.lower, ":", color="tab:green", lw=1.6, label="lower bound")
        _shade(ax, path.s, ~bounds.holds)
        ax.set_title(f"trajectory {number}: {bounds.holds.sum()} of {len(path.s)}", fontsize=10)
        ax.set_xlabel("way along it [m]")
        ax.set_ylabel("[m²]")
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _shade(ax: Any, s: NDArray[np.float64], wrong: NDArray[np.bool_]) -> None:
    low, high = ax.get_ylim()
    ax.fill_between(s, low, high, where=wrong, color="0.88", step="mid", zorder=0)
    ax.set_ylim(low, high)


CONDITIONS = TableSpec(
    "figs-7-14", "Feasibility of the trajectories (section 4.1, figures 7 to 14)", _cells, _build
)

"""Tables and pictures of the bees algorithm: section 7, figure 6, and all branches."""

from typing import TYPE_CHECKING

import numpy as np

from kinverse.paths import named_samples
from kinverse.studies.cell import Cell, Row, Value
from kinverse.studies.masajedi2013.bees import bees_along, every_branch
from kinverse.studies.masajedi2013.branches import branches_along, largest_step
from kinverse.studies.rows import as_number, quartiles
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PATHS", "SHOWN", "TABLES", "bees_cells", "chosen_q"]

PATHS = ("masajedi_straight", "masajedi_curved")
SHOWN = ("shoulder+ elbow+ wrist+", "shoulder- elbow+ wrist-")
"""Two branches that differ in shoulder and wrist, drawn and simulated."""
SEEDS = (201, 202, 203, 204, 205)
JOINTS = [f"theta{k}, deg" for k in range(1, 7)]
READINGS: dict[str, tuple[str, str, int, bool]] = {
    "as printed, radius of the range": ("position", "range", 20_000, False),
    "as printed, radius in rad": ("position", "own", 20_000, False),
    "as printed, ten times the evaluations": ("position", "range", 200_000, False),
    "full pose": ("pose", "range", 20_000, False),
    "full pose, ten times the evaluations": ("pose", "range", 200_000, False),
    "full pose, then a descent": ("pose", "range", 2_000, True),
}
"""Task, unit of the radius, evaluations a point, descent at the end."""
NEAR_MM, NEAR_DEG = 1.0, 1.0
SAME_DEG = 1e-4
"""Largest difference of two answers that are one."""
FOUND = 95.0
"""Share of the points [%] from which on a branch counts as found."""
ALONE = {
    "bees, position only": (f"bees-0-{PATHS[1]}-{SEEDS[0]}", "x", "0.6"),
    "bees, full pose": (f"bees-3-{PATHS[1]}-{SEEDS[0]}", "^", "tab:orange"),
}
"""Cells of figure 6 without a descent, with marker and colour."""


def bees_cells(quick: bool) -> list[Cell]:
    """A cell for each reading, path and seed."""
    cells = []
    for k, (task, unit, evaluations, polish) in enumerate(READINGS.values()):
        if quick and evaluations > 20_000:
            continue
        for path in PATHS:
            for seed in SEEDS[:2] if quick else SEEDS:
                arguments: dict[str, Value] = {
                    "path": path,
                    "task": task,
                    "radius_unit": unit,
                    "evaluations": evaluations,
                    "polish": polish,
                    "seed": seed,
                }
                cells.append(Cell(f"bees-{k}-{path}-{seed}", bees_along, arguments))
    return cells


def chosen_q(rows: list[Row]) -> np.ndarray:
    """Joint values (N, 6) [rad] of rows with columns ``theta1, deg`` ..."""
    return np.radians([[as_number(row, name) for name in JOINTS] for row in rows])


def _bees_table(rows: dict[str, list[Row]]) -> Table:
    table: list[Row] = []
    for path in PATHS:
        known, _ = branches_along(named_samples(path).T)
        for k, (name, (_, _, evaluations, _)) in enumerate(READINGS.items()):
            runs = [cell for key, cell in rows.items() if key.startswith(f"bees-{k}-{path}-")]
            if runs:
                table.append({"path": path, "reading": name, **_told(runs, evaluations)})
        steps = np.degrees([largest_step(q) for q in known])
        table.append(
            {
                "path": path,
                "reading": "a closed-form branch",
                "largest step of a joint, deg": float(np.median(steps)),
            }
        )
    printed_rows = [row for row in table if str(row["reading"]).startswith("as printed")]
    far = [as_number(row, "position error, median, mm") for row in printed_rows]
    away = [as_number(row, "from the nearest branch, median, deg") for row in printed_rows]
    return Table(
        title="Section 7: the bees algorithm at 21 accuracy points",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=f"as printed: {min(far):.2g} to {max(far):.2g} mm from the points,"
        f" {min(away):.0f} to {max(away):.0f} deg from the nearest of the eight solutions"
        " (medians)",
        note="The document prints neither coordinates nor errors; it says that the error is close"
        " to zero. Equation 31 holds the position alone, so its answers lie on a continuum: joint"
        " angles near one of the eight solutions need the orientation in the objective. The"
        " settings are those of section 6; the unit of the radius is not printed. Each point is"
        " searched by itself, so neighbours may lie on different branches: the largest step shows"
        " it. Distances count whole turns as none.",
    )


def _told(runs: list[list[Row]], evaluations: int) -> Row:
    def each(column: str) -> np.ndarray:
        return np.array([[as_number(row, column) for row in run] for run in runs])

    far, turned = each("position error, mm"), each("rotation error, deg")
    away = each("from the nearest branch, deg")
    steps = [np.degrees(largest_step(chosen_q(run))) for run in runs]
    return {
        "evaluations a point": evaluations,
        "seeds": len(runs),
        **_quartiles("position error", "mm", far),
        f"within {NEAR_MM:g} mm, %": 100.0 * float(np.mean(far <= NEAR_MM)),
        **_quartiles("rotation error", "deg", turned),
        **_quartiles("from the nearest branch", "deg", away),
        f"within {NEAR_DEG:g} deg of a branch, %": 100.0 * float(np.mean(away <= NEAR_DEG)),
        "largest step of a joint, deg": float(np.median(steps)),
    }


def _quartiles(what: str, unit: str, values: np.ndarray) -> Row:
    """Median and quartiles over points and seeds, each a column."""
    low, middle, high = quartiles(values)
    return {
        f"{what}, median, {unit}": middle,
        f"{what}, lower quartile, {unit}": low,
        f"{what}, upper quartile, {unit}": high,
    }


def _branch_cells(quick: bool) -> list[Cell]:
    return [
        Cell(f"branches-{path}-{seed}", every_branch, {"path": path, "seed": seed})
        for path in PATHS
        for seed in (SEEDS[:1] if quick else SEEDS)
    ]


def _branch_table(rows: dict[str, list[Row]]) -> Table:
    table: list[Row] = []
    for path in PATHS:
        known, labels = branches_along(named_samples(path).T)
        runs = [cell for key, cell in rows.items() if key.startswith(f"branches-{path}-")]
        for k, label in enumerate(labels):
            mine = [[row for row in run if row["branch"] == label] for run in runs]
            gaps = np.array([[as_number(row, "gap, deg") for row in run] for run in mine])
            table.append(
                {
                    "path": path,
                    "branch": label,
                    "seeds": len(runs),
                    "points where bees found it, %": 100.0 * float(np.mean(gaps < SAME_DEG)),
                    "largest difference from the closed form, deg": float(gaps.max()),
                    "largest step, closed form, deg": float(np.degrees(largest_step(known[k]))),
                    "largest step, bees, deg": float(
                        np.degrees(max(largest_step(chosen_q(run)) for run in mine))
                    ),
                }
            )
    shares = [as_number(row, "points where bees found it, %") for row in table]
    found = sum(share >= FOUND for share in shares)
    return Table(
        title="Section 7: eight answers for every accuracy point",
        rows=table,
        verdict=Verdict.OTHER_READING if found == len(table) else Verdict.NOT_REPRODUCED,
        residual=f"{found} of {len(table)} branches found at {FOUND:g} % of their points or more;"
        f" the fewest points: {min(shares):.3g} %",
        note="The document speaks of eight solutions. Another reading: the full pose, searches that"
        " shun the solutions known so far, and a descent at the end; the objective as printed, the"
        " position alone, does not tell branches apart. An answer is a branch's if no joint is"
        f" {SAME_DEG:g} deg from the closed form. Paths are ours.",
    )


def _figure_6_cells(quick: bool) -> list[Cell]:
    wanted = [cell for cell, _, _ in ALONE.values()]
    return [cell for cell in bees_cells(quick) if cell.name in wanted] + [
        cell for cell in _branch_cells(quick) if cell.name == f"branches-{PATHS[1]}-{SEEDS[0]}"
    ]


def _figure_6_table(rows: dict[str, list[Row]]) -> Table:
    known, labels = branches_along(named_samples(PATHS[1]).T)
    table: list[Row] = []
    found = rows[f"branches-{PATHS[1]}-{SEEDS[0]}"]
    for label in SHOWN:
        exact = known[labels.index(label)]
        q = chosen_q([row for row in found if row["branch"] == label])
        gap = np.abs((q - exact + np.pi) % (2 * np.pi) - np.pi).max(axis=0)
        for joint in range(6):
            table.append(
                {
                    "branch": label,
                    "joint": joint + 1,
                    "from, deg": float(np.degrees(exact[:, joint].min())),
                    "to, deg": float(np.degrees(exact[:, joint].max())),
                    "largest difference, deg": float(np.degrees(gap[joint])),
                }
            )
    worst = max(as_number(row, "largest difference, deg") for row in table)
    alone = {
        task: float(
            np.median([as_number(row, "from the nearest branch, deg") for row in rows[cell]])
        )
        for task, (cell, _, _) in ALONE.items()
    }
    away = ", ".join(f"{task}: {value:.2g} deg" for task, value in alone.items())
    picture = Picture(
        "Joint angles along the curved path, as in figure 6",
        f"Six panels, one a joint: lines of the branches {SHOWN[0]} and {SHOWN[1]}, and the bees'"
        f" answers, at most {worst:.1g} deg off. Answers of the bees by themselves are away from"
        f" the nearest of the eight branches, median: {away}.",
        lambda: _figure_6(rows),
    )
    return Table(
        title="Figure 6: joint angles of two branches",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=f"bees with the full pose and a descent: {worst:.1g} deg from the closed form",
        note="The document shows two sets of joint angles for one path, bees beside ADAMS, without"
        " numbers. Here the closed form stands for ADAMS.",
        pictures=(picture,),
    )


def _figure_6(rows: dict[str, list[Row]]) -> "Figure":
    from kinverse.plots import new_figure

    known, labels = branches_along(named_samples(PATHS[1]).T)
    points = np.arange(1, known.shape[1] + 1)
    figure = new_figure((10.0, 6.4))
    found = rows[f"branches-{PATHS[1]}-{SEEDS[0]}"]
    for joint, axes in enumerate(figure.subplots(2, 3, sharex=True).ravel()):
        for name, (cell, marker, colour) in ALONE.items():
            values = _principal(np.degrees(chosen_q(rows[cell])[:, joint]))
            axes.plot(points, values, marker, ms=4, color=colour, mfc="none", label=name)
        for label, colour in zip(SHOWN, ("tab:red", "tab:blue"), strict=True):
            exact = np.degrees(known[labels.index(label)][:, joint])
            q = chosen_q([row for row in found if row["branch"] == label])[:, joint]
            turned = np.degrees(q) + 360.0 * np.round((exact - np.degrees(q)) / 360.0)
            axes.plot(points, exact, color=colour, label=f"closed form, {label}")
            axes.plot(points, turned, "o", ms=4, color=colour, label="bees, pose and descent")
        axes.set_title(f"joint {joint + 1}", fontsize=10)
        axes.grid(alpha=0.3)
        if joint % 3 == 0:
            axes.set_ylabel("angle [deg]")
        if joint > 2:
            axes.set_xlabel("accuracy point")
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _principal(angle: np.ndarray) -> np.ndarray:
    return (angle + 180.0) % 360.0 - 180.0


TABLES = (
    TableSpec("bees", "Section 7: bees at 21 accuracy points", bees_cells, _bees_table),
    TableSpec("branches", "Section 7: eight answers a point", _branch_cells, _branch_table),
    TableSpec("fig-6", "Figure 6: joint angles", _figure_6_cells, _figure_6_table),
)

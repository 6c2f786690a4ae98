"""Figures 7 to 9: the tool between the points, in the simulator, and what the joints carry."""

from collections.abc import Callable

import numpy as np

from kinverse.studies.cell import Cell, Row
from kinverse.studies.masajedi2013.bees_tables import PATHS, SHOWN
from kinverse.studies.masajedi2013.motion import (
    APART,
    BY_ITSELF,
    LARGEST,
    ON,
    RMS,
    SECONDS,
    interpolated,
    moved,
)
from kinverse.studies.masajedi2013.motion_pictures import figure_7, figure_8, figure_9
from kinverse.studies.rows import as_number
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

__all__ = ["TABLES", "compared"]

SEEDS = (301, 302, 303)
BEES = (f"{ON}{SHOWN[0]}", f"{ON}{SHOWN[1]}")
ALL = (*SHOWN, *BEES, *BY_ITSELF)


def _cells(function: Callable[..., list[Row]], sources: tuple[str, ...], quick: bool) -> list[Cell]:
    """A cell for each path, kind of joint values and seed."""
    cells = []
    for path in PATHS:
        for source in sources:
            for seed in _seeds(source, quick):
                name = f"{function.__name__}-{path}-{ALL.index(source)}-{seed}"
                cells.append(Cell(name, function, {"path": path, "source": source, "seed": seed}))
    return cells


def _between_cells(quick: bool) -> list[Cell]:
    return _cells(interpolated, (*SHOWN, *BEES), quick)


def _seeds(source: str, quick: bool) -> tuple[int, ...]:
    """The closed form has no seed."""
    if not source.startswith("bees"):
        return SEEDS[:1]
    return SEEDS[:1] if quick else SEEDS


def _between_table(rows: dict[str, list[Row]]) -> Table:
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in (row for cell in rows.values() for row in cell):
        groups.setdefault((row["path"], row["joint values"], row["degree"]), []).append(row)
    table: list[Row] = []
    for (path, source, degree), group in groups.items():
        strays = [as_number(row, "between them, largest, mm") for row in group]
        table.append(
            {
                "path": str(path),
                "joint values": str(source),
                "degree": int(str(degree)),
                "seeds": len(group),
                "at the points, largest, mm": _median(group, "at the points, largest, mm"),
                "between them, largest, mm": float(np.median(strays)),
                "between them, best seed, mm": min(strays),
                "between them, worst seed, mm": max(strays),
            }
        )
    exact = [row for row in table if row["joint values"] in SHOWN and row["degree"] == 6]
    worst = max(as_number(row, "between them, largest, mm") for row in exact)
    picture = Picture(
        "Coordinates of the tool along the curved path, as in figure 7",
        "Three panels, x, y and z of the tool against the share of the path: the path as a line,"
        " the 21 accuracy points as dots on it, and beneath each how far splines of degree 3, 5 and"
        f" 6 through the joint values stray, below {max(1.0, worst):.2g} mm.",
        figure_7,
    )
    return Table(
        title="Figure 7: the tool between the accuracy points",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=f"closed form, degree 6: at most {worst:.2g} mm off between the points",
        note="The document joins the joint values of 21 points by interpolation of sixth order"
        " (degree 5 or 6) and shows the tool's coordinates without numbers. Bees on a branch search"
        " the full pose within 10 degrees of the last answer, which is ours.",
        pictures=(picture,),
    )


def _motion_cells(quick: bool) -> list[Cell]:
    return _cells(moved, ALL, quick)


def _motion_table(rows: dict[str, list[Row]]) -> Table:
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in (row for cell in rows.values() for row in cell if row["kind"] == "motion"):
        groups.setdefault((row["path"], row["joint values"], row["drive"]), []).append(row)
    table: list[Row] = []
    for (path, source, drive), group in groups.items():
        table.append(
            {
                "path": str(path),
                "joint values": str(source),
                "drive": str(drive),
                "seeds": len(group),
                "ran to the end, %": 100.0
                * float(np.mean([bool(r["ran to the end"]) for r in group])),
                RMS: _median(group, RMS),
                LARGEST: _median(group, LARGEST),
                APART: _median(group, APART),
                "why not": "; ".join(dict.fromkeys(str(r["reason"]) for r in group if r["reason"])),
            }
        )
    by = {(row["path"], row["joint values"], row["drive"]): row for row in table}
    exact = [by[path, source, "joints"] for path in PATHS for source in SHOWN]
    near = [by[path, source, "joints"] for path in PATHS for source in BEES]
    alone = [by[path, source, "joints"] for path in PATHS for source in BY_ITSELF]
    told = {
        "closed form": _range(exact),
        "bees that stay on the branch": _range(near),
        "bees by themselves": _range(alone),
    }
    words = "; ".join(f"{name} {values}" for name, values in told.items())
    picture = Picture(
        "Distance of the tool from the curved path in the simulator, as in figure 8",
        f"Distance against time on a logarithmic scale. Largest of both paths: {words}.",
        lambda: figure_8(_drawn(rows)),
    )
    return Table(
        title="Figure 8: joint angles as motor input in the simulator",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=f"largest error: {words}",
        note=f"MuJoCo stands for ADAMS: {SECONDS:g} s from rest to rest, links of 40 kg a metre"
        " (both ours, the document prints neither), splines of degree 5 through the 21 points."
        " Drive joints: the joint angles are the input, and the tool is measured. Drive tool: the"
        " tool is held to the path and the joints, which turn freely, are measured. The document"
        " reports an error close to zero. Bees on a branch search within 10 degrees of the last"
        " answer, which is ours; each point by itself, as printed, they jump between branches, and"
        " where a spline through the jumps leaves the joint limits there is no motion.",
        pictures=(picture,),
    )


def _drawn(rows: dict[str, list[Row]]) -> dict[str, list[Row]]:
    """Cells of the curved path and the first seed, by the kind of joint values."""
    names = {source: f"moved-{PATHS[1]}-{k}-{SEEDS[0]}" for k, source in enumerate(ALL)}
    return {source: rows[name] for source, name in names.items() if name in rows}


def _range(rows: list[Row]) -> str:
    """Largest errors [mm] from the least to the greatest; motions that there are not are told."""
    values = [as_number(row, LARGEST) for row in rows if row[LARGEST] is not None]
    told = f"{min(values):.2g} to {max(values):.2g} mm" if values else "unknown"
    none = len(rows) - len(values)
    return told if not none else f"{told}, no motion in {none} of {len(rows)}"


def _median(rows: list[Row], column: str) -> float | None:
    """Of the rows that have a number there."""
    values = [as_number(row, column) for row in rows if row[column] is not None]
    return float(np.median(values)) if values else None


def _force_cells(quick: bool) -> list[Cell]:
    return _cells(moved, SHOWN, quick)


def _force_table(rows: dict[str, list[Row]]) -> Table:
    table: list[Row] = []
    for cell in rows.values():
        for row in cell:
            if row["kind"] == "joint":
                table.append({key: value for key, value in row.items() if key != "kind"})
    told = compared(table)
    words = "; ".join(
        f"{row['tool held']} against {row['joints driven']}: more uniform at"
        f" {row['more uniform']} of {row['of']} joints, greater at {row['greater']}"
        for row in told
    )
    picture = Picture(
        "Forces that the joints pass on along the curved path, as in figure 9",
        "Six panels, one a joint: force against time of two branches, joints driven and tool held."
        f" Over both paths, tool held beside joints driven: {words}.",
        lambda: figure_9(_drawn(rows)),
    )
    return Table(
        title="Figure 9: forces and torques of the joints, two branches",
        rows=table,
        verdict=Verdict.CANNOT_CHECK,
        residual=words,
        note="The document says that forces with the values of ADAMS are more uniform and greater"
        " than those with the bees' values; it prints no number, mass, time or path. Here the tool"
        " held to its path stands for ADAMS, joints driven for the bees, whose values on a branch"
        " are the closed form's after a descent. Force: what a joint passes on to the links behind"
        " it, from the measured motion by Newton's second law, with the force on the tool."
        " Uniformity is rms over peak: 1 where the load never changes.",
        pictures=(picture,),
    )


def compared(table: list[Row]) -> list[Row]:
    """At how many joints of both paths the held tool's forces are more uniform, and greater.

    Args:
        table: rows of joints with path, joint values, drive, "force, uniformity" and peaks.
    """
    by = {(r["path"], r["joint values"], r["drive"], r["joint"]): r for r in table}
    paths = dict.fromkeys(row["path"] for row in table)
    out: list[Row] = []
    for held in SHOWN:
        for driven in SHOWN:
            pairs = [
                (by[path, held, "tool", k], by[path, driven, "joints", k])
                for path in paths
                for k in range(1, 7)
            ]
            row: Row = {"tool held": held, "joints driven": driven, "of": len(pairs)}
            for name, column in (
                ("more uniform", "force, uniformity"),
                ("greater", "force, peak, N"),
            ):
                row[name] = sum(as_number(a, column) > as_number(b, column) for a, b in pairs)
            out.append(row)
    return out


TABLES = (
    TableSpec("fig-7", "Figure 7: the tool between the points", _between_cells, _between_table),
    TableSpec("fig-8", "Figure 8: the motion in the simulator", _motion_cells, _motion_table),
    TableSpec("fig-9", "Figure 9: forces of the joints", _force_cells, _force_table),
)

"""Figure 4: what the tool reaches under the joint ranges (4)."""

import numpy as np

from kinverse.studies.cell import Cell, Row
from kinverse.studies.habibkhah2021.arm import arm
from kinverse.studies.rows import as_number
from kinverse.studies.table import Picture, Table, TableSpec, Verdict
from kinverse.workspace import PlanarWorkspace, workspace_figure

__all__ = ["WORKSPACE", "describe_workspace"]

POINTS, SEED = 20_000, 30_000


def describe_workspace() -> list[Row]:
    """The exact edge, arc by arc, and random postures held against it."""
    space = PlanarWorkspace(arm())
    dots = space.points(POINTS, rng=SEED)
    rows: list[Row] = [
        {
            "part": "whole",
            "area_m2": space.area,
            "annulus_m2": float(np.pi * (space.annulus[1] ** 2 - space.annulus[0] ** 2)),
            "postures": POINTS,
            "outside": int((~space.reaches(dots)).sum()),
        }
    ]
    for arc in space.boundary:
        row: Row = {
            "part": "arc",
            "centre x [m]": round(arc.center[0], 12),
            "centre y [m]": round(arc.center[1], 12),
        }
        row |= {"radius [m]": arc.radius, "from [deg]": float(np.degrees(arc.start))}
        row |= {"to [deg]": float(np.degrees(arc.end)), "reached": arc.reached}
        rows.append(row)
    return rows


def _cells(quick: bool) -> list[Cell]:
    return [Cell("workspace", describe_workspace)]


def _build(found: dict[str, list[Row]]) -> Table:
    whole, *arcs = found["workspace"]
    area, disc = as_number(whole, "area_m2"), as_number(whole, "annulus_m2")
    return Table(
        title="Figure 4: the workspace under the joint ranges (4), its exact edge",
        rows=[{k: v for k, v in row.items() if k != "part"} for row in arcs],
        verdict=Verdict.CANNOT_CHECK,
        residual=(
            f"the figure is not in the text; {whole['outside']} of {whole['postures']} random"
            " postures outside our edge"
        ),
        note=(
            f"The edge is {len(arcs)} arcs about an area of {area:.2f} m²"
            f" ({100 * area / disc:.1f} % of what the links would reach without the ranges)."
            " The document prints no unit of length; its numbers are read as metres."
        ),
        pictures=(
            Picture(
                "What the tool reaches, and with which share of its directions",
                f"Random postures of the arm fill an area of {area:.0f} m² inside a red edge of"
                f" {len(arcs)} arcs; the colour, the share of directions of the last link that"
                " can be had, is greatest close to the first joint.",
                lambda: workspace_figure(PlanarWorkspace(arm()), points=4000, orientations=36),
            ),
        ),
    )


WORKSPACE = TableSpec("fig-4", "Workspace (section 2.2, figure 4)", _cells, _build)

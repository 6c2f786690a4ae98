"""Figures of several regions side by side: rows, columns, pictures."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Row, Value
from kinverse.studies.chiddarwar2010.poses import REGIONS, region_name
from kinverse.studies.rows import Spread

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "ByRegion",
    "columns",
    "draw_by_region",
    "grouped",
    "in_words",
    "tried",
]

ByRegion = dict[float, Spread]
"""By half width [deg]."""


def grouped(rows: Iterable[Row], *keys: str) -> dict[tuple[Value, ...], list[Row]]:
    """Rows by the values of these columns, in the order they come."""
    groups: dict[tuple[Value, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return groups


def columns(found: ByRegion, unit: str) -> Row:
    """Medians and quartiles for each region that was run, and how many seeds they are of."""
    row: Row = {"seeds": min(spread.size for spread in found.values())}
    for half in REGIONS:
        if half in found:
            row |= found[half].columns(f"{region_name(half)} [{unit}]")
    return row


def tried(rows: Iterable[Row]) -> str:
    """The regions of rows, in words.

    Example:
        >>> tried([{"half_deg": 2.0}, {"half_deg": 180.0}])
        '±2 deg, whole workspace'
    """
    halves = {row["half_deg"] for row in rows}
    return ", ".join(region_name(half) for half in REGIONS if half in halves)


def in_words(lines: dict[str, ByRegion], unit: str) -> str:
    """Each line's medians in its smallest and its widest region, for those who cannot see it."""
    parts = []
    for name, found in lines.items():
        ends = dict.fromkeys((min(found), max(found)))
        said = [f"{found[half].median:.2g} {unit} ({region_name(half)})" for half in ends]
        parts.append(f"{name} {' to '.join(said)}")
    return "Medians on a logarithmic scale by region: " + "; ".join(parts) + "."


def draw_by_region(
    lines: dict[str, ByRegion], printed: dict[str, tuple[float, float]], label: str
) -> "Figure":
    """Lines with quartile bars over regions, one of each name, and printed ranges as bands.

    Args:
        lines: by name.
        printed: least and greatest printed number by the name of a line.
        label: of the vertical axis, with its unit.
    """
    figure = new_figure((8.0, 4.6))
    ax = figure.subplots()
    for k, (name, found) in enumerate(lines.items()):
        colour = f"C{k}"
        halves = [half for half in REGIONS if half in found]
        at = np.array([REGIONS.index(half) for half in halves]) + 0.06 * (k - len(lines) / 2)
        middle = np.array([found[half].median for half in halves])
        low = middle - [found[half].low for half in halves]
        high = np.array([found[half].high for half in halves]) - middle
        ax.errorbar(at, middle, [low, high], fmt="o-", color=colour, label=name, capsize=3, lw=1.2)
        if name in printed:
            ends = printed[name]
            ax.axhspan(ends[0], ends[1], color=colour, alpha=0.15, lw=0)
    ax.set_yscale("log")
    ax.set_xlim(-0.4, len(REGIONS) - 0.6)
    ax.set_xticks(range(len(REGIONS)), [region_name(half) for half in REGIONS])
    ax.set_xlabel("region of the joints")
    ax.set_ylabel(label)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize="small")
    return figure

"""Rows of the comparison brought together: medians and quartiles over arms and seeds."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from kinverse.studies.cell import Row
from kinverse.studies.rows import quartiles
from kinverse.studies.summary.arms import SITUATIONS
from kinverse.studies.summary.methods import BUDGET, CALLS

__all__ = ["by_arm", "by_situation", "cannot_spend", "overall"]

SPENT = 0.99
"""Share of the budget from which it counts as spent."""


def by_arm(rows: Iterable[Row]) -> list[Row]:
    """One row an arm, task and method: over the seeds of targets and solvers."""
    out: list[Row] = []
    for group in _groups(rows, "arm", "task", "method"):
        first = group[0]
        row: Row = {key: first[key] for key in ("arm", "task", "situation", "method")}
        if "reason" in first:
            out.append({**row, "reason": first["reason"]})
            continue
        out.append(
            {
                **row,
                **_spread(group, "solved, %", "solved", " %"),
                **_spread(group, "position error, median", "position error", " mm", 1e3),
                "position error, 95 % below, mm": _scaled(group, "position error, 95 %", 1e3),
                "rotation error, deg": _scaled(group, "rotation error, median", 180 / np.pi),
                "rotation error, 95 % below, deg": _scaled(
                    group, "rotation error, 95 %", 180 / np.pi
                ),
                **_spread(group, "seconds a pose", "time a pose", " ms", 1e3),
                "solutions a pose": _scaled(group, "solutions a pose"),
                "evaluations": _scaled(group, "evaluations, median"),
                "evaluations, most": max(int(r["evaluations, most"] or 0) for r in group),
                "training, s": _scaled(group, "seconds to fit"),
                "reason": "",
            }
        )
    return out


def by_situation(rows: Iterable[Row]) -> list[Row]:
    """One row a situation and method: over its arms and all seeds."""
    groups = _groups(rows, "situation", "method")
    out = [_overview(group, group[0]["situation"]) for group in groups]
    return sorted(out, key=lambda row: SITUATIONS.index(str(row["situation"])))


def overall(rows: Iterable[Row]) -> list[Row]:
    """One row a method: over all arms, tasks and seeds."""
    return [_overview(group, "all") for group in _groups(rows, "method")]


def cannot_spend(rows: Iterable[Row]) -> list[str]:
    """Methods that on no pose of any arm use up the budget."""
    most: dict[str, int] = {}
    for row in rows:
        if "reason" not in row:
            name = str(row["method"])
            most[name] = max(most.get(name, 0), int(row["evaluations, most"] or 0))
    return [name for name, count in most.items() if count < SPENT * BUDGET]


def _overview(group: list[Row], situation: Any) -> Row:
    done = [row for row in group if "reason" not in row]
    cases = {(row["arm"], row["task"]) for row in group}
    solved = {(row["arm"], row["task"]) for row in done}
    return {
        "situation": situation,
        "method": group[0]["method"],
        "family": group[0]["family"],
        "call": CALLS[str(group[0]["method"])],
        "arms it applies to": len(solved),
        "arms": len(cases),
        "targets an arm": int(str(group[0]["targets"])),
        "seeds": len({row["seed of targets"] for row in group}),
        **_spread(done, "solved, %", "solved", " %"),
        "solved, lowest of an arm, %": _lowest(done),
        **{
            name: value
            for name, value in _errors(done, "median", "median").items()
            if "quartile" not in name
        },
        **_errors(done, "95 %", "95 % below"),
        **_spread(done, "seconds a pose", "time a pose", " ms", 1e3),
        "solutions a pose": _scaled(done, "solutions a pose"),
        "training, s": _scaled(done, "seconds to fit"),
    }


def _errors(rows: list[Row], column: str, name: str) -> Row:
    """Errors of arms of all sizes: of the position by reach, of the rotation where it counts."""
    far, turned = f"position error, {column}", f"rotation error, {column}"
    by_reach: list[Row] = [
        {far: None if row[far] is None else _number(row[far]) / _number(row["reach, m"])}
        for row in rows
    ]
    poses = [row for row in rows if row["task"] == "pose"]
    return {
        **_spread(by_reach, far, f"position error, {name}", " % of reach", 100.0),
        **_spread(poses, turned, f"rotation error, {name}", " deg", 180 / np.pi),
    }


def _lowest(rows: list[Row]) -> float | None:
    """Of the arms the one with the least share solved: all its seeds have as many targets."""
    means = [
        np.mean([_number(row["solved, %"]) for row in arm]) for arm in _groups(rows, "arm", "task")
    ]
    return float(min(means)) if means else None


def _groups(rows: Iterable[Row], *keys: str) -> list[list[Row]]:
    """Rows with the same values of some columns, in the order in which they come first."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[key] for key in keys), []).append(row)
    return list(found.values())


def _spread(rows: list[Row], column: str, name: str, unit: str, scale: float = 1.0) -> Row:
    """Median and quartiles; None where infinite or not there."""
    values = [_number(row[column]) for row in rows if row[column] is not None]
    gone = sum(row[column] is None for row in rows)
    if not values or gone > len(rows) // 4:
        low = middle = high = None
    else:
        # an error that has no bound counts as the greatest
        filled = np.array(values + [np.inf] * gone) * scale
        with np.errstate(invalid="ignore"):  # between two errors without a bound
            low, middle, high = (x if np.isfinite(x) else None for x in quartiles(filled))
    return {
        f"{name},{unit}": middle,
        f"{name}, lower quartile,{unit}": low,
        f"{name}, upper quartile,{unit}": high,
    }


def _scaled(rows: list[Row], column: str, scale: float = 1.0) -> float | None:
    values = [_number(row[column]) for row in rows if row.get(column) is not None]
    return scale * float(np.median(values)) if values else None


def _number(value: Any) -> float:
    return float(value)

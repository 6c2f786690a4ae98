"""Tables 7.1 to 7.37 that print joint values with positions, and what holds of them."""

from collections.abc import Sequence
from functools import partial
from itertools import groupby
from statistics import median

import numpy as np

from kinverse.studies.cell import Row
from kinverse.studies.jha2015.arms import source
from kinverse.studies.jha2015.forward_kinematics import CASES, Case
from kinverse.studies.jha2015.units import METRES
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES"]

Rows = list[Row]


def _build(case: Case, rows: dict[str, Rows]) -> Table:
    """The table under the printed and the inferred reading that come nearest."""
    readings = [list(group) for _, group in groupby(rows[case.cell.name], _reading)]
    best = min(readings, key=_middle)
    unit = str(best[0]["unit"])
    same = [reading for reading in readings if reading[0]["unit"] == unit]
    theirs = min((r for r in same if "inferred" not in _arm(r)), key=_middle)
    inferred = min((r for r in same if "inferred" in _arm(r)), key=_middle, default=None)
    signs = [_sign_that_fits(row) for row in best]
    holds = [_holds(row) or bool(sign) for row, sign in zip(best, signs, strict=True)]
    # by chance no row holds: that most do settles the geometry, the others are named
    verdict = Verdict.NOT_REPRODUCED
    if best is theirs and all(map(_holds, best)):
        verdict = Verdict.REPRODUCED
    elif sum(holds) > len(holds) / 2:
        verdict = Verdict.OTHER_READING
    notes = [_told(theirs, "Printed geometry")]
    if inferred is not None:
        notes.append(_told(inferred, "Inferred geometry"))
    notes.append(f"{sum(map(_holds, best))} of {len(best)} rows hold within one unit of print.")
    if verdict is Verdict.NOT_REPRODUCED:
        tried = dict.fromkeys(", ".join(_reading(reading[0])[1:]) for reading in readings)
        notes.append(f"Read as {'; '.join(tried)}: the nearest is shown, compared as lengths.")
    for row, axis, ok in zip(best, signs, holds, strict=True):
        if axis:
            notes.append(f"Row {row['row']} holds with the opposite sign of {axis}.")
        elif not ok and verdict is Verdict.OTHER_READING:
            off = _number(row, "distance")
            notes.append(f"Row {row['row']} is off by {_short(off)} {unit}.")
    notes.extend(_axis_alone(best, unit))
    far = [_number(row, "distance") for row, sign in zip(best, signs, strict=True) if not sign]
    pairs = zip(best, signs, strict=True)
    turned = [f"row {row['row']} with the opposite sign of {sign}" for row, sign in pairs if sign]
    return Table(
        title=_title(case),
        rows=[_shown(*lines) for lines in zip(best, theirs, inferred or theirs, strict=True)],
        verdict=verdict,
        residual=f"{_short(median(far))} {unit} median, {_short(max(far))} {unit} at most"
        + "".join(f"; {told}" for told in turned),
        note=" ".join(notes),
    )


def _title(case: Case) -> str:
    return f"Table {case.table}: joint values and positions of the {case.robot}"


def _reading(row: Row) -> tuple[str, str, str]:
    return str(row["arm"]), str(row["convention"]), str(row["unit"])


def _arm(reading: Rows) -> str:
    return str(reading[0]["arm"])


def _number(row: Row, column: str) -> float:
    value = row[column]
    assert isinstance(value, float)
    return value


def _holds(row: Row) -> bool:
    return _number(row, "distance") <= _number(row, "allowed")


def _middle(reading: Rows) -> float:
    """Median distance [m]: readings in different units are compared as lengths."""
    return METRES[str(reading[0]["unit"])] * median(_number(row, "distance") for row in reading)


def _axes(row: Row) -> list[str]:
    return [axis for axis in "XYZ" if f"{axis} ours" in row]


def _sign_that_fits(row: Row) -> str:
    """The axis whose opposite sign makes a row hold that does not; empty if there is none."""
    off = np.array([_number(row, f"{a} ours") - _number(row, f"{a} printed") for a in _axes(row)])
    if _holds(row):
        return ""
    for k, axis in enumerate(_axes(row)):
        turned = off.copy()
        turned[k] = _number(row, f"{axis} ours") + _number(row, f"{axis} printed")
        if np.linalg.norm(turned) <= _number(row, "allowed"):
            return axis
    return ""


def _axis_alone(reading: Rows, unit: str) -> list[str]:
    """Axes that hold by themselves in every row where the position does not."""
    if any(map(_holds, reading)):
        return []
    told = []
    for axis in _axes(reading[0]):
        off = [abs(_number(r, f"{axis} ours") - _number(r, f"{axis} printed")) for r in reading]
        if all(d <= _number(r, "allowed") for d, r in zip(off, reading, strict=True)):
            told.append(f"{axis} alone holds in every row ({_short(max(off))} {unit} at most).")
    return told


def _told(reading: Rows, kind: str) -> str:
    name, convention, unit = _reading(reading[0])
    far = [_number(row, "distance") for row in reading]
    return (
        f"{kind} ({source(name)}, {convention} rows, positions read as {unit}): distance"
        f" {_short(median(far))} {unit} in the median, {_short(max(far))} {unit} at most."
    )


def _shown(best: Row, theirs: Row, inferred: Row) -> Row:
    """One line of the table; the three readings have one unit."""
    unit = best["unit"]
    made: Row = {"row": best["row"]}
    for kind in ("printed", "ours"):
        made.update({f"{a} {kind}, {unit}": best[f"{a} {kind}"] for a in _axes(best)})
    made[f"off, printed geometry, {unit}"] = theirs["distance"]
    if inferred is not theirs:
        made[f"off, inferred geometry, {unit}"] = inferred["distance"]
    made[f"one unit of print, {unit}"] = best["allowed"]
    return made


def _short(value: float) -> str:
    return f"{value:.3g}"


def _spec(case: Case) -> TableSpec:
    return TableSpec(case.table, _title(case), lambda quick: [case.cell], partial(_build, case))


TABLES: Sequence[TableSpec] = tuple(map(_spec, CASES))

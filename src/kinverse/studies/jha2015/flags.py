"""Properties of the numbers printed in chapter 7, each counted by code.

They say what the numbers are, not why. The text is a copy by optical character recognition: some
entries were repaired there, which the data files note.
"""

from collections.abc import Iterator

import numpy as np

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import Printed, printed
from kinverse.studies.jha2015.arms import printed_limits
from kinverse.studies.jha2015.forward_kinematics import (
    joint_columns,
    last_place,
    position_columns,
)
from kinverse.studies.jha2015.printed_values import configuration_flags, error_flags, grid_flags
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES", "flag_rows"]

ARMS = {
    "planar3r_7.2.1": ("7.1",),
    "scara": ("7.3", "7.25", "7.26"),
    "5r": ("7.7", "7.27", "7.28"),
    "puma560": ("7.14", "7.30", "7.31"),
    "irb1400": ("7.17", "7.33", "7.34"),
    "irb6": ("7.20", "7.35", "7.36"),
    "rx160l": ("7.23", "7.37", "7.38"),
}
"""Which limits the joint values of a table are held against."""
SEARCHES = ("7.26", "7.28", "7.31", "7.34", "7.36", "7.38")
"""Tables of joint values with function values of population searches."""
SHORTER = (("7.33", "7.17"), ("7.35", "7.20"), ("7.37", "7.23"))
"""Tables of five positions, and those of the network chapter with the same joint values."""
ROUND = (0.0, 1.0, *(10.0 * k for k in range(1, 11)))


def flag_rows() -> list[Row]:
    """A row for each property: table, flag, how many entries have it, of how many, and which."""
    found = [*_outside_limits(), *_negative_norms(), *error_flags(), *_repeated_joints()]
    found += [*_equal_sums(), *_same_positions(), *_shorter(), *_near_copies(), *grid_flags()]
    return [*found, *configuration_flags()]


def _data(table: str) -> Printed:
    return printed("jha2015", f"table_{table.replace('.', '_')}")


def _flag(table: str, flag: str, count: int, of: int, detail: str = "") -> Row:
    return {"table": table, "flag": flag, "count": count, "of": of, "detail": detail}


def _outside_limits() -> Iterator[Row]:
    for name, tables in ARMS.items():
        low, high = printed_limits(name).T
        for table in tables:
            rows = _data(table)
            heads = [head for head in joint_columns(rows) if "mlp" not in head]
            q = rows.numbers(heads)
            outside = (q < low) | (q > high)
            told = f"{outside.any(axis=1).sum()} of {len(rows)} rows; by joint"
            told += f" {', '.join(str(count) for count in outside.sum(axis=0))}"
            yield _flag(table, "outside the printed limits", int(outside.sum()), q.size, told)


def _negative_norms() -> Iterator[Row]:
    for table in SEARCHES:
        value = _data(table).numbers(["function_value"])[:, 0]
        told = f"most negative {value.min():.8g}; {np.sum(value == 0)} zeros;"
        told += f" {np.sum(np.abs(value) <= 0.01)} of size 0.01 or less"
        what = "negative function value (the objective, equation 6.28, is a norm)"
        yield _flag(table, what, int(np.sum(value < 0)), len(value), told)


def _repeated_joints() -> Iterator[Row]:
    """Algorithms whose rows have one value at two joints, but for the last printed place."""
    for table in SEARCHES:
        rows = _data(table)
        heads = joint_columns(rows)
        algorithms = np.array(rows.text("algorithm"))
        q = rows.numbers(heads)
        for later in range(len(heads)):
            for first in range(later):
                place = last_place(rows, [heads[first], heads[later]]).max(axis=1)
                same = np.abs(q[:, first] - q[:, later]) <= place + 1e-9
                names = dict.fromkeys(algorithms.tolist())
                whole = [name for name in names if same[algorithms == name].all()]
                same &= np.isin(algorithms, whole)
                if whole:
                    flag = f"{_short(heads[later])} repeats {_short(heads[first])}"
                    told = f"all rows of {', '.join(whole)}"
                    yield _flag(table, flag, int(same.sum()), len(rows), told)


def _equal_sums() -> Iterator[Row]:
    """Rows of table 7.1 whose joint angles have the same sum, but for the last printed places."""
    rows = _data("7.1")
    heads = joint_columns(rows)
    total = rows.numbers(heads).sum(axis=1)
    middle = float(np.median(total))
    off = np.abs(total - middle)
    same = off <= last_place(rows, heads).sum(axis=1) / 2.0 + 1e-9
    what = f"{' + '.join(map(_short, heads))} is {middle:.6g} deg"
    yield _flag("7.1", what, int(same.sum()), len(rows), f"off by {off.max():.1g} deg at most")


def _same_positions() -> Iterator[Row]:
    """Tables of positions of different arms that have the same ones."""
    tables = ["7.25", "7.27", "7.30", "7.33", "7.35", "7.37"]
    places = {name: _data(name).numbers(position_columns(_data(name))) for name in tables}
    for k, later in enumerate(tables):
        for first in tables[:k]:
            same = (places[first] == places[later]).all(axis=1)
            if same.any():
                told = "positions of two different arms"
                yield _flag(f"{first}, {later}", "same positions", int(same.sum()), len(same), told)


def _shorter() -> Iterator[Row]:
    for short, long in SHORTER:
        few, many = _data(short), _data(long)
        both = [*zip(joint_columns(few), joint_columns(many), strict=True)]
        both += [*zip(position_columns(few), position_columns(many), strict=True)]
        a = few.numbers([pair[0] for pair in both])
        b = many.numbers([pair[1] for pair in both])[: len(few)]
        off = np.abs(a - b)
        near = (off < 0.1).all(axis=1)
        told = f"largest difference {off.max():.2g}; {np.sum(off > 0.01 + 1e-9)} entries"
        told += " differ by more than their last place"
        yield _flag(
            short, f"is the first rows of {long}, truncated", int(near.sum()), len(few), told
        )


def _near_copies() -> Iterator[Row]:
    """Entries of table 7.14 beside those of table 7.7."""
    copy, model = _data("7.14"), _data("7.7")
    places = copy.numbers(position_columns(copy)), model.numbers(position_columns(model))
    apart = np.abs(places[0] - places[1])
    near = (np.abs(apart[..., None] - ROUND) <= 0.06).any(axis=-1)
    what = "X, Y, Z of the same row of 7.7 but for 0, 1, 10, 20 ... 100 (within 0.06)"
    told = "an earlier list of errata has 24: by this wording 90.035 and 59.995 are near, too"
    yield _flag("7.14", what, int(near.sum()), near.size, told)
    heads = joint_columns(model)
    angles = copy.numbers(heads)
    known = model.numbers(heads).ravel()
    there = (np.abs(angles[..., None] - known) <= 0.02).any(axis=-1)
    value, times = np.unique(angles, return_counts=True)
    most = ", ".join(f"{angle:.3f}" for angle in value[times == times.max()])
    told = f"most often, {times.max()} times each: {most}"
    what = "theta1 to theta5 that occur in 7.7 (within 0.02 deg)"
    yield _flag("7.14", what, int(there.sum()), there.size, told)


def _short(column: str) -> str:
    return column.partition("_")[0]


CELL = Cell("flags", flag_rows)


def _build(rows: dict[str, list[Row]]) -> Table:
    flags = rows[CELL.name]
    return Table(
        title="Properties of the printed numbers of chapter 7",
        rows=flags,
        verdict=Verdict.OURS,
        residual=f"{len(flags)} properties, counted from the printed values",
        note="Counted by code from the numbers as printed. These are properties of the numbers;"
        " nothing is said of their cause.",
    )


TABLES = (
    TableSpec(
        "flags", "Properties of the printed numbers of chapter 7", lambda quick: [CELL], _build
    ),
)

"""Properties of single printed values: mean square errors, evenly spaced angles, settings."""

from collections.abc import Iterator
from math import floor

import numpy as np

from kinverse.studies.cell import Row
from kinverse.studies.data import printed

__all__ = ["ROUNDING", "configuration_flags", "error_flags", "grid_flags"]

ERRORS = ("7.11", "7.12", "7.15", "7.18", "7.21", "7.24")
"""Tables of mean square errors of networks."""
ROUNDING = 1e-30
"""Squared rounding of an output of size 1 in double precision is about 5e-32."""
GRIDS = (
    ("theta1_analytic_deg", -120.0, 120.0, ""),
    ("theta2_analytic_deg", -130.0, 130.0, ""),
    ("theta4_analytic_deg", 0.0, 360.0, ""),
    (
        "theta4_analytic_deg",
        0.0,
        150.0,
        "; an earlier list of errata has this range with 18 rows: they are those of 0 to 360",
    ),
    ("d3_analytic", 0.0, 150.0, ""),
)
"""Columns of table 7.3, ranges that are divided evenly into 1000 values, and what to add."""
NEAR = 0.002
"""By chance one fraction in 250 is as near."""


def _row(table: str, flag: str, count: int, of: int, detail: str = "") -> Row:
    return {"table": table, "flag": flag, "count": count, "of": of, "detail": detail}


def error_flags() -> Iterator[Row]:
    """Mean square errors that are zero or smaller than rounding, or in more than one table."""
    seen: dict[str, set[str]] = {}
    for table in ERRORS:
        rows = printed("jha2015", f"table_{table.replace('.', '_')}")
        value = rows.numbers(["mse_printed"])[:, 0]
        given = value[~np.isnan(value)]
        tiny = (given > 0) & (given < ROUNDING)
        least = int(np.nanargmin(np.where(value > 0, value, np.nan)))
        where = rows.rows[least]
        told = f"smallest above 0: {where['mse_printed']} ({where['algorithm']} {where['output']})"
        yield _row(
            table, "mean square error printed as 0", int((given == 0).sum()), len(rows), told
        )
        yield _row(table, f"mean square error below {ROUNDING:g}", int(tiny.sum()), len(rows), told)
        for text, number in zip(rows.text("mse_printed"), value.tolist(), strict=True):
            if number > 0:
                seen.setdefault(text, set()).add(table)
    several = sum(len(tables) > 1 for tables in seen.values())
    yield _row("7.11-7.24", "distinct errors printed in more than one table", several, len(seen))


def grid_flags() -> Iterator[Row]:
    """Entries of table 7.3 whose fraction is that of the same row of an even grid."""
    rows = printed("jha2015", "table_7_3")
    for column, low, high, more in GRIDS:
        value = rows.numbers([column])[:, 0]
        grid = np.linspace(low, high, 1000)[: len(rows)]
        apart = np.abs(np.abs(value) % 1 - np.abs(grid) % 1)
        same = np.minimum(apart, 1 - apart) <= NEAR
        whole = int((np.abs(value - grid) <= NEAR).sum())
        what = f"{column.partition('_')[0]}: fraction of an even grid {low:g} to {high:g}"
        yield _row("7.3", what, int(same.sum()), len(rows), f"whole value in {whole}{more}")


def configuration_flags() -> Iterator[Row]:
    """Settings and summaries that agree, or do not, with one another."""
    summary = printed("jha2015", "table_7_4")
    columns = ["regression_R", "mse", "resolution_adept_manual", "resolution_mlpnn"]
    R, mse, manual, ours = summary.numbers(columns).T
    apart = np.abs(mse - (1 - R)) > 5e-6
    yield _row("7.4", "mse is not 1 - R", int(apart.sum()), len(summary), "by joint, as printed")
    products = [floor(1e6 * m * r + 1e-6) / 1e6 for m, r in zip(manual, R, strict=True)]
    same = np.isclose(products, ours, rtol=0, atol=1e-9)
    what = "resolution through MLP is the manual's times R, truncated"
    yield _row("7.4", what, int(same.sum()), len(summary))
    other = printed("jha2015", "table_7_6").numbers(["mse_mlpnn"])[:, 0]
    which = (np.flatnonzero(mse != other) + 1).tolist()
    told = f"joints {', '.join(map(str, which))}"
    yield _row("7.6", "mse of the MLP differs from 7.4", len(which), len(mse), told)
    for first, second in (("7_5", "7_9"), ("7_16", "7_19")):
        a, b = (_settings(name) for name in (first, second))
        common = [name for name in a if name in b]
        equal = sum(a[name] == b[name] for name in common)
        tables = f"{first}, {second}".replace("_", ".")
        yield _row(tables, "same setting in both", equal, len(common), _told(a))


def _settings(table: str) -> dict[str, str]:
    rows = printed("jha2015", f"table_{table}")
    return dict(zip(rows.text("parameter"), rows.text("value"), strict=True))


def _told(settings: dict[str, str]) -> str:
    """What the numbers of one table say of one another."""
    if "Number of nonlinear parameters" in settings:
        rules = int(settings["Number of fuzzy rules"])
        per_input = round(rules ** (1 / 3))
        each = int(settings["Number of nonlinear parameters"]) / (3 * per_input)
        return f"{rules} rules = {per_input}^3; {each:g} parameters in each membership function"
    parts = [settings[f"{kind} datasets"] for kind in ("Training", "Testing", "Target")]
    return f"{parts[0]} training and {parts[1]} testing of {parts[2]} data sets"

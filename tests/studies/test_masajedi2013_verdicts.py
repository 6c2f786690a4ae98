"""Verdicts of document 002 follow the rows: falsified rows turn them."""

import functools

import pytest

from kinverse.studies.masajedi2013 import STUDY
from kinverse.studies.masajedi2013.bees_tables import SHOWN
from kinverse.studies.table import Verdict


@functools.cache
def quick_rows(name):
    """A table's specification and the rows of its quick cells."""
    spec = next(spec for spec in STUDY.tables if spec.name == name)
    return spec, {c.name: c.function(**c.arguments) for c in spec.cells(True)}


def with_value(rows, column, value, only=lambda row: True):
    """The cells with a column falsified."""
    return {
        name: [{**row, column: value} if column in row and only(row) else row for row in cell]
        for name, cell in rows.items()
    }


def test_equations_that_hold_or_fail_turn_the_verdict():
    spec, rows = quick_rows("equations")
    wrong = spec.build(with_value(rows, "largest error", 5.0))
    assert wrong.verdict is Verdict.NOT_REPRODUCED
    assert "0 of 6 corrected equations hold" in wrong.residual
    one = with_value(rows, "largest error", 1e-3, lambda row: row["equation"].startswith("(13)"))
    assert spec.build(one).verdict is Verdict.NOT_REPRODUCED
    assert spec.build(with_value(rows, "largest error", 0.0)).verdict is Verdict.REPRODUCED
    with pytest.raises(TypeError, match="largest error"):
        spec.build(with_value(rows, "largest error", None))


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("position error, largest, mm", 500.0),
        ("rotation error, largest, deg", 1.0),
        ("difference from kv.Analytic, largest, deg", 90.0),
        ("same number as kv.Analytic, %", 99.0),
        ("eight solutions inside the limits, %", 50.0),
    ],
)
def test_eight_solutions_that_are_off_turn_the_verdict(column, value):
    spec, rows = quick_rows("eight")
    assert spec.build(rows).verdict is Verdict.OTHER_READING
    wrong = spec.build(with_value(rows, column, value))
    assert wrong.verdict is Verdict.NOT_REPRODUCED
    assert f"{value:.1g}" in wrong.residual or f"{value:.3g}" in wrong.residual


def test_branches_that_are_not_found_turn_the_verdict():
    spec, rows = quick_rows("branches")
    assert spec.build(rows).verdict is Verdict.OTHER_READING
    wrong = spec.build(with_value(rows, "gap, deg", 90.0))
    assert wrong.verdict is Verdict.NOT_REPRODUCED
    assert wrong.residual.startswith("0 of 16 branches found")
    one = with_value(rows, "gap, deg", 90.0, lambda row: row["branch"] == SHOWN[0])
    assert spec.build(one).residual.startswith("14 of 16 branches found")


def test_the_picture_of_joint_angles_says_how_far_the_bees_are():
    spec, rows = quick_rows("fig-6")
    far = with_value(rows, "from the nearest branch, deg", 77.0)
    assert "position only: 77 deg, bees, full pose: 77 deg" in spec.build(far).pictures[0].alt

"""Document 004: matrices beside quaternion pairs."""

from dataclasses import fields

import pytest

from kinverse.studies.counted import Tally
from kinverse.studies.jha2015 import conventional
from kinverse.studies.jha2015.conventional import ROBOTS, VERSIONS, compare_forms
from kinverse.studies.table import Verdict

SOLVED = [
    (arm, version)
    for arm in ROBOTS
    for version in VERSIONS
    if (arm, version) != ("RX160L", "printed")
]


@pytest.mark.parametrize(("arm", "version"), SOLVED)
def test_both_forms_reach_every_pose_with_every_branch(arm, version):
    by_matrix, by_pair = compare_forms(arm, 12, version)
    most = {"planar3R": 2, "SCARA": 2, "Pioneer2_5R": 1, "ASEA_IRb6": 4}.get(arm, 8)
    assert by_matrix["branches"] == by_pair["branches"] == most
    assert by_matrix["scalars"] == 12 and by_pair["scalars"] == 7
    assert max(by_matrix["apart"], by_pair["apart"]) < 1e-10
    assert by_matrix["inverse us"] > 0.0


def test_the_table_has_both_printed_times():
    [spec] = conventional.TABLES
    table = spec.build({cell.name: compare_forms(**cell.arguments) for cell in spec.cells(True)})
    assert table.verdict is Verdict.CANNOT_CHECK
    assert "for 7 of 7 arms as printed" in table.residual
    assert "of 7 corrected and" in table.residual and "of 6 printed geometries" in table.residual
    assert len(table.rows) == 7 * 2 * 2
    assert "As printed RX160L has axes in another order" in table.note
    assert "SCARA: tables 3.3 and 4.3" in table.note
    [row, _] = [row for row in table.rows if (row["arm"], row["geometry"]) == ("RX160L", "printed")]
    assert row["inverse additions"] is None and row["branches"] is None
    assert row["forward [us]"] > 0.0 and row["forward additions"] > 0
    told = {(row["arm"], row["method"]): row["printed [s]"] for row in table.rows}
    assert told["RX160L", "HT"] == 0.446 and told["planar3R", "QA"] == 0.11
    assert "matrix 36 x and 27 +" in table.note
    first = table.rows[0]
    for what, kinds in OPERATIONS.items():
        assert all(isinstance(first[f"{what} {kind}"], int) for kind in kinds)
        assert {name.partition(" ")[2] for name in first if name in counted(what)} == set(kinds)


OPERATIONS = {
    "forward": ("additions", "multiplications", "sines"),
    "inverse": ("additions", "multiplications", "square roots", "sines", "arctangents"),
}


def counted(what):
    return {f"{what} {each.name.replace('_', ' ')}" for each in fields(Tally)}

"""Document 004: matrices beside quaternion pairs."""

from dataclasses import fields

import pytest

from kinverse.studies.counted import Tally
from kinverse.studies.jha2015 import conventional
from kinverse.studies.jha2015.conventional import ROBOTS, compare_forms
from kinverse.studies.table import Verdict


@pytest.mark.parametrize("arm", ROBOTS)
def test_both_forms_reach_every_pose_with_every_branch(arm):
    by_matrix, by_pair = compare_forms(arm, 12)
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

"""What holds of the numbers that the thesis prints: positions and flags."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from kinverse.errors import InputError
from kinverse.load import load
from kinverse.studies.data import printed
from kinverse.studies.jha2015.arms import arm, arm_names, conventions, printed_limits
from kinverse.studies.jha2015.flags import flag_rows
from kinverse.studies.jha2015.forward_kinematics import CASES, forward_rows
from kinverse.studies.jha2015.free_lengths import CHECKED, free_lengths, position_matrices
from kinverse.studies.registry import load_study
from kinverse.studies.table import Verdict


@pytest.fixture(scope="module")
def tables():
    study = load_study("jha2015")
    rows = {case.table: {case.cell.name: forward_rows(**case.cell.arguments)} for case in CASES}
    return {spec.name: spec.build(rows[spec.name]) for spec in study.tables if spec.name in rows}


RESIDUALS = {  # ERRATA: median and largest distance, in the unit of print
    "7.7": ("5r_inferred", "standard", "mm", 2e-4, 3e-4),
    "7.17": ("irb1400_inferred", "modified", "cm", 6e-5, 1.14e-4),
    "7.23": ("rx160l_inferred", "modified", "cm", 6e-5, 1e-4),
    "7.33": ("irb1400_inferred", "modified", "cm", 0.0097, 0.0156),
    "7.37": ("rx160l_inferred", "modified", "cm", 0.0126, 0.0412),
}


@pytest.mark.parametrize("table", RESIDUALS)
def test_positions_are_those_of_the_inferred_geometry(table):
    name, convention, unit, median, most = RESIDUALS[table]
    rows = forward_rows(table, name, unit)
    assert {row["convention"] for row in rows} == {convention}
    far = np.array([row["distance"] for row in rows])
    if table == "7.7":
        assert far[5] == pytest.approx(2 * 59.6708, abs=1e-3)  # row 6: the sign of Y
        assert rows[5]["Y ours"] == pytest.approx(-rows[5]["Y printed"], abs=3e-4)
        far = np.delete(far, 5)
    assert np.median(far) <= median and far.max() <= most
    assert np.median(far) > median / 2  # the residual told, not a smaller one


@pytest.mark.parametrize("table", RESIDUALS)
def test_positions_are_not_those_of_the_printed_geometry(table):
    [case] = [case for case in CASES if case.table == table]
    rows = forward_rows(table, " ".join(n for n in case.arms if "inferred" not in n), case.unit)
    assert min(row["distance"] / row["allowed"] for row in rows) > 100


def test_verdicts(tables):
    for table, made in tables.items():
        expected = Verdict.OTHER_READING if table in RESIDUALS else Verdict.NOT_REPRODUCED
        assert made.verdict is expected, table
    assert "Row 6 holds with the opposite sign of Y." in tables["7.7"].note
    assert "10 of 11 rows hold" in tables["7.7"].note
    assert "11 of 11 rows hold" in tables["7.17"].note
    assert "10 of 10 rows hold" in tables["7.23"].note
    assert "Row P2 is off by 0.0411 cm" in tables["7.37"].note
    assert "Z alone holds in every row (0.01 mm at most)" in tables["7.25"].note


def test_a_printed_digit_more_or_less_is_seen():
    """One unit of print is neither nothing nor a wide door."""
    for table in RESIDUALS:
        name, _, unit, _, most = RESIDUALS[table]
        allowed = [row["allowed"] for row in forward_rows(table, name, unit)]
        assert most / 10 < max(allowed) < 20 * most


def test_inferred_lengths_are_the_least_squares_of_the_table():
    """The position is linear in d and a: the table itself gives back the lengths."""
    data = printed("jha2015", "table_7_17")
    q = np.radians(data.numbers([f"theta{k}_deg" for k in range(1, 7)]))
    robot = arm("irb1400_inferred", "modified")
    p = data.numbers(["X", "Y", "Z"]) / 100.0

    def axes(q_row):
        """Directions of z and x of each joint's frame, from rotations alone."""
        z, x, R = [], [], np.eye(3)
        for angle, alpha in zip(q_row, np.radians([0, 0, -90, 90, -90, 90]), strict=True):
            c, s = np.cos(alpha), np.sin(alpha)
            x.append(R[:, 0])
            R = R @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
            z.append(R[:, 2])
            c, s = np.cos(angle), np.sin(angle)
            R = R @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return np.array(z + x).T

    A = np.vstack([axes(row) for row in q])
    found, *_ = np.linalg.lstsq(A, p.ravel(), rcond=None)
    assert np.abs(A @ found - p.ravel()).max() < 1.2e-6
    lengths = found[[3, 5]]  # d4 and d6; d1 and d2 share an axis, and some lengths only their sum
    assert lengths == pytest.approx([0.72, 0.085], abs=1e-5)
    assert robot.fk(q)[:, :3, 3] == pytest.approx((A @ found).reshape(-1, 3), abs=3e-6)


def flags_by_table():
    found = {}
    for row in flag_rows():
        found.setdefault(row["table"], []).append(row)
    return found


def listed_flags():
    """Flags of the errata, each with ours that are told in the same words."""
    text = (Path(__file__).parent / "thesis_flags.csv").read_text()
    found = flags_by_table()
    for row in csv.DictReader(text.splitlines()):
        if row["table"] not in ELSEWHERE:
            table = ALIASES.get(row["table"], row["table"])
            yield row, [ours for ours in found.get(table, []) if same(ours["flag"], row["flag"])]


def test_flags_are_those_of_the_errata():
    expected = list(listed_flags())
    missing = []
    for row, ours in expected:
        mine = [each["count"] for each in ours]
        if mine != [int(count) for count in row["count"].split("/")]:
            missing.append((row["table"], row["count"], mine))
    assert len(expected) == 47
    # 26, not 24: by the definition as it is worded two more entries (90.035, 59.995) are near;
    # theta4 of 7.3: the grid is 0 to 360, not the 0 to 150 that the errata have
    assert missing == [("7.14", "24", [26]), ("7.3", "18", [0])]
    theta4 = [row for row in flags_by_table()["7.3"] if row["flag"].startswith("theta4")]
    assert [(row["flag"].split("grid ")[1], row["count"]) for row in theta4] == [
        ("0 to 360", 18),
        ("0 to 150", 0),
    ]
    assert "those of 0 to 360" in theta4[1]["detail"]


def test_angles_that_are_printed_most_often_are_all_told():
    [row] = [row for row in flags_by_table()["7.14"] if row["flag"].startswith("theta1 to theta5")]
    # the errata name two of the three
    assert row["detail"] == "most often, 3 times each: 26.351, 39.879, 138.870"


DETAILS = {  # what is read from our details, and from those of the errata
    "outside": (r"(\d+) of (\d+) rows; by joint (.*)", r"(\d+) of (\d+) rows; per joint \[(.*)\]"),
    "negative": (
        r"most negative (\S+); (\d+) zeros; (\d+) of size",
        r"most negative (\S+); zeros (\d+); .f.<=0.01 in (\d+)",
    ),
    "mean square": (r"above 0: (\S+) \((.*)\)", r"smallest non-zero (\S+) \((.*?)\)"),
    "is the first rows": (r"largest difference ([\d.]+)", r"largest difference ([\d.]+)"),
    "theta1: ": (r"whole value in (\d+)", r"whole value agrees in (\d+)"),
    "theta2: ": (r"whole value in (\d+)", r"whole value agrees in (\d+)"),
    "theta4: ": (r"whole value in (\d+)", r"whole value agrees in (\d+)"),
    "d3: ": (r"whole value in (\d+)", r"whole value agrees in (\d+)"),
}


def test_details_of_flags_are_those_of_the_errata():
    seen = 0
    for row, ours in listed_flags():
        for each in ours:
            [(mine, theirs)] = [
                pair for start, pair in DETAILS.items() if each["flag"].startswith(start)
            ] or [(None, None)]
            if mine is not None:
                told, listed = re.search(mine, each["detail"]), re.search(theirs, row["detail"])
                assert told and listed, (row, each)
                a, b = (" ".join(found.groups()).lower() for found in (told, listed))
                assert a == b, (row["table"], row["flag"])
                seen += 1
            if "repeats" in each["flag"]:
                names = set(each["detail"].removeprefix("all rows of ").split(", "))
                assert names == set(re.findall("[A-Z]{2,}", row["detail"]))
                seen += 1
    assert seen == 19 + 6 + 2 * 6 + 3 + 4 + 2


WORDS = {  # of the errata, and ours
    "outside the limits": "outside the printed limits",
    "negative function value": "negative function value",
    "mean square error": "mean square error",
    "theta6 repeats": "theta6 repeats",
    "theta3 repeats": "theta3 repeats",
    "is rows 1-5": "is the first rows",
    "X,Y,Z entries": "X, Y, Z of the same row",
    "theta1-5": "theta1 to theta5",
    "theta1_analytic": "theta1: fraction",
    "theta2_analytic": "theta2: fraction",
    "theta4_analytic": "theta4: fraction",
    "d3_analytic": "d3: fraction",
    "mse vs": "mse is not",
    "'resolution": "resolution through",
    "MLPNN mse": "mse of the MLP",
    "identical five": "same positions",
    "distinct printed": "distinct errors",
}
ELSEWHERE = ("7.5=7.9", "7.16=7.19", "000")  # settings that agree: below; another document
ALIASES = {"7.30/7.33": "7.30, 7.33", "7.6 vs 7.4": "7.6"}


def same(ours, theirs):
    grid = re.search(r"linspace\((\S+),(\S+),1000\)", theirs)
    if grid and not ours.endswith(f"even grid {grid[1]} to {grid[2]}"):
        return False
    return any(theirs.startswith(a) and ours.startswith(b) for a, b in WORDS.items())


def test_joints_of_table_7_1_add_up_to_60_deg():
    [row] = [row for row in flag_rows() if row["flag"] == "theta1 + theta2 + theta3 is 60 deg"]
    assert (row["table"], row["count"], row["of"]) == ("7.1", 10, 10)
    assert row["detail"] == "off by 0.0001 deg at most"


def test_settings_that_agree():
    told = {row["table"]: row for row in flag_rows() if row["flag"] == "same setting in both"}
    assert (told["7.5, 7.9"]["count"], told["7.16, 7.19"]["count"]) == (6, 8)
    assert told["7.5, 7.9"]["detail"].startswith("343 rules = 7^3; 3 parameters")
    assert told["7.16, 7.19"]["detail"] == "700 training and 100 testing of 500 data sets"


def test_arms_read_in_every_convention():
    for name in arm_names():
        for convention in conventions(name):
            robot = arm(name, convention)
            assert len(printed_limits(name)) == robot.dof
    with pytest.raises(InputError, match="no arm 'abb'; there are .*irb1400_inferred"):
        arm("abb", "standard")


def test_data_tell_what_they_have():
    with pytest.raises(InputError, match="no data 'table_9_9'; it has .*table_7_7"):
        printed("jha2015", "table_9_9")
    with pytest.raises(InputError, match="no column 'W'; it has .*theta1_deg"):
        printed("jha2015", "table_7_7").numbers(["W"])
    assert printed("jha2015", "table_7_7").text("X_mm")[2] == "-131.5420"  # as printed


def test_one_row_of_7_7_keeps_it_from_a_fit():
    [row] = free_lengths("7.7", 5, 1)
    assert row["row left out"] == 6 and row["residual"] > 0.1
    assert row["residual, one row left out"] < 1e-6


@pytest.mark.slow
def test_lengths_of_any_arm_explain_three_tables_and_no_other():
    rows = {table: free_lengths(table, 20, 1)[0] for table in CHECKED}
    fitted = [table for table in CHECKED if rows[table]["residual, one row left out"] < 1e-5]
    assert fitted == ["7.7", "7.17", "7.23"]
    for table in ("7.1", "7.14", "7.20"):
        assert rows[table]["residual"] > 0.8 * rows[table]["shuffled, least"], table


def test_free_lengths_find_an_arm_that_is_there():
    """Positions of a catalogue arm are in the family, and its lengths are found."""
    robot = load("rx160l")
    q = robot.random(12, np.random.default_rng(5))
    p = robot.fk(q)[:, :3, 3]
    off = [
        np.linalg.norm(A @ np.linalg.lstsq(A, p.ravel(), rcond=None)[0] - p.ravel())
        for A in position_matrices(q).reshape(7776, -1, 15)[:, : p.size]
    ]
    assert min(off) < 1e-9 and np.median(off) > 0.1


def test_tables_come_in_the_order_of_the_thesis():
    names = [spec.name for spec in load_study("jha2015").tables]
    numbers = [int(found[1]) for name in names if (found := re.match(r"7\.(\d+)", name))]
    assert numbers == sorted(numbers) and len(names) == len(set(names))


@pytest.mark.parametrize("name", ["7.14", "7.20", "7.30", "7.35"])
def test_readings_in_other_units_are_compared_as_lengths(tables, name):
    # read as cm their numbers are smaller and the positions farther off: the arms reach 1 m
    assert "X printed, mm" in tables[name].rows[0] and "cm" in tables[name].note


def test_a_row_with_another_sign_stands_in_the_residual(tables):
    assert "row 6 with the opposite sign of Y" in tables["7.7"].residual

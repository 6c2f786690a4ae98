"""Document 004: its arms, and the population methods on five positions of each."""

import numpy as np
import pytest

import oracle
from kinverse.errors import InputError
from kinverse.studies.data import printed
from kinverse.studies.jha2015 import swarm
from kinverse.studies.jha2015.geometries import GEOMETRIES, geometry
from kinverse.studies.jha2015.positions import ALGORITHMS, ARMS, printed_answers
from kinverse.studies.jha2015.swarm import values
from kinverse.studies.jha2015.swarm.cells import POPULATIONS, cells_of
from kinverse.studies.jha2015.swarm.search import search, search_times
from kinverse.studies.jha2015.units import METRES
from kinverse.studies.table import Verdict

NAMES = sorted({name for task in ARMS.values() for name in task.geometries})


def specs():
    return {spec.name: spec for spec in swarm.TABLES}


@pytest.fixture(scope="module")
def made():
    """Rows of small searches for one table, by its own cells."""

    def rows_of(name, seeds=3, evaluations=600):
        cells = specs()[name].cells(True)
        small = {"seeds": seeds, "evaluations": evaluations}
        return {cell.name: cell.function(**{**cell.arguments, **small}) for cell in cells}

    return rows_of


@pytest.mark.parametrize(
    ("name", "table", "unit", "residual", "turned"),
    [
        # the row whose Y is printed with the other sign
        ("pioneer2_7_7", "table_7_7", "mm", 3e-4, 5),
        ("irb1400_7_17", "table_7_17", "cm", 1.2e-4, None),
        ("rx160l_7_23", "table_7_23", "cm", 1e-4, None),
    ],
)
def test_inferred_geometries_give_the_printed_positions(name, table, unit, residual, turned):
    robot, rows = geometry(name), printed("jha2015", table)
    q = np.radians(rows.numbers([f"theta{k}_deg" for k in range(1, robot.dof + 1)]))
    axes = [column for column in rows.columns if column[0] in "XYZ"]
    wanted = rows.numbers(axes)
    if turned is not None:
        wanted[turned, 1] *= -1.0
    found = np.array([oracle.robot_fk(robot, row)[:3, 3] for row in q]) / METRES[unit]
    assert np.abs(found - wanted).max() <= residual


@pytest.mark.parametrize("name", NAMES)
def test_a_geometry_is_its_rows(name):
    each = GEOMETRIES[name]
    rows = printed("jha2015", "arms").where("arm", each.arm)
    robot = geometry(name)
    unit = METRES[rows.text("unit")[0]]
    theta, d, a, alpha = rows.numbers(["theta_deg", "d", "a", "alpha_deg"]).T
    table = np.stack([np.radians(theta), unit * d, unit * a, np.radians(alpha)], axis=1)
    assert each.convention in rows.text("conventions")[0]
    for row in robot.random(3, np.random.default_rng(5)):
        T = oracle.dh_fk(table, rows.text("joint"), row, each.convention)
        assert np.abs(robot.fk(row) - T).max() < 1e-12


def test_limits_are_the_printed_ones_or_those_that_are_said():
    assert np.degrees(geometry("irb1400_7_17").limits[1]) == pytest.approx([-70, 70])
    assert np.degrees(geometry("irb6").limits[0]) == pytest.approx([90, 130])
    assert np.degrees(geometry("irb6_free").limits) == pytest.approx(np.tile([-180, 180], (5, 1)))


def test_positions_of_the_puma_are_those_of_the_irb1400():
    assert np.array_equal(ARMS["PUMA560"].targets, ARMS["IRB1400"].targets)


@pytest.mark.parametrize(("arm", "name"), [("ASEA_IRb6", "irb6"), ("RX160L", "rx160l")])
def test_where_ranges_are_set_aside_every_printed_row_breaks_them(arm, name):
    robot = geometry(name)
    rows = printed("jha2015", "table_" + ARMS[arm].table.replace(".", "_"))
    q = np.radians(rows.numbers([f"theta{k}_deg" for k in range(1, robot.dof + 1)]))
    low, high = robot.limits.T
    assert ((q < low) | (q > high)).any(axis=1).all()


def test_unknown_geometry_is_answered_with_those_there_are():
    with pytest.raises(InputError, match="irb6_free"):
        geometry("irb7")


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_function_value_is_the_objective_at_the_joints_returned(arm, algorithm):
    task = ARMS[arm]
    unit = METRES[task.unit]
    for name in task.geometries:
        robot = geometry(name)
        rows = search(arm, name, algorithm, 10, 2, 300)
        found = [row for row in rows if row["kind"] == "answer"]
        assert len(found) == 10
        for row in found:
            q = [row[f"q{k}"] for k in range(1, robot.dof + 1)]
            p = oracle.robot_fk(robot, q)[:3, 3] / unit
            far = np.linalg.norm(p - task.targets[row["position"]] / unit)
            assert abs(row["f"] - far) <= 1e-9
            assert np.abs(p - [row["x"], row["y"], row["z"]]).max() <= 1e-9
            assert row["f"] >= row["least"] - 1e-6
            assert (q >= robot.limits[:, 0]).all() and (q <= robot.limits[:, 1]).all()


def test_off_a_solution_is_measured_to_a_solution():
    rows = search("SCARA", "scara", "pso", 20, 3, 6_000)
    robot, task = geometry("scara"), ARMS["SCARA"]
    for row in rows:
        if row["kind"] != "answer" or row["off"] is None:
            continue
        # by the law of cosines, with both elbows
        x, y, z = task.targets[row["position"]]
        bend = np.arccos((x * x + y * y - 0.25**2 - 0.15**2) / (2 * 0.25 * 0.15))
        offs = []
        for t2 in (bend, -bend):
            t1 = np.arctan2(y, x) - np.arctan2(0.15 * np.sin(t2), 0.25 + 0.15 * np.cos(t2))
            q = np.array([t1, t2, -z - 0.15])
            if (q >= robot.limits[:3, 0]).all() and (q <= robot.limits[:3, 1]).all():
                offs.append(np.abs(q - [row["q1"], row["q2"], row["q3"]]).max())
        assert row["off"] == pytest.approx(min(offs), abs=1e-6)


def test_more_evaluations_do_not_end_higher():
    few = search("IRB1400", "irb1400_7_17", "pso", 20, 3, 400)
    rows = search("IRB1400", "irb1400_7_17", "pso", 20, 3, 4_000)
    curve = [row["median"] for row in rows if row["kind"] == "curve"]
    assert all(b <= a for a, b in zip(curve, curve[1:], strict=False))
    assert rows[0]["f"] < few[0]["f"]


def test_every_population_that_a_method_can_have_is_searched():
    task = ARMS["SCARA"]
    few = [cell.arguments["algorithm"] for cell in cells_of(task, (3,), True)]
    # swarms of crabs have more than five
    assert set(ALGORITHMS) - set(few) == {"cibo"} and len(few) == len(ALGORITHMS) - 1
    assert len(cells_of(task, POPULATIONS, True)) == 14


def test_printed_solutions_of_table_7_28_end_where_the_errata_say(made):
    table = specs()["7.28"].build(made("7.28"))
    assert table.verdict is Verdict.NOT_REPRODUCED
    assert "73.7 to 380.8 mm" in table.residual and "median 174.8" in table.residual
    assert "4 printed values" in table.residual
    assert "5 of 5 (pioneer2), 5 of 5 (pioneer2_7_7)" in table.note
    assert len(table.rows) == 2 * 5 * 5
    assert all(row["lower quartile [mm]"] <= row["f, median [mm]"] for row in table.rows)


@pytest.mark.parametrize("arm", [arm for arm in ARMS if ARMS[arm].answers])
def test_printed_norms_that_are_negative_are_as_many_as_in_the_errata(arm):
    negative = {"7.26": 7, "7.28": 4, "7.31": 23, "7.34": 6, "7.36": 3, "7.38": 4}
    task = ARMS[arm]
    answers = printed_answers(task, geometry(task.geometries[0]))
    assert len(answers) == 25
    assert sum(value < 0 for value, _ in answers.values()) == negative[task.answers]


def test_printed_joints_of_table_7_36_under_both_models_of_the_arm():
    # equations 4.251 to 4.253 with a6 = d6 = 0
    robot = geometry("irb6_4_251")
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (6, 5))
    t1, t2, t23, t234 = q[:, 0], q[:, 1], q[:, 1:3].sum(axis=1), q[:, 1:4].sum(axis=1)
    out = -0.45 * np.sin(t2) + 0.67 * np.cos(t23) + 0.095 * np.cos(t234)
    z = 0.07 + 0.45 * np.cos(t2) + 0.67 * np.sin(t23) + 0.095 * np.sin(t234)
    wanted = np.column_stack([-np.sin(t1) * out, np.cos(t1) * out, z])
    assert robot.fk(q)[:, :3, 3] == pytest.approx(wanted, abs=1e-12)
    _, told = values._verdict(ARMS["ASEA_IRb6"])
    # ERRATA: closest 480, median 1112.0, largest 2000.5
    assert "end 480 to 2000 mm" in told and "median 1112, geometry irb6_4_251" in told
    assert "irb6, irb6_free: 252 to 1920, median 1195" in told


def test_joints_and_populations_make_tables_and_pictures(made):
    rows = made("7.26-populations")
    table = specs()["7.26-populations"].build(rows)
    assert len(table.rows) == 14
    assert all(row["positions in reach"] == 3 for row in table.rows)
    [picture] = table.pictures
    assert picture.alt and picture.draw().axes
    joints = specs()["7.26-joints"].build(rows)
    first, f = joints.rows[0], specs()["7.26"].build(rows).rows[0]["f, median [mm]"]
    assert first["X wanted [mm]"] == pytest.approx(102.86)
    reached = [first[f"{axis} reached [mm]"] for axis in "XYZ"]
    wanted = [first[f"{axis} wanted [mm]"] for axis in "XYZ"]
    assert all(isinstance(value, float) for value in reached)
    assert np.linalg.norm(np.subtract(reached, wanted)) == pytest.approx(f)
    assert len(joints.pictures[0].draw().axes) == 5


def test_times_stand_beside_both_printed_ones():
    rows = {
        cell.name: search_times(cell.arguments["arm"], cell.arguments["algorithm"], 6, 60)
        for cell in specs()["7.41"].cells(True)
    }
    table = specs()["7.41"].build(rows)
    assert table.verdict is Verdict.CANNOT_CHECK
    by_key = {(row["arm"], row["algorithm"]): row for row in table.rows}
    assert by_key["PUMA560", "ga"]["printed, 7.29 or 7.32 [s]"] == 5.896
    assert by_key["PUMA560", "ga"]["printed, 7.41 [s]"] == 5.89
    assert by_key["planar3R", "ga"]["printed, 7.41 [s]"] is None

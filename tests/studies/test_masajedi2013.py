"""Document 002 again: equations, eight solutions, bees, forces of the joints, error models."""

import builtins

import numpy as np
import pytest

import kinverse as kv
from kinverse import judge
from kinverse.paths import default_links, named_samples
from kinverse.studies.data import printed
from kinverse.studies.masajedi2013 import STUDY, equations, error_models, motion_tables
from kinverse.studies.masajedi2013.bees import bees_along, bees_near, colony, every_branch
from kinverse.studies.masajedi2013.bees_tables import PATHS, SHOWN
from kinverse.studies.masajedi2013.branches import branches_along, largest_step
from kinverse.studies.masajedi2013.closed_form import EQUATIONS, eight, measured
from kinverse.studies.masajedi2013.motion import (
    BY_ITSELF,
    SECONDS,
    blend,
    interpolated,
    joint_forces,
    moved,
    times,
)
from kinverse.studies.masajedi2013.motion_tables import _median, _range
from kinverse.studies.masajedi2013.parameters import points_a_step
from kinverse.studies.masajedi2013.real_arm import NOISE, WORLDS, real_arm
from kinverse.studies.table import Verdict


@pytest.fixture(scope="module")
def robot():
    return kv.load("kr16")


def drawn(robot, seed, count):
    low, high = robot.limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, 6))


def table(name, quick=True):
    spec = next(spec for spec in STUDY.tables if spec.name == name)
    return spec.build({c.name: c.function(**c.arguments) for c in spec.cells(quick)})


# ---------------------------------------------------------------------------- section 4
def test_the_eight_solutions_reach_their_pose_and_are_those_of_the_library(robot):
    T = judge.pose(robot, drawn(robot, 1, 300))
    answers = eight(T)
    there = ~np.isnan(answers[..., 2])
    assert set(there.sum(axis=1)) <= {4, 8}
    assert (there.sum(axis=1) == 8).any()
    wanted = np.repeat(T[:, None], 8, axis=1)[there]
    far, turned = judge.errors(wanted, judge.pose(robot, answers[there]))
    assert far.max() < 1e-12 and turned.max() < 1e-9
    ours = kv.Analytic(limits="ignore").fit(robot).solve(T)
    for i in range(len(T)):
        gaps = judge.apart(answers[i][there[i]][:, None], ours[i].q[None])
        assert gaps.min(axis=1).max() < 1e-6 and gaps.min(axis=0).max() < 1e-6


def test_joint_values_are_among_the_solutions_of_their_pose(robot):
    q = drawn(robot, 2, 200)
    gaps = judge.apart(eight(judge.pose(robot, q)), q[:, None])
    assert np.nanmin(gaps, axis=1).max() < 1e-6


def test_equations_hold_and_fail_as_listed(robot):
    found = measured(drawn(robot, 3, 2000))
    listed = printed("masajedi2013", "equation_checks")
    assert len(listed) == len(found) == len(EQUATIONS)
    for (name, (error, _)), before in zip(found.items(), listed.rows, strict=True):
        least = equations.ROTATIONS if "number" in name else equations.HOLDS
        assert (error <= least) == (before["verdict"] == "correct"), name
    # properties that do not depend on what was drawn
    assert found["(14)-(19) number of different 0R4"][0] == 4
    assert found["(7)-(9) one phi for both theta1"][0] == pytest.approx(2 * 260, abs=1.0)


def test_the_equation_table_agrees_in_every_row():
    made = table("equations")
    assert all(row["agrees"] for row in made.rows)
    assert made.verdict is Verdict.OTHER_READING
    assert "6 of 6 corrected equations hold" in made.residual


# ---------------------------------------------------------------------------- bees
def test_the_colony_is_the_printed_one():
    bees = colony()
    assert (bees.population, bees.sites, bees.elites) == (50, 3, 1)
    assert (bees.elite_recruits, bees.recruits, bees.radius) == (4, 4, 0.02)
    assert bees.abandon_after == 3
    assert points_a_step() == 62


@pytest.mark.parametrize("path", PATHS)
def test_branches_are_motions_inside_the_limits(robot, path):
    T = named_samples(path).T
    q, labels = branches_along(T)
    assert len(set(labels)) == 8
    for branch in q:
        assert judge.inside(robot, branch).all()
        assert judge.errors(T, judge.pose(robot, branch))[0].max() < 1e-12
        assert largest_step(branch) < np.radians(10)


def test_a_missing_branch_is_told(robot):
    T = named_samples(PATHS[0]).T.copy()
    T[4, :3, 3] = [9.0, 0.0, 0.0]
    with pytest.raises(kv.InputError, match="pose 4 has 0 solutions"):
        branches_along(T)


def test_position_alone_leaves_the_branches_and_the_pose_leads_to_them():
    printed_rows = bees_along(PATHS[0], "position", "range", 4000, False, 1)
    whole = bees_along(PATHS[0], "pose", "range", 2000, True, 1)
    assert len(printed_rows) == len(whole) == 21
    away = [row["from the nearest branch, deg"] for row in printed_rows]
    assert np.median(away) > 20
    assert np.median([row["position error, mm"] for row in printed_rows]) < 50
    assert max(row["position error, mm"] for row in whole) < 1e-3
    assert max(row["from the nearest branch, deg"] for row in whole) < 1e-3


@pytest.mark.slow
def test_medians_of_the_bees_stand_with_quartiles_and_seeds():
    for row in table("bees").rows:
        if row["reading"] == "a closed-form branch":
            continue
        assert row["seeds"] == 2
        for what in ("position error", "rotation error", "from the nearest branch"):
            unit = "mm" if what == "position error" else "deg"
            low, middle, high = (
                row[f"{what}, {which}, {unit}"]
                for which in ("lower quartile", "median", "upper quartile")
            )
            assert 0.0 <= low <= middle <= high


def test_bees_find_every_branch():
    rows = every_branch(PATHS[1], 5)
    assert len(rows) == 21 * 8
    assert np.mean([row["gap, deg"] < 1e-4 for row in rows]) > 0.98


def test_bees_near_stay_on_their_branch():
    q = bees_near(PATHS[1], SHOWN[0], 2000, 1)
    known, labels = branches_along(named_samples(PATHS[1]).T)
    gaps = judge.apart(q, known[labels.index(SHOWN[0])])
    assert 0 < np.median(gaps) < np.radians(10)


# ---------------------------------------------------------------------------- motion
def test_times_pass_the_points_from_rest_to_rest():
    t = times(21)
    assert t[0] == 0.0 and t[-1] == SECONDS
    assert blend(t / SECONDS) == pytest.approx(np.linspace(0, 1, 21), abs=1e-6)


def test_at_rest_a_joint_passes_on_the_weight_behind_it(robot):
    t = np.linspace(0.0, 0.1, 11)
    q = np.tile([0.2, -1.2, 1.3, 0.3, 0.8, 0.1], (11, 1))
    weights = 9.81 * np.array([link.mass for link in default_links(robot)])
    force = joint_forces(robot, t, q, np.zeros((11, 3)))
    assert force[5] == pytest.approx(np.cumsum(weights[::-1])[::-1])
    held = joint_forces(robot, t, q, np.tile([0.0, 0.0, weights.sum()], (11, 1)))
    assert held[5, 0] == pytest.approx(0.0, abs=1e-9)


def test_higher_degrees_are_nearer_on_the_straight_path():
    rows = interpolated(PATHS[0], SHOWN[0], 1)
    strays = [row["between them, largest, mm"] for row in rows]
    assert strays == sorted(strays, reverse=True)
    assert max(row["at the points, largest, mm"] for row in rows) < 1e-9


def test_both_drives_of_a_branch_follow_the_path():
    pytest.importorskip("mujoco")
    rows = moved(PATHS[0], SHOWN[0], 1)
    motions = [row for row in rows if row["kind"] == "motion"]
    assert [row["drive"] for row in motions] == ["joints", "tool"]
    for row in motions:
        assert row["ran to the end"] and row["error, largest, mm"] < 0.1
    joints = [row for row in rows if row["kind"] == "joint"]
    assert len(joints) == 12
    assert all(0 < row["force, uniformity"] <= 1 for row in joints)
    assert all(row["torque, uniformity"] is None for row in joints if row["drive"] == "tool")


def test_the_tool_force_is_what_balances_the_torques(robot):
    # J^T W is what the drives would give: shows the sign of the force on the tool
    pytest.importorskip("mujoco")
    from kinverse.paths import simulate

    q = branches_along(named_samples(PATHS[0]).T)[0][0]
    held = simulate(robot, times(21), q, drive="tool")
    driven = simulate(robot, times(21), q, control="prescribed")
    k = len(held.t) // 2
    wrench = np.linalg.solve(robot.jacobian(held.q[k]).T, driven.torque[k])
    assert held.constraint_force[k, :3] == pytest.approx(wrench[:3], rel=0.02)


def test_without_the_simulator_the_cell_names_the_command(monkeypatch):
    real = builtins.__import__

    def none(name, *args, **kwargs):
        if name.split(".")[0] == "mujoco":
            raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(kv.MissingExtra, match="pip install"):
        moved(PATHS[0], SHOWN[0], 1)
    assert interpolated(PATHS[0], SHOWN[0], 1)


def test_the_comparison_of_forces_counts():
    rows = [
        {
            "path": "p",
            "joint values": label,
            "drive": drive,
            "joint": joint,
            "force, uniformity": 0.9 if drive == "tool" and joint > 2 else 0.5,
            "force, peak, N": 100.0 if drive == "tool" and label == SHOWN[1] else 50.0,
        }
        for label in SHOWN
        for drive in ("joints", "tool")
        for joint in range(1, 7)
    ]
    told = motion_tables.compared(rows)
    assert len(told) == 4
    assert {row["more uniform"] for row in told} == {4}
    assert [row["greater"] for row in told] == [0, 0, 6, 6]


# ---------------------------------------------------------------------------- section 5
def test_a_real_arm_is_some_tenths_of_a_millimetre_off(robot):
    q = drawn(robot, 4, 50)
    arm = real_arm(WORLDS[1], np.random.default_rng(1))
    tool = robot.with_tool(kv.pose([0.05, 0.02, 0.1]))
    error = np.linalg.norm(arm.position(q) - judge.pose(tool, q)[:, :3, 3], axis=1)
    assert 1e-4 < np.median(error) < 5e-3
    noise = arm.measured(q, np.random.default_rng(2)) - arm.position(q)
    assert np.std(noise) == pytest.approx(NOISE, rel=0.3)


def test_models_fit_the_errors_they_are_made_for():
    left = {}
    for world in WORLDS:
        rows = error_models.fitted(world, 501, 200, 200)
        before = rows[0]["held out"]
        left[world] = {row["model"]: row["held out"] / before for row in rows}
    sums, links = (left[world] for world in WORLDS)
    assert sums["fourier:2"] < 0.05 and links["fourier:2"] > 0.5
    assert links["geometric"] < 0.2 and sums["geometric"] > 0.5
    for degree in (2, 4):
        same = [sums[f"polynomial:{degree}:{basis}"] for basis in error_models.BASES]
        assert np.ptp(same) < 1e-6


# ---------------------------------------------------------------------------- tables
def test_cells_are_named_once_for_one_piece_of_work():
    for quick in (True, False):
        named = {}
        for spec in STUDY.tables:
            for cell in spec.cells(quick):
                assert named.setdefault(cell.name, cell) == cell


@pytest.mark.slow
@pytest.mark.parametrize("name", ["eight", "parameters", "bees", "branches", "fig-6", "fig-7"])
def test_tables_and_pictures_are_made(name):
    made = table(name)
    assert made.rows and made.residual
    for picture in made.pictures:
        assert len(picture.alt) > 40 and picture.draw().axes


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fig-8", "fig-9"])
def test_simulated_tables_and_pictures_are_made(name):
    pytest.importorskip("mujoco")
    test_tables_and_pictures_are_made(name)


def test_values_that_jump_out_of_the_limits_make_no_motion():
    pytest.importorskip("mujoco")
    [row] = [row for row in moved(PATHS[0], BY_ITSELF[0], 302) if row["drive"] == "joints"]
    assert row["kind"] == "motion" and not row["ran to the end"]
    assert "limits" in str(row["reason"]) and row["error, largest, mm"] is None


def test_errors_that_are_not_known_are_not_zero():
    rows = [{"error, largest, mm": value} for value in (None, 3.0, 5.0)]
    assert _range(rows) == "3 to 5 mm, no motion in 1 of 3"
    assert _range(rows[:1]) == "unknown, no motion in 1 of 1"
    assert _median(rows, "error, largest, mm") == 4.0

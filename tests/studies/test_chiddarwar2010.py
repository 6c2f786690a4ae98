"""Document 000 run again: poses, patterns, percent errors, what tables say of printed numbers."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.studies.cell_file import check_rows
from kinverse.studies.chiddarwar2010 import STUDY
from kinverse.studies.chiddarwar2010.data_set import DATA_SET
from kinverse.studies.chiddarwar2010.fusion import FUSION
from kinverse.studies.chiddarwar2010.held_out import _absolute_patterns, held_out_errors
from kinverse.studies.chiddarwar2010.loop import run_fusion
from kinverse.studies.chiddarwar2010.networks import CONSTANT, make_network
from kinverse.studies.chiddarwar2010.path import percent_row
from kinverse.studies.chiddarwar2010.plan import fusion_cells, held_out_cells
from kinverse.studies.chiddarwar2010.poses import (
    REGIONS,
    WHOLE,
    arm,
    draw,
    path_joints,
    predicates,
    region,
)
from kinverse.studies.chiddarwar2010.reach import How, reached, verdict
from kinverse.studies.chiddarwar2010.rms import SPLITS_TABLE, TABLE_3
from kinverse.studies.chiddarwar2010.source import METHODS, limits_of_rms, parameter, percent_error
from kinverse.studies.rows import Spread, as_number, select, spread_of
from kinverse.studies.table import Verdict

ROBOTS = ("ir361", "puma560")


@pytest.fixture(scope="module")
def quick():
    """Rows of the quick run's cells, of few epochs."""
    found = {}
    for cell in held_out_cells(True) + fusion_cells(True):
        found[cell.name] = check_rows(cell.function(**{**cell.arguments, "epochs": 2}))
    return found


@pytest.mark.parametrize("robot", ROBOTS)
def test_seventy_poses_make_sixty_patterns_fewer_than_printed(robot):
    cells = [cell for cell in DATA_SET.cells(True) if cell.arguments["robot"] == robot]
    found = {cell.name: check_rows(cell.function(**cell.arguments)) for cell in cells}
    [[row]] = found.values()
    assert row["ordered pairs"] == 70 * 69 == 4830
    table = DATA_SET.build(found)
    assert table.verdict is Verdict.NOT_REPRODUCED
    assert "60 more" in table.residual
    for split in ("pose", "pair"):
        parts = [f"{part}, split by {split}" for part in ("train", "test", "in neither")]
        assert sum(row[part] for part in parts) == 4830
    assert row["in neither, split by pair"] == 0 < row["in neither, split by pose"]


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("half", [2.0, 30.0, WHOLE])
def test_poses_meet_the_conditions_and_stay_in_their_region(robot, half):
    given = arm(robot)
    q = draw(given, 70, half, 0, 9).q
    assert all(test(q).all() for test in predicates(given))
    low, high = given.limits.T
    assert ((q >= low) & (q <= high)).all()
    if half < WHOLE:
        centre, width = region(given, half, 0)
        assert (np.abs(q - centre) <= width + 1e-12).all()
        assert np.degrees(np.abs(q - centre).max()) > 0.8 * half


def test_some_poses_of_the_whole_workspace_are_turned_away():
    rejected = draw(arm("ir361"), 70, WHOLE, 0, 9).rejected
    assert rejected["collision_free"] > 0 < rejected["far_from_singularity"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_path_starts_beside_its_five_poses_and_is_free(robot):
    q = path_joints(arm(robot), WHOLE, 0, 3)
    assert q.shape == (6, 6)
    assert np.allclose(np.diff(q, 2, axis=0), 0.0)
    assert all(test(q).all() for test in predicates(arm(robot)))


def test_absolute_networks_have_as_many_patterns_as_printed():
    _, train, test = _absolute_patterns("ir361", 5.0, 0)
    assert len(train) + len(test) == parameter("patterns") == 4890
    assert len(train) == 3423
    assert not set(map(tuple, train.q)) & set(map(tuple, test.q))


def test_seeds_of_training_fresh_poses_and_paths_are_unrelated():
    from kinverse.studies.chiddarwar2010 import held_out, loop, path, poses

    firsts = [held_out.POSES, held_out.SPLIT, held_out.SAMPLES, held_out.START]
    firsts += [loop.FRESH, path.PATH, poses.CENTRES]
    assert np.diff(sorted(firsts)).min() >= 1000


def test_networks_have_the_printed_size():
    for name in ("RBF as printed", "RBF scaled (ours)"):
        assert make_network(name, 3, 0).n_neurons == 68
    printed = make_network("RBF as printed", 3, 0)
    assert (printed.spread, printed.goal, printed.goal_kind) == (0.75, 0.001, "sse")
    assert make_network("MLP", 3, 0).hidden == (68,)


def test_percent_error_leaves_small_angles_out_and_counts_them():
    iterative = np.array([[1.0, np.radians(0.5)], [-2.0, 0.5]])
    row = percent_row(iterative + [[0.01, 1.0], [0.02, 0.0]], iterative)
    assert abs(row["percent_error"] - (1.0 + 1.0 + 0.0) / 3.0) < 1e-12
    assert (row["angles"], row["small_angles"], row["poses_without_iterative"]) == (3, 1, 0)
    row = percent_row(iterative, np.full((2, 2), np.nan))
    assert row["percent_error"] is None
    assert row["poses_without_iterative"] == 2


@pytest.mark.slow
def test_loop_agrees_with_the_iterative_method_where_it_arrives(quick):
    rows = quick["fusion-ir361-2-0"]
    [loop] = select(rows, part="loop", network="RBF as printed")
    assert loop["arrived"] == loop["poses"] == 20
    [path] = select(rows, part="path", network="RBF as printed", asked="the loop")
    assert as_number(path, "percent_error") < 0.05 < percent_error("RBF fusion")
    [iterative] = select(rows, part="iterative")
    assert iterative["solved"] == iterative["poses"] == 5


def test_fresh_poses_of_the_loop_are_verified_by_forward_kinematics():
    given = arm("ir361")
    near = region(given, 2.0, 0)
    solver = kv.Fusion(n_poses=30, region=near, fallback=None, random_state=1).fit(given)
    T = draw(given, 20, 2.0, 0, 5).T
    found = solver.solve(T)
    assert found.ok.all()
    reached_at = given.fk(found.q)[:, :3, 3]
    assert np.linalg.norm(reached_at - T[found.pose_index, :3, 3], axis=1).max() <= 2e-5


@pytest.mark.slow
def test_rms_rows_cover_all_joints_networks_and_splits(quick):
    rows = select(quick["held-out-ir361-2-0"], part="rms")
    kinds = {(row["method"], row["network"], row["split"]) for row in rows}
    assert len(kinds) == 12 and len(rows) == 72
    assert {method for method, _, _ in kinds} == {*METHODS, "constant fusion", "constant absolute"}
    assert {row["tested"] for row in select(rows, split="pose")} == {420}
    assert {row["tested"] for row in select(rows, split="pair")} == {1449}


@pytest.mark.slow
def test_the_constant_predictor_is_the_mean_of_its_training_patterns(quick):
    rows = select(quick["held-out-ir361-2-0"], part="rms", network=CONSTANT, split="sample")
    _, train, test = _absolute_patterns("ir361", 2.0, 0)
    rms = np.degrees(np.sqrt(np.mean((test.q - train.q.mean(axis=0)) ** 2, axis=0)))
    assert [row["rms_deg"] for row in rows] == pytest.approx(rms.tolist())
    table = TABLE_3.build({k: v for k, v in quick.items() if k.startswith("held-out")})
    told = select(table.rows, network=CONSTANT)
    assert [row["held out by"] for row in told] == ["pose", "pair", "sample"]
    assert {row["printed range met in"] for row in told} == {None}
    # its 1.2 deg in the region of +-2 deg is below the printed 1.32 to 1.95 deg
    assert "MLP absolute 1.32 to 1.95 deg: none of them (no region where the" in table.residual
    assert {row["network"] for row in SPLITS_TABLE.build(quick).rows}.isdisjoint({CONSTANT})


@pytest.mark.slow
def test_whole_workspace_is_out_of_reach_of_the_printed_ranges():
    rows = held_out_errors("ir361", WHOLE, 0, 1)
    for method in METHODS:
        worst = max(as_number(row, "rms_deg") for row in select(rows, part="rms", method=method))
        assert worst > 10.0 * limits_of_rms(method)[1]


def by_region(*medians):
    return {h: Spread(m, m, m, 1) for h, m in zip(REGIONS, medians, strict=False)}


FAR = by_region(9.0, 9.0, 9.0, 9.0, 9.0)


@pytest.mark.parametrize(
    ("ours", "where", "how"),
    [
        ((0.3, 0.4, 0.9), "±5 deg", How.PART),
        ((0.1, 0.2, 0.9), "between ±5 deg and ±10 deg", How.BETWEEN),
        ((0.9, 0.3, 0.3), "none of them", How.ABOVE),
        ((0.3, 0.3, 0.3, 0.3, 0.4), "whole workspace", How.WHOLE),
        ((0.1, 0.1, 0.1, 0.1, 0.1), "whole workspace", How.BELOW),
        ((0.1,), "±2 deg", How.BELOW),
    ],
)
def test_both_ends_of_a_printed_range_are_looked_at(ours, where, how):
    found = reached(by_region(*ours), (0.25, 0.5), FAR)
    assert (found.where, found.how) == (where, how)
    assert found.open is (len(ours) == 1)


def test_a_region_that_a_constant_reaches_too_says_nothing():
    ours = by_region(0.3, 0.4, 0.9)
    assert reached(ours, (0.25, 0.5), by_region(0.5, 2.0, 4.0)).where == "±5 deg"
    assert reached(ours, (0.25, 0.5), by_region(0.2, 0.5, 4.0)).how is How.TRIVIAL


def test_verdicts_follow_the_regions():
    whole, part, above, below, one = (
        reached(by_region(*ours), (0.25, 0.5), FAR)
        for ours in ([0.3] * 5, [0.3, 0.9], [0.9], [0.1] * 5, [0.1])
    )
    assert verdict([whole] * 4) is Verdict.REPRODUCED
    assert verdict([whole, part]) is Verdict.OTHER_READING
    assert verdict([part, above]) is Verdict.NOT_REPRODUCED
    assert verdict([whole, below]) is Verdict.NOT_REPRODUCED
    # one small region and none wider: nobody knows where the range is left
    assert verdict([part, one]) is Verdict.CANNOT_CHECK
    trivial = reached(by_region(0.3, 0.9), (0.25, 0.5), by_region(0.4, 9.0))
    assert verdict([part, trivial]) is Verdict.NOT_REPRODUCED


def _rms_row(method, network, split, half, seed, joint, rms):
    row = {"part": "rms", "robot": "ir361", "method": method, "network": network, "split": split}
    return row | {"half_deg": half, "seed": seed, "joint": joint, "rms_deg": rms}


def _table_3(rms, constant=90.0):
    """Table 3 of rows whose rms is rms(method, half) in joint 1, half of it in joint 2."""
    kinds = [("RBF fusion", "RBF as printed", "pair"), ("MLP fusion", "MLP", "pair")]
    kinds += [("RBF absolute", "RBF as printed", "sample"), ("MLP absolute", "MLP", "sample")]
    kinds += [("RBF fusion", "RBF scaled (ours)", "pair")]
    kinds += [(f"constant {split}", CONSTANT, split) for split in ("pair", "sample")]

    def error(kind, half):
        # ours would reach all: it does not count
        ours = {CONSTANT: constant, "RBF scaled (ours)": 0.1}
        return ours.get(kind[1]) or rms(kind[0], half)

    rows = [
        _rms_row(*kind, half, seed, joint, error(kind, half) / joint)
        for kind in kinds
        for half in (2.0, WHOLE)
        for seed in range(3)
        for joint in (1, 2)
    ]
    return TABLE_3.build({"held-out": rows})


def test_table_3_takes_the_worst_joint_and_every_method():
    def most(method, half):
        return limits_of_rms(method)[1]

    table = _table_3(most)
    assert table.verdict is Verdict.REPRODUCED
    assert [row["±2 deg [deg]"] for row in table.rows[:4]] == [0.11, 1.1, 0.34, 1.95]
    assert {row["seeds"] for row in table.rows} == {3} and "over 3 seeds" in table.note
    assert all("±2 deg [deg], lower quartile" in row for row in table.rows)
    table = _table_3(lambda method, half: most(method, half) * (1.0 if half == 2.0 else 9.0))
    assert table.verdict is Verdict.OTHER_READING
    assert "RBF fusion 0.02 to 0.11 deg: ±2 deg (inside" in table.residual
    assert _table_3(lambda method, half: 0.2).verdict is Verdict.NOT_REPRODUCED
    assert _table_3(most, constant=1.0).verdict is Verdict.NOT_REPRODUCED
    assert _table_3(lambda method, half: 0.01).verdict is Verdict.NOT_REPRODUCED


def test_the_process_counts_where_a_constant_does_not_arrive():
    def table(**arrived):
        rows = [
            {
                "part": "loop",
                "robot": "ir361",
                "network": network,
                "half_deg": half,
                "poses": 10,
                "arrived": count if half == 2.0 else 0,
                "rounds": 3.0,
                "position_error_mm": 0.01,
                "pose_us": 1.0,
            }
            for network, count in zip(NAMES, arrived.values(), strict=True)
            for half in (2.0, WHOLE)
        ]
        return FUSION.build({"fusion": rows}).verdict

    assert table(rbf=10, scaled=10, mlp=9, constant=0) is Verdict.OTHER_READING
    assert table(rbf=10, scaled=10, mlp=2, constant=0) is Verdict.NOT_REPRODUCED
    assert table(rbf=10, scaled=10, mlp=10, constant=10) is Verdict.NOT_REPRODUCED


NAMES = ("RBF as printed", "RBF scaled (ours)", "MLP", CONSTANT)


def test_spread_is_median_and_quartiles():
    assert spread_of([1.0, 2.0, 3.0, 4.0, 5.0]) == Spread(3.0, 2.0, 4.0, 5)
    assert spread_of([1.0, 2.0, 3.0]).columns("rms") == {
        "rms": 2.0,
        "rms, lower quartile": 1.5,
        "rms, upper quartile": 2.5,
    }
    with pytest.raises(ValueError, match="no values"):
        spread_of([])
    with pytest.raises(TypeError, match="'rms' holds None"):
        as_number({"rms": None}, "rms")


@pytest.mark.slow
@pytest.mark.parametrize("spec", STUDY.tables, ids=lambda spec: spec.name)
def test_tables_are_built_with_pictures_that_can_be_read_aloud(spec, quick):
    found = {
        cell.name: quick.get(cell.name) or check_rows(cell.function(**cell.arguments))
        for cell in spec.cells(True)
    }
    table = spec.build(found)
    assert table.rows and table.residual
    check_rows(table.rows)
    for picture in table.pictures:
        assert len(picture.alt) > 60
        assert picture.draw().axes


@pytest.mark.slow
def test_the_loop_does_not_arrive_in_the_whole_workspace():
    rows = run_fusion("ir361", WHOLE, 0, 2, 20)
    assert all(as_number(row, "arrived") <= 2 for row in select(rows, part="loop"))


def test_full_run_has_five_seeds_in_every_region():
    names = {cell.name for cell in held_out_cells(False)}
    for half in REGIONS:
        assert sum(name.startswith(f"held-out-ir361-{half:g}-") for name in names) == 5

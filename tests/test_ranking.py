"""Whole turns: the solution that is chosen is wound towards where the arm is."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.ranking import has_lost_rank, joint_distance, rewound, turning
from kinverse.robot import Robot
from kinverse.task import as_task


@pytest.fixture(scope="module")
def ur5():
    return kv.load("ur5")


def test_a_wrist_at_200_degrees_stays_there(ur5):
    q = np.radians([20, -70, 80, -100, 60, 200])
    s = kv.solve(ur5, ur5.fk(q))
    assert s.nearest(q)[0] == pytest.approx(q, abs=1e-9)
    near = np.radians([20, -70, 80, -100, 60, 190])
    assert np.degrees(s.nearest(near)[0, 5]) == pytest.approx(200.0)
    assert np.degrees(s.nearest(-near)[0, 5]) == pytest.approx(-160.0)
    # the errors are still true of what is returned
    assert np.allclose(ur5.fk(s.nearest(near)[0]), ur5.fk(q), atol=1e-9)


def test_nearest_is_the_best_of_all_windings(ur5):
    rng = np.random.default_rng(5)
    T = ur5.fk(ur5.random(10, rng))
    some = kv.solve(ur5, T)
    every = kv.solve(ur5, T, solver=kv.Analytic(windings="all"))
    near = ur5.random(10, rng)
    best = joint_distance(every.nearest(near), near)
    assert joint_distance(some.nearest(near), near) == pytest.approx(best, abs=1e-9)
    low, high = ur5.limits.T
    chosen = some.nearest(near)
    assert ((low - 1e-9 <= chosen) & (chosen <= high + 1e-9)).all()


def test_no_turn_leads_out_of_the_limits(ur5):
    q, near = np.radians([[0, 0, 170, 0, 0, -160]]), np.radians([[900, 0, -170, 0, 0, 350]])
    assert np.degrees(rewound(ur5, q, near)) == pytest.approx(np.array([[360, 0, 170, 0, 0, 200]]))
    free = np.degrees(rewound(ur5, q, near, "ignore"))
    # 900 is two turns and a half away: either neighbour is as near
    assert free[0, 2] == pytest.approx(-190) and free[0, 0] in (720, 1080)


def test_without_limits_any_turn_is_taken(ur5):
    q = np.radians([20, -70, 80, -100, 60, 1000])
    T = ur5.fk(q)
    free = kv.solve(ur5, T, solver=kv.Analytic(limits="ignore"))
    assert free.nearest(q)[0] == pytest.approx(q, abs=1e-9)
    held = kv.solve(ur5, T).nearest(q)[0]
    assert np.degrees(held[5]) == pytest.approx(280.0)


def test_slides_and_joints_with_an_odd_mimic_are_left_alone():
    def arm(ratio):
        return kv.Robot(
            np.tile(np.eye(4), (4, 1, 1)), "RRP", limits=[(-20, 20), (-20, 20)],
            source=[0, 0, 1], multiplier=[1.0, ratio, 1.0],
        )  # fmt: skip

    assert turning(arm(0.5)).tolist() == [False, False]
    assert turning(arm(-2.0)).tolist() == [True, False]
    q, near = np.zeros((1, 2)), np.full((1, 2), 12.0)
    assert rewound(arm(0.5), q, near).tolist() == [[0.0, 0.0]]
    assert rewound(arm(-2.0), q, near).tolist() == [[4 * np.pi, 0.0]]


def test_a_path_through_a_whole_turn_has_no_jump(ur5):
    start = np.radians([20, -70, 80, -100, 60, 100])
    path = start + np.linspace(0, 1, 30)[:, None] * np.radians([20, 10, 5, 10, 5, 200])
    s = kv.solve(ur5, ur5.fk(path))
    chosen = s.select("least_motion", start)
    assert chosen.q == pytest.approx(path, abs=1e-6)
    assert np.array_equal(chosen.count, np.ones(30))
    assert np.abs(np.diff(s.select("least_motion").q, axis=0)).max() < 0.2


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_rank_is_lost_where_an_axis_is_met_and_nowhere_else(size):
    half = np.pi / 2
    arm = Robot.from_dh(
        a=np.array([0, 0.43, 0.02, 0, 0, 0]) * size,
        d=np.array([0, 0, 0.15, 0.43, 0, 0.1]) * size,
        alpha=[half, 0, -half, half, -half, 0],
        joints="RRRRRR",
    )
    q = arm.random(50, 3)
    assert not has_lost_rank(arm, as_task("pose"), q).any()
    q[:, 4] = 0.0  # axes 4 and 6 in line
    assert has_lost_rank(arm, as_task("pose"), q).all()
    assert not has_lost_rank(arm, as_task("position"), q).any()
    assert has_lost_rank(arm, as_task("pose"), q[:0]).shape == (0,)


def test_the_flag_of_a_pose_is_that_of_its_solutions(puma):
    # a stretched elbow: two branches meet, no continuum
    q = puma.random(40, 3)
    q[:20, 2] = -np.arctan2(0.0203, 0.4318) + np.pi / 2
    T = puma.fk(q)
    s = kv.Analytic(limits="ignore").fit(puma).solve(T)
    lost = has_lost_rank(puma, as_task("pose"), s.q)
    expected = np.zeros(40, bool)
    expected[s.pose_index[lost]] = True
    np.testing.assert_array_equal(s.stats.singular, expected | s.stats.continuum)
    assert not s.stats.continuum.any()
    assert s[3].stats.singular == s.stats.singular[3]

"""Shorter arms and partial tasks in closed form."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.bench.arms import SHORT, random_short
from kinverse.solvers.analytic import Analytic

ON_AXIS = kv.pose([-0.3, 0.0, 0.0])


def wrapped(robot, difference):
    turns = np.array([kind == "R" for kind in robot.kinds])
    return np.where(turns, (difference + np.pi) % (2 * np.pi) - np.pi, difference)


@pytest.mark.parametrize("name", SHORT)
def test_short_arms_find_the_generating_configuration(name):
    robot = SHORT[name]()
    solver = Analytic().fit(robot)
    q = robot.random(150, rng=77)
    T = robot.fk(q)
    s = solver.solve(T)
    assert s.ok.all()
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-6
    assert set(s.pose_index[near]) == set(range(150))
    assert s.position_error.max() < 1e-9 and s.rotation_error.max() < 1e-9
    for values, i in zip(s.q[::9], s.pose_index[::9], strict=True):
        assert np.abs(oracle.robot_fk(robot, values) - T[i]).max() < 1e-8


@pytest.mark.parametrize("name", ["RRR", "RRRR", "RRRRR", "spherical", "elbow"])
def test_a_pose_off_the_reach_of_a_short_arm_is_not_solved(name):
    robot = SHORT[name]()
    T = robot.fk(robot.random(60, rng=3))
    T[:, :3, 3] += np.random.default_rng(4).normal(scale=0.05, size=(60, 3))
    s = Analytic().fit(robot).solve(T)
    assert not s.ok.any()
    assert (s.status == kv.Status.UNREACHABLE).mean() > 0.5
    searched = kv.Numerical(limits="ignore", max_starts=40).fit(robot).solve(T)
    assert not searched.ok.any()


@pytest.mark.parametrize(
    "kinds", ["PP", "PPR", "RPP", "PRPR", "PPRR", "PPRRR", "RPRPR", "RRRPP", "PRRRP"]
)
def test_no_reachable_pose_of_an_arm_with_slides_is_denied(kinds):
    """Slides leave an elimination with few roots: one that it loses is not to be taken for none."""
    robot = random_short(kinds)
    q = robot.random(3000, rng=8)
    s = Analytic().fit(robot).solve(robot.fk(q))
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-6
    assert set(s.pose_index[near]) == set(range(3000))


@pytest.mark.parametrize("kinds", ["PPR", "RPP", "PRP", "RRP", "RPR", "PRR", "PPP"])
def test_places_are_found_whatever_the_hand_does(kinds):
    robot = random_short(kinds)
    q = robot.random(1000, rng=8)
    T = robot.fk(q)
    T[:, :3, :3] = T[::-1, :3, :3]
    s = Analytic(task="position").fit(robot).solve(T)
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-6
    assert set(s.pose_index[near]) == set(range(1000))


def branches_by_search(robot, task, T, starts):
    """Every solution that many independent starts of the numerical solver end in."""
    solver = kv.Numerical(task=task, max_starts=1, method="lm").fit(robot)
    s = solver.solve(np.broadcast_to(T, (len(starts), 4, 4)).copy(), q_seed=starts)
    kept = []
    for q in s.q:
        if all(np.abs(wrapped(robot, q - k)).max() > 1e-4 for k in kept):
            kept.append(q)
    return kept


@pytest.mark.parametrize(
    ("make", "task"),
    [
        (SHORT["elbow"], "position"),
        (SHORT["spherical"], "position"),
        (SHORT["cylindrical"], "position"),
        (SHORT["RRR"], "position"),
        (SHORT["RRPRR"], "position_axis"),
        (SHORT["RRRRR"], "position_axis"),
    ],
)
def test_partial_tasks_give_every_branch(make, task):
    robot = make()
    solver = Analytic(task=task).fit(robot)
    q = robot.random(12, rng=5)
    T = robot.fk(q)
    s = solver.solve(T)
    assert s.ok.all()
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-6
    assert set(s.pose_index[near]) == set(range(12))
    starts = robot.random(150, rng=6)
    for i in range(4):
        for found in branches_by_search(robot, task, T[i], starts):
            assert np.abs(wrapped(robot, s[i].q - found)).max(axis=1).min() < 1e-4


def test_a_roll_that_the_task_leaves_free_has_no_closed_form():
    with pytest.raises(kv.NoClosedForm, match="joint5 turns about"):
        Analytic(task="position_axis").fit(kv.load("irb6"))


@pytest.mark.parametrize(
    ("robot", "task"),
    [
        (kv.load("planar3r"), "position"),
        (kv.Robot.from_dh(0.3, 0, [1.5, 0, 0], joints="RRR", tool=ON_AXIS), "position"),
        (random_short("PPPPP"), "position_axis"),
    ],
)
def test_joints_that_cannot_move_what_the_task_constrains(robot, task):
    with pytest.raises(kv.NoClosedForm, match="independently"):
        Analytic(task=task).fit(robot)


def test_tasks_that_do_not_close_the_system_are_refused():
    for name, task in [("puma560", "position"), ("kr16", "position_axis"), ("panda", "position")]:
        with pytest.raises(kv.NoClosedForm, match="close the system"):
            Analytic(task=task).fit(kv.load(name))
        assert kv.solve(kv.load(name), kv.load(name).fk(kv.load(name).random()), task=task).ok.all()

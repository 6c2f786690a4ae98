"""Shorter arms and partial tasks in closed form."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.bench.arms import SHORT
from kinverse.solvers.analytic import Analytic


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


def test_tasks_that_do_not_close_the_system_are_refused():
    for name, task in [("puma560", "position"), ("kr16", "position_axis"), ("panda", "position")]:
        with pytest.raises(kv.NoClosedForm, match="close the system"):
            Analytic(task=task).fit(kv.load(name))
        assert kv.solve(kv.load(name), kv.load(name).fk(kv.load(name).random()), task=task).ok.all()

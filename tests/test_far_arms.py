"""Far bases and tools, slides much longer than links: what an arm is must not drown in them."""

import pickle

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.solvers.analytic import Analytic

TURNED = kv.pose([0.0, 0.0, 0.0], rpy=[0.3, 0.2, 0.9])


def far(distance):
    T = TURNED.copy()
    T[:3, 3] = distance
    return T


def found(robot, q, s, close=1e-4):
    turns = np.array([kind == "R" for kind in robot.kinds])
    apart = s.q - q[s.pose_index]
    apart = np.where(turns, (apart + np.pi) % (2 * np.pi) - np.pi, apart)
    return len(set(s.pose_index[np.abs(apart).max(axis=1) < close]))


@pytest.mark.parametrize("distance", [1e3, 1e6, 1e8])
@pytest.mark.parametrize("name", ["ur5", "puma560", "jaco2", "adept_one", "planar3r"])
def test_a_far_base_or_tool_costs_no_solution(name, distance):
    for robot in (kv.load(name).with_base(far(distance)), kv.load(name).with_tool(far(distance))):
        q = robot.random(100, rng=1)
        T = robot.fk(q)
        solver = Analytic().fit(robot)
        s = solver.solve(T)
        assert s.ok.all()
        assert found(robot, q, s) >= 98  # at 1e8 m a digit is 1.5e-8 m: close ones merge
        assert np.array_equal(pickle.loads(pickle.dumps(solver)).solve(T).q, s.q)
        for values, i in zip(s.q[::40], s.pose_index[::40], strict=True):
            assert np.abs(oracle.robot_fk(robot, values)[:3, 3] - T[i][:3, 3]).max() < 2e-6


@pytest.mark.parametrize("name", ["ur5", "puma560", "jaco2", "irb6"])
@pytest.mark.parametrize("distance", [1e7, 1e9, 1e11])
def test_no_reachable_pose_is_denied_for_its_digits(name, distance):
    for robot in (kv.load(name).with_base(far(distance)), kv.load(name).with_tool(far(distance))):
        s = Analytic().fit(robot).solve(robot.fk(robot.random(60, rng=1)))
        assert np.isin(s.status, (kv.Status.SOLVED, kv.Status.NOT_FOUND)).all()


def test_far_poses_of_an_arm_with_a_far_base_are_shown_to_be_out_of_reach():
    robot = kv.load("ur5").with_base(far(1e6))
    T = robot.fk(robot.random(40, rng=2))
    T[:, :3, 3] += 2.0
    assert (Analytic().fit(robot).solve(T).status == kv.Status.UNREACHABLE).all()


def test_seven_joints_on_a_far_base():
    robot = kv.load("iiwa14").with_base(far(1e6))
    q = robot.random(40, rng=3)
    T = robot.fk(q)
    solver = Analytic().fit(robot)
    assert solver.redundancy_ == "arm_angle"
    assert found(robot, q, solver.solve_at(T, solver.redundancy_at(q))) == 40
    assert solver.solve(T[:4]).ok.all()


@pytest.mark.parametrize("task", ["planar", "schoenflies"])
def test_partial_tasks_on_a_far_base(task):
    robot = kv.load("planar3r" if task == "planar" else "adept_one")
    base = np.eye(4)
    base[:3, 3] = 1e6
    robot = robot.with_base(base)
    q = robot.random(60, rng=1)
    assert found(robot, q, Analytic(task=task).fit(robot).solve(robot.fk(q))) == 60


@pytest.mark.parametrize("stroke", [1.0, 50.0, 2000.0, 1e9])
@pytest.mark.parametrize("kinds", ["RP", "PRR"])
def test_a_long_slide_on_short_links_is_not_denied(kinds, stroke):
    limits = [(-3, 3) if kind == "R" else (-stroke, stroke) for kind in kinds]
    a = [0.0, 0.001] if kinds == "RP" else [0.0, 4e-3, 3e-3]
    robot = kv.Robot.from_dh(a=a, d=0, alpha=0, joints=kinds, limits=limits)
    q = robot.random(500, rng=2)
    T = robot.fk(q)
    s = Analytic().fit(robot).solve(T)
    assert not np.isin(s.status, (kv.Status.UNREACHABLE, kv.Status.OUT_OF_LIMITS)).any()
    if stroke < 1e3:
        assert s.ok.all()
    assert (s.position_error < 1e-6).all()

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


HALF = np.pi / 2
CONTINUA = {
    "two slides on a line": ([0.1, 0.2, 0.1], 0, [0, 1.2, 0.3], "PPR", 0.2),
    "slides on a line": (0, 0, 0, "PP", 0.5),
    "two turns on a line": ([0, 0.3, 0.2], [0.1, 0.1, 0], [0, 1, 0], "RRR", 1.0),
    "a slide between": ([0.2, 0.1, 0.3, 0.2], 0, [0, 1.0, -1.0, 0.4], "RPRR", 0.7),
    "apart by turns": ([0, 0, 0.3, 0.2], [0.1, 0.2, 0, 0.1], [0, 0, 1.1, 0.3], "RRPP", 0.6),
}


def continuum(name):
    a, d, alpha, kinds, bound = CONTINUA[name]
    limits = [(-bound, bound)] * len(kinds)
    return kv.Robot.from_dh(a, d, alpha, joints=kinds, limits=limits)


@pytest.mark.parametrize("name", CONTINUA)
def test_joints_that_repeat_each_other_deny_no_pose(name):
    """Roots of a continuum mean nothing: members inside the limits, flagged, and no proof."""
    robot = continuum(name)
    q = robot.random(200, rng=1)
    s = kv.solve(robot, robot.fk(q))
    assert s.ok.all()
    s = Analytic().fit(robot).solve(robot.fk(q))
    assert not np.isin(s.status, (kv.Status.UNREACHABLE, kv.Status.OUT_OF_LIMITS)).any()
    assert s.ok.mean() > 0.98
    if len(robot.kinds) < 4:
        assert s.stats.singular.all()
        near = Analytic().fit(robot).solve(robot.fk(q), q_seed=q)
        assert near.ok.all()
        assert np.abs(near.nearest(q) - q).max() < 1e-6


def off(T, by, rng):
    """Poses moved by a length in a random direction."""
    T = T.copy()
    way = rng.normal(size=(len(T), 3))
    T[:, :3, 3] += by * way / np.linalg.norm(way, axis=1, keepdims=True)
    return T


@pytest.mark.parametrize("name", SHORT)
def test_a_pose_within_the_tolerances_is_solved_and_never_denied(name):
    robot = SHORT[name]()
    rng = np.random.default_rng(9)
    q = robot.random(300, rng=1)
    turns = np.array([kind == "R" for kind in robot.kinds])
    special = turns & (rng.random(q.shape) < 0.3) & (rng.random((300, 1)) < 0.5)
    q = np.where(special, rng.choice([0, HALF, -HALF, 1e-3], q.shape), q)
    T = robot.fk(np.clip(q, *robot.limits.T))
    solver = Analytic(limits="ignore").fit(robot)
    for by, share in ((0.0, 1.0), (3e-7, 1.0), (9.5e-7, 0.95)):
        s = solver.solve(off(T, by, rng))
        assert s.ok.mean() >= share
        assert not (s.status == kv.Status.UNREACHABLE).any()
    assert solver.solve(np.round(T, 7)).ok.mean() > 0.97


@pytest.mark.parametrize("name", ["RR", "RRR", "planar2r", "elbow", "spherical", "RRP"])
def test_a_millimetre_off_the_reach_of_a_short_arm_is_shown(name):
    robot = SHORT[name]()
    T = off(robot.fk(robot.random(100, rng=1)), 1e-3, np.random.default_rng(3))
    s = Analytic(limits="ignore").fit(robot).solve(T)
    # with a slide the evidence of the roots is weak more often, and weak evidence shows nothing
    assert (s.status == kv.Status.UNREACHABLE).mean() > (0.5 if "P" in robot.kinds else 0.7)
    shown = np.flatnonzero(s.status == kv.Status.UNREACHABLE)[:20]
    searched = kv.Numerical(limits="ignore", max_starts=40).fit(robot).solve(T[shown])
    assert not searched.ok.any()


def test_what_the_joints_do_not_move_shows_that_a_pose_is_out_of_reach():
    tilted = kv.pose([0, 0, 0], rpy=[0.1, 0.2, 0.3])
    for name in ("cartesian", "PP", "planar2r"):
        robot = SHORT[name]()
        T = robot.fk(robot.random(50, rng=1)) @ tilted
        s = Analytic().fit(robot).solve(T)
        assert (s.status == kv.Status.UNREACHABLE).all()
        assert set(s.stats.evidence.method) == {"bounds"}


ALMOST_SHORT = {
    "5R": ([0, 0.4, 0.3, 0, 0], [0.3, 0, 0, 0, 0.2], [HALF, 0, 0, HALF, 0], "RRRRR", 4),
    "SCARA": ([0.4, 0.3, 0, 0], [0.3, 0, 0, 0.1], [0, np.pi, 0, 0], "RRPR", 2),
    "planar": ([0.4, 0.3, 0.2], [0, 0, 0], [0, 0, 0], "RRR", 2),
    "lift": ([0, 0], [0, 0], [0, 0], "RP", 1),
}


@pytest.mark.parametrize("off_by", [1e-12, 1e-10, 1e-9, 3e-9, 2e-8])
@pytest.mark.parametrize("name", ALMOST_SHORT)
def test_an_almost_special_short_arm_loses_no_branch(name, off_by):
    a, d, alpha, kinds, branches = ALMOST_SHORT[name]
    rng = np.random.default_rng(7)
    a, d, alpha = (
        np.array(row, float) + off_by * rng.normal(size=len(row)) for row in (a, d, alpha)
    )
    limits = [(-3.1, 3.1) if kind == "R" else (-1, 1) for kind in kinds]
    robot = kv.Robot.from_dh(a, d, alpha, joints=kinds, limits=limits)
    q = robot.random(200, rng=2)
    s = Analytic(limits="ignore").fit(robot).solve(robot.fk(q))
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-5
    assert len(set(s.pose_index[near])) >= 199
    assert s.count.mean() > branches - 0.02


@pytest.mark.parametrize("name", ["RRRRR", "elbow", "PRRRR"])
def test_a_pose_is_polished_alike_alone_and_in_a_batch(name):
    robot = SHORT[name]()
    T = off(robot.fk(robot.random(40, rng=1)), 3e-7, np.random.default_rng(3))
    solver = Analytic(limits="ignore").fit(robot)
    s = solver.solve(T)
    for i in range(0, 40, 7):
        assert np.array_equal(solver.solve(T[i]).q, s[i].q)


def test_members_of_continua_are_found_alike_alone_and_in_a_batch():
    robot = continuum("two turns on a line")
    T = robot.fk(robot.random(20, rng=1))
    solver = Analytic().fit(robot)
    s = solver.solve(T)
    for i in range(0, 20, 7):
        assert np.array_equal(solver.solve(T[i]).q, s[i].q)


def short_arm(seed):
    """One to five joints as they are built: right angles, zero lengths, slides side by side."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    kinds = "".join(rng.choice(["R", "P"], n, p=[0.6, 0.4]))
    alpha = rng.choice([0, HALF, -HALF, np.pi, 1.1, 2.3], n)
    a, d = (rng.choice([0, 0.3, 1], n) * rng.uniform(0.5, 1.5, n) for _ in range(2))
    limits = [(-np.pi, np.pi) if kind == "R" else (-1, 1) for kind in kinds]
    return kv.Robot.from_dh(a, d, alpha, rng.choice([0, HALF, 0.7], n), kinds, limits=limits)


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_no_reachable_pose_of_any_short_arm_is_denied(first):
    solved = []
    for seed in range(first, first + 20):
        robot = short_arm(seed)
        rng = np.random.default_rng(seed)
        q = robot.random(60, rng=rng)
        turns = np.array([kind == "R" for kind in robot.kinds])
        special = turns & (rng.random(q.shape) < 0.2)
        q = np.where(special, rng.choice([0, HALF, -HALF, 1e-3], q.shape), q)
        s = Analytic().fit(robot).solve(robot.fk(q))
        assert np.isin(s.status, (kv.Status.SOLVED, kv.Status.NOT_FOUND)).all()
        solved.append(s.ok.mean())
    assert np.mean(solved) > 0.99

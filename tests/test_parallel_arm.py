"""Closed forms of "planar" and "schoenflies", for arms whose turning axes are all parallel."""

from itertools import product

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.solvers.analytic import Analytic

HALF = np.pi / 2
Z = np.array([0.0, 0.0, 1.0])
TILTED = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
CHAINS = [
    (task, "".join(kinds))
    for task, n in (("planar", 3), ("schoenflies", 4))
    for kinds in product("RP", repeat=n)
    if 0 < kinds.count("R") < 4
]
every_chain = pytest.mark.parametrize(("task", "kinds"), CHAINS)


def frame_along(z, rng):
    x = np.cross(z, rng.normal(size=3))
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    return oracle.homogeneous(R, rng.uniform(-0.5, 0.5, 3))


def chain(kinds, rng, axis=Z, slides="any"):
    """Joint axes at random places: turns along axis or against it, slides anywhere or across it."""
    stations = [np.eye(4)]
    for kind in kinds:
        way = axis * rng.choice([-1, 1])
        if kind == "P":
            way = rng.normal(size=3)
            way = way - (way @ axis) * axis if slides == "flat" else way
        stations.append(frame_along(way / np.linalg.norm(way), rng))
    stations.append(oracle.homogeneous(oracle.about(rng.normal(size=3), 2.0), rng.normal(size=3)))
    frames = [np.linalg.inv(a) @ b for a, b in zip(stations, stations[1:], strict=False)]
    limits = [(-3.0, 3.0) if kind == "R" else (-0.6, 0.6) for kind in kinds]
    return kv.Robot(np.array(frames), kinds, limits, name=kinds)


def spoiled(task, T, rng):
    """The same targets for the task: other tilts, and heights where these are free."""
    out = T.copy()
    for i in range(len(T)):
        tilt = rng.normal(size=2)
        tilt *= rng.uniform(0.0, 2.5) / np.linalg.norm(tilt)
        out[i, :3, :3] = oracle.about([*tilt, 0.0], np.linalg.norm(tilt)) @ T[i, :3, :3]
    if task == "planar":
        out[:, 2, 3] += rng.normal(size=len(T))
    return out


def wrapped(robot, difference):
    turns = np.array([kind == "R" for kind in robot.kinds])
    return np.where(turns, (difference + np.pi) % (2 * np.pi) - np.pi, difference)


def assert_found(robot, task, q, T, s):
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < 1e-6
    assert set(s.pose_index[near]) == set(range(len(q)))
    for k in range(0, len(s.q), 41):
        reached = oracle.robot_fk(robot, s.q[k])
        assert max(oracle.errors(task, T[s.pose_index[k]], reached)) < 1e-9


@every_chain
@pytest.mark.parametrize("axis", [Z, TILTED], ids=["upright", "tilted"])
def test_the_generating_configuration_is_found(task, kinds, axis):
    rng = np.random.default_rng(CHAINS.index((task, kinds)))
    robot = chain(kinds, rng, axis)
    q = robot.random(1000, rng)
    T = spoiled(task, robot.fk(q), rng)
    assert_found(robot, task, q, T, Analytic(task=task).fit(robot).solve(T))


@pytest.mark.parametrize("kinds", [kinds for task, kinds in CHAINS if task == "planar"])
def test_arms_that_stay_in_a_plane(kinds):
    rng = np.random.default_rng(len(kinds))
    robot = chain(kinds, rng, slides="flat")
    q = robot.random(1000, rng)
    T = spoiled("planar", robot.fk(q), rng)
    assert_found(robot, "planar", q, T, Analytic(task="planar").fit(robot).solve(T))


@every_chain
def test_no_branch_is_missing(task, kinds):
    """Every solution that many starts of the numerical solver end in is listed."""
    rng = np.random.default_rng(CHAINS.index((task, kinds)))
    robot = chain(kinds, rng)
    T = spoiled(task, robot.fk(robot.random(3, rng)), rng)
    s = Analytic(task=task).fit(robot).solve(T)
    search = kv.Numerical(task=task, max_starts=1, tol_position=1e-12, tol_rotation=1e-12)
    search.fit(robot)
    starts = robot.random(60, rng)
    for i in range(3):
        found = search.solve(np.broadcast_to(T[i], (60, 4, 4)).copy(), q_seed=starts)
        assert len(found.q)
        away = np.abs(wrapped(robot, found.q[:, None] - s[i].q[None])).max(axis=2)
        assert away.min(axis=1).max() < 1e-4


@every_chain
def test_out_of_reach_is_said_only_where_no_search_succeeds(task, kinds):
    rng = np.random.default_rng(CHAINS.index((task, kinds)))
    robot = chain(kinds, rng)
    T = spoiled(task, robot.fk(robot.random(200, rng)), rng)
    T[:, :3, 3] += rng.normal(scale=2.0, size=(200, 3))
    s = Analytic(task=task, limits="ignore").fit(robot).solve(T)
    denied = np.flatnonzero(s.status == kv.Status.UNREACHABLE)
    if kinds.count("R") == 1:
        assert s.ok.all()  # slides without limits go anywhere
    elif kinds.count("R") == 3:
        assert len(denied) > 20
    search = kv.Numerical(task=task, limits="ignore", max_starts=40).fit(robot)
    assert not search.solve(T[denied[:20]]).ok.any()
    assert (s.ok | (s.status == kv.Status.UNREACHABLE)).mean() > 0.99


@pytest.mark.parametrize("task", ["planar", "schoenflies"])
def test_the_edge_of_the_reach(task):
    """Stretched: 0.4 um beyond is within the tolerance, 4 um beyond is out of reach."""
    name = {"planar": "planar3r", "schoenflies": "adept_one"}[task]
    robot = kv.load(name)
    q = robot.limits.mean(axis=1)
    q[1] = 0.0
    T = np.repeat(robot.fk(q)[None], 3, axis=0)
    first = robot.frames[0] @ oracle.joint_motion("R", q[0])
    out = first[:3, :3] @ robot.frames[1][:3, 3] * [1.0, 1.0, 0.0]
    T[:, :3, 3] += np.outer([0.0, 4e-7, 4e-6], out / np.linalg.norm(out))
    s = Analytic(task=task, limits="ignore").fit(robot).solve(T)
    assert s.ok[:2].all() and s.status[2] == kv.Status.UNREACHABLE


@pytest.mark.parametrize(
    ("task", "kinds"),
    [("planar", "RRR"), ("planar", "PRP"), ("schoenflies", "RRPR"), ("schoenflies", "RPPP")],
)
def test_the_contract(task, kinds):
    kv.check_solver(Analytic(task=task), chain(kinds, np.random.default_rng(3)))


@pytest.mark.parametrize(("name", "task"), [("planar3r", "planar"), ("adept_one", "schoenflies")])
def test_arms_of_the_catalogue(name, task):
    robot = kv.load(name)
    kv.check_solver(Analytic(task=task), robot)
    q = robot.random(200, 3)
    T = spoiled(task, robot.fk(q), np.random.default_rng(4))
    s = kv.solve(robot, T, task=task)
    assert_found(robot, task, q, T, s)
    assert set(s.branch_labels) <= {"elbow+", "elbow-"}


def test_a_tool_that_stands_on_its_head_may_turn_as_it_likes():
    """Half a turn about a level axis away, the rotation that is left over has no part about z."""
    robot = kv.load("adept_one")
    solver = Analytic(task="schoenflies").fit(robot)
    q = robot.random(30, 5)
    T = robot.fk(q)
    for i, level in enumerate(np.random.default_rng(6).normal(size=(30, 2))):
        T[i, :3, :3] = oracle.about([*level, 0.0], np.pi) @ T[i, :3, :3]
    s = solver.solve(T, q_seed=q)
    assert s.ok.all() and s.stats.singular.all()
    assert np.abs(s.nearest(q) - q).max() < 1e-9
    assert solver.solve(T).ok.all()


def test_links_of_equal_length_folded_on_each_other():
    """The wrist on the first axis: that joint is free."""
    limits = [(-1.0, 2.0), (-4.0, 4.0), (-3.0, 3.0)]
    robot = kv.Robot.from_dh([0.3, 0.3, 0.1], 0, 0, joints="RRR", limits=limits)
    solver = Analytic(task="planar").fit(robot)
    q = np.column_stack([np.linspace(-0.9, 1.9, 40), np.full(40, np.pi), np.linspace(-1, 1, 40)])
    s = solver.solve(robot.fk(q))
    assert s.ok.all() and s.stats.singular.all()
    near = solver.solve(robot.fk(q), q_seed=q).nearest(q)
    assert np.abs(near - q).max() < 1e-6


def test_slides_that_come_to_lie_side_by_side():
    """The second slide is carried round until both go one way: a continuum, or out of reach."""
    across = oracle.homogeneous(oracle.rot_y(HALF))
    frames = np.array([across, across.T, across, np.eye(4)])
    robot = kv.Robot(frames, "PRP", [(-1, 1), (-3, 3), (-1, 1)])
    solver = Analytic(task="planar").fit(robot)
    q = np.array([[0.2, 0.0, 0.3], [-0.4, 0.0, 0.1]])
    s = solver.solve(robot.fk(q), q_seed=q)
    assert s.ok.all() and s.stats.singular.all()
    np.testing.assert_allclose(s.nearest(q), q, atol=1e-9)
    T = robot.fk(q)
    T[:, 1, 3] += 0.1
    assert not solver.solve(T).ok.any()


def test_windings_and_limits():
    robot = kv.load("planar3r").with_limits([(-7.0, 7.0), (-3.0, 3.0), (-7.0, 7.0)])
    q = np.array([[0.4, 1.0, -0.3]])
    T = robot.fk(q)
    both = Analytic(task="planar").fit(robot).solve(T).q
    turns = np.array([[i, 0, k] for i in range(-3, 4) for k in range(-3, 4)]) * 2.0 * np.pi
    every = (both[:, None] + turns).reshape(-1, 3)
    every = every[(np.abs(every) <= robot.limits[:, 1]).all(axis=1)]
    many = Analytic(task="planar", windings="all").fit(robot).solve(T).q
    assert len(both) == 2 and len(many) == len(every) > 8
    assert np.abs(many[:, None] - every).max(axis=2).min(axis=1).max() < 1e-9
    tight = robot.with_limits([(-7.0, 7.0), (-0.5, 0.5), (-7.0, 7.0)])
    assert Analytic(task="planar").fit(tight).solve(T).status[0] == kv.Status.OUT_OF_LIMITS
    assert Analytic(task="planar", limits="ignore").fit(tight).solve(T).count[0] == 2


@pytest.mark.parametrize(
    ("robot", "task", "message"),
    [
        (kv.Robot.from_dh(0.3, 0.1, [0, HALF, 0], joints="RRR"), "planar", "joint1 and joint3"),
        (chain("RRRR", np.random.default_rng(0)), "schoenflies", "move 3 of them"),
        (chain("RRRP", np.random.default_rng(0), slides="flat"), "schoenflies", "move 3 of them"),
        (chain("PPPP", np.random.default_rng(0)), "schoenflies", "slides only"),
        (kv.load("puma560"), "schoenflies", "schoenflies with four"),
        (kv.load("adept_one"), "planar", "planar with three"),
    ],
)
def test_arms_that_the_task_does_not_close(robot, task, message):
    with pytest.raises(kv.NoClosedForm, match=message):
        Analytic(task=task).fit(robot)


def test_joints_that_stand_at_a_shift_of_their_value_are_refused():
    """The closed forms work on the frames alone, and would deny poses that the arm reaches."""
    straight = chain("RRR", np.random.default_rng(1))
    for task, more in product(("pose", "planar", "position"), ({"offset": [0.3, 0, 0]}, {})):
        shifted = kv.Robot(straight.frames, "RRR", source=[1, 0, 2] if not more else None, **more)
        with pytest.raises(kv.NoClosedForm, match="multiple or a shift"):
            Analytic(task=task).fit(shifted)

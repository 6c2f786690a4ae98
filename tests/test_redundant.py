"""Seven joints: every branch at a value of the free parameter, and every range that has one."""

import pickle

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import kernels
from kinverse.conformance import check_solver
from kinverse.robot_class import robot_class
from kinverse.solvers.analytic import Analytic
from kinverse.status import Status

HALF = np.pi / 2
TURN = 2 * np.pi


def skew_srs(rng):
    """Spherical shoulder and wrist without a right angle, and an elbow with offsets."""
    alpha = np.array([1.3, -1.4, 1.2, -1.5, 1.1, -1.3, 0.4])
    a = np.array([0, 0, 0.06, -0.05, 0, 0, 0.02])
    d = np.array([0.3, 0, 0.41, 0.03, 0.38, 0, 0.1])
    return kv.Robot.from_dh(
        a, d, alpha, rng.uniform(-1, 1, 7), joints="R" * 7, limits=[(-2.8, 2.8)] * 7, name="skew"
    )


def turned_round(robot):
    """The same arm held by its hand: T(q) of the new one is the inverse, joints reversed."""
    inverse = [np.linalg.inv(frame) for frame in robot.frames]
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    frames = [inverse[-1] @ flip]
    frames += [flip @ frame @ flip for frame in inverse[-2:0:-1]]
    frames += [flip @ inverse[0]]
    return kv.Robot(np.array(frames), robot.kinds[::-1], robot.limits[::-1], name="turned_round")


ARMS = {
    "iiwa14": lambda: (kv.load("iiwa14"), None),
    "panda": lambda: (kv.load("panda"), None),
    "iiwa14 joint 7": lambda: (kv.load("iiwa14"), 6),
    "iiwa14 joint 1": lambda: (kv.load("iiwa14"), "joint1"),
    "panda by its hand": lambda: (turned_round(kv.load("panda")), None),
    "skew shoulder and wrist": lambda: (skew_srs(np.random.default_rng(3)), None),
    "skew joint 7": lambda: (skew_srs(np.random.default_rng(4)), 6),
}


@pytest.fixture(scope="module", params=list(ARMS))
def arm(request):
    robot, redundancy = ARMS[request.param]()
    return robot, Analytic(redundancy=redundancy).fit(robot)


def wrapped(difference):
    return (difference + np.pi) % TURN - np.pi


def found(s, q, within=1e-6):
    near = np.abs(wrapped(s.q - q[s.pose_index])).max(axis=1) < within
    hit = np.zeros(len(s), bool)
    hit[s.pose_index[near]] = True
    return hit


def assert_true(robot, T, s, tolerance=1e-9, every=7):
    assert s.position_error.max(initial=0) <= tolerance
    assert s.rotation_error.max(initial=0) <= tolerance
    for q, i in zip(s.q[::every], s.pose_index[::every], strict=True):
        reached = oracle.robot_fk(robot, q)
        assert np.linalg.norm(reached[:3, 3] - T[i, :3, 3]) <= tolerance
        assert oracle.angle_between(reached[:3, :3], T[i, :3, :3]) <= tolerance
    low, high = robot.limits.T
    assert (s.q >= low).all() and (s.q <= high).all()


def sweep_range(robot, redundancy):
    return (-np.pi, np.pi) if redundancy == "arm_angle" else robot.limits[redundancy]


def poses(robot, count, rng=71):
    q = robot.random(count, rng=rng)
    return q, robot.fk(q)


def test_the_class_of_a_robot_names_the_free_parameter():
    names = {name: robot_class(kv.load(name)).free_parameter for name in ("iiwa14", "panda", "ur5")}
    assert names == {"iiwa14": "the arm angle", "panda": "panda_joint7", "ur5": None}


# At a value -------------------------------------------------------------------------------------


def test_what_is_chosen():
    chosen = {name: Analytic().fit(kv.load(name)).redundancy_ for name in ("iiwa14", "panda")}
    assert chosen == {"iiwa14": "arm_angle", "panda": 6}
    assert Analytic().fit(turned_round(kv.load("panda"))).redundancy_ == 0
    assert Analytic(redundancy="panda_joint7").fit(kv.load("panda")).redundancy_ == 6
    assert Analytic().fit(kv.load("puma560")).redundancy_ is None


def generating_configuration_is_found(robot, solver, count):
    q, T = poses(robot, count)
    s = solver.solve_at(T, solver.redundancy_at(q))
    assert found(s, q).all()
    assert_true(robot, T, s)


def test_generating_configuration_is_found_at_its_own_value(arm):
    generating_configuration_is_found(*arm, 3000)


@pytest.mark.slow
def test_generating_configuration_of_ten_thousand(arm):
    generating_configuration_is_found(*arm, 10_000)


def test_solutions_have_the_value_they_were_asked_for(arm):
    robot, solver = arm
    _, T = poses(robot, 200)
    low, high = sweep_range(robot, solver.redundancy_)
    value = np.random.default_rng(1).uniform(low, high, 200)
    s = solver.solve_at(T, value)
    got = solver.redundancy_at(s.q)
    assert len(got) > 100
    assert np.abs(wrapped(got - value[s.pose_index])).max() < 1e-6
    free = Analytic(redundancy=solver.redundancy_, limits="ignore").fit(robot)
    most = free.solve_at(T, value).count.max()
    assert most == 8


def test_arm_angle_is_where_the_elbow_is():
    robot = kv.load("iiwa14")
    solver = Analytic().fit(robot)
    q, T = poses(robot, 50)
    s = solver.solve_at(T, 0.7)
    shoulder, elbow_to = np.array([0, 0, 0.36]), 0.42
    for joints, i in zip(s.q, s.pose_index, strict=True):
        upper = oracle.rot_z(joints[0]) @ oracle.rot_y(joints[1])
        elbow = elbow_to * upper[:, 2]
        wrist = T[i, :3, 3] - 0.126 * T[i, :3, 2] - shoulder
        line = wrist / np.linalg.norm(wrist)
        up = np.array([0, 0, 1]) - line[2] * line
        up /= np.linalg.norm(up)
        angle = np.arctan2(elbow @ np.cross(line, up), elbow @ up)
        assert abs(wrapped(angle - 0.7)) < 1e-7


def test_one_value_many_values_and_seeds():
    robot = kv.load("iiwa14")
    solver = Analytic().fit(robot)
    q, T = poses(robot, 20)
    value = solver.redundancy_at(q)
    one = solver.solve_at(T[3], 0.5)
    assert len(one) == 1 and np.array_equal(one.q, solver.solve_at(T[3:4], [0.5]).q)
    many = solver.solve_at(T[0], np.linspace(-3, 3, 7))
    assert len(many) == 7
    assert len(solver.solve_at(T, 0.1)) == 20
    seeded = solver.solve_at(T, value, q_seed=q)
    first = np.concatenate([[0], np.cumsum(seeded.count)[:-1]])
    assert np.abs(seeded.q[first] - q).max() < 1e-6
    assert len(solver.solve_at(T[:0], 0.1)) == 0
    assert np.array_equal(solver.solve_at(T.tolist(), 0.1).q, solver.solve_at(T, 0.1).q)


def test_a_batch_at_values_is_its_single_poses(arm):
    robot, solver = arm
    q, T = poses(robot, 37)
    value = solver.redundancy_at(q)
    whole = solver.solve_at(T, value)
    for i in range(0, 37, 5):
        alone = solver.solve_at(T[i], value[i])
        assert alone.q.tobytes() == whole[i].q.tobytes()
        assert alone.position_error.tobytes() == whole[i].position_error.tobytes()


# Over all values --------------------------------------------------------------------------------


def a_solution_is_found(robot, solver, count):
    q, T = poses(robot, count, rng=72)
    s = solver.solve(T)
    assert s.ok.all()
    assert_true(robot, T, s)
    value = solver.redundancy_at(q)
    iv = s.intervals
    own = value[iv.pose_index]
    holds = np.zeros(len(own), bool)
    for turn in (0, TURN):
        holds |= (iv.low - 1e-6 <= own + turn) & (own + turn <= iv.high + 1e-6)
    hit = np.zeros(count, bool)
    hit[iv.pose_index[holds]] = True
    assert hit.all()


def test_a_solution_of_every_reachable_pose_is_found(arm):
    a_solution_is_found(*arm, 200)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_a_solution_of_ten_thousand_poses(name):
    robot = kv.load(name)
    a_solution_is_found(robot, Analytic().fit(robot), 10_000)


def feasible(solver, T, value, branch):
    """Whether a branch exists inside the limits at a value, judged by the oracle."""
    robot = solver.robot_
    # tight: just beyond an end a near miss is within the usual tolerances
    free = Analytic(
        redundancy=solver.redundancy_, limits="ignore", tol_position=1e-9, tol_rotation=1e-9
    )
    s = free.fit(robot).solve_at(T, value)
    rows = s.q[s.branch == branch]
    if not len(rows):
        return False
    q = rows[0]
    middle = robot.limits.mean(axis=1)
    q = middle + wrapped(q - middle)
    low, high = robot.limits.T
    reached = oracle.robot_fk(robot, q)
    assert np.linalg.norm(reached - T) < 1e-8
    return bool(((low <= q) & (q <= high)).all())


def test_ends_of_intervals_are_boundaries(arm):
    robot, solver = arm
    _, T = poses(robot, 12, rng=73)
    s = solver.solve(T)
    joint = solver.redundancy_
    checked = 0
    for pose, branch, low, high in zip(*s.intervals, strict=True):
        assert low <= high
        if high - low > TURN - 1e-9:
            continue
        for end, way in ((low, -1), (high, 1)):
            width = min(1e-5, (high - low) / 4)
            assert feasible(solver, T[pose], end - way * width, branch)
            if joint != "arm_angle" and np.abs(robot.limits[joint] - end).min() < 1e-9:
                continue
            assert not feasible(solver, T[pose], end + way * 1e-5, branch)
            checked += 1
    assert checked > 20


def test_intervals_are_complete(arm):
    """No value of a fine grid has a branch that no interval holds."""
    robot, solver = arm
    _, T = poses(robot, 6, rng=74)
    s = solver.solve(T)
    joint = solver.redundancy_
    low, high = sweep_range(robot, joint)
    grid = np.linspace(low, high, 5001)
    for i in range(len(T)):
        at = solver.solve_at(T[i], grid)
        mine = s.intervals.pose_index == i
        for branch in range(8):
            rows = mine & (s.intervals.branch == branch)
            holds = np.zeros(len(grid), bool)
            for a, b in zip(s.intervals.low[rows], s.intervals.high[rows], strict=True):
                for turn in (-TURN, 0, TURN):
                    holds |= (a - 1e-6 <= grid + turn) & (grid + turn <= b + 1e-6)
            has = np.zeros(len(grid), bool)
            has[at.pose_index[at.branch == branch]] = True
            assert (holds | ~has).all()
            # a gap between two values of the grid may lie inside; beyond that both agree
            assert (holds & ~has).sum() <= 2


def test_one_solution_of_each_interval():
    robot = kv.load("iiwa14")
    _, T = poses(robot, 30)
    s = Analytic().fit(robot).solve(T)
    solver = Analytic().fit(robot)
    count = np.bincount(s.intervals.pose_index, minlength=30)
    assert np.array_equal(count, s.count)
    middle = 0.5 * (s.intervals.low + s.intervals.high)
    assert np.abs(wrapped(solver.redundancy_at(s.q) - middle)).max() < 1e-6
    assert np.array_equal(s.branch, s.intervals.branch)


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_nearest_to_the_seed_comes_first(name):
    robot = kv.load(name)
    solver = Analytic().fit(robot)
    q, T = poses(robot, 300, rng=75)
    s = solver.solve(T, q_seed=q)
    first = np.concatenate([[0], np.cumsum(s.count)[:-1]])
    assert np.abs(s.q[first] - q).max() < 1e-6
    # seeds that are no solution: never further than the best of a fine grid of values
    seed = robot.random(20, rng=76)
    s = solver.solve(T[:20], q_seed=seed)
    low, high = sweep_range(robot, solver.redundancy_)
    grid = np.linspace(low, high, 3001)
    for i in range(20):
        at = solver.solve_at(T[i], grid, q_seed=seed[i])
        best = np.abs(at.q - seed[i]).max(axis=1).min()
        away = np.abs(s[i].q - seed[i]).max(axis=1)
        assert away[0] <= best + 1e-6
        assert (np.diff(away) >= 0).all()


def test_intervals_travel_with_solutions():
    robot = kv.load("iiwa14")
    _, T = poses(robot, 8)
    s = Analytic().fit(robot).solve(T)
    iv = s.intervals
    part = s[2:5].intervals
    rows = (iv.pose_index >= 2) & (iv.pose_index < 5)
    assert np.array_equal(part.pose_index, iv.pose_index[rows] - 2)
    assert np.array_equal(part.low, iv.low[rows])
    again = pickle.loads(pickle.dumps(s)).intervals
    kept = s.filter(lambda q: q[:, 0] > 0).intervals
    chosen = s.select("mid_limits").intervals
    for other in (again, kept, chosen):
        assert all(np.array_equal(a, b) for a, b in zip(iv, other, strict=True))
    both = kv.FirstOf([Analytic(), kv.Numerical()]).fit(robot).solve(T).intervals
    assert all(np.array_equal(a, b) for a, b in zip(iv, both, strict=True))
    with pytest.raises(ValueError, match="read-only"):
        iv.low[0] = 0.0
    puma = kv.load("puma560")
    assert not len(Analytic().fit(puma).solve(puma.fk(np.zeros(6))).intervals.low)


def test_the_contract_of_a_solver(arm):
    robot, solver = arm
    check_solver(solver, robot)


def test_threads_give_the_same_bits():
    robot = kv.load("panda")
    solver = Analytic().fit(robot)
    _, T = poses(robot, 40)
    one = solver.solve(T)
    try:
        kernels.set_threads(3)
        three = solver.solve(T)
    finally:
        kernels.set_threads(1)
    assert one.q.tobytes() == three.q.tobytes()
    assert one.intervals.low.tobytes() == three.intervals.low.tobytes()
    assert np.array_equal(one.intervals.pose_index, three.intervals.pose_index)


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_every_instruction_set(name):
    robot = kv.load(name)
    q, T = poses(robot, 60)
    solver = Analytic().fit(robot)
    before, answers = kernels.instruction_set(), []
    try:
        for each in kernels.instruction_sets():
            kernels.set_instruction_set(each)
            answers.append((solver.solve_at(T, solver.redundancy_at(q)), solver.solve(T)))
    finally:
        kernels.set_instruction_set(before)
    for at, swept in answers:
        assert found(at, q).all() and swept.ok.all()
        assert np.array_equal(swept.intervals.branch, answers[0][1].intervals.branch)
        assert np.allclose(swept.intervals.low, answers[0][1].intervals.low, atol=1e-6)


# Hard poses -------------------------------------------------------------------------------------

SINGULAR = {
    "elbow straight": ("iiwa14", {3: 0.0}),
    "shoulder": ("iiwa14", {1: 0.0}),
    "wrist": ("iiwa14", {5: 0.0}),
    "shoulder and wrist": ("iiwa14", {1: 0.0, 5: 0.0}),
    "elbow and wrist": ("iiwa14", {3: 0.0, 5: 0.0}),
    "straight up": ("iiwa14", {1: 0.0, 3: 0.0, 5: 0.0}),
    "panda shoulder": ("panda", {1: 0.0}),
    "panda wrist": ("panda", {5: 0.0}),
    "panda joint 5": ("panda", {4: 0.0}),
    "panda both": ("panda", {1: 0.0, 5: 0.0}),
}


@pytest.mark.parametrize("case", SINGULAR)
def test_singular_poses_are_solved(case):
    name, held = SINGULAR[case]
    robot = kv.load(name)
    solver = Analytic().fit(robot)
    q, _ = poses(robot, 100)
    for joint, value in held.items():
        q[:, joint] = value
    T = robot.fk(q)
    s = solver.solve(T)
    assert s.ok.all()
    assert_true(robot, T, s, 1e-6)
    at = solver.solve_at(T, solver.redundancy_at(q), q_seed=q)
    assert at.ok.all()
    assert_true(robot, T, at, 1e-6)
    if name == "iiwa14":
        assert at.stats.singular.all()
    if case in ("elbow straight", "straight up"):
        assert s.stats.singular.all()


def test_out_of_reach_is_shown_and_confirmed():
    rng = np.random.default_rng(9)
    for name, radius in (("iiwa14", 1.1), ("panda", 1.0)):
        robot = kv.load(name)
        T = robot.fk(robot.random(300, rng=5))
        away = rng.normal(size=(300, 3))
        away /= np.linalg.norm(away, axis=1)[:, None]
        T[:, :3, 3] = away * rng.uniform(0, radius * 1.4, (300, 1))
        s = Analytic().fit(robot).solve(T)
        shown = s.status == Status.UNREACHABLE
        assert shown.sum() > 50
        assert not Analytic(limits="ignore").fit(robot).solve(T[shown]).ok.any()
        open_limits = robot.with_limits(np.tile([-np.pi, np.pi], (7, 1)))
        assert not kv.Numerical().fit(open_limits).solve(T[shown][:20]).ok.any()
        # what is denied by the limits is denied by the numerical search too
        denied = s.status == Status.OUT_OF_LIMITS
        assert denied.any()
        assert not kv.Numerical().fit(robot).solve(T[denied][:20]).ok.any()


def test_narrow_limits():
    """A posture's own neighbourhood as limits: tiny intervals, found by descent."""
    for name in ("iiwa14", "panda"):
        robot = kv.load(name)
        q, T = poses(robot, 40, rng=77)
        low, high = robot.limits.T
        for i in range(40):
            tight = np.column_stack([np.maximum(q[i] - 2e-3, low), np.minimum(q[i] + 2e-3, high)])
            narrow = robot.with_limits(tight)
            s = Analytic().fit(narrow).solve(T[i])
            assert s.ok.all(), (name, i)
            assert_true(narrow, T[i : i + 1], s, every=1)


def test_windings_and_ignored_limits():
    wide = kv.load("iiwa14").with_limits(np.tile([-7.0, 7.0], (7, 1)))
    q, T = poses(wide, 5)
    every = Analytic(windings="all").fit(wide)
    nearest = Analytic().fit(wide)
    v = nearest.redundancy_at(q)
    assert (every.solve_at(T, v).count > nearest.solve_at(T, v).count).all()
    assert found(every.solve_at(T, v), q).all()
    assert (every.solve(T).count >= nearest.solve(T).count).all()
    assert len(every.solve(T).intervals.low) == len(nearest.solve(T).intervals.low)
    for redundancy in ("arm_angle", 6, 0):
        s = Analytic(redundancy=redundancy).fit(wide).solve(T)
        assert s.ok.all()
        assert_true(wide, T, s)
        free = Analytic(redundancy=redundancy, limits="ignore").fit(kv.load("iiwa14")).solve(T)
        assert free.ok.all()
        assert free.position_error.max() < 1e-9


# Arms without a form of their own ---------------------------------------------------------------


def test_an_inner_joint_held():
    robot = kv.load("iiwa14")
    solver = Analytic(redundancy=2).fit(robot)
    assert solver.redundancy_ == 2 and len(solver.branch_labels_) == 8
    q, T = poses(robot, 40)
    s = solver.solve_at(T, q[:, 2])
    assert found(s, q).all()
    assert_true(robot, T, s)
    swept = solver.solve(T[:2])
    assert swept.ok.all() and len(swept.intervals.low)
    assert_true(robot, T[:2], swept, every=1)
    near = solver.solve(T[:1], q_seed=q[:1])
    assert np.abs(near.q[0] - q[0]).max() < 1e-4
    again = pickle.loads(pickle.dumps(solver)).solve_at(T, q[:, 2])
    assert again.q.tobytes() == s.q.tobytes()


def general(robot):
    try:
        return Analytic().fit(robot)
    except kv.NoClosedForm as reason:
        assert "Numerical" in str(reason)
        return None


def test_gen3_and_random_arms_solve_or_say_why_not():
    rng = np.random.default_rng(12)
    arms = [kv.load("gen3")]
    for _ in range(3):
        arms.append(
            kv.Robot.from_dh(
                rng.uniform(-0.3, 0.3, 7),
                rng.uniform(-0.3, 0.3, 7),
                rng.uniform(-2, 2, 7),
                rng.uniform(-1, 1, 7),
                joints="R" * 7,
                limits=[(-2.5, 2.5)] * 7,
                name="random7",
            )
        )
    for robot in arms:
        solver = general(robot)
        if solver is not None:
            q, T = poses(robot, 20)
            s = solver.solve_at(T, solver.redundancy_at(q))
            assert found(s, q).all()
            assert_true(robot, T, s)
            swept = solver.solve(T[:3], q_seed=q[:3])
            assert swept.ok.all()
            assert_true(robot, T, swept)
            assert set(swept.intervals.branch) == {-1}  # roots have no lasting numbers


def test_bad_input():
    iiwa, panda, puma = (kv.load(name) for name in ("iiwa14", "panda", "puma560"))
    with pytest.raises(kv.InputError, match="spherical shoulder"):
        Analytic(redundancy="arm_angle").fit(panda)
    for wrong in (7, -1, "elbow", 1.5, True):
        with pytest.raises(kv.InputError, match="redundancy must be a joint of panda"):
            Analytic(redundancy=wrong).fit(panda)
    with pytest.raises(kv.InputError, match="has 6 joints"):
        Analytic(redundancy=2).fit(puma)
    solver = Analytic().fit(panda)
    T = panda.fk(panda.random(3))
    with pytest.raises(kv.InputError, match=r"panda_joint7.*3\.5.*-2\.8973 to 2\.8973"):
        solver.solve_at(T, 3.5)
    with pytest.raises(kv.InputError, match="outside|cannot be held"):
        Analytic(redundancy=2).fit(iiwa).solve_at(T, 3.0)
    for bad in (np.nan, np.inf, np.zeros(2), np.zeros((3, 1))):
        with pytest.raises(kv.InputError):
            solver.solve_at(T, bad)
    with pytest.raises(TypeError):
        solver.solve_at(T, "zero")
    with pytest.raises(kv.InputError, match="not fitted"):
        Analytic().solve_at(T, 0.0)
    with pytest.raises(kv.InputError, match="seven joints"):
        Analytic().fit(puma).solve_at(T, 0.0)
    with pytest.raises(kv.InputError, match="q_seed"):
        solver.solve_at(T, 0.0, q_seed=np.zeros(6))


def railed(arm, at):
    """An arm with a slide along x before its first joint, behind its last, or in between."""
    along_x = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1.0]])
    frames = [*arm.frames[:at], arm.frames[at] @ along_x, along_x.T, *arm.frames[at + 1 :]]
    if at == 0:
        frames = [along_x, along_x.T @ arm.frames[0], *arm.frames[1:]]
    stroke = [-1.5, 1.5] if at == 0 else [-0.2, 0.2]
    limits = np.insert(arm.limits, at, stroke, axis=0)
    return kv.Robot(frames, arm.kinds[:at] + "P" + arm.kinds[at:], limits, name=f"{arm.name} {at}")


@pytest.mark.parametrize(("name", "at"), [("kr16", 0), ("ur5", 6), ("puma560", 3), ("jaco2", 0)])
def test_an_arm_on_a_rail_has_the_rail_to_choose(name, at):
    robot = railed(kv.load(name), at)
    solver = Analytic().fit(robot)
    assert solver.redundancy_ == at
    q = robot.random(12, rng=1)
    T = robot.fk(q)
    s = solver.solve_at(T, solver.redundancy_at(q))
    gap = np.abs((s.q - q[s.pose_index] + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
    assert set(s.pose_index[gap < 1e-6]) == set(range(12))
    np.testing.assert_allclose(s.q[:, at], q[s.pose_index, at], rtol=0, atol=1e-12)
    swept = solver.solve(T[:4])
    assert swept.ok.all()
    for i, one in enumerate(swept):
        rows = swept.intervals.pose_index == i
        low, high = swept.intervals.low[rows], swept.intervals.high[rows]
        held = (one.q[:, at, None] >= low - 1e-6) & (one.q[:, at, None] <= high + 1e-6)
        assert held.any(axis=1).all()
        assert robot.limits[at, 0] - 1e-9 <= low.min() and high.max() <= robot.limits[at, 1] + 1e-9
    near = solver.solve(T[0], q_seed=q[0])
    assert np.abs(near.q[0] - q[0]).max() < 1e-4


def test_slides_may_be_held_by_name_and_ignored_limits_keep_their_stroke():
    robot = railed(kv.load("kr16"), 0)
    solver = Analytic(redundancy=robot.joint_names[0], limits="ignore").fit(robot)
    T = robot.fk(robot.random(2, rng=3))
    assert (solver.solve_at(T, 2.5).q[:, 0] == 2.5).all()  # beyond the stroke, if asked
    assert np.abs(solver.solve(T).q[:, 0]).max() <= 1.5
    with pytest.raises(kv.InputError, match="cannot be held at 2.5"):
        Analytic(redundancy=0).fit(robot).solve_at(T, 2.5)
    with pytest.raises(kv.InputError, match="arm_angle"):
        Analytic(redundancy="arm_angle").fit(robot)


def test_degenerate_arms_are_refused_or_solved():
    half = [-HALF, HALF, HALF, -HALF, -HALF, HALF, 0]
    for d in (
        [0.36, 0, 0, 0, 0.4, 0, 0.126],  # no upper arm
        [0.36, 0, 0.42, 0, 0, 0, 0.126],  # no forearm
        [0, 0, 0, 0, 0, 0, 0],
        [3.6e5, 0, 4.2e5, 0, 4e5, 0, 1.26e5],
        [3.6e-7, 0, 4.2e-7, 0, 4e-7, 0, 1.26e-7],
    ):
        robot = kv.Robot.from_dh(0, d, half, joints="R" * 7, limits=[(-2.9, 2.9)] * 7)
        try:
            solver = Analytic().fit(robot)
        except kv.NoClosedForm:
            continue
        q, T = poses(robot, 5)
        s = solver.solve(T)
        assert not (s.status == Status.UNREACHABLE).any()
        size = max(1.0, sum(d))
        for row, i in zip(s.q, s.pose_index, strict=True):
            assert np.linalg.norm(oracle.robot_fk(robot, row) - T[i]) < 1e-5 * size


@pytest.mark.parametrize("offset", [1e-9, 3e-9, 2e-8])
def test_an_almost_special_arm_loses_no_branch(offset):
    """Axes that just miss each other: a branch that is off by so much is a branch all the same."""
    exact = kv.load("iiwa14")
    frames = np.array(exact.frames)
    frames[2, 0, 3] += offset
    frames[6, 1, 3] += 3 * offset
    robot = kv.Robot(frames, exact.kinds, exact.limits)
    q = robot.random(100, rng=1)
    T = robot.fk(q)
    solvers = [Analytic(limits="ignore").fit(arm) for arm in (robot, exact)]
    s, whole = (solver.solve_at(T, solver.redundancy_at(q)) for solver in solvers)
    assert s.count.mean() > whole.count.mean() - 0.05
    assert max(s.position_error.max(), s.rotation_error.max()) < 1e-7


@pytest.mark.parametrize(("name", "half", "count"), [("panda", 0.05, 400), ("iiwa14", 1e-4, 100)])
def test_a_range_too_narrow_for_a_sweep_is_found_by_a_search(name, half, count):
    robot = kv.load(name)
    rng = np.random.default_rng(0)
    for _ in range(count):
        q = robot.random(rng=rng)
        low = np.maximum(robot.limits[:, 0], q - half * rng.random(7))
        high = np.minimum(robot.limits[:, 1], q + half * rng.random(7))
        boxed = robot.with_limits(np.column_stack([low, high]))
        solver = Analytic().fit(boxed)
        s = solver.solve(robot.fk(q))
        assert s.ok[0]
        value = solver.redundancy_at(s.q)
        ranges = s.intervals
        inside = (value[:, None] >= ranges.low - 1e-9) & (value[:, None] <= ranges.high + 1e-9)
        assert inside.any(axis=1).all()


def test_a_search_beside_a_sweep_lists_windings_too():
    robot = kv.load("iiwa14")
    q = robot.random(rng=5)
    boxed = robot.with_limits(np.column_stack([q - 1e-6, q + 1e-6]))
    s = Analytic(windings="all").fit(boxed).solve(np.stack([robot.fk(q), robot.fk(-q)]))
    assert s.status[0] == Status.SOLVED and s.status[1] != Status.SOLVED


@pytest.mark.parametrize("value", [1e300, -2e6, [0.0, 1e12]])
def test_values_whose_turns_cannot_be_told_apart_are_refused(value):
    solver = Analytic(limits="ignore").fit(kv.load("iiwa14"))
    with pytest.raises(kv.InputError, match="1e\\+06"):
        solver.solve_at(kv.load("iiwa14").fk(np.full(7, 0.3)), value)

"""Six joints of any kind: every branch, judged by plain NumPy and by a search of another kind."""

import copy
import pickle
from itertools import combinations

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import kernels
from kinverse.bench import arms
from kinverse.solvers.closed_form.families import Family, closed_form_spec
from kinverse.status import Status

HALF = np.pi / 2
ARMS = arms.GENERAL


def poses_of(robot, count, seed):
    """Any angle: the elimination does not know limits."""
    rng = np.random.default_rng(seed)
    turning = np.array([kind == "R" for kind in robot.kinds])
    low = np.where(turning, -np.pi, robot.limits[:, 0])
    high = np.where(turning, np.pi, robot.limits[:, 1])
    q = rng.uniform(low, high, (count, 6))
    return q, robot.fk(q)


def apart(robot, a, b):
    """Largest joint distance, whole turns not counted."""
    d = np.abs(np.asarray(a) - b)
    turning = np.array([kind == "R" for kind in robot.kinds])
    return np.where(turning, np.abs(np.remainder(d + np.pi, 2 * np.pi) - np.pi), d).max(axis=-1)


def not_found(robot, s, q, within=1e-5):
    near = apart(robot, s.q, q[s.pose_index]) < within
    return np.setdiff1d(np.arange(len(q)), s.pose_index[near])


def assert_true(robot, T, s, count):
    """Every solution of the first poses by the oracle's forward kinematics."""
    for k in np.flatnonzero(s.pose_index < count):
        position, rotation = oracle.errors(
            "pose", T[s.pose_index[k]], oracle.robot_fk(robot, s.q[k])
        )
        assert position <= 1e-9 and rotation <= 1e-9


def search(robot, T, starts, seed=0, rounds=80):
    """Solutions by Levenberg-Marquardt from random starts; shares no code with the package."""
    rng = np.random.default_rng(seed)
    turning = np.array([kind == "R" for kind in robot.kinds])
    q = np.where(turning, rng.uniform(-np.pi, np.pi, (starts, 6)), rng.uniform(-2, 2, (starts, 6)))
    damping = np.full(starts, 1e-2)

    def state(q):
        M = np.broadcast_to(robot.frames[0], (starts, 4, 4))
        axis, origin = [], []
        for i in range(6):
            axis.append(M[:, :3, 2])
            origin.append(M[:, :3, 3])
            step = np.broadcast_to(np.eye(4), (starts, 4, 4)).copy()
            if turning[i]:
                c, s = np.cos(q[:, i]), np.sin(q[:, i])
                step[:, 0, 0], step[:, 0, 1], step[:, 1, 0], step[:, 1, 1] = c, -s, s, c
            else:
                step[:, 2, 3] = q[:, i]
            M = M @ step @ robot.frames[i + 1]
        J = np.zeros((starts, 6, 6))
        for i in range(6):
            if turning[i]:
                J[:, :3, i] = np.cross(axis[i], M[:, :3, 3] - origin[i])
                J[:, 3:, i] = axis[i]
            else:
                J[:, :3, i] = axis[i]
        E = T[:3, :3] @ np.swapaxes(M[:, :3, :3], 1, 2)
        w = np.stack([E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0], E[:, 1, 0] - E[:, 0, 1]], 1)
        w /= np.sqrt(np.maximum(1 + np.trace(E, axis1=1, axis2=2), 1e-3))[:, None]
        return np.concatenate([T[:3, 3] - M[:, :3, 3], w], axis=1), J

    e, J = state(q)
    for _ in range(rounds):
        A = np.swapaxes(J, 1, 2) @ J
        A = A + (damping * np.minimum(1, (e * e).sum(1)) + 1e-15)[:, None, None] * np.eye(6)
        trial = q + np.linalg.solve(A, (np.swapaxes(J, 1, 2) @ e[:, :, None]))[:, :, 0]
        new_e, new_J = state(trial)
        better = (new_e**2).sum(1) < (e**2).sum(1)
        q, e = np.where(better[:, None], trial, q), np.where(better[:, None], new_e, e)
        J = np.where(better[:, None, None], new_J, J)
        damping = np.where(better, np.maximum(0.3 * damping, 1e-7), 5 * damping)
    found = []
    for row in q[np.abs(e).max(axis=1) < 1e-10]:
        if not found or apart(robot, np.array(found), row).min() > 1e-5:
            found.append(row)
    return np.array(found).reshape(-1, 6)


@pytest.mark.parametrize("name", ARMS)
def test_the_generating_configuration_is_among_the_branches(name):
    robot = ARMS[name]()
    assert closed_form_spec(robot).family in (Family.GENERAL_6R, Family.DECOUPLED)
    q, T = poses_of(robot, 300, seed=1)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert s.ok.all() and len(not_found(robot, s, q)) == 0
    # limits are ignored: a slide of some ten kilometres rounds in steps of its own
    far = np.maximum(
        1.0, np.abs(s.q[:, [kind == "P" for kind in robot.kinds]]).max(axis=1, initial=0)
    )
    assert (s.position_error / far).max() <= 1e-9 and s.rotation_error.max() <= 1e-9
    assert s.count.max() <= 16
    assert_true(robot, T, s, 40)


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_of_ten_thousand_generating_configurations_at_most_one_is_missed(name):
    robot = ARMS[name]()
    q, T = poses_of(robot, 10_000, seed=2)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert s.ok.all() and len(not_found(robot, s, q)) <= 1
    # limits are ignored: a slide of some ten kilometres rounds in steps of its own
    far = np.maximum(
        1.0, np.abs(s.q[:, [kind == "P" for kind in robot.kinds]]).max(axis=1, initial=0)
    )
    assert (s.position_error / far).max() <= 1e-9 and s.rotation_error.max() <= 1e-9
    assert_true(robot, T, s, 200)


@pytest.mark.parametrize("name", ["general_0", "general_3", "RPRRPR", "jaco2", "gofa", "crx10"])
def test_no_branch_is_missed_that_a_search_from_300_starts_finds(name):
    compare_with_search(ARMS[name](), 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_no_branch_is_missed_in_fifty_poses(name):
    compare_with_search(ARMS[name](), 50)


def compare_with_search(robot, count):
    _, T = poses_of(robot, count, seed=3)
    solved = kv.Analytic(limits="ignore").fit(robot).solve(T)
    for i in range(count):
        found = search(robot, T[i], 300, seed=i)
        for row in found:
            assert apart(robot, solved[i].q, row).min() < 1e-5


@pytest.mark.parametrize("offset", [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("make", [arms.almost_puma, arms.almost_ur5])
def test_an_almost_special_arm_neither_loses_branches_nor_invents_them(make, offset):
    robot = make(offset)
    q, T = poses_of(robot, 300, seed=4)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert len(not_found(robot, s, q, within=1e-4)) == 0
    special = kv.Analytic(limits="ignore").fit(make(0.0)).solve(T)
    # the same number of branches, but where two of them are about to merge
    assert np.mean(s.count == special.count) > 0.95
    assert_true(robot, T, s, 30)


@pytest.mark.parametrize("name", ["general_1", "jaco2", "gofa", "PRRPRR"])
def test_half_turns_and_right_angles_are_angles_like_others(name):
    robot = ARMS[name]()
    q, _ = poses_of(robot, 240, seed=5)
    for i in range(6):
        if robot.kinds[i] == "R":
            q[40 * i : 40 * (i + 1), i] = np.resize([np.pi, 0.0, HALF, -HALF], 40)
    s = kv.Analytic(limits="ignore").fit(robot).solve(robot.fk(q))
    missed = not_found(robot, s, q)
    # some of these are singular: there the solution found may be another one of a continuum
    smallest = np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1]
    assert (smallest[missed] < 1e-6).all() and s.ok.all()


def test_two_branches_about_to_merge_are_two_and_a_merged_one_is_one():
    robot = arms.random_arm(6)
    solver = kv.Analytic(limits="ignore").fit(robot)
    rng = np.random.default_rng(0)
    tried = singles = 0
    while tried < 20:
        a, b = rng.uniform(-np.pi, np.pi, (2, 6))
        steps = np.linspace(0, 1, 50)[:, None]
        sign = np.sign(np.linalg.det(robot.jacobian(a + steps * (b - a))))
        if (sign == sign[0]).all():
            continue
        k = int(np.argmax(sign != sign[0]))
        low, high = steps[k - 1, 0], steps[k, 0]
        for _ in range(60):
            middle = (low + high) / 2
            same = np.sign(np.linalg.det(robot.jacobian(a + middle * (b - a)))) == sign[0]
            low, high = (middle, high) if same else (low, middle)
        q = a + low * (b - a)
        null = np.linalg.svd(robot.jacobian(q))[2][-1]
        tried += 1
        merged = solver.solve(robot.fk(q))
        near = merged.q[apart(robot, merged.q, q) < 1e-3]
        assert merged.ok.all()
        singles += len(near) == 1
        for gap in (1e-2, 1e-3, 1e-4):
            pair = solver.solve(robot.fk(q + gap * null))
            assert apart(robot, pair.q, q + gap * null).min() < 1e-5
            there = pair.q[apart(robot, pair.q, q) < 3 * gap]
            assert len(there) == 2
    assert singles >= 19  # the others are split by rounding


def test_poses_out_of_reach_are_shown_to_be_and_no_reachable_one_is():
    robot = arms.random_arm(7)
    solver = kv.Analytic(limits="ignore").fit(robot)
    q, T = poses_of(robot, 400, seed=6)
    T[:, :3, 3] *= np.linspace(0.2, 3.0, 400)[:, None]
    T[-10:, :3, 3] += 10.0  # farther than all links in a line
    s = solver.solve(T)
    out = s.status == Status.UNREACHABLE
    assert out[-10:].all() and s.ok.sum() > 20
    # few poses lie so near the edge that nothing can be said
    assert np.mean(s.status == Status.NOT_FOUND) < 0.1
    for i in np.flatnonzero(out)[::20]:
        assert len(search(robot, T[i], 100)) == 0
    assert_true(robot, T, s, 50)


def test_evidence_is_given_for_each_pose():
    robot = kv.load("jaco2")
    _, T = poses_of(robot, 100, seed=7)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    evidence = s.stats.evidence
    assert (evidence.method == "elimination").all() and evidence.weak.mean() < 0.05
    assert (evidence.real_roots == s.count)[~evidence.weak].all()
    assert (evidence.real_roots + evidence.complex_roots == 16).all()
    assert (evidence.root_gap > 0).all() and (evidence.root_margin > 0).all()
    assert (s.stats.evaluations > 0).all()
    # the gap is that of one joint's angle, so no more than that of the solutions
    for i in range(20):
        apart_most = [apart(robot, np.delete(s[i].q, k, 0), q).min() for k, q in enumerate(s[i].q)]
        assert evidence.weak[i] or evidence.root_gap[i] <= min(apart_most) + 1e-9


def test_limits_seeds_and_windings_are_those_of_every_solver():
    robot = kv.load("jaco2")
    q = robot.random(200, rng=8)
    T = robot.fk(q)
    held = kv.Analytic().fit(robot).solve(T)
    assert len(not_found(robot, held, q)) == 0
    assert ((held.q >= robot.limits[:, 0]) & (held.q <= robot.limits[:, 1])).all()
    near = kv.Analytic().fit(robot).solve(T, q_seed=q)
    first = np.searchsorted(near.pose_index, np.arange(200))
    assert np.abs(near.q[first] - q).max() < 1e-5
    every = kv.Analytic(windings="all").fit(robot).solve(T)
    assert (every.count >= held.count).all()
    # tight limits around one solution leave that one; around none, the status says so
    tight = robot.with_limits(np.column_stack([q[0] - 0.01, q[0] + 0.01]))
    s = kv.Analytic().fit(tight).solve(T[:2])
    assert s.ok[0] and s.count[0] == 1 and s.status[1] == Status.OUT_OF_LIMITS


def test_single_poses_batches_threads_and_the_checked_way_give_the_same_bits():
    robot = arms.gofa()
    _, T = poses_of(robot, 120, seed=9)
    solver = kv.Analytic(limits="ignore").fit(robot)
    batch = solver.solve(T)
    alone = [solver.solve(pose) for pose in T[:40]]
    assert np.array_equal(np.concatenate([s.q for s in alone]), batch.q[batch.pose_index < 40])
    assert np.array_equal(solver.solve(T[::-1].copy())[119].q, batch[0].q)
    before = kernels.threads()
    try:
        kernels.set_threads(2)
        assert np.array_equal(solver.solve(T).q, batch.q)
    finally:
        kernels.set_threads(before)
    for twin in (copy.deepcopy(solver), pickle.loads(pickle.dumps(solver))):
        assert np.array_equal(twin.solve(T).q, batch.q)
    checked = kv.Analytic(limits="ignore").fit(robot)
    checked._fused = None
    slow = checked.solve(T)
    assert np.array_equal(slow.q, batch.q) and np.array_equal(slow.branch, batch.branch)


def test_each_instruction_set_finds_the_same_branches():
    robot = kv.load("xarm6")
    q, T = poses_of(robot, 150, seed=10)
    before = kernels.instruction_set()
    counts = []
    try:
        for name in kernels.instruction_sets():
            kernels.set_instruction_set(name)
            s = kv.Analytic(limits="ignore").fit(robot).solve(T)
            assert len(not_found(robot, s, q)) == 0
            counts.append(s.count)
    finally:
        kernels.set_instruction_set(before)
    assert all(np.array_equal(counts[0], count) for count in counts)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_lengths_from_micrometres_to_megametres(scale):
    robot = arms.random_arm(8)
    frames = robot.frames.copy()
    rng = np.random.default_rng(8)
    scaled = kv.Robot.from_dh(
        a=scale * rng.uniform(0.05, 0.6, 6),
        d=scale * rng.uniform(-0.5, 0.5, 6),
        alpha=rng.uniform(0.2, np.pi - 0.2, 6) * rng.choice([-1, 1], 6),
        joints="R" * 6,
    )
    assert np.isfinite(frames).all()
    q, T = poses_of(scaled, 200, seed=11)
    tolerance = 1e-9 * scale if scale < 1 else 1e-6
    s = kv.Analytic(limits="ignore", tol_position=tolerance).fit(scaled).solve(T)
    assert len(not_found(scaled, s, q)) == 0


@pytest.mark.parametrize(
    "kinds, alpha",
    [
        ("RRRRRR", [0, 0, 0, 0, 0, 0]),  # all axes parallel
        ("RRRRRR", [HALF, 0, 0, HALF, 0, HALF]),
        ("PPPPPP", [HALF, HALF, 0.3, HALF, 0.2, 0.1]),
        ("PPPRRR", [HALF, HALF, 0, HALF, -HALF, 0]),
        ("PPRRRR", [0, HALF, 0.3, HALF, 0.2, 0.1]),  # two slides along one line
    ],
)
def test_degenerate_arms_get_an_answer_or_an_honest_none(kinds, alpha):
    robot = kv.Robot.from_dh(
        a=0.1, d=0, alpha=alpha, joints=kinds, limits=[(-1.0, 1.0) for _ in kinds]
    )
    q = robot.random(20, rng=0)
    T = robot.fk(q)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert (s.status != Status.UNREACHABLE).all()
    assert_true(robot, T, s, 20)


def test_six_joints_with_a_mimic_are_still_refused():
    with pytest.raises(kv.NoClosedForm, match="mimic"):
        kv.Analytic().fit(kv.load("ir361"))


# ---- slides ---------------------------------------------------------------

PAIRS = ["".join("RP"[i in slides] for i in range(6)) for slides in combinations(range(6), 2)]
SINGLE = ["R" * i + "P" + "R" * (5 - i) for i in range(6)]


@pytest.mark.parametrize("kinds", SINGLE + PAIRS)
def test_wherever_one_or_two_joints_slide_nothing_is_missed(kinds):
    robot = arms.random_arm(104, kinds)
    q, T = poses_of(robot, 400, seed=12)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert len(not_found(robot, s, q)) == 0
    assert s.stats.evidence.weak.mean() < 0.01
    assert_true(robot, T, s, 20)
    held = kv.Analytic().fit(robot).solve(T)
    assert held.ok.all()


@pytest.mark.parametrize("kinds", ["PRRRRP", "PPRRRR", "RPRRRP"])
def test_two_slides_give_no_branch_less_than_a_search(kinds):
    compare_with_search(arms.random_arm(98, kinds), 3)


def special_arm(rng, kinds):
    """Right angles, parallel axes and axes that meet, as often as not."""
    n = len(kinds)
    alpha = rng.choice([0, HALF, -HALF, np.pi, 99], n, p=[0.25, 0.25, 0.2, 0.1, 0.2])
    a = rng.choice([0, 0.3, 99], n, p=[0.45, 0.2, 0.35])
    d = rng.choice([0, 0.2, 99], n, p=[0.45, 0.2, 0.35])
    theta = rng.choice([0, HALF, 99], n)
    return kv.Robot.from_dh(
        a=np.where(a == 99, rng.uniform(0.05, 0.6, n), a),
        d=np.where(d == 99, rng.uniform(-0.5, 0.5, n), d),
        alpha=np.where(alpha == 99, rng.uniform(-3, 3, n), alpha),
        theta=np.where(theta == 99, rng.uniform(-3, 3, n), theta),
        joints=kinds,
        limits=[(-np.pi, np.pi) if kind == "R" else (-1.0, 1.0) for kind in kinds],
    )


@pytest.mark.parametrize("share", [0.0, 0.2, 0.4])
def test_the_evidence_of_special_arms_never_contradicts_the_answer(share):
    rng = np.random.default_rng(int(10 * share) + 20)
    arms_tried = poses_tried = 0
    while arms_tried < 25:
        kinds = "".join(rng.choice(["R", "P"], 6, p=[1 - share, share]))
        robot = special_arm(rng, kinds)
        q, T = poses_of(robot, 60, seed=arms_tried)
        rank = np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1]
        if np.median(rank) < 1e-3 or closed_form_spec(robot).family is not Family.GENERAL_6R:
            continue
        arms_tried += 1
        s = kv.Analytic(limits="ignore").fit(robot).solve(T)
        evidence = s.stats.evidence
        sure = ~evidence.weak & (evidence.method == "elimination")
        assert (evidence.real_roots == s.count)[sure].all()
        assert (evidence.real_roots + evidence.complex_roots == 16)[sure].all()
        missed = not_found(robot, s, q)
        assert (evidence.weak[missed] | (rank[missed] < 1e-3)).all()
        assert not np.isin(s.status, [Status.UNREACHABLE, Status.OUT_OF_LIMITS]).any()
        poses_tried += sure.sum()
    assert poses_tried > 1000


def test_a_rail_may_be_a_thousand_times_longer_than_the_arm():
    robot = kv.Robot.from_dh(
        a=[0.1, 0.2, 0.3, 0.2, 0.1, 0.2],
        d=0.1,
        alpha=[1.0, 1.3, 0.8, 2, 1.1, 0.4],
        joints="PRRRRR",
        limits=[(-2000, 2000)] + [(-3, 3)] * 5,
    )
    q = robot.random(200, rng=13)
    s = kv.Analytic().fit(robot).solve(robot.fk(q))
    assert len(not_found(robot, s, q)) == 0


# ---- continua and limits ---------------------------------------------------

DEFICIENT = {
    "slides side by side": {
        "a": [0.1, 0.1, 0.4, 0.3, 0.2, 0.1],
        "d": [0, 0, 0.1, 0.1, 0.2, 0.1],
        "alpha": [0, 1.2, 1.0, 1.1, 0.7, 0.4],
        "joints": "PPRRRR",
    },
    "two joints on one axis": {
        "a": [0, 0.4, 0.3, 0, 0, 0],
        "d": [0, 0.1, 0, 0.4, 0, 0.1],
        "alpha": [0, HALF, 0, -HALF, HALF, 0],
        "joints": "RRRRRR",
    },
    "four slides": {
        "a": 0.1,
        "d": 0.1,
        "alpha": [0.7, 1.2, 1.0, 1.1, 0.7, 0.4],
        "joints": "PPPPRR",
    },
}


@pytest.mark.parametrize("name", DEFICIENT)
def test_where_every_pose_is_a_continuum_members_inside_the_limits_are_given(name):
    robot = kv.Robot.from_dh(**DEFICIENT[name], limits=[(-0.5, 0.5)] * 2 + [(-3, 3)] * 4)
    q = robot.random(100, rng=14)
    T = robot.fk(q)
    s = kv.Analytic().fit(robot).solve(T)
    assert not np.isin(s.status, [Status.UNREACHABLE, Status.OUT_OF_LIMITS]).any()
    assert s.ok.mean() > 0.95 and s.stats.singular[s.ok].all()
    assert ((s.q >= robot.limits[:, 0]) & (s.q <= robot.limits[:, 1])).all()
    assert kv.solve(robot, T).ok.all()
    # the checked way says no more than the native one
    every = kv.Analytic(windings="all").fit(robot).solve(T)
    assert not np.isin(every.status, [Status.UNREACHABLE, Status.OUT_OF_LIMITS]).any()


def merged_pairs(robot, count, seed):
    """Joint values at which two branches are one: the determinant of the Jacobian changes sign."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        a, b = rng.uniform(-np.pi, np.pi, (2, 6))
        sign = [np.sign(np.linalg.det(robot.jacobian(a + t * (b - a)))) for t in (0.0, 1.0)]
        if sign[0] == sign[1]:
            continue
        low, high = 0.0, 1.0
        for _ in range(60):
            t = (low + high) / 2
            same = np.sign(np.linalg.det(robot.jacobian(a + t * (b - a)))) == sign[0]
            low, high = (t, high) if same else (low, t)
        found.append(a + low * (b - a))
    return np.array(found)


@pytest.mark.parametrize("name", ["general_6", "xarm6"])
def test_a_double_root_at_a_limit_is_a_solution(name):
    robot = ARMS[name]()
    for k, q in enumerate(merged_pairs(robot, 30, seed=15)):
        joint, wide = k % 6, np.tile([-7.0, 7.0], (6, 1))
        wide[joint] = [q[joint] - 1.0, q[joint]] if k % 2 else [q[joint], q[joint] + 1.0]
        held = robot.with_limits(wide)
        s = kv.Analytic().fit(held).solve(held.fk(q))
        assert s.ok[0]

"""Closed forms: complete, exact, honest about what is out of reach; judged by plain NumPy."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import kernels
from kinverse.solvers.analytic import Analytic
from kinverse.solvers.closed_form.families import Family, Regional, closed_form_spec

CATALOGUE = [
    "planar3r",
    "planar3r_003",
    "adept_one",
    "pioneer2",
    "puma560",
    "irb1400",
    "irb6",
    "rx160l",
    "kr16",
    "ir361_equivalent",
    "ur5",
    "ur10",
]
WIDE = [(-3.1, 3.1)] * 6


def regional_arm(regional, rng, dof=6, wrist=(1.2, -0.9)):
    """An arm with a hand of meeting axes and no right angles, whose first joints are of a kind."""
    a, d = rng.uniform(0.2, 0.6, 6), rng.uniform(-0.4, 0.4, 6)
    alpha = rng.uniform(0.5, 1.3, 6) * rng.choice([-1, 1], 6)
    a[3:5], d[4], alpha[3:5] = 0, 0, wrist
    if regional == Regional.PARALLEL_23:
        alpha[1] = 0
    elif regional == Regional.PARALLEL_12:
        alpha[0] = np.pi  # antiparallel: the axis has to be turned round
    elif regional == Regional.INTERSECTING_12:
        a[0] = 0
    else:
        a[1] = 0
    return kv.Robot.from_dh(
        a[:dof],
        d[:dof],
        alpha[:dof],
        rng.uniform(-3, 3, dof),
        joints="R" * dof,
        limits=WIDE[:dof],
        name=f"{regional.name.lower()}_{dof}r",
    )


def three_parallel_arm(rng, dof=6):
    a, d = rng.uniform(0.2, 0.6, 6), rng.uniform(-0.3, 0.3, 6)
    alpha = np.array([1.1, 0, np.pi, -1.2, 0.8, 0.4])
    a[4] = 0
    return kv.Robot.from_dh(
        a[:dof], d[:dof], alpha[:dof], rng.uniform(-3, 3, dof), joints="R" * dof, limits=WIDE[:dof]
    )


def turned_round(robot):
    """The same arm held by its hand: T(q) of the new one is the inverse, joints reversed."""
    inverse = [np.linalg.inv(frame) for frame in robot.frames]
    # the inverse of a turn about z is a turn about -z: half a turn about x on either side
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    frames = [inverse[-1] @ flip]
    frames += [flip @ frame @ flip for frame in inverse[-2:0:-1]]
    frames += [flip @ inverse[0]]
    return kv.Robot(np.array(frames), robot.kinds[::-1], robot.limits[::-1], name="turned_round")


def _arms():
    for name in CATALOGUE:
        yield pytest.param(lambda name=name: kv.load(name), id=name)
    for regional in Regional:
        for dof in (5, 6):
            yield pytest.param(
                lambda r=regional, n=dof: regional_arm(r, np.random.default_rng(int(r)), n),
                id=f"{regional.name.lower()}_{dof}r",
            )
    yield pytest.param(lambda: three_parallel_arm(np.random.default_rng(5)), id="three_parallel")
    yield pytest.param(
        lambda: three_parallel_arm(np.random.default_rng(6), 5), id="three_parallel_5r"
    )
    yield pytest.param(lambda: turned_round(kv.load("puma560")), id="wrist_at_the_base")
    yield pytest.param(
        lambda: turned_round(regional_arm(Regional.PARALLEL_12, np.random.default_rng(8))),
        id="inclined_wrist_at_the_base",
    )


ARMS = list(_arms())


def turns(robot):
    return np.array([kind == "R" for kind in robot.kinds])


def wrapped(robot, difference):
    return np.where(turns(robot), (difference + np.pi) % (2 * np.pi) - np.pi, difference)


def found(robot, s, q, within=1e-6):
    near = np.abs(wrapped(robot, s.q - q[s.pose_index])).max(axis=1) < within
    hit = np.zeros(len(s), bool)
    hit[s.pose_index[near]] = True
    return hit


def assert_verified(robot, T, s, tolerance=1e-6):
    for q, i in zip(s.q[::7], s.pose_index[::7], strict=True):
        reached = oracle.robot_fk(robot, q)
        assert np.linalg.norm(reached[:3, 3] - T[i, :3, 3]) <= tolerance
        assert oracle.angle_between(reached[:3, :3], T[i, :3, :3]) <= tolerance
    low, high = robot.limits.T
    assert (s.q >= low).all() and (s.q <= high).all()


@pytest.mark.parametrize("make", ARMS)
def test_generating_configuration_is_found_and_all_answers_hold(make):
    robot = make()
    solver = Analytic().fit(robot)
    q = robot.random(3000, rng=4321)
    T = robot.fk(q)
    s = solver.solve(T)
    assert found(robot, s, q).all()
    assert s.position_error.max() <= 1e-9 and s.rotation_error.max() <= 1e-9
    assert_verified(robot, T, s)


@pytest.mark.parametrize("make", ARMS)
def test_moved_base_and_tool_change_nothing(make):
    robot = make()
    rng = np.random.default_rng(3)
    base = kv.pose(rng.normal(size=3), rpy=rng.uniform(-3, 3, 3))
    tool = kv.pose(rng.normal(size=3), rpy=rng.uniform(-3, 3, 3))
    moved = robot.with_base(base).with_tool(tool)
    q = robot.random(200, rng=11)
    s = Analytic().fit(moved).solve(moved.fk(q))
    assert found(moved, s, q).all()
    assert (s.count == Analytic().fit(robot).solve(robot.fk(q)).count).all()


def test_families_are_recognised():
    expected = {
        "puma560": Family.SPHERICAL_WRIST,
        "ur5": Family.THREE_PARALLEL,
        "pioneer2": Family.TWO_AXIS_WRIST,
        "adept_one": Family.SCARA,
    }
    assert {name: closed_form_spec(kv.load(name)).family for name in expected} == expected
    rng = np.random.default_rng(0)
    for regional in Regional:
        spec = closed_form_spec(regional_arm(regional, rng))
        assert (spec.family, spec.regional) == (Family.SPHERICAL_WRIST, regional)
        assert not spec.perpendicular_wrist
    assert closed_form_spec(turned_round(kv.load("kr16"))).is_reversed


def test_an_arm_of_no_family_is_refused_with_what_was_looked_for():
    with pytest.raises(kv.NoClosedForm, match="mimic"):
        Analytic().fit(kv.load("ir361"))
    with pytest.raises(kv.NoClosedForm, match="task 'position'"):
        Analytic(task="position").fit(kv.load("puma560"))


@pytest.mark.parametrize("name", ["puma560", "kr16", "ur5"])
def test_eight_distinct_branches_inside_wide_limits(name):
    robot = kv.load(name).with_limits(np.tile([-np.pi, np.pi], (6, 1)))
    s = Analytic(limits="ignore").fit(robot).solve(robot.fk(robot.random(300, rng=1)))
    assert s.count.max() == 8
    full = s[int(np.argmax(s.count))]
    assert list(full.branch) == list(range(8))
    assert len(set(full.branch_labels)) == 8
    assert full.branch_labels[0] == "shoulder+ elbow+ wrist+"
    apart = np.abs(wrapped(robot, full.q[:, None] - full.q[None])).max(axis=2)
    assert (apart[~np.eye(8, dtype=bool)] > 1e-3).all()


@pytest.mark.parametrize("name", ["puma560", "kr16", "ur5", "ur10", "rx160l", "irb1400"])
@pytest.mark.parametrize("bend", [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, -1e-6])
def test_wrist_singular_poses_are_solved(name, bend):
    robot = kv.load(name)
    q = robot.random(200, rng=5)
    q[:, 4] = bend
    T = robot.fk(q)
    s = Analytic().fit(robot).solve(T)
    assert s.ok.all()
    assert_verified(robot, T, s)
    if abs(bend) < 1e-11:
        assert s.stats.singular.all()
    elif abs(bend) > 1e-9:
        assert (
            not s.stats.continuum.any() and found(robot, s, q, max(1e-6, 1e-12 / abs(bend))).all()
        )


def test_singular_representative_is_the_nearest_to_the_seed():
    robot = kv.load("kr16")
    q = robot.random(20, rng=5)
    q[:, 4] = 0.0
    s = Analytic().fit(robot).solve(robot.fk(q), q_seed=q)
    assert s.stats.singular.all()
    # the seed itself solves the pose, so the nearest member of the continuum is the seed
    np.testing.assert_allclose(s.nearest(q), q, atol=2e-3)


@pytest.mark.parametrize("name", ["kr16", "irb6", "pioneer2", "rx160l"])
def test_a_wrist_on_the_first_axis_leaves_the_first_joint_free(name):
    robot = kv.load(name)
    from kinverse.bench import cases

    q = cases.shoulder_singular(robot, 100)
    T = robot.fk(q)
    s = Analytic().fit(robot).solve(T)
    assert s.ok.all() and s.stats.singular.all()
    assert_verified(robot, T, s)


def test_stretched_arm_with_a_singular_wrist():
    """The continuum has shrunk to a point that no sample hits."""
    robot = kv.load("ur10")
    q = np.array([[0.4, -1.0, 0.0, 0.3, 0.0, 0.9], [2.0, -2.0, 0.0, -1.0, 0.0, 0.0]])
    s = Analytic().fit(robot).solve(robot.fk(q))
    assert s.ok.all()


@pytest.mark.parametrize("name", ["puma560", "ur5", "kr16", "planar3r", "adept_one"])
def test_out_of_reach_is_shown_and_never_claimed_falsely(name):
    robot = kv.load(name)
    solver = Analytic().fit(robot)
    T = robot.fk(robot.random(300, rng=9))
    away = T[:, :3, 3] / np.linalg.norm(T[:, :3, 3], axis=1, keepdims=True)
    far = T.copy()
    far[:, :3, 3] += 10 * away
    assert (solver.solve(far).status == kv.Status.UNREACHABLE).all()
    # with tolerances as large as the miss, the same poses can be met or at least not denied
    loose = Analytic(tol_position=30.0, tol_rotation=3.2).fit(robot)
    assert not (loose.solve(far).status == kv.Status.UNREACHABLE).any()


def test_just_out_of_reach_and_just_within_tolerance():
    robot = kv.load("planar3r")
    stretched = robot.fk(np.zeros(3))
    for miss, status in [(1e-8, "SOLVED"), (9e-7, "SOLVED"), (1e-4, "UNREACHABLE")]:
        T = stretched.copy()
        T[0, 3] += miss
        s = Analytic().fit(robot).solve(T)
        assert kv.Status(s.status[0]).name == status, miss
        if status == "SOLVED":
            assert s.position_error[0] == pytest.approx(miss, rel=1e-3)


def test_out_of_limits_is_told_from_out_of_reach():
    robot = kv.load("puma560")
    narrow = robot.with_limits(np.tile([-0.1, 0.1], (6, 1)))
    T = robot.fk([1.0, -1.0, 1.0, 0.5, 0.8, 0.2])
    s = Analytic().fit(narrow).solve(T)
    assert s.status[0] == kv.Status.OUT_OF_LIMITS and len(s.q) == 0
    free = Analytic(limits="ignore").fit(narrow).solve(T)
    assert len(free.q) >= 4


def test_a_limit_missed_by_rounding_is_met():
    robot = kv.load("kr16")
    q = robot.random(400, rng=6)
    joint = np.arange(400) % 6
    q[np.arange(400), joint] = robot.limits[joint, np.arange(400) // 6 % 2]
    s = Analytic().fit(robot).solve(robot.fk(q))
    assert found(robot, s, q, 1e-5).mean() > 0.99 and s.ok.all()
    assert_verified(robot, robot.fk(q), s)


def test_windings():
    robot = kv.load("kr16")  # joints 4 and 6 turn +-350 degrees
    q = np.array([0.3, -0.9, 1.1, 0.7, 0.8, -0.4])
    T = robot.fk(q)
    one = Analytic().fit(robot).solve(T)
    every = Analytic(windings="all").fit(robot).solve(T)
    assert len(every.q) > len(one.q)
    steps = np.round((every.q[:, None] - one.q[None]) / (2 * np.pi))
    same = np.abs(every.q[:, None] - one.q[None] - steps * 2 * np.pi).max(axis=2) < 1e-9
    assert (same.sum(axis=1) == 1).all()
    # the winding nearest to the seed
    seed = q + [0, 0, 0, -2 * np.pi, 0, 2 * np.pi]
    np.testing.assert_allclose(Analytic().fit(robot).solve(T, q_seed=seed).q[0], seed, atol=1e-9)


@pytest.mark.parametrize("isa", kernels.instruction_sets())
@pytest.mark.parametrize("name", ["puma560", "ur5", "pioneer2", "adept_one", "ir361_equivalent"])
def test_every_instruction_set_and_every_place_in_a_batch_gives_the_same(isa, name):
    robot = kv.load(name)
    solver = Analytic().fit(robot)
    q = robot.random(37, rng=8)
    T = robot.fk(q)
    before = kernels.instruction_set()
    kernels.set_instruction_set(isa)
    try:
        batch = solver.solve(T, q_seed=q)
        assert found(robot, batch, q).all()
        for i in (0, 5, 36):
            alone = solver.solve(T[i], q_seed=q[i])
            assert alone.q.tobytes() == batch[i].q.tobytes()
            assert alone.position_error.tobytes() == batch[i].position_error.tobytes()
        shuffled = np.random.default_rng(0).permutation(37)
        other = solver.solve(T[shuffled], q_seed=q[shuffled])
        for k, i in enumerate(shuffled):
            assert other[int(k)].q.tobytes() == batch[int(i)].q.tobytes()
    finally:
        kernels.set_instruction_set(before)


@pytest.mark.parametrize("make", ARMS)
def test_propose_and_verify_give_what_the_fused_call_gives(make):
    robot = make()
    fused, stepwise = Analytic().fit(robot), Analytic().fit(robot)
    stepwise._fused = None
    q = robot.random(150, rng=13)
    T = robot.fk(q)
    T[::5, 0, 3] += 0.3
    if robot.dof == 6:
        q[::7, 4] = 0.0
        T[::7] = robot.fk(q[::7])
    for seed in (None, q):
        one, two = fused.solve(T, q_seed=seed), stepwise.solve(T, q_seed=seed)
        np.testing.assert_array_equal(one.status, two.status)
        np.testing.assert_array_equal(one.count, two.count)
        np.testing.assert_array_equal(one.branch, two.branch)
        np.testing.assert_allclose(one.q, two.q, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_tiny_and_huge_arms(scale):
    rows = kv.load("puma560")
    frames = rows.frames.copy()
    frames[:, :3, 3] *= scale
    robot = kv.Robot(frames, rows.kinds, rows.limits)
    q = robot.random(500, rng=2)
    s = Analytic(tol_position=1e-6 * max(1.0, scale)).fit(robot).solve(robot.fk(q))
    assert found(robot, s, q).all()
    assert s.position_error.max() <= 1e-9 * max(1.0, scale)


def test_six_digit_poses_pass():
    robot = kv.load("ur5")
    q = robot.random(50, rng=3)
    T = np.round(robot.fk(q), 6)
    s = Analytic().fit(robot).solve(T)
    assert (s.count > 0).mean() > 0.9
    assert s.position_error.max() <= 1e-6


# ---- what a review found: each of these once gave a wrong answer ----------------------------


def special(name, robot, count):
    from kinverse.bench.cases import SPECIAL

    return SPECIAL[name](robot, count)


@pytest.mark.parametrize("isa", kernels.instruction_sets())
@pytest.mark.parametrize("name", ["kr16", "irb1400", "ur5"])
def test_singular_neighbours_in_a_batch_change_nothing(isa, name):
    robot = kv.load(name)
    solver = Analytic().fit(robot)
    kinds = ["wrist singular", "shoulder singular", "joints at 0, +-pi/2, pi"]
    q = np.stack([special(kind, robot, 16) for kind in kinds], axis=1).reshape(-1, 6)
    T = robot.fk(q)
    before = kernels.instruction_set()
    kernels.set_instruction_set(isa)
    try:
        batch = solver.solve(T)
        for i in range(len(T)):
            assert solver.solve(T[i]).q.tobytes() == batch[i].q.tobytes()
    finally:
        kernels.set_instruction_set(before)


@pytest.mark.parametrize("name", ["irb1400", "puma560", "kr16", "rx160l"])
def test_two_singularities_and_narrow_limits_are_never_out_of_limits_falsely(name):
    robot = kv.load(name)
    q = special("shoulder singular", robot, 60)
    q[:, 4], q[:, 3] = 0.0, np.linspace(-0.4, 0.4, 60)
    narrow = robot.with_limits({3: (-0.5, 0.5)})
    s = Analytic().fit(narrow).solve(narrow.fk(q))
    assert not (s.status == kv.Status.OUT_OF_LIMITS).any()
    assert kv.solve(narrow, narrow.fk(q)).ok.all()


@pytest.mark.parametrize("noise", [1e-10, 1e-8, 1e-7])
def test_noise_near_a_singular_pose_does_not_put_it_out_of_limits(noise):
    robot = kv.load("puma560").with_limits({3: (-0.5, 0.5), 1: (-1.2, -0.4), 2: (0.2, 1.0)})
    q = robot.random(60, rng=1)
    q[:, 4] = 0.0
    T = robot.fk(q)
    axes = np.random.default_rng(2).normal(size=(60, 3))
    T[:, :3, :3] = T[:, :3, :3] @ kv.se3.rotation_exp(noise * axes)
    assert kv.solve(robot, T).ok.all()


def test_just_outside_a_limit_but_within_the_tolerance_is_solved():
    robot = kv.load("puma560")
    q = robot.random(100, rng=5)
    q[:, 1] = robot.limits[1, 1] + 3e-7
    s = kv.solve(robot, robot.fk(q))
    assert s.ok.all()
    low, high = robot.limits.T
    assert (s.q >= low).all() and (s.q <= high).all()


def test_axes_that_are_only_nearly_parallel_prove_nothing_false():
    a = 1.570796327
    robot = kv.Robot.from_dh(
        a=[0.1, 0.3, 0.2, 0, 0], d=[0.4, 0, 0, 0, 0.1], alpha=[a, 0, 4e-9, a, 0], joints="RRRRR"
    )
    tight = Analytic(tol_position=1e-9, tol_rotation=1e-9).fit(robot)
    s = tight.solve(robot.fk(robot.random(200, rng=1)))
    assert not (s.status == kv.Status.UNREACHABLE).any()


@pytest.mark.parametrize("tolerance", [1e-6, 1e-3, 1e-2])
def test_the_same_branches_whichever_way_they_are_verified(tolerance):
    for name in ("ur5", "kr16"):
        robot = kv.load(name)
        settings = {"tol_position": tolerance, "tol_rotation": tolerance}
        fused, stepwise = Analytic(**settings).fit(robot), Analytic(**settings).fit(robot)
        stepwise._fused = None
        exact_angles = special("joints at 0, +-pi/2, pi", robot, 99)
        q = np.concatenate([robot.random(300, rng=3), exact_angles])
        one, two = fused.solve(robot.fk(q)), stepwise.solve(robot.fk(q))
        np.testing.assert_array_equal(one.status, two.status)
        np.testing.assert_array_equal(one.count, two.count)


@pytest.mark.parametrize("off_by", [1e-11, 1e-10, 1e-9, 1e-8])
@pytest.mark.parametrize("regional", Regional)
def test_an_almost_special_arm_is_solved_exactly(regional, off_by):
    """What an arm misses its family by is measured in many places: the largest is what counts."""
    rng = np.random.default_rng(11)
    robot = regional_arm(regional, rng)
    frames = np.array(robot.frames)
    for frame in frames:
        frame[:3, :3] = kv.pose([0, 0, 0], rpy=off_by * rng.normal(size=3))[:3, :3] @ frame[:3, :3]
        frame[:3, 3] += off_by * rng.normal(size=3)
    robot = kv.Robot(frames, robot.kinds, robot.limits)
    q = robot.random(300, rng=2)
    s = Analytic(limits="ignore").fit(robot).solve(robot.fk(q))
    apart = np.abs((s.q - q[s.pose_index] + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
    assert len(set(s.pose_index[apart < 1e-5])) >= 299
    assert max(s.position_error.max(), s.rotation_error.max()) < 2e-9

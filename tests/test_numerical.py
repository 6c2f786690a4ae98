"""The numerical solver: what it finds is right, and the same however the work is shared out."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import kernels
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solutions import Status
from kinverse.solvers.compose import Seeded
from kinverse.solvers.numerical import METHODS, Numerical
from kinverse.task import TASKS

ARMS = ("puma560", "ur5", "panda", "iiwa14")


@pytest.fixture(params=kernels.instruction_sets())
def instruction_set(request):
    before = kernels.instruction_set()
    kernels.set_instruction_set(request.param)
    yield request.param
    kernels.set_instruction_set(before)


def random_arm(rng, kinds, size=1.0, **more):
    n = len(kinds)
    limits = [[-2.5, 2.5] if kind == "R" else [-0.3 * size, 0.4 * size] for kind in kinds]
    return Robot.from_dh(
        a=size * rng.uniform(0.05, 0.4, n),
        d=size * rng.uniform(-0.3, 0.3, n),
        alpha=rng.choice([0.0, np.pi / 2, -np.pi / 2, 0.7], n),
        theta=rng.uniform(-np.pi, np.pi, n),
        joints=kinds,
        limits=more.pop("limits", limits),
        **more,
    )


def assert_true(robot, T, s, tol=1e-6):
    """Every solution holds by the oracle's forward kinematics and lies inside the limits."""
    for q, i in zip(s.q, s.pose_index, strict=True):
        reached = oracle.fk(
            robot.frames, robot.kinds, q, robot.source, robot.multiplier, robot.offset
        )
        assert np.linalg.norm(reached[:3, 3] - T[i][:3, 3]) <= tol * (1 + 1e-6)
        chord = np.linalg.norm(reached[:3, :3] - T[i][:3, :3]) / np.sqrt(2)
        assert chord <= 1e-6 * (1 + 1e-6)
        assert (q >= robot.limits[:, 0]).all() and (q <= robot.limits[:, 1]).all()


def same_bits(a, b):
    for name in ("q", "pose_index", "position_error", "rotation_error", "status"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    assert a.stats.evaluations.tobytes() == b.stats.evaluations.tobytes()


@pytest.mark.parametrize("name", ARMS)
def test_every_reachable_target_is_solved(name, instruction_set):
    robot = kv.load(name)
    rng = np.random.default_rng(11)
    q, seeds = robot.random(1000, rng), robot.random(1000, rng)
    T = robot.fk(q)
    for near in (seeds, None):
        s = Numerical().fit(robot).solve(T, q_seed=near)
        assert s.ok.all()
        assert_true(robot, T[:40], s[:40])
    # one more step than needed: most answers are exact to rounding
    assert np.mean(s.position_error < 1e-10) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_ten_thousand_targets(name):
    robot = kv.load(name)
    rng = np.random.default_rng(1)
    q, seeds = robot.random(10_000, rng), robot.random(10_000, rng)
    assert Numerical().fit(robot).solve(robot.fk(q), q_seed=seeds).ok.all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["panda", "six prismatic"])
def test_batch_single_order_and_threads_give_the_same_bits(name, method, instruction_set):
    robot = kv.load(name) if name == "panda" else random_arm(np.random.default_rng(0), "RPRRPR")
    rng = np.random.default_rng(2)
    T, seeds = robot.fk(robot.random(130, rng)), robot.random(130, rng)
    T[5, :3, 3] *= 10  # out of reach: all starts are used
    solver = Numerical(method=method, max_starts=12).fit(robot)
    whole = solver.solve(T, q_seed=seeds, rng=7)
    for i in (0, 3, 5, 6, 50):
        same_bits(whole[i], solver.solve(T[i], q_seed=seeds[i], rng=7))
    same_bits(whole[3:6], solver.solve(T[3:6], q_seed=seeds[3:6], rng=7))
    back = solver.solve(T[::-1], q_seed=seeds[::-1], rng=7)
    same_bits(whole[2], back[127])
    kernels.set_threads(2)
    try:
        same_bits(whole, solver.solve(T, q_seed=seeds, rng=7))
    finally:
        kernels.set_threads(1)


def test_fused_and_separate_verification_agree():
    robot = kv.load("ur5")
    rng = np.random.default_rng(3)
    T, seeds = robot.fk(robot.random(60, rng)), robot.random(60, rng)
    T[7, :3, 3] += 5.0
    solver = Numerical(max_starts=20).fit(robot)
    fused = solver.solve(T, q_seed=seeds)
    solver._fused = None
    same_bits(fused, solver.solve(T, q_seed=seeds))
    np.testing.assert_array_equal(fused.stats.best_q, solver.solve(T, q_seed=seeds).stats.best_q)


@pytest.mark.parametrize("n", range(1, 17))
def test_chains_of_one_to_sixteen_joints(n):
    rng = np.random.default_rng(n)
    kinds = "".join(rng.choice(list("RRRP"), n))
    robot = random_arm(rng, kinds)
    T = robot.fk(robot.random(20, rng))
    s = Numerical(max_starts=2000).fit(robot).solve(T)
    assert s.ok.all()
    assert_true(robot, T, s)


def test_thirty_two_joints():
    robot = random_arm(np.random.default_rng(0), "R" * 32)
    assert Numerical().fit(robot).solve(robot.fk(robot.random(10, rng=1))).ok.all()


def test_mimic_joints_move_together():
    rng = np.random.default_rng(5)
    plain = random_arm(rng, "RRPRRRP")
    robot = Robot(
        plain.frames, plain.kinds, limits=[[-2, 2], [-2, 2], [-0.3, 0.3], [-2, 2], [-2, 2]],
        source=[0, 1, 2, 1, 3, 4, 2], multiplier=[1, 1, 1, -0.5, 1, 1, 2.0],
        offset=[0, 0, 0, 0.3, 0, 0, 0.1],
    )  # fmt: skip
    T = robot.fk(robot.random(30, rng))
    s = Numerical(max_starts=1000).fit(robot).solve(T)
    assert s.ok.all()
    assert_true(robot, T, s)


@pytest.mark.parametrize("task", TASKS)
def test_tasks_hold_what_they_name(task):
    robot = kv.load("puma560")
    rng = np.random.default_rng(6)
    T = robot.fk(robot.random(200, rng))
    s = Numerical(task=task).fit(robot).solve(T, q_seed=robot.random(200, rng))
    assert s.ok.all()
    reached = robot.fk(s.q)
    d = reached[:, :3, 3] - T[:, :3, 3]
    assert np.abs(d[:, :2] if task == "planar" else d).max() <= 1e-6
    if task == "position_axis":
        assert np.linalg.norm(reached[:, :3, 2] - T[:, :3, 2], axis=1).max() <= 1e-6


@pytest.mark.parametrize("task", ["position", "planar"])
def test_tasks_fit_arms_with_few_joints(task):
    robot = kv.load("planar3r_003")
    T = robot.fk(robot.random(50, rng=3))
    assert Numerical(task=task).fit(robot).solve(T).ok.all()


def test_limits_active_at_the_solution():
    robot = kv.load("panda")
    rng = np.random.default_rng(8)
    q = robot.random(200, rng)
    for row in q:
        j = rng.integers(7)
        row[j] = robot.limits[j, rng.integers(2)]
    s = Numerical().fit(robot).solve(robot.fk(q), q_seed=robot.random(200, rng))
    assert s.ok.all()
    assert (s.q >= robot.limits[:, 0]).all() and (s.q <= robot.limits[:, 1]).all()


def test_limits_can_be_ignored():
    robot = kv.load("puma560")
    narrow = robot.with_limits(np.tile([-0.1, 0.1], (6, 1)))
    T = robot.fk(robot.random(100, rng=9))
    assert not Numerical(max_starts=5).fit(narrow).solve(T).ok.any()
    s = Numerical(limits="ignore").fit(narrow).solve(T)
    assert s.ok.all()


@pytest.mark.parametrize("method", METHODS)
def test_max_joint_distance_is_a_hard_bound(method):
    robot = kv.load("panda")
    rng = np.random.default_rng(10)
    q = robot.random(200, rng)
    T, seeds = robot.fk(q), robot.random(200, rng)
    far = Numerical(method=method, max_joint_distance=1.0, max_starts=20).fit(robot)
    s = far.solve(T, q_seed=seeds)
    assert (np.abs(s.q - seeds[s.pose_index]) <= 1.0 + 1e-9).all()
    near = far.solve(T, q_seed=np.clip(q + 0.3, *robot.limits.T))
    assert near.ok.mean() > 0.9
    with pytest.raises(InputError, match="q_seed"):
        far.solve(T)
    with pytest.raises(InputError, match="windings"):
        Numerical(max_joint_distance=1.0, windings="all").fit(robot)


def test_a_half_turn_away_does_not_stall():
    robot = kv.load("ur5")
    rng = np.random.default_rng(12)
    q = robot.random(100, rng)
    T = robot.fk(q)
    for axis in np.eye(3):
        turned = T.copy()
        turned[:, :3, :3] = oracle.about(axis, np.pi) @ T[:, :3, :3]
        turned = turned[kv.solve(robot, turned, solver="analytic").ok]
        seeds = q[: len(turned)]
        assert Numerical().fit(robot).solve(turned, q_seed=seeds).ok.all()


def test_out_of_reach_is_not_found_with_its_true_best_error():
    robot = kv.load("puma560")
    T = robot.fk(robot.random(10, rng=13))
    T[:, :3, 3] *= 3.0 / np.linalg.norm(T[:, :3, 3], axis=1)[:, None]
    s = Numerical().fit(robot).solve(T)
    assert (s.status == Status.NOT_FOUND).all()
    for i in range(10):
        reached = robot.fk(s.stats.best_q[i])
        error = np.linalg.norm(reached[:3, 3] - T[i, :3, 3])
        assert s.stats.best_position_error[i] == pytest.approx(error, abs=1e-12)
        assert 1.5 < error < 2.5
    assert (s.stats.starts == 1000).all()


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_arms_of_any_size(size):
    rng = np.random.default_rng(14)
    robot = random_arm(rng, "RRPRRR", size)
    T = robot.fk(robot.random(50, rng))
    tol = 1e-9 if size < 1 else 1e-6
    s = Numerical(tol_position=tol, max_starts=1000).fit(robot).solve(T)
    assert s.ok.all()
    assert_true(robot, T, s, tol)


def test_a_seed_that_solves_the_pose_comes_back_as_it_is():
    for kinds in ("RRRRRR", "RRPRRRP"):
        robot = random_arm(np.random.default_rng(15), kinds, 1.7)
        q = robot.random(50, rng=1)
        s = Numerical().fit(robot).solve(robot.fk(q), q_seed=q)
        np.testing.assert_array_equal(s.q, q)


@pytest.mark.parametrize("method", METHODS[1:])
def test_classical_methods_from_a_near_guess(method):
    robot = kv.load("puma560")
    rng = np.random.default_rng(16)
    q = robot.random(200, rng) * 0.8
    solver = Numerical(method=method, damping=0.01, max_iterations=500).fit(robot)
    s = solver.solve(robot.fk(q), q_seed=q + rng.normal(size=q.shape) * 0.02)
    assert s.ok.mean() > 0.9
    assert (s.stats.starts == 1).all()
    assert (s.stats.iterations >= 1).all()
    assert s.stats.iterations.max() <= 500


def test_stop_criteria_of_the_iterative_technique():
    robot = kv.load("puma560")
    q = np.array([0.3, -0.7, 0.4, 0.2, 0.9, -0.3])
    T = robot.fk(q)

    def stop(**settings):
        solver = Numerical(method="newton_raphson", **settings).fit(robot)
        return solver.solve(T, q_seed=q + 0.05).stats.stop[0]

    assert stop() == "residual"
    assert stop(step_tolerance=10.0) == "step"
    assert stop(jacobian_tolerance=10.0) == "jacobian"
    assert stop(max_iterations=1) == "iterations"


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "iiwa14"])
def test_follow_goes_along_without_jumps(name):
    robot = kv.load(name)
    middle, width = robot.limits.mean(axis=1), np.minimum(np.ptp(robot.limits, axis=1), 4.0)
    phase = np.linspace(0.0, 4.0, 500)[:, None] + np.arange(robot.dof)
    path = middle + 0.15 * width * np.sin(phase) + 0.1 * width
    s = Numerical().fit(robot).follow(robot.fk(path), q_start=path[0])
    assert s.ok.all()
    assert np.abs(np.diff(s.q, axis=0)).max() < 0.1
    assert np.abs(s.q[0] - path[0]).max() < 1e-9


def test_follow_goes_on_after_a_pose_that_cannot_be_reached():
    robot = kv.load("puma560")
    path = np.array([0.3, -0.7, 0.4, 0.2, 0.9, -0.3]) + np.linspace(0, 0.5, 50)[:, None]
    T = robot.fk(path)
    T[20, :3, 3] += 4.0
    s = Numerical().fit(robot).follow(T, q_start=path[0])
    assert s.status[20] == Status.NOT_FOUND
    assert s.ok.sum() == 49
    np.testing.assert_allclose(s.q, np.delete(path, 20, axis=0), atol=1e-5)


def test_refine_starts_where_it_is_told():
    robot = kv.load("puma560")
    q = robot.random(50, rng=17) * 0.8
    T = robot.fk(q)
    near = Numerical().fit(robot)._refine(T, q + 1e-3)
    assert np.abs(near - q).max() < 0.5
    s = Seeded(Numerical(max_iterations=3), Numerical()).fit(robot).solve(T)
    assert s.ok.mean() > 0.2


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"method": "magic"}, "newton_raphson"),
        ({"max_starts": 0}, "max_starts"),
        ({"max_iterations": 1.5}, "max_iterations"),
        ({"weights": (1.0, 0.0)}, "weights"),
        ({"weights": (1.0,)}, "weights"),
        ({"weights": ("a", 1)}, "weights"),
        ({"weights": ((1, 2), 3)}, "weights"),
        ({"weights": (1.0, 1j)}, "weights"),
        ({"weights": None}, "weights"),
        ({"weights": (1.0, np.inf)}, "weights"),
        ({"weights": (1e-3, 1.1e3)}, "weights must be within a factor of"),
        ({"damping": np.complex128(1)}, "damping"),
        ({"damping": -1.0}, "damping"),
        ({"max_joint_distance": float("nan")}, "max_joint_distance"),
        ({"step_tolerance": "small"}, "step_tolerance"),
    ],
)
def test_bad_settings_are_named(settings, word):
    with pytest.raises(InputError, match=word):
        Numerical(**settings).fit(kv.load("puma560"))

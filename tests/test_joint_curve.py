"""Joint curves and motions in time: orders of convergence, tolerances and limits kept."""

import pickle
import re
import sys

import numpy as np
import pytest

import kinverse as kv
from kinverse.paths import (
    JointCurve,
    Path,
    ToolCurve,
    Trajectory,
    deviation,
    minimum_jerk,
    named_path,
    named_samples,
    point_to_point,
    refined,
    retime,
    tool_deviation,
)

PATHS = ("masajedi_straight", "masajedi_curved")
DEGREES = (3, 4, 5, 6, 7)


@pytest.fixture(scope="module")
def robot():
    return kv.load("kr16")


@pytest.fixture(scope="module")
def follow(robot):
    return kv.Numerical(tol_position=1e-11, tol_rotation=1e-11).fit(robot).follow


@pytest.fixture(scope="module")
def starts(robot):
    """The eight branches at the start of each path."""
    return {name: kv.solve(robot, named_path(name)(0.0)).q for name in PATHS}


@pytest.fixture(scope="module")
def curve(robot, follow, starts):
    T, s = named_samples("masajedi_straight")
    return JointCurve(s, follow(T, starts["masajedi_straight"][0]).q, degree=5)


# ---------------------------------------------------------------------------- splines
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("kind", [JointCurve, ToolCurve])
def test_a_spline_meets_its_samples_and_is_exact_on_polynomials(kind, degree):
    rng = np.random.default_rng(degree)
    s = np.cumsum(rng.uniform(0.1, 1.0, 30))
    scaled = np.polynomial.Polynomial(rng.normal(size=degree + 1), domain=[s[0], s[-1]])
    curve = kind(s, np.stack([scaled(s)] * 3, axis=1), degree)
    np.testing.assert_allclose(curve(s), curve.values, atol=1e-10)
    at = rng.uniform(s[0], s[-1], (4, 5))
    assert curve(at).shape == (4, 5, 3)
    for order in range(3):
        want = scaled.deriv(order)(at) if order else scaled(at)
        np.testing.assert_allclose(curve(at, order)[..., 1], want, atol=1e-6)
    again = pickle.loads(pickle.dumps(curve))
    assert np.array_equal(again(at), curve(at)) and f"degree {degree}" in repr(curve)


@pytest.mark.parametrize("degree", DEGREES)
def test_deviation_falls_with_the_order_of_the_spline(robot, follow, starts, degree):
    path = named_path("masajedi_straight")
    found = []
    for share, count in ((1, 41), (2, 81)):
        T, s = path.sample(count)
        q = follow(T, starts["masajedi_straight"][4]).q
        made = deviation(robot, JointCurve(s, q, degree), path)
        # at both ends a spline comes into its order later
        found.append(made.positions[8 * share : -8 * share].max())
    assert found[0] / found[1] > 2.0**degree
    assert found[1] < 1e-5


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("degree", (3, 4, 5, 6))
def test_more_accuracy_points_come_nearer_on_every_branch(robot, follow, starts, name, degree):
    path = named_path(name)
    for start in starts[name]:
        found = []
        for count in (21, 41, 81):
            T, s = path.sample(count)
            found.append(deviation(robot, JointCurve(s, follow(T, start).q, degree), path).position)
        assert found[0] > found[1] > found[2]
    tool = [
        tool_deviation(ToolCurve(s, T[:, :3, 3], degree), path).position
        for T, s in map(path.sample, (21, 41, 81))
    ]
    assert tool[2] < 2e-6 and tool[2] <= max(tool[0], 1e-14)


def test_deviation_is_what_a_fine_look_finds(robot, curve):
    path = named_path("masajedi_straight")
    found = deviation(robot, curve, path)
    s = np.linspace(0, path.length, 20_001)
    away = np.linalg.norm(robot.fk(curve(s))[:, :3, 3] - path(s)[:, :3, 3], axis=1)
    assert found.position <= away.max() * (1 + 1e-6)
    assert found.position == pytest.approx(away.max(), rel=0.02)
    at = np.linalg.norm(robot.fk(curve(found.at))[:3, 3] - path(found.at)[:3, 3])
    assert at == pytest.approx(found.position)
    assert found.positions.shape == found.rotations.shape == (20,)
    assert found.positions.max() == found.position and found.rotations.max() == found.rotation


def test_a_shift_of_the_tool_is_its_deviation(robot, curve):
    path = named_path("masajedi_straight")
    moved = robot.with_tool(kv.pose([0.003, 0.0, 0.004], axis=([1, 2, 3], 0.05)))
    found = deviation(moved, curve, path)
    assert found.position == pytest.approx(0.005, rel=1e-4)
    assert found.rotation == pytest.approx(0.05, rel=1e-4)


# ---------------------------------------------------------------------------- refinement
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("name", PATHS)
def test_refined_keeps_its_tolerance(robot, follow, starts, name, degree):
    path = named_path(name)
    made = refined(robot, path, follow, starts[name][5], 1e-5, degree=degree, count=9)
    s = np.linspace(0, path.length, 5001)
    away = np.linalg.norm(robot.fk(made.curve(s))[:, :3, 3] - path(s)[:, :3, 3], axis=1)
    assert away.max() <= 1.05e-5 and made.deviation.position <= 1e-5
    assert made.curve.degree == degree
    loose = refined(robot, path, follow, starts[name][5], 1e-3, degree=degree, count=9)
    assert len(loose.curve.s) <= len(made.curve.s) < 300
    assert np.isin(path.breaks, made.curve.s).all()


@pytest.mark.parametrize("degree", DEGREES)
def test_samples_gather_at_a_corner(robot, follow, starts, degree):
    R = named_path("masajedi_curved")(0.0)
    points = [[-0.2, -0.4, 1.7], [0.0, -0.5, 1.75], [0.2, -0.4, 1.7]]
    path = Path.polyline(points, orientation=R)
    start = kv.solve(robot, path(0.0)).q[0]
    made = refined(robot, path, follow, start, 1e-5, rotation_tolerance=1e-4, degree=degree)
    corner = path.breaks[1]
    steps, middle = np.diff(made.curve.s), (made.curve.s[1:] + made.curve.s[:-1]) / 2
    near = np.abs(middle - corner) < 0.01
    assert steps[near].max() < steps[~near].max() / 4 and made.deviation.rotation <= 1e-4
    assert len(made.curve.s) < 300


def test_an_arm_with_joints_to_spare_and_plain_arrays():
    robot = kv.load("iiwa14")
    q0 = np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1])
    path = Path.line(robot.fk(q0), robot.fk(q0) @ kv.pose([0.0, 0.1, 0.15]))
    solver = kv.Numerical(tol_position=1e-10, tol_rotation=1e-10).fit(robot)
    made = refined(robot, path, lambda T, q: solver.follow(T, q).q, q0, 1e-6)
    assert made.deviation.position <= 1e-6


def test_where_there_is_no_way_it_says_where(robot, follow, starts):
    start = starts["masajedi_straight"][0]
    begin = named_path("masajedi_straight")(0.0)
    out = begin.copy()
    out[:3, 3] += [0.0, -3.0, 0.0]
    with pytest.raises(kv.NoSolution, match=r"follow found no solution at s = \d"):
        refined(robot, Path.line(begin, out), follow, start, 1e-4)
    # joints that jump: no number of samples brings the tool near
    q = starts["masajedi_straight"]

    def jumping(T, near):
        first, second = (follow(T, q[b]).q for b in (0, 2))
        return np.where((np.arange(len(T)) < len(T) / 2)[:, None], first, second)

    with pytest.raises(kv.NoSolution, match=r"samples the tool is still .* m and .* rad off"):
        refined(robot, named_path("masajedi_straight"), jumping, start, 1e-5)


# ---------------------------------------------------------------------------- in time
LIMITS = {"velocity": [2.7, 2.7, 2.7, 5.7, 5.7, 10.0], "acceleration": 15.0}


def check_motion(motion, velocity, acceleration):
    """Derivatives are derivatives, and the limits hold everywhere."""
    t = np.linspace(0, motion.duration, 20_001)
    state = motion(t)
    assert (np.abs(state.velocity) <= np.asarray(velocity) * (1 + 1e-3)).all()
    assert (np.abs(state.acceleration) <= np.asarray(acceleration) * (1 + 1e-2)).all()
    h = t[1]
    speed = np.diff(state.q, axis=0) / h
    middle = (state.velocity[1:] + state.velocity[:-1]) / 2
    np.testing.assert_allclose(speed, middle, atol=2e-3 * np.abs(state.velocity).max())
    moved = np.cumsum(np.vstack([state.q[:1] * 0, middle * h]), axis=0) + state.q[0]
    np.testing.assert_allclose(moved, state.q, atol=1e-6)
    for end in (0, -1):
        assert np.abs(state.velocity[end]).max() < 1e-9
    return state


def test_retime_keeps_its_limits_and_the_way(curve):
    motion = retime(curve, **LIMITS)
    state = check_motion(motion, **LIMITS)
    # one joint is always at a limit, but for the grid's steps: no motion is faster
    used = np.maximum(
        (np.abs(state.velocity) / LIMITS["velocity"]).max(axis=1),
        (np.abs(state.acceleration) / LIMITS["acceleration"]).max(axis=1),
    )
    assert np.quantile(used, 0.05) > 0.9
    np.testing.assert_allclose(state.q[[0, -1]], curve.values[[0, -1]], atol=1e-12)
    away = np.abs(state.q[:, None] - curve(np.linspace(*curve.s[[0, -1]], 2001))[None, ::20])
    assert away.max(axis=2).min(axis=0).max() < 1e-3  # it passes all of the curve
    again = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(again(0.1).q, motion(0.1).q)


@pytest.mark.parametrize(
    ("count", "degree", "seed"), [(60, 6, 3), (60, 3, 3), (40, 7, 1), (300, 5, 4), (1500, 3, 1)]
)
def test_retime_keeps_its_limits_between_its_steps(count, degree, seed):
    # samples at random: the spline swings between two of them
    rng = np.random.default_rng(seed)
    s = np.sort(rng.uniform(0, 10, count))
    curve = JointCurve(s, np.cumsum(rng.normal(0, 0.05, (count, 6)), axis=0), degree)
    motion = retime(curve, velocity=1.0, acceleration=4.0)
    _, state = motion.sample(100_001)
    velocity, acceleration = np.abs(state.velocity).max(), np.abs(state.acceleration).max()
    assert velocity <= 1.0 + 1e-9 and acceleration <= 4.0 + 4e-9
    assert max(velocity, np.sqrt(acceleration / 4.0)) > 0.999


def test_time_scales_as_limits_do(curve):
    one = retime(curve, 1.0, 4.0).duration
    assert retime(curve, 2.0, 16.0).duration == pytest.approx(one / 2, rel=1e-3)
    assert retime(curve, 1.0, 2.0).duration > one
    assert retime(curve, 0.5, 4.0).duration > one


def test_a_straight_move_is_the_textbooks():
    # one joint, 3 rad at 1 rad/s and 2 rad/s^2: half a second each to start and stop
    s = np.linspace(0, 3, 9)
    assert retime(JointCurve(s, s[:, None]), 1.0, 2.0).duration == pytest.approx(3.5, rel=1e-3)
    short = retime(JointCurve(s, s[:, None] / 30), 1.0, 2.0).duration
    assert short == pytest.approx(2 * np.sqrt(0.1 / 2), rel=1e-3)


def test_the_least_jerk_begins_and_ends_at_rest(curve):
    motion = minimum_jerk(curve, 2.0)
    state = check_motion(motion, np.inf, np.inf)
    assert np.abs(state.acceleration[[0, -1]]).max() < 1e-9
    np.testing.assert_allclose(state.q[[0, -1]], curve.values[[0, -1]], atol=1e-12)
    # half the way in half the time, and no motion in other times but slower
    np.testing.assert_allclose(motion(1.0).q, curve(np.mean(curve.s[[0, -1]])), atol=1e-12)
    np.testing.assert_allclose(minimum_jerk(curve, 4.0)(1.0).velocity, motion(0.5).velocity / 2)
    for bad in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(kv.InputError, match="duration"):
            minimum_jerk(curve, bad)
    with pytest.raises(kv.InputError, match="JointCurve"):
        minimum_jerk(motion, 1.0)


def test_a_corner_is_passed_within_limits(robot, follow):
    R = named_path("masajedi_curved")(0.0)
    points = [[-0.2, -0.4, 1.7], [0.0, -0.5, 1.75], [0.2, -0.4, 1.7]]
    path = Path.polyline(points, orientation=R)
    start = kv.solve(robot, path(0.0)).q[0]
    check_motion(retime(refined(robot, path, follow, start, 1e-4).curve, **LIMITS), **LIMITS)


@pytest.mark.parametrize("seed", range(8))
def test_point_to_point_keeps_three_limits(robot, seed):
    a, b = robot.random(2, seed)
    b[seed % 6] = a[seed % 6]  # one joint rests
    velocity, acceleration, jerk = LIMITS["velocity"], 15.0, 150.0
    motion = point_to_point(robot, a, b, velocity, acceleration, jerk)
    state = check_motion(motion, velocity, acceleration)
    np.testing.assert_allclose(state.q[[0, -1]], [a, b], atol=1e-12)
    assert (state.q >= np.minimum(a, b) - 1e-9).all() and (state.q <= np.maximum(a, b) + 1e-9).all()
    step = motion.duration / 20_000
    assert np.abs(np.diff(state.acceleration, axis=0) / step).max() <= jerk * (1 + 1e-6)
    # the slowest joint alone takes no less
    alone = [
        point_to_point(robot, a, np.where(np.arange(6) == j, b, a), velocity, 15.0, 150.0).duration
        for j in range(6)
        if a[j] != b[j]
    ]
    assert motion.duration == pytest.approx(max(alone), rel=0.05)
    assert motion.duration >= max(alone) - 1e-9
    again = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(again(0.1).q, motion(0.1).q)


def test_a_jerk_limited_move_is_the_textbooks():
    robot = kv.Robot.from_dh([0.3], 0, 0, joints="R")
    # too short to reach any other limit: jerk for four times (d / (2 j))^(1/3)
    motion = point_to_point(robot, [0.0], [0.01], 10.0, 10.0, 5.0)
    assert motion.duration == pytest.approx(4 * (0.01 / (2 * 5.0)) ** (1 / 3))


def test_a_trajectory_through_samples():
    t = np.linspace(2.0, 5.0, 31)
    q = np.stack([np.sin(t), np.cos(2 * t)], axis=1)
    motion = Trajectory.through(t, q)
    assert motion.duration == 3.0
    at, state = motion.sample(301)
    np.testing.assert_allclose(state.q[:, 0], np.sin(at + 2), atol=1e-6)
    np.testing.assert_allclose(state.acceleration[:, 0], -np.sin(at + 2), atol=1e-3)
    assert motion(0.3).q.shape == (2,) and motion([[0.3]]).velocity.shape == (1, 1, 2)
    assert "2 joints, 3 s" in repr(motion)


@pytest.mark.parametrize(("package", "call"), [("toppra", "retime"), ("ruckig", "point_to_point")])
def test_without_the_packages_the_extra_is_named(monkeypatch, robot, curve, package, call):
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setitem(sys.modules, f"{package}.algorithm", None)
    with pytest.raises(kv.MissingExtra, match=r'pip install "kinverse\[paths\]"'):
        if call == "retime":
            retime(curve, 1.0, 1.0)
        else:
            point_to_point(robot, *robot.random(2, 1), 1, 1, 1)


# ---------------------------------------------------------------------------- bad input
S, Q = np.linspace(0, 1, 9), np.zeros((9, 6))
NAN = np.where(np.arange(9)[:, None] == 4, np.nan, Q)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: JointCurve(S, Q, 2), r"degree must be one of \(3, 4, 5, 6, 7\), got 2"),
        (lambda: JointCurve(S, Q, 3.0), "degree must be one of"),
        (lambda: JointCurve(S[:4], Q[:4], 5), "degree 5 needs 6 samples, got 4"),
        (lambda: JointCurve(S, NAN), "row 4 holds NaN"),
        (lambda: JointCurve(S[::-1], Q), r"s must increase: s\[1\] = 0.875 follows 1"),
        (lambda: JointCurve(S[[0, 1, 1, 2, 3, 4]], Q[:6]), r"s must increase: s\[2\]"),
        (lambda: JointCurve(S, Q[:5]), r"got \(9,\) and \(5, 6\)"),
        (lambda: JointCurve(S, S), r"values \(K, d\)"),
        (lambda: JointCurve(S, Q)(1.5), "s must lie from 0 to 1"),
        (lambda: JointCurve(S, Q)(np.nan), "s must lie from 0 to 1"),
        (lambda: Trajectory.through([0, 1, 3, 2, 4, 5], Q[:6]), r"times must increase: t\[3\] = 2"),
        (lambda: Trajectory.through([0, 1, np.nan, 3, 4, 5], Q[:6]), "row 2 holds NaN"),
        (lambda: Trajectory.through(S, S + Q.T[:1].T)(2.0), "t must lie from 0 to 1 s"),
        (lambda: Trajectory.through(S, Q).sample(1), "count must be"),
        (lambda: retime(JointCurve(S, Q), 1.0, 1.0), "does not move"),
        (lambda: retime(ToolCurve(S, Q), 1.0, 1.0), "must be a JointCurve"),
        (lambda: retime(JointCurve(S, Q + S[:, None]), 0.0, 1.0), "velocity must be positive"),
        (lambda: retime(JointCurve(S, Q + S[:, None]), 1.0, np.nan), "acceleration must be pos"),
        (lambda: retime(JointCurve(S, Q + S[:, None]), 1.0, 0.0), "acceleration must be pos"),
        (lambda: Trajectory.through([0.0], Q[:1]), "needs 6 samples, got 1"),
        (lambda: Trajectory.through([0, 1, 1, 2, 4, 5], Q[:6]), r"times must increase: t\[2\] = 1"),
        (lambda: Trajectory.through(S, NAN), "row 4 holds NaN"),
        (lambda: retime(JointCurve(S, Q + S[:, None]), [1, 2], 1.0), r"one number or \(6,\)"),
        (
            lambda: retime(JointCurve(S, Q + S[:, None]), [1, 1, 1, 0, 1, 1], 1.0),
            r"velocity\[3\] must be positive and finite, got 0",
        ),
        (lambda: tool_deviation(ToolCurve(S, Q), named_path("habibkhah_1")), "x, y and z"),
        (
            lambda: tool_deviation(ToolCurve(S + 5, Q[:, :3]), Path.line([0, 0, 0], [1, 0, 0])),
            "s mu",
        ),
    ],
)
def test_bad_input_is_named(call, says):
    with pytest.raises(kv.InputError, match=says):
        call()


def test_a_deviation_is_printed_in_a_line(robot):
    T, s = named_samples("masajedi_straight")
    q = kv.Numerical().fit(robot).follow(T, kv.solve(robot, T[0]).q[0]).q
    told = repr(deviation(robot, JointCurve(s, q), named_path("masajedi_straight")))
    assert re.fullmatch(r"Deviation: [\d.e-]+ m, [\d.e-]+ rad at most, at s = .*21 samples", told)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"q_start": np.zeros(5)}, r"q_start must have shape"),
        ({"q_end": np.full(6, np.nan)}, "q_end must be finite"),
        ({"q_end": [9, 0, 0, 0, 0, 0]}, "q_end: joint 'joint1' is at 9, outside its limits"),
        ({"q_end": [0.1, -1, 0.5, 0, 0.4, 0]}, "are the same"),
        ({"jerk": 0.0}, "jerk must be positive and finite, got 0"),
        ({"velocity": [1, 1]}, r"velocity must be one number or \(6,\)"),
        ({"acceleration": -1}, "acceleration must be positive"),
    ],
)
def test_point_to_point_names_bad_input(robot, change, says):
    given = {"q_start": [0.1, -1, 0.5, 0, 0.4, 0], "q_end": [0.2, -1, 0.5, 0, 0.4, 0]}
    given |= {"velocity": 1.0, "acceleration": 1.0, "jerk": 1.0} | change
    with pytest.raises(kv.InputError, match=says):
        point_to_point(robot, **given)


def test_refined_and_deviation_name_bad_input(robot, follow, curve):
    path = named_path("masajedi_straight")
    q0 = curve.values[0]
    for call, says in [
        (lambda: refined(robot, path, follow, q0, 0.0), "tolerance must be"),
        (lambda: refined(robot, path, follow, q0, 1e-3, rotation_tolerance=-1.0), "rotation_tol"),
        (lambda: refined(robot, path, follow, q0, 1e-3, degree=8), "degree must be"),
        (lambda: refined(robot, path, follow, q0[:5], 1e-3), "q_start must have shape"),
        (lambda: refined(robot, path, lambda T, q: q, q0, 1e-3), "follow must give"),
        (
            lambda: refined(robot, path, lambda T, q: kv.solve(robot, T), q0, 1e-3),
            "one solution a pose",
        ),
        (lambda: deviation(kv.load("panda"), curve, path), "6 columns, robot 'panda' 7 joints"),
        (lambda: deviation(robot, curve.values, path), "must be a JointCurve"),
    ]:
        with pytest.raises(kv.InputError, match=says):
            call()

"""The multibody simulator agrees with forward kinematics, and its loads with mechanics."""

import sys

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.errors import InputError
from kinverse.load import names
from kinverse.paths import JointCurve, Trajectory, minimum_jerk, retime
from kinverse.paths.links import Link, default_links
from kinverse.paths.simulate import Effort, simulate

START = np.array([0.2, -1.2, 1.3, 0.3, 0.8, 0.1])
MOVE = np.array([0.5, 0.3, -0.3, 0.4, -0.3, 0.5])


def motion(seconds=1.0, count=21):
    """A smooth move from rest to rest."""
    s = np.linspace(0.0, 1.0, count)
    blend = s**3 * (10 - 15 * s + 6 * s * s)
    return seconds * s, START + blend[:, None] * MOVE


@pytest.fixture(scope="module")
def kr16():
    return kv.load("kr16")


@pytest.mark.parametrize("name", ["kr16", "puma560", "adept_one", "panda", "planar3r"])
def test_the_tool_at_rest_is_where_forward_kinematics_puts_it(name):
    robot = kv.load(name)
    q = robot.random(3, np.random.default_rng(2))
    for row in q:
        run = simulate(robot, [0.0, 0.01], [row, row], control="prescribed")
        np.testing.assert_allclose(run.T[0], oracle.robot_fk(robot, row), atol=1e-6)


def test_computed_torque_follows_the_path(kr16):
    run = simulate(kr16, *motion())
    assert run.ok and run.position_error.max() < 1e-4
    assert run.constraint_force.max() == 0.0


def test_a_trajectory_is_played_as_it_is(kr16):
    share = np.linspace(0.0, 1.0, 21)
    curve = JointCurve(share, START + share[:, None] * MOVE, 5)
    run = simulate(kr16, retime(curve, 1.0, 4.0), control="prescribed")
    speed = np.diff(run.q_wanted, axis=0) / np.diff(run.t)[:, None]
    assert np.abs(speed).max() == pytest.approx(1.0, rel=1e-2)
    # its acceleration begins at once: the torque is not that of an arm at rest
    still = simulate(kr16, [0, 0.01], [run.q[0]] * 2, control="prescribed")
    assert np.abs(run.torque[0] - still.torque[0]).max() > 10.0
    # while one of least jerk begins and ends like it
    smooth = minimum_jerk(curve, 1.0)
    run = simulate(kr16, smooth, control="prescribed")
    assert np.allclose(run.torque[0], still.torque[0])
    t = np.linspace(0.0, 1.0, 41)
    by_samples = simulate(kr16, t, smooth(t).q, control="prescribed")
    assert np.allclose(by_samples.q, run.q, atol=1e-6)
    assert np.allclose(by_samples.torques.rms, run.torques.rms, rtol=1e-3)


@pytest.mark.parametrize("bandwidth", [5e3, 1e8])
def test_the_simulator_never_begins_anew(kr16, tmp_path, monkeypatch, bandwidth, capfd):
    monkeypatch.chdir(tmp_path)  # it would leave a log here
    run = simulate(kr16, *motion(), bandwidth=bandwidth)
    assert not run.ok and len(run.t) < 20
    assert not list(tmp_path.iterdir()) and capfd.readouterr().out == ""


def test_it_forgives_wrong_masses_and_friction(kr16):
    run = simulate(kr16, *motion(), mass_error=0.1, friction=5.0, damping=1.0)
    assert 1e-6 < run.rms_position_error < 1e-4
    better = simulate(kr16, *motion(), mass_error=0.1, friction=5.0, damping=1.0, bandwidth=600.0)
    assert better.rms_position_error < run.rms_position_error


def test_the_servo_knows_less_and_follows_worse(kr16):
    assert (
        simulate(kr16, *motion(), control="servo").rms_position_error
        > 10.0 * simulate(kr16, *motion()).rms_position_error
    )


def across(name, share=0.1):
    """A smooth move in a second, near the middle of the limits."""
    robot = kv.load(name)
    low, high = robot.limits.T
    s = np.linspace(0.0, 1.0, 11)
    blend = s**3 * (10 - 15 * s + 6 * s * s)
    return robot, s, low + (high - low) * (0.55 - share * blend[:, None])


ARMS = sorted(set(names()) - {"ir361"})


@pytest.mark.parametrize("name", ARMS)
def test_the_servo_is_stable_on_every_arm(name):
    robot, t, q = across(name)
    length = sum(np.linalg.norm(frame[:3, 3]) for frame in robot.frames)
    weight = 9.81 * length * sum(link.mass for link in default_links(robot))
    for rows in (q, np.repeat(q[:1], len(q), axis=0)):
        run = simulate(robot, t, rows, control="servo")
        assert run.ok and run.position_error.max() < 1e-3 * length
        needed = simulate(robot, t, rows, control="prescribed").torque
        slack = 0.02 * np.abs(needed).max() + 1e-9 * weight
        # behind the sag at the start, the springs give what the motion takes
        assert np.abs(run.torque - needed)[200:].max() < slack


def test_a_servo_sags_as_its_springs_do():
    # M of two rods in a plane by hand; the springs are as stiff as its diagonal says
    robot = kv.Robot.from_dh(a=[0.5, 0.3], d=0, alpha=0, joints="RR")
    q = np.array([0.4, 0.7])
    links = [Link(2.0, np.array([0.2, 0, 0]), 0.01 * np.eye(3))]
    links += [Link(1.0, np.array([0.1, 0, 0]), 0.01 * np.eye(3))]
    run = simulate(
        robot, [0, 0.5], [q, q], links=links, gravity=(0, -9.81, 0), control="servo", bandwidth=60.0
    )
    elbow = 0.01 + 0.1**2
    shoulder = 0.01 + 2.0 * 0.2**2 + 0.01 + 0.5**2 + 0.1**2 + 2 * 0.5 * 0.1 * np.cos(0.7)
    first, second = run.q[-1, 0], run.q[-1].sum()
    weight = 9.81 * np.array([0.9 * np.cos(first) + 0.1 * np.cos(second), 0.1 * np.cos(second)])
    np.testing.assert_allclose(
        60.0**2 * np.array([shoulder, elbow]) * (q - run.q[-1]), weight, rtol=1e-4
    )


@pytest.mark.parametrize("mass_error", [-0.95, -0.85])
def test_drives_that_shake_the_arm_are_noticed(kr16, mass_error):
    # joints a seventh as heavy as believed tremble within a millimetre, at a hundred kilonewtons
    run = simulate(kr16, *motion(), mass_error=mass_error)
    assert not run.ok and len(run.t) < 100 and "gives" in run.reason


def test_a_joint_far_from_where_it_should_be_is_noticed(kr16):
    run = simulate(kr16, *motion(), control="servo", bandwidth=1.0)
    assert not run.ok and "joint" in run.reason and "rad off" in run.reason
    assert np.abs(run.q - run.q_wanted).max() < 1.1


def test_torques_of_an_arm_at_rest_hold_its_weight():
    # two rods of one plane: the moments of their weights, by hand
    robot = kv.Robot.from_dh(a=[0.5, 0.3], d=0, alpha=0, joints="RR")
    inertia = 0.01 * np.eye(3)
    links = [Link(2.0, np.array([0.2, 0, 0]), inertia), Link(1.0, np.array([0.1, 0, 0]), inertia)]
    q = np.array([0.4, 0.7])
    run = simulate(
        robot, [0, 0.1], [q, q], links=links, gravity=(0, -9.81, 0), control="prescribed"
    )
    first = 0.2 * np.cos(0.4)
    second = 0.5 * np.cos(0.4) + 0.1 * np.cos(1.1)
    wanted = 9.81 * np.array([2.0 * first + second, 0.1 * np.cos(1.1)])
    np.testing.assert_allclose(run.torque[0], wanted, rtol=1e-6)


def test_prescribed_and_driven_joints_need_the_same_torques(kr16):
    t, q = motion()
    one, two = simulate(kr16, t, q), simulate(kr16, t, q, control="prescribed")
    scale = np.abs(two.torque).max(axis=0)
    assert (np.abs(one.torque - two.torque).max(axis=0) < 0.02 * scale.max()).all()


def test_a_driven_tool_turns_the_joints_as_inverse_kinematics_says(kr16):
    run = simulate(kr16, *motion(), drive="tool")
    assert run.ok and run.position_error.max() < 2e-4
    assert np.abs(run.q - run.q_wanted).max() < 1e-3
    assert run.constraint_forces.peak[2] > 100.0  # it carries the arm
    assert not run.torque.any()


@pytest.mark.parametrize("name", ["kr16", "irb6", "puma560", "adept_one", "ur5"])
def test_what_holds_the_tool_is_told_in_the_base_frame(name):
    robot, t, q = across(name)
    still = np.repeat(q[:1], len(q), axis=0)
    held = simulate(robot, t, still, drive="tool")
    needed = simulate(robot, t, still, control="prescribed").torque[-1]
    J = oracle.jacobian(lambda row: oracle.robot_fk(robot, row), held.q[-1])
    given = J.T @ held.constraint_force[-1]
    np.testing.assert_allclose(given, needed, atol=1e-5 * np.abs(needed).max())


def test_it_is_that_of_a_moving_tool_too(kr16):
    t, q = motion()
    held = simulate(kr16, t, q, drive="tool")
    needed = simulate(kr16, t, q, control="prescribed").torque
    for k in range(300, 1900, 200):
        J = oracle.jacobian(lambda row: oracle.robot_fk(kr16, row), held.q[k])
        off = J.T @ held.constraint_force[k] - needed[k]
        assert np.abs(off).max() < 2e-3 * np.abs(needed).max()


AXES = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, -1, 0.5])


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("sweep", [0.25, 0.0])
def test_moments_keep_their_sign_where_a_tool_is_turned_by_half_a_turn(axis, sweep):
    # there quaternions change sign, with a sweep of zero by rounding alone and step by step
    robot, axis = kv.load("ur5"), np.array(axis) / np.linalg.norm(axis)
    T = np.tile(np.eye(4), (21, 1, 1))
    turns = np.pi + np.linspace(-sweep, sweep, 21)
    T[:, :3, :3] = [oracle.about(axis, turn) for turn in turns]
    T[:, :3, 3] = [0.35, 0.2, 0.4] + np.linspace(0, 0.1, 21)[:, None] * [0, 1, 0]
    starts = kv.Analytic().fit(robot).solve(T[:1]).q
    q = kv.Numerical().fit(robot).follow(T, starts[0]).q
    t = np.linspace(0.0, 1.0, 21)
    held = simulate(robot, t, q, drive="tool", step=1e-3)
    needed = simulate(robot, t, q, control="prescribed", step=1e-3).torque
    given = np.einsum("kij,ki->kj", robot.jacobian(held.q), held.constraint_force)
    assert held.ok and np.abs(given - needed)[20:-20].max() < 0.03 * np.abs(needed).max()
    moments = held.constraint_force[:, 3:]
    assert np.abs(np.diff(moments, axis=0)).max() < 0.1 * np.abs(moments).max()


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_an_arm_that_moves_with_its_tool_held_is_refused(name):
    robot, t, q = across(name)
    with pytest.raises(InputError, match="determines 6 of 7 joints"):
        simulate(robot, t, q, drive="tool")


def test_options_that_would_count_for_nothing_are_refused(kr16):
    for options, said in (
        ({"drive": "tool", "control": "servo"}, "control is of driven joints"),
        ({"drive": "tool", "bandwidth": 300.0}, "bandwidth is of driven joints"),
        ({"control": "prescribed", "bandwidth": 300.0}, "bandwidth is of a feedback"),
    ):
        with pytest.raises(InputError, match=said):
            simulate(kr16, *motion(), **options)
    # dry friction is the joints', however they are moved
    plain, rough = (
        simulate(kr16, *motion(), drive="tool", friction=friction) for friction in (0.0, 50.0)
    )
    assert np.abs(plain.constraint_force - rough.constraint_force)[500].max() > 10.0


def test_peak_speeds_are_those_of_the_motion(kr16):
    t, q = motion(seconds=2.0, count=41)
    run = simulate(kr16, t, q, control="prescribed")
    # 1.875 is the largest speed of the blend from 0 to 1 in a second
    np.testing.assert_allclose(run.peak_speeds, 1.875 / 2.0 * np.abs(MOVE), rtol=1e-3)


def test_prescribed_torques_are_those_of_the_true_arm(kr16):
    t, q = motion()
    plain = simulate(kr16, t, q, control="prescribed")
    # the motion's speed by differences, without the spline
    speed = np.gradient(plain.q, plain.t, axis=0)
    heavy = simulate(kr16, t, q, control="prescribed", mass_error=0.5)
    np.testing.assert_allclose(heavy.torque, 1.5 * plain.torque, atol=1e-6)
    rough = simulate(kr16, t, q, control="prescribed", friction=7.0, damping=20.0)
    added = (rough.torque - plain.torque)[10:-10]
    wanted = (7.0 * np.sign(speed) + 20.0 * speed)[10:-10]
    np.testing.assert_allclose(added, wanted, atol=1e-3)
    # and driven joints need the same
    driven = simulate(kr16, t, q, friction=7.0, damping=20.0, mass_error=0.5)
    both = simulate(kr16, t, q, control="prescribed", friction=7.0, damping=20.0, mass_error=0.5)
    off = np.abs(driven.torque - both.torque)[200:-200].max(axis=0)
    assert (off < 0.02 * np.abs(both.torque).max()).all()


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 9])
def test_motions_begin_and_end_at_rest(kr16, count):
    t = np.linspace(0.0, 1.0, count)
    q = START + t[:, None] * MOVE
    run = simulate(kr16, t, q, control="prescribed")
    h = run.t[1]
    for ends in (run.q[:3], run.q[:-4:-1]):
        speed, pull = (ends[1] - ends[0]) / h, (ends[2] - 2 * ends[1] + ends[0]) / h**2
        # jerk is finite: both fall with the step
        assert np.abs(speed).max() < 2e-4 and np.abs(pull).max() < 0.4
    weight = simulate(kr16, t[:2], np.repeat(q[:1], 2, axis=0), control="prescribed").torque[0]
    np.testing.assert_allclose(run.torque[0], weight, atol=1e-8)
    at = np.searchsorted(run.t, t - 1e-9)
    np.testing.assert_allclose(run.q[at], q, atol=5e-4)


def test_a_motion_beyond_the_limits_is_refused(kr16):
    low, high = kr16.limits.T
    q = np.repeat(START[None], 11, axis=0)
    q[:, 0] = [2.6, 2.75, 2.9, 3.05, 3.2, 3.203, 3.2, 3.05, 2.9, 2.75, 2.6]
    assert q[:, 0].max() < high[0]
    # evenly in time these joint values, all inside, are joined by a spline that stays inside
    assert simulate(kr16, np.linspace(0, 2, 11), q, control="prescribed").q[:, 0].max() < high[0]
    # by the way between them it runs away
    t = np.cumsum(np.append(0.0, np.abs(np.diff(q[:, 0]))))
    with pytest.raises(InputError, match=r"at t = .* s joint1 is asked for .* its limits are"):
        simulate(kr16, t, q)
    with pytest.raises(InputError, match="joint1 is asked for"):
        simulate(kr16, Trajectory.through(t, q))


def test_less_mass_needs_less(kr16):
    links = default_links(kr16)
    light = simulate(kr16, *motion(), links=[link.scaled(0.5) for link in links])
    heavy = simulate(kr16, *motion(), links=links)
    np.testing.assert_allclose(light.torques.rms, 0.5 * heavy.torques.rms, rtol=1e-2)


def test_uniformity_is_one_for_a_steady_load_and_small_for_a_jerk():
    values = np.zeros((100, 2))
    values[:, 0], values[3, 1] = -2.0, 5.0
    effort = Effort.of(values)
    np.testing.assert_allclose(effort.peak, [2.0, 5.0])
    np.testing.assert_allclose(effort.uniformity, [1.0, 0.1])


def test_an_unstable_run_stops_and_says_when(kr16):
    run = simulate(kr16, *motion(), bandwidth=5000.0, step=2e-3)
    assert not run.ok
    assert "unstable at t = " in run.reason
    assert 0 < len(run.t) < 500 and len(run.q) == len(run.torque) == len(run.t)
    assert np.isfinite(run.q).all() and run.q.shape == run.q_wanted.shape


def test_a_run_that_blows_up_in_one_step_stops_too(kr16, tmp_path, monkeypatch):
    # MuJoCo then sets everything to zero and goes on; it writes a file of warnings where it runs
    monkeypatch.chdir(tmp_path)
    run = simulate(kr16, *motion(), bandwidth=1e6, step=2e-3)
    assert not run.ok and "unstable at t = " in run.reason and len(run.t) < 10
    np.testing.assert_allclose(run.q[0], START)


def test_a_driven_tool_that_is_too_fast_stops_too(kr16, monkeypatch):
    monkeypatch.setattr(sys.modules["kinverse.paths.simulation_run"], "FASTEST", 0.3)
    run = simulate(kr16, *motion(), drive="tool")
    assert not run.ok and "unstable at t = " in run.reason
    assert 0 < len(run.t) < 2000 and len(run.constraint_force) == len(run.t)
    assert run.position_error.max() < 1e-3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"t": [0.0, 1.0, 1.0]}, "t must increase: row 2"),
        ({"t": [0.0, np.nan, 2.0]}, "t is not finite at row 1"),
        ({"t": [0.0, 1.0]}, "shapes"),
        ({"t": Trajectory.through([0, 1, 2, 3], np.zeros((4, 6)), 3)}, "either a Trajectory"),
        ({"t": Trajectory.through([0, 1, 2, 3], np.zeros((4, 2)), 3), "q": None}, "has 2 joints"),
        ({"q": None}, "q is missing"),
        ({"t": [0.0], "q": [START]}, "at least two instants, got 1"),
        ({"q": [START, np.full(6, np.nan), START]}, "q must be finite, got NaN or inf in row 1"),
        ({"gravity": (0.0, np.nan, -9.8)}, "gravity must be three finite numbers"),
        ({"gravity": (0.0, -9.8)}, "gravity must be three finite numbers"),
        ({"drive": "wheels"}, "drive must be 'joints' or 'tool'"),
        ({"control": "magic"}, "computed_torque, servo, prescribed"),
        ({"friction": -1.0}, "friction"),
        ({"step": 0.0}, "step must be positive"),
        ({"step": 1e-9}, "more than"),
        ({"mass_error": -1.0}, "mass_error"),
        ({"links": [Link(1.0, np.zeros(3), np.eye(3))]}, "6 moving links, got 1"),
        ({"links": [Link(-1.0, np.zeros(3), np.eye(3))] * 6}, "link 1: mass"),
        ({"links": [Link(1.0, np.zeros(3), np.diag([1.0, 1.0, 3.0]))] * 6}, "no body has"),
    ],
)
def test_bad_input(kr16, changes, words):
    given = {"t": [0.0, 1.0, 2.0], "q": [START, START, START]} | changes
    with pytest.raises(InputError, match=words):
        simulate(kr16, given.pop("t"), given.pop("q"), **given)


def test_joints_that_drive_others_are_refused():
    robot = kv.load("ir361")
    q = np.zeros((2, robot.dof))
    with pytest.raises(InputError, match="mimic"):
        simulate(robot, [0.0, 1.0], q)


def test_runs_are_drawn_side_by_side(kr16, tmp_path):
    from kinverse.simulation_plots import simulation_figure

    runs = {name: simulate(kr16, *motion(), drive=name) for name in ("joints", "tool")}
    figure = simulation_figure(runs, "KR16")
    assert [axes.get_title() for axes in figure.axes[:2]] == ["joints", "tool"]
    assert len(figure.axes) == 4 and len(figure.axes[0].lines) == 6
    figure.savefig(tmp_path / "runs.png")
    with pytest.raises(InputError, match="one to three"):
        simulation_figure({})

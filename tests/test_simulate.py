"""The multibody simulator agrees with forward kinematics, and its loads with mechanics."""

import sys

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.errors import InputError
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
    run = simulate(kr16, *motion(), control="servo", bandwidth=bandwidth)
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
    run = simulate(kr16, *motion(), control="servo", bandwidth=5000.0, step=2e-3)
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
    # the module is hidden behind the function of its name
    monkeypatch.setattr(sys.modules["kinverse.paths.simulate"], "FASTEST", 0.3)
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

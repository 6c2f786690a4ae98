"""The geometry of an arm found from measurements: how much can be found, and that it is found."""

import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import cross_val_score

import kinverse as kv
import oracle
from kinverse import se3
from kinverse.bench.real_arm import TARGET_POINT, nominal, real_arm
from kinverse.calibration import GeometricErrorModel, tool_error
from kinverse.calibration.link_errors import identification_jacobian, with_link_errors
from kinverse.errors import InputError

ARMS = ["kr16", "puma560", "ur5", "iiwa14", "adept_one", "planar3r"]
OFFSET = kv.pose([0.05, 0.02, 0.1], rpy=[0.1, 0.2, 0.3])


def disturbed(robot, seed, size=1e-3):
    """The arm with a rigid error of about ``size`` behind every frame, by the tests' own means."""
    rng = np.random.default_rng(seed)
    errors = [kv.pose(rng.normal(0, size, 3), rpy=rng.normal(0, size, 3)) for _ in robot.frames]
    return kv.Robot(
        robot.frames @ np.array(errors),
        robot.kinds,
        robot.limits,
        robot.joint_names,
        robot.source,
        robot.multiplier,
        robot.offset,
        robot.name,
    )


def seen(robot, q, rotations=False):
    T = np.array([oracle.robot_fk(robot, values) for values in q])
    return T if rotations else T[:, :3, 3]


# ---------------------------------------------------------------------------- what can be found
@pytest.mark.parametrize("name", ARMS)
def test_poses_show_four_errors_a_turn_two_a_slide_and_six(name):
    # a line has four parameters, a direction two; the last six are the tool with its joint zeros
    robot = kv.load(name)
    q = robot.random(60, 1)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, robot.fk(q)))
    turns, slides = robot.kinds.count("R"), robot.kinds.count("P")
    assert model.identified_.sum() == 4 * turns + 2 * slides + 6
    assert len(model.parameters_) == model.identified_.sum()


def test_positions_show_what_moves_the_point():
    kr16 = kv.load("kr16")
    q = kr16.random(60, 1)
    for robot, count in (
        (kr16.with_tool(OFFSET), 27),  # all but the tool's rotation
        (kr16, 25),  # a point on the last axis does not tell that axis's direction
        (kv.load("puma560"), 21),  # nor one on three axes those of three
    ):
        model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, robot.fk(q)[:, :3, 3]))
        assert model.identified_.sum() == count
        assert not any(word in model.parameters_ for word in ("tool rx", "tool ry", "tool rz"))


def test_a_joint_that_never_moved_shows_less():
    robot = kv.load("kr16").with_tool(OFFSET)
    q = robot.random(60, 1)
    q[:, 4] = 0.3
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, robot.fk(q)[:, :3, 3]))
    # joints 4 and 6 are left of the wrist: as a 5R arm
    assert model.identified_.sum() == 4 * 5 + 6 - 3


@pytest.mark.parametrize("name", ["kr16", "adept_one", "planar3r"])
def test_the_identification_jacobian_is_the_derivative(name):
    robot = kv.load(name)
    errors = np.random.default_rng(2).normal(0, 0.2, (len(robot.frames), 6))
    q = robot.random(3, 3)
    J = identification_jacobian(robot, q, errors)
    for i, k in np.ndindex(errors.shape):
        step = np.zeros_like(errors)
        step[i, k] = 1e-6
        ahead, behind = (with_link_errors(robot, errors + s).fk(q) for s in (step, -step))
        turn = se3.rotation_log(ahead[:, :3, :3] @ np.swapaxes(behind[:, :3, :3], 1, 2))
        moved = np.hstack([ahead[:, :3, 3] - behind[:, :3, 3], turn]) / 2e-6
        assert np.allclose(J[:, :, i, k], moved, atol=1e-8)


# ---------------------------------------------------------------------------- that it is found
@pytest.mark.parametrize("rotations", [False, True], ids=["positions", "poses"])
@pytest.mark.parametrize("name", ARMS)
def test_a_disturbed_arm_is_found_from_measurements_without_noise(name, rotations):
    robot = kv.load(name).with_tool(OFFSET)
    real = disturbed(robot, seed=4)
    q, unseen = robot.random(60, 5), robot.random(40, 6)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, seen(real, q, rotations)))
    expected = tool_error(robot, unseen, seen(real, unseen, rotations))
    assert np.abs(expected[:, :3]).max() > 1e-3
    assert np.allclose(model.predict(unseen), expected, atol=1e-8)
    corrected = seen(model.robot_, unseen, rotations)
    assert np.allclose(corrected, seen(real, unseen, rotations), atol=1e-8)
    assert not model.errors_[~model.identified_].any()


def test_a_point_on_the_last_axis_is_predicted_but_for_what_is_small_twice():
    # the axis it is really off by 1e-3 m has a direction that is off by 1e-3 rad
    robot = kv.load("kr16")
    real = disturbed(robot, seed=4)
    q, unseen = robot.random(60, 5), robot.random(40, 6)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, seen(real, q)))
    left = model.predict(unseen) - tool_error(robot, unseen, seen(real, unseen))
    assert 1e-8 < np.abs(left).max() < 1e-5


def test_parallel_axes_that_are_not_quite_parallel_are_found_as_dh_rows():
    robot = kv.load("ur5")
    table = robot.to_dh().arguments()
    alpha = np.array(table["alpha"], float)
    alpha[1] += 0.004  # the elbow's axis leaves the plane: rows of DH jump there
    real = kv.Robot.from_dh(**{**table, "alpha": alpha})
    q, unseen = robot.random(60, 7), robot.random(40, 8)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, real.fk(q)))
    assert np.allclose(model.robot_.fk(unseen), real.fk(unseen), atol=1e-9)
    rebuilt = kv.Robot.from_dh(**model.robot_.to_dh().arguments())
    assert np.allclose(rebuilt.fk(unseen), real.fk(unseen), atol=1e-9)


def test_a_base_frame_elsewhere_is_found_with_the_rest():
    robot = kv.load("kr16").with_tool(OFFSET)
    real = disturbed(robot, seed=9).with_base(kv.pose([1.5, -0.7, 0.2], rpy=[0.1, -0.2, 1.2]))
    q, unseen = robot.random(80, 10), robot.random(40, 11)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, seen(real, q)))
    assert np.allclose(seen(model.robot_, unseen), seen(real, unseen), atol=1e-8)


def test_mimic_joints_keep_their_ratio():
    half = kv.pose([0.3, 0, 0], rpy=[np.pi / 2, 0, 0])
    robot = kv.Robot([np.eye(4), half, half, half], "RRR", source=[0, 1, 1], multiplier=[1, 1, -2])
    real = disturbed(robot, seed=12)
    q, unseen = robot.random(60, 13), robot.random(40, 14)
    model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, seen(real, q, True)))
    assert np.allclose(model.robot_.fk(unseen), seen(real, unseen, True), atol=1e-8)


def test_gear_errors_are_found_at_their_joints():
    robot = kv.load("kr16").with_tool(OFFSET)
    real = disturbed(robot, seed=15)
    rng = np.random.default_rng(16)
    amplitude, phase = rng.uniform(1e-4, 1e-3, (2, 6)), rng.uniform(0, 6, (2, 6))

    def off(q):
        return q + sum(amplitude[k] * np.sin((k + 1) * q + phase[k]) for k in (0, 1))

    q, unseen = robot.random(100, 17), robot.random(40, 18)
    error = tool_error(robot, q, seen(real, off(q)))
    expected = tool_error(robot, unseen, seen(real, off(unseen)))
    model = GeometricErrorModel(robot, harmonics=2).fit(q, error)
    assert np.allclose(model.predict(unseen), expected, atol=1e-8)
    # second harmonics are nothing a link could do
    assert np.allclose(np.hypot(*model.gear_[:, 2:].T), amplitude[1], rtol=1e-3)
    plain = GeometricErrorModel(robot).fit(q, error)
    assert np.abs(plain.predict(unseen) - expected).max() > 1e-4
    assert np.array_equal(plain.robot_.frames, with_link_errors(robot, plain.errors_).frames)


def test_slides_have_no_gear_errors():
    robot = kv.load("adept_one")
    q = robot.random(80, 19)
    error = tool_error(robot, q, seen(disturbed(robot, seed=20), q, True))
    model = GeometricErrorModel(robot, harmonics=1).fit(q, error)
    assert not model.gear_[robot.kinds.index("P")].any()


def test_standard_errors_are_what_noise_does():
    robot = kv.load("puma560").with_tool(OFFSET)
    real = disturbed(robot, seed=21)
    q = robot.random(100, 22)
    model = GeometricErrorModel(robot)
    exact = clone(model).fit(q, tool_error(robot, q, seen(real, q)))
    rng, found, said = np.random.default_rng(23), [], []
    for _ in range(40):
        noisy = seen(real, q) + rng.normal(0, 2e-5, (100, 3))
        fitted = clone(model).fit(q, tool_error(robot, q, noisy))
        found.append(fitted.errors_[fitted.identified_])
        said.append(fitted.standard_errors_[fitted.identified_])
    scatter = (found - exact.errors_[exact.identified_]) / np.mean(said, axis=0)
    assert np.sqrt(np.mean(scatter**2)) == pytest.approx(1.0, abs=0.15)
    assert np.isnan(exact.standard_errors_[~exact.identified_]).all()


# ---------------------------------------------------------------------------- the synthetic arm
def test_the_synthetic_arm_is_the_kr16_and_its_levers_are_true():
    robot = kv.load("kr16").with_tool(kv.pose(TARGET_POINT))
    q = robot.random(20_000, 24)
    assert np.allclose(nominal().pose(q), robot.fk(q), atol=1e-12)
    from kinverse.bench import real_arm as module

    levers = np.linalg.norm(robot.jacobian(q)[:, :3], axis=1).max(axis=0)
    assert np.allclose(levers, module.LEVER, rtol=0.03)
    assert np.linalg.norm(robot.fk(q)[:, :2, 3], axis=1).max() == pytest.approx(
        module.REACH, rel=0.03
    )


@pytest.mark.parametrize("seed", range(3))
def test_an_arm_with_everything_wrong_is_predicted_within_a_tenth_of_a_millimetre(seed):
    robot = kv.load("kr16").with_tool(kv.pose(TARGET_POINT))
    arm, rng = real_arm(np.random.default_rng([25, seed])), np.random.default_rng([26, seed])
    q, unseen = robot.random(300, rng), robot.random(300, rng)
    model = GeometricErrorModel(robot, harmonics=2)
    model.fit(q, tool_error(robot, q, arm.measured(q, rng)))
    left = model.predict(unseen) - tool_error(robot, unseen, arm.position(unseen))
    assert np.sqrt((left**2).sum(axis=1).mean()) < 1e-4


# ---------------------------------------------------------------------------- as an estimator
def test_it_clones_pickles_and_cross_validates():
    robot = kv.load("kr16")
    q = robot.random(60, 27)
    error = tool_error(robot, q, seen(disturbed(robot, seed=28), q))
    model = GeometricErrorModel(robot, harmonics=1).fit(q, error)
    fresh = clone(model)
    assert fresh.get_params() == model.get_params() and not hasattr(fresh, "errors_")
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.predict(q), model.predict(q))
    assert cross_val_score(fresh, q, error, cv=3).min() > 0.999


def test_fewer_numbers_than_parameters_is_said():
    robot = kv.load("kr16").with_tool(OFFSET)
    q = robot.random(8, 29)
    with pytest.warns(UserWarning, match="24 measured numbers for 25 parameters"):
        model = GeometricErrorModel(robot).fit(q, np.zeros((8, 3)))
    assert np.isnan(model.standard_errors_).all()


@pytest.mark.parametrize(
    ("changes", "columns", "rows"),
    [
        ({"robot": "kr16"}, 6, 3),
        ({"harmonics": -1}, 6, 3),
        ({"harmonics": 1000}, 6, 3),
        ({"tolerance": 0.0}, 6, 3),
        ({"length": -1.0}, 6, 3),
        ({}, 5, 3),
        ({}, 6, 4),
    ],
)
def test_what_cannot_be_used_is_refused(changes, columns, rows):
    model = GeometricErrorModel(kv.load("kr16")).set_params(**changes)
    with pytest.raises(InputError):
        model.fit(np.zeros((50, columns)), np.zeros((50, rows)))


def test_errors_are_measured_minus_computed():
    robot = kv.load("kr16")
    q = robot.random(5, 30)
    T = robot.fk(q)
    step, turn = np.array([1e-3, 2e-3, 3e-3]), np.array([0.01, -0.02, 0.03])
    moved = T.copy()
    moved[:, :3, 3] += step
    moved[:, :3, :3] = se3.rotation_exp(turn) @ T[:, :3, :3]
    assert np.allclose(tool_error(robot, q, moved[:, :3, 3]), step)
    assert np.allclose(tool_error(robot, q, moved), np.concatenate([step, turn]))
    with pytest.raises(InputError, match="row 3"):
        bad = moved[:, :3, 3].copy()
        bad[3, 1] = np.nan
        tool_error(robot, q, bad)
    for wrong in (moved[:4], moved[:4, :3, 3], moved[0, :3, 3], 2.0 * moved):
        with pytest.raises(InputError):
            tool_error(robot, q, wrong)
    with pytest.raises(InputError, match="shape"):
        tool_error(robot, q[0], moved[0, :3, 3])

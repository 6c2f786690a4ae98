"""Error models of document 002, section 5, as estimators: what they can and cannot hold."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.dummy import DummyRegressor
from sklearn.utils.estimator_checks import parametrize_with_checks

import kinverse as kv
from kinverse import calibration
from kinverse.bench.real_arm import TARGET_POINT, real_arm
from kinverse.calibration import (
    FourierErrorModel,
    GeometricErrorModel,
    PolynomialErrorModel,
    Stack,
    ZeroErrorModel,
    choose,
    make_model,
)
from kinverse.calibration.polynomial import BASES
from kinverse.errors import InputError

MODELS = [
    FourierErrorModel(),
    FourierErrorModel(3, ridge=1e-3, period=40.0),
    *(PolynomialErrorModel(2, basis) for basis in BASES),
    PolynomialErrorModel(4, "legendre", ridge=1e-2),
    ZeroErrorModel(),
    Stack([PolynomialErrorModel(1), FourierErrorModel(1)]),
]


@pytest.mark.filterwarnings("ignore::UserWarning")
@parametrize_with_checks(MODELS)
def test_scikit_learn_finds_nothing_to_object(estimator, check):
    check(estimator)


def joints(rows=200, count=3, seed=1):
    return np.random.default_rng(seed).uniform(-2.5, 2.5, (rows, count))


# ---------------------------------------------------------------------------- equations 24 to 27
def test_a_fourier_polynomial_of_the_joints_is_found_term_by_term():
    rng = np.random.default_rng(2)
    q, K = joints(), rng.normal(size=3)
    A, B = rng.normal(size=(2, 2, 3, 3))  # harmonic, joint, coordinate

    def error(q):
        # equation (25) as it is written
        out = np.tile(K, (len(q), 1))
        for harmonic in (1, 2):
            for i in range(3):
                wave = np.stack([np.cos(harmonic * q[:, i]), np.sin(harmonic * q[:, i])], axis=1)
                out += wave @ np.stack([A[harmonic - 1, i], B[harmonic - 1, i]])
        return out

    model = FourierErrorModel(2).fit(q, error(q))
    unseen = joints(seed=3)
    assert np.allclose(model.predict(unseen), error(unseen), atol=1e-10)
    found = model.coef_.reshape(2, 2, 3, 3)  # harmonic, cosine or sine, joint, coordinate
    assert np.allclose(found[:, 0], A, atol=1e-9) and np.allclose(found[:, 1], B, atol=1e-9)
    assert np.allclose(model.intercept_, K, atol=1e-9)


@pytest.mark.parametrize("basis", BASES)
def test_a_polynomial_of_the_joints_is_found_in_every_basis(basis):
    rng = np.random.default_rng(4)
    q, Q, A = joints(), rng.normal(size=3), rng.normal(size=(3, 3, 3))

    def error(q):
        return Q + sum(q[:, i, None] ** (j + 1) * A[j, i] for j in range(3) for i in range(3))

    unseen = joints(seed=5)
    found = PolynomialErrorModel(3, basis).fit(q, error(q)).predict(unseen)
    assert np.allclose(found, error(unseen), atol=1e-9)


def test_products_of_joints_are_beyond_both_families():
    q = joints(2000)
    error = (np.sin(q[:, 0]) * np.sin(q[:, 1]))[:, None]
    for model in (FourierErrorModel(4), PolynomialErrorModel(6)):
        # odd in each joint: no sum of functions of one joint has a part of it
        assert model.fit(q, error).score(q, error) < 0.05


def jump(theta):
    """Limits -0.4 from the left and 1.0 from the right of theta = 0.5; smooth elsewhere."""
    return np.where(theta < 0.5, -0.4 + 0.3 * (theta - 0.5), 1.0 - 0.2 * (theta - 0.5))


def test_at_a_jump_the_fourier_series_goes_to_the_mean_of_both_sides():
    # document 002, below equation (23); 0.5 + k step is never 0.5 itself
    theta = 0.5 + 2 * np.pi * (np.arange(5_000) + 0.5) / 5_000
    theta = np.where(theta > np.pi, theta - 2 * np.pi, theta)[:, None]
    at, mean = np.array([[0.5]]), (-0.4 + 1.0) / 2
    left = []
    for harmonics in (4, 16, 64):
        model = FourierErrorModel(harmonics).fit(theta, jump(theta[:, 0]))
        left.append(abs(model.predict(at)[0] - mean))
    assert np.all(np.diff(left) < 0) and left[-1] < 1e-2  # of a jump of 1.4
    # and beside the jump to the function
    beside = np.array([[-1.0], [0.2], [1.5]])
    assert np.allclose(model.predict(beside), jump(beside[:, 0]), atol=2e-2)


# ---------------------------------------------------------------------------- least squares
def test_without_a_ridge_all_bases_predict_alike_and_with_one_they_differ():
    q, error = joints(), np.random.default_rng(6).normal(size=(200, 3))
    plain = [PolynomialErrorModel(5, basis).fit(q, error).predict(q) for basis in BASES]
    ridged = [PolynomialErrorModel(5, basis, ridge=0.1).fit(q, error).predict(q) for basis in BASES]
    assert all(np.allclose(plain[0], other, atol=1e-9) for other in plain[1:])
    assert all(np.abs(ridged[0] - other).max() > 1e-3 for other in ridged[1:])


@pytest.mark.parametrize("make", [FourierErrorModel, PolynomialErrorModel])
def test_a_ridge_draws_towards_the_mean(make):
    q, error = joints(), np.random.default_rng(7).normal(2.0, 1.0, (200, 3))
    spread = [
        make(3, ridge=ridge).fit(q, error).predict(q).std() for ridge in (0.0, 0.1, 1.0, 10.0)
    ]
    assert np.all(np.diff(spread) < 0)
    stiff = make(3, ridge=1e12).fit(q, error).predict(q)
    assert np.allclose(stiff, error.mean(axis=0), atol=1e-9)


@pytest.mark.parametrize("model", MODELS[1:7], ids=repr)
def test_a_joint_that_never_moved_says_nothing(model):
    q, error = joints(), np.random.default_rng(8).normal(size=(200, 3))
    still = np.column_stack([q, np.full(200, 0.7)])
    both = clone(model).fit(still, error)
    assert np.allclose(both.predict(still), clone(model).fit(q, error).predict(q), atol=1e-9)
    elsewhere = still + np.array([0.0, 0.0, 0.0, 1.0])
    assert np.allclose(both.predict(elsewhere), both.predict(still), atol=1e-9)


def test_fewer_measurements_than_parameters_is_said():
    q, error = joints(20), np.zeros((20, 3))
    with pytest.warns(UserWarning, match="20 measurements for 25 parameters"):
        FourierErrorModel(4).fit(q, error)
    PolynomialErrorModel(6).fit(q, error)  # 19 parameters: nothing to say


@pytest.mark.parametrize(
    "model",
    [
        FourierErrorModel(0),
        FourierErrorModel(1.5),
        FourierErrorModel(10**9),
        FourierErrorModel(ridge=-1.0),
        FourierErrorModel(period=0.0),
        FourierErrorModel(period=[1.0, 2.0]),
        FourierErrorModel(period="turn"),
        PolynomialErrorModel(0),
        PolynomialErrorModel(10**9),
        PolynomialErrorModel(2, "bessel"),
        PolynomialErrorModel(2, ridge=np.nan),
        Stack([]),
        Stack([FourierErrorModel]),
        Stack("geometric"),
    ],
    ids=repr,
)
def test_settings_that_cannot_be_used_are_refused_by_fit(model):
    with pytest.raises(InputError):
        model.fit(joints(), np.zeros((200, 3)))


def test_nan_and_other_widths_are_refused():
    model = FourierErrorModel(1).fit(joints(), np.zeros((200, 3)))
    bad = joints()
    bad[3, 1] = np.nan
    for call in (lambda: model.predict(bad), lambda: model.fit(bad, np.zeros((200, 3)))):
        with pytest.raises(ValueError, match="NaN"):
            call()
    with pytest.raises(ValueError, match="features"):
        model.predict(joints(count=4))


# ---------------------------------------------------------------------------- together
def test_a_stack_learns_what_is_left():
    q = joints()
    error = np.stack([np.cos(q[:, 0]), q[:, 1] ** 2, np.sin(q[:, 2])], axis=1)
    first = PolynomialErrorModel(2).fit(q, error)
    second = FourierErrorModel(1).fit(q, error - first.predict(q))
    stack = Stack([PolynomialErrorModel(2), FourierErrorModel(1)]).fit(q, error)
    assert np.array_equal(stack.predict(q), first.predict(q) + second.predict(q))
    assert not hasattr(stack.models[0], "coef_")


def test_any_regressor_may_be_in_a_stack():
    q, error = joints(), np.full((200, 3), 2.0)
    assert np.allclose(Stack([DummyRegressor()]).fit(q, error).predict(q), 2.0)


def test_the_choice_is_by_what_was_held_back():
    q = joints(60)
    rng = np.random.default_rng(9)
    error = np.stack([np.cos(q[:, 0]), np.sin(q[:, 1]), np.cos(q[:, 2])], axis=1)
    error += rng.normal(0.0, 0.1, error.shape)
    contest = {
        "one": FourierErrorModel(1),
        "too many": FourierErrorModel(7),  # 43 parameters for the 48 rows of a fold
        "none of it": DummyRegressor(),
    }
    chosen = choose(contest, q, error)
    assert chosen.name == "one" and [row.name for row in chosen.table][0] == "one"
    assert [row.rms for row in chosen.table] == sorted(row.rms for row in chosen.table)
    assert all(row.low <= row.rms <= row.high for row in chosen.table)
    # the noise is 0.1 in each of three coordinates
    assert chosen.table[0].rms == pytest.approx(0.1 * np.sqrt(3), rel=0.3)
    # no model at all: the error itself
    assert chosen.before.rms == pytest.approx(np.sqrt((error**2).sum(axis=1).mean()))
    assert np.array_equal(chosen.model.predict(q), FourierErrorModel(1).fit(q, error).predict(q))
    assert not hasattr(contest["one"], "coef_")
    assert choose(contest, q, error).table == chosen.table


def test_where_every_model_harms_none_is_chosen():
    q, error = joints(60), np.random.default_rng(10).normal(size=(60, 3))
    chosen = choose({"fourier": FourierErrorModel(6)}, q, error)
    assert chosen.name == "none" and not chosen.model.predict(q).any()


@pytest.mark.parametrize("jitter", [0.0, 1e-4])
def test_repeats_of_a_posture_are_held_back_together(jitter):
    # a smooth error that no sum over single joints follows, and many more rows than postures
    rng = np.random.default_rng(11)
    postures, unseen = joints(40), joints(500, seed=12)
    q = np.repeat(postures, 10, axis=0)[rng.permutation(400)]

    def smooth(q):
        return 1e-3 * np.sin(q + 2.0 * np.roll(q, 1, axis=1))

    error = smooth(q) + rng.normal(0.0, 2e-5, (400, 3))
    q = q + rng.uniform(-jitter, jitter, q.shape)
    models = {f"fourier:{k}": FourierErrorModel(k) for k in (1, 3, 6)}
    chosen = choose(models, q, error)
    assert chosen.postures == 40
    left = chosen.model.predict(unseen) - smooth(unseen)
    true = np.sqrt((left**2).sum(axis=1).mean())
    assert true == pytest.approx(chosen.table[0].rms, rel=0.5)
    assert true < 1.2 * np.sqrt((smooth(unseen) ** 2).sum(axis=1).mean())
    with pytest.raises(InputError, match="400 measurements of 40 different postures make no 41"):
        choose(models, q, error, 41)
    # without repeats a posture is a row
    assert choose({}, postures, smooth(postures)).postures == 40


def test_a_choice_that_cannot_be_made_is_refused():
    q, error = joints(5), np.zeros((5, 3))
    for folds in (1, 6, 2.5):
        with pytest.raises(InputError, match="folds"):
            choose({"fourier": FourierErrorModel(1)}, q, error, folds)
    with pytest.raises(InputError, match="none"):
        choose({"none": FourierErrorModel(1)}, q, error)
    with pytest.raises(ValueError, match="NaN"):
        choose({}, q, np.full((5, 3), np.nan))


# ---------------------------------------------------------------------------- names and files
ROBOT = kv.load("kr16").with_tool(kv.pose(TARGET_POINT))
TEXTS = [
    "none",
    "fourier:2",
    "polynomial:3",
    "polynomial:3:laguerre",
    "geometric",
    "geometric:2",
    "geometric:1+fourier:2+polynomial:2:hermite",
]


@pytest.fixture(scope="module")
def measured():
    q = ROBOT.random(150, 11)
    arm, rng = real_arm(np.random.default_rng(12)), np.random.default_rng(13)
    return q, calibration.tool_error(ROBOT, q, arm.measured(q, rng))


@pytest.mark.parametrize("text", TEXTS)
def test_a_saved_model_predicts_the_same_bits(text, measured, tmp_path):
    model = make_model(text, ROBOT).fit(*measured)
    calibration.save(model, tmp_path / "model.npz")
    again = calibration.load(tmp_path / "model.npz")
    unseen = ROBOT.random(50, 14)
    assert np.array_equal(again.predict(unseen), model.predict(unseen))
    assert repr(again) == repr(model)
    with np.load(tmp_path / "model.npz", allow_pickle=False) as archive:
        assert all(archive[name].dtype != object for name in archive.files)


def test_what_cannot_be_saved_without_code_is_refused(measured, tmp_path):
    with pytest.raises(InputError, match="not fitted"):
        calibration.save(FourierErrorModel(1), tmp_path / "model.npz")
    for model in (DummyRegressor(), Stack([DummyRegressor()])):
        with pytest.raises(InputError, match="without code"):
            calibration.save(model.fit(*measured), tmp_path / "model.npz")
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_error_model_is_refused(tmp_path):
    from kinverse.networks.storage import write

    (tmp_path / "text.npz").write_text("no model")
    write(tmp_path / "network.npz", "network", {}, {})
    write(tmp_path / "unknown.npz", "error model", {"model": {"model": "os.system"}}, {})
    write(tmp_path / "empty.npz", "error model", {}, {})
    for name in ("text", "network", "unknown", "empty"):
        with pytest.raises(InputError, match=name):
            calibration.load(tmp_path / f"{name}.npz")


def test_a_geometric_model_by_name_corrects_the_robot_given():
    model = make_model("geometric:2", ROBOT)
    assert isinstance(model, GeometricErrorModel) and model.robot is ROBOT and model.harmonics == 2


@pytest.mark.parametrize(
    "text",
    ["", "fourier", "fourier:", "fourier:x", "fourier:2:3", "polynomial:2:bessel", "geometric:-1"]
    + ["wavelet:2", "geometric+", "none:1", "geometric:1:2", 3],
)
def test_names_of_no_model_are_refused(text):
    with pytest.raises(InputError):
        make_model(text, ROBOT)


def test_the_package_names_what_it_has():
    assert set(calibration.MODELS) < set(dir(calibration))
    for name in dir(calibration):
        assert getattr(calibration, name) is not None
    with pytest.raises(AttributeError, match="nothing"):
        _ = calibration.nothing

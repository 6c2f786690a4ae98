import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import oracle
from kinverse import se3
from kinverse.errors import InputError

angle = st.floats(-3.2, 3.2)
vector = arrays(float, 3, elements=st.floats(-3.0, 3.0, allow_subnormal=False))


def rotations(count, seed=0):
    """Uniform rotations, then some near 0 and near a half turn, where formulas change."""
    rng = np.random.default_rng(seed)
    w = rng.normal(size=(count, 3))
    unit = w / np.linalg.norm(w, axis=1, keepdims=True)
    sizes = np.concatenate(
        [
            rng.uniform(0, np.pi, count - 20),
            np.logspace(-12, -1, 10),
            np.pi - np.logspace(-12, -1, 10),
        ]
    )
    return unit, sizes, np.stack([oracle.about(u, a) for u, a in zip(unit, sizes, strict=True)])


class Carrier:
    """Stands for SciPy's RigidTransform."""

    def __init__(self, T):
        self.T = T

    def as_matrix(self):
        return self.T


class Stacked:
    """Stands for spatialmath's SE3 of several poses: .A is a list."""

    def __init__(self, T):
        self.A = list(T)


# ---------------------------------------------------------------------------- intake
@pytest.mark.parametrize("count", [None, 0, 1, 5])
def test_shapes_are_stacked(count):
    T = np.eye(4) if count is None else np.tile(np.eye(4), (count, 1, 1))
    out = se3.as_poses(T)
    assert out.shape == (1 if count is None else count, 4, 4)
    assert out.dtype == np.float64 and out.flags.c_contiguous


@pytest.mark.parametrize(
    "form",
    [
        lambda T: T.astype(np.float32),
        lambda T: np.asfortranarray(T),
        lambda T: np.repeat(T, 2, axis=0)[::2],
        lambda T: T.tolist(),
        Carrier,
        Stacked,
        lambda T: T.astype(">f8"),
        np.longdouble,
    ],
)
def test_forms_are_converted(form):
    T = np.stack([se3.pose([1, 2, 3], rpy=[0.1, 0.2, 0.3]), np.eye(4)])
    np.testing.assert_allclose(se3.as_poses(form(T)), T, atol=1e-6)


def test_scipy_rigid_transform_is_taken():
    from scipy.spatial.transform import RigidTransform

    T = se3.pose([1, 2, 3], rpy=[0.1, 0.2, 0.3])
    np.testing.assert_allclose(se3.as_poses(RigidTransform.from_matrix(T)), T[None], atol=1e-15)
    stack = RigidTransform.from_matrix(np.stack([T, T]))
    assert se3.as_poses(stack).shape == (2, 4, 4)


def test_integers_are_converted():
    assert se3.as_poses(np.eye(4, dtype=int)).dtype == np.float64


@pytest.mark.parametrize("dtype", [complex, object, str, bool])
def test_other_types_are_a_type_error(dtype):
    with pytest.raises(TypeError, match="real numbers"):
        se3.as_poses(np.eye(4).astype(dtype))


@pytest.mark.parametrize("shape", [(), (4,), (3, 4), (3, 3), (2, 2, 4, 4), (0,), (4, 4, 4, 4)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(InputError, match=r"shape \(4, 4\)"):
        se3.as_poses(np.zeros(shape))


def test_ragged_input_is_refused():
    with pytest.raises(InputError, match="ragged"):
        se3.as_poses([[1, 2], [3]])


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        ((0, 0), np.nan, "NaN"),
        ((1, 3), np.inf, "NaN or inf"),
        ((2, 3), 1.1e100, "translation is 1.1e\\+100 m, allowed is 1e\\+100"),
        ((0, 3), -1e300, "translation"),
        ((0, 0), 1.001, "R'R"),
        ((0, 1), 1e200, "R'R"),
        ((2, 2), -1.0, "reflection"),
        ((3, 3), 2.0, "last row"),
        ((3, 0), 1e-3, "last row"),
    ],
)
def test_bad_rows_are_named(entry, value, reason):
    T = np.tile(np.eye(4), (9, 1, 1))
    T[7][entry] = value
    with pytest.raises(InputError, match=reason) as error:
        se3.as_poses(T)
    assert "row 7" in str(error.value)
    with pytest.raises(InputError, match=reason):
        se3.as_poses(T[7])


@pytest.mark.parametrize(("size", "good"), [(0.9e-5, True), (1.1e-5, False)])
def test_rigid_tolerance_is_the_same_for_one_and_many(size, good):
    T = np.eye(4)
    T[0, 1] = size
    for case in (T, np.stack([T, np.eye(4)])):
        if good:
            se3.as_poses(case)
        else:
            with pytest.raises(InputError):
                se3.as_poses(case)


def test_caller_keeps_the_data():
    T = np.eye(4)
    T.setflags(write=False)
    se3.as_poses(T)
    with pytest.raises(InputError, match="one"):
        se3.as_pose(np.tile(T, (2, 1, 1)))


def test_joints():
    assert se3.as_joints([1, 2], 2).dtype == np.float64
    assert se3.as_joints(np.zeros((3, 4, 2)), 2).shape == (3, 4, 2)
    assert se3.as_joints([1, 2], 2, count=3).shape == (3, 2)
    assert se3.as_joints(np.zeros((0, 2)), 2, count=0).shape == (0, 2)
    with pytest.raises(InputError, match=r"\(\.\.\., 2\)"):
        se3.as_joints([1, 2, 3], 2)
    with pytest.raises(InputError, match=r"\(3, 2\)"):
        se3.as_joints(np.zeros((4, 2)), 2, count=3)
    with pytest.raises(InputError, match="row 1"):
        se3.as_joints([[0, 0], [0, np.nan]], 2)
    with pytest.raises(TypeError):
        se3.as_joints(["a", "b"], 2)


# ---------------------------------------------------------------------------- constructors
@given(vector, vector)
def test_pose_from_rpy(xyz, rpy):
    T = se3.pose(xyz, rpy=rpy)
    np.testing.assert_allclose(T, oracle.homogeneous(oracle.rpy(*rpy), xyz), atol=1e-14)


def test_pose_forms_agree():
    R = oracle.about([1, 2, 3], 0.7)
    half = np.array([1, 2, 3]) / np.sqrt(14) * np.sin(0.35)
    T = oracle.homogeneous(R, [1, 2, 3])
    np.testing.assert_allclose(se3.pose([1, 2, 3], axis=([2, 4, 6], 0.7)), T, atol=1e-15)
    np.testing.assert_allclose(se3.pose([1, 2, 3], quat=[np.cos(0.35), *half]), T, atol=1e-15)
    np.testing.assert_array_equal(se3.pose(), np.eye(4))


@pytest.mark.parametrize(
    "call",
    [
        lambda: se3.pose([1, 2]),
        lambda: se3.pose([1, 2, np.nan]),
        lambda: se3.pose(rpy=[0, 0, 0], quat=[1, 0, 0, 0]),
        lambda: se3.pose(quat=[1, 1, 0, 0]),
        lambda: se3.pose(quat=[0, 0, 0, 0]),
        lambda: se3.pose(axis=([0, 0, 0], 1.0)),
        lambda: se3.pose(axis=([0, 0, 1], np.nan)),
        lambda: se3.pose(axis=[0, 0, 1]),
    ],
)
def test_pose_refuses(call):
    with pytest.raises(InputError):
        call()


def test_right_angles_are_exact():
    for k in range(-8, 9):
        for digits in (0.0, 4e-13 if k else 0.0):
            c, s = se3.cos_sin(k * np.pi / 2 + digits)
            assert (c, s) == (round(np.cos(k * np.pi / 2)), round(np.sin(k * np.pi / 2)))
    assert set(np.unique(se3.pose(rpy=[np.pi / 2, -np.pi / 2, np.pi]))) <= {-1.0, 0.0, 1.0}
    for size in (1e-6, 1e-13):
        assert se3.cos_sin(size) == (np.cos(size), np.sin(size))


def test_inverse():
    T = se3.as_poses([se3.pose([1, 2, 3], rpy=[0.1, 2.0, -3.0]), np.eye(4)])
    np.testing.assert_allclose(se3.inverse(T) @ T, np.tile(np.eye(4), (2, 1, 1)), atol=1e-15)


# ---------------------------------------------------------------------------- rotations
def test_axis_and_log_round_trip():
    axis, size, R = rotations(200)
    np.testing.assert_allclose(se3.rotation_from_axis(axis, size), R, atol=1e-13)
    w = se3.rotation_log(R)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), size, atol=1e-12)
    np.testing.assert_allclose(se3.rotation_exp(w), R, atol=2e-13)
    # relative, so that small angles keep their digits
    small = size < 0.1
    exact = se3.rotation_from_axis(axis[small], size[small])
    back = se3.rotation_log(exact)
    np.testing.assert_allclose(back, axis[small] * size[small, None], rtol=1e-3, atol=1e-15)


def test_log_at_the_ends():
    np.testing.assert_array_equal(se3.rotation_log(np.eye(3)), 0.0)
    np.testing.assert_array_equal(se3.rotation_exp(np.zeros(3)), np.eye(3))
    for axis in np.eye(3):
        w = se3.rotation_log(oracle.about(axis, np.pi))
        np.testing.assert_allclose(np.abs(w), np.pi * axis, atol=1e-12)


def test_quaternion_round_trip():
    _, _, R = rotations(200, seed=1)
    q = se3.quat_from_rotation(R)
    assert (q[:, 0] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(se3.rotation_from_quat(q), R, atol=1e-13)
    np.testing.assert_allclose(se3.rotation_from_quat(-3e-170 * q), R, atol=1e-13)


@given(angle, st.floats(-1.5, 1.5), angle)
def test_rpy_round_trip(roll, pitch, yaw):
    back = se3.rpy_from_rotation(oracle.rpy(roll, pitch, yaw))
    np.testing.assert_allclose(oracle.rpy(*back), oracle.rpy(roll, pitch, yaw), atol=1e-13)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_rpy_at_gimbal_lock(pitch):
    R = se3.rotation_from_rpy([0.3, pitch, 0.8])
    roll, _, _ = back = se3.rpy_from_rotation(R)
    assert roll == 0.0
    np.testing.assert_allclose(se3.rotation_from_rpy(back), R, atol=1e-9)


def test_nearest_rotation():
    rng = np.random.default_rng(2)
    _, _, R = rotations(50, seed=3)
    noisy = R + rng.normal(scale=1e-3, size=R.shape)
    near = se3.nearest_rotation(noisy)
    np.testing.assert_allclose(near, [oracle.nearest_rotation(N) for N in noisy], atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(near), 1.0, atol=1e-13)
    assert np.linalg.det(se3.nearest_rotation(-np.eye(3))) > 0


@given(vector, vector)
def test_oracle_angle_agrees_with_log(a, b):
    A, B = se3.rotation_exp(a), se3.rotation_exp(b)
    size = np.linalg.norm(se3.rotation_log(A @ B.T))
    assert abs(oracle.angle_between(A, B) - size) < 1e-7


def test_joints_beyond_a_bound_name_their_row():
    q = np.zeros((2, 4, 3))
    q[1, 2, 0] = -2e6
    assert se3.as_joints(q, 3).shape == q.shape
    with pytest.raises(InputError, match=r"q must lie within \+-1e\+06, got -2e\+06 in row 1, 2"):
        se3.as_joints(q, 3, bound=1e6)
    with pytest.raises(InputError, match=r"got -2e\+06$"):
        se3.as_joints(q[1, 2], 3, bound=1e6)
    assert se3.as_joints([1e6, -1e6], 2, bound=1e6).tolist() == [1e6, -1e6]

"""Features of poses: what they say, where they are continuous, what they refuse."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinverse as kv
import oracle
from kinverse.learning import PoseFeatures
from kinverse.learning.features import KINDS

ANGLE = st.floats(-np.pi, np.pi)
RPY = st.tuples(ANGLE, st.floats(-1.5, 1.5), ANGLE)


@pytest.fixture(scope="module")
def poses():
    robot = kv.load("kr16")
    return robot.fk(robot.random(300, rng=1))


def rotation_of(kind, row):
    """The rotation matrix a row of features stands for."""
    part = kind.partition("+")[2]
    if part == "matrix":
        return row[3:].reshape(3, 3)
    if part == "quat":
        return kv.pose(quat=row[3:])[:3, :3]
    return oracle.rpy(*row[3:])


@pytest.mark.parametrize("kind", KINDS)
def test_names_and_widths_agree(kind, poses):
    features = PoseFeatures(kind)
    X = features.fit_transform(poses)
    assert X.shape == (len(poses), features.n_features_) == (len(poses), len(features.names_))
    assert (X == features.transform(poses)).all()
    place = 2 if kind.startswith("xy+") or kind == "xy" else 3
    assert (X[:, :place] == poses[:, :place, 3]).all()
    assert features.transform(poses[0]).shape == (1, features.n_features_)
    assert features.transform(poses[:0]).shape == (0, features.n_features_)
    assert (features.transform(poses[5:9]) == X[5:9]).all()


@pytest.mark.parametrize("kind", ["xyz+rpy", "xyz+quat", "xyz+matrix"])
def test_the_features_are_the_rotation(kind, poses):
    X = PoseFeatures(kind).fit(poses[:50]).transform(poses)
    for T, row in zip(poses, X, strict=True):
        assert np.abs(rotation_of(kind, row) - T[:3, :3]).max() < 1e-12


def test_the_widths_of_the_issue():
    widths = {kind: len(names) for kind, names in KINDS.items()}
    assert [widths[k] for k in ("xyz", "xyz+rpy", "xyz+quat", "xyz+matrix")] == [3, 6, 7, 12]


@pytest.mark.parametrize("kind", ["xyz+rpy", "xyz+yaw", "xy+yaw"])
def test_angles_stay_together_across_half_a_turn(kind):
    around = np.pi + np.linspace(-0.3, 0.3, 61)
    rpy = np.column_stack([around, 0.1 * around, around])
    T = kv.pose(rpy=rpy)
    raw = np.arctan2(np.sin(around), np.cos(around))
    assert np.abs(np.diff(raw)).max() > 6.0  # the library's own reading jumps by a turn
    X = PoseFeatures(kind).fit(T[::7]).transform(T)
    assert np.abs(np.diff(X, axis=0)).max() < 0.011


@given(st.lists(RPY, min_size=1, max_size=8), st.lists(RPY, min_size=1, max_size=8))
def test_every_angle_lies_within_half_a_turn_of_the_reference(training, asked):
    features = PoseFeatures("xyz+rpy").fit(kv.pose(rpy=np.array(training)))
    T = kv.pose(rpy=np.array(asked))
    X = features.transform(T)
    assert (np.abs(X[:, 3:] - features.reference_) <= np.pi + 1e-12).all()
    for row, (roll, pitch, yaw) in zip(X, asked, strict=True):
        assert np.abs(oracle.rpy(*row[3:]) - oracle.rpy(roll, pitch, yaw)).max() < 1e-9


@given(st.lists(RPY, min_size=1, max_size=8), st.lists(RPY, min_size=1, max_size=8))
def test_quaternions_lie_in_the_hemisphere_of_the_reference(training, asked):
    features = PoseFeatures("xyz+quat").fit(kv.pose(rpy=np.array(training)))
    X = features.transform(kv.pose(rpy=np.array(asked)))
    assert (X[:, 3:] @ features.reference_ >= 0.0).all()
    assert np.abs(np.linalg.norm(features.reference_) - 1.0) < 1e-12


def test_quaternions_stay_together_across_a_half_turn():
    T = kv.pose(axis=([0.0, 1.0, 0.0], np.pi + np.linspace(-0.5, 0.5, 101)))
    assert np.abs(np.diff(PoseFeatures("xyz+quat").fit_transform(T), axis=0)).max() < 0.006


def test_the_reference_is_the_middle_of_what_it_was_fitted_to():
    middle = np.array([3.0, 0.4, -2.9])
    away = np.random.default_rng(2).uniform(-0.4, 0.4, (200, 3))
    T = kv.pose(rpy=middle + np.vstack([away, -away]))  # on both sides alike
    rpy = PoseFeatures("xyz+rpy").fit(T).reference_
    assert np.abs(np.exp(1j * rpy) - np.exp(1j * middle)).max() < 1e-12
    spin = np.linspace(-0.5, 0.5, 11)
    T = kv.pose(rpy=middle)[None] @ kv.pose(axis=([1.0, 2.0, -1.0], spin))
    quat = PoseFeatures("xyz+quat").fit(T).reference_
    assert np.abs(kv.pose(quat=quat)[:3, :3] - oracle.rpy(*middle)).max() < 1e-12


@given(st.tuples(*[ANGLE] * 6), st.tuples(*[st.integers(-9, 9)] * 3))
def test_differences_are_wrapped(angles, turns):
    features = PoseFeatures("xyz+rpy").fit(np.eye(4))
    a = np.array([1.0, 2.0, 3.0, *angles[:3]])
    b = np.array([0.0, 0.0, 5.0, *angles[3:]])
    d = features.difference(a, b + 2 * np.pi * np.array([0, 0, 0, *turns]))
    assert (d[:3] == [-1.0, -2.0, 2.0]).all()
    assert ((d[3:] > -np.pi) & (d[3:] <= np.pi)).all()
    assert np.abs(np.exp(1j * d[3:]) - np.exp(1j * (b - a)[3:])).max() < 1e-12


def test_a_difference_of_half_a_turn_is_positive():
    features = PoseFeatures("xy+yaw").fit(np.eye(4))
    for turn in (np.pi, -np.pi, 3 * np.pi, -np.pi + 2 * np.pi * -5):
        assert features.difference([0.0, 0.0, 0.0], [0.0, 0.0, turn])[2] == np.pi


def test_differences_of_quaternions_go_the_short_way():
    features = PoseFeatures("xyz+quat").fit(np.eye(4))
    T = kv.pose(axis=([0.0, 0.0, 1.0], np.array([3.0, 3.2])))  # on both sides of half a turn
    A, B = features.transform(T)
    assert np.abs(A - B).max() > 1.9
    assert np.abs(features.difference(A, B)).max() < 0.11
    assert features.difference(np.array([A, B]), B).shape == (2, 7)


def test_a_clone_forgets_and_a_pickle_remembers(poses):
    features = PoseFeatures("xyz+rpy").fit(poses)
    assert repr(features) == "PoseFeatures(kind='xyz+rpy')"
    assert (
        pickle.loads(pickle.dumps(features)).transform(poses) == features.transform(poses)
    ).all()
    with pytest.raises(kv.InputError, match="not fitted"):
        features.clone().transform(poses)
    assert features.clone() == features


def test_another_kind_needs_another_fit(poses):
    features = PoseFeatures("xyz+rpy").fit(poses)
    with pytest.raises(kv.InputError, match="not fitted"):
        features.set_params(kind="xyz+quat").transform(poses)


@pytest.mark.parametrize("kind", ["rpy", "", None, 3, ["xyz"]])
def test_unknown_kinds_are_refused_by_name(kind):
    with pytest.raises(kv.InputError, match=r"xyz, xyz\+rpy, xyz\+quat, xyz\+matrix"):
        PoseFeatures(kind).fit(np.eye(4))


def test_bad_input_is_refused(poses):
    features = PoseFeatures("xyz+rpy")
    with pytest.raises(kv.InputError, match="at least one pose"):
        features.fit(poses[:0])
    broken = poses.copy()
    broken[7, 0, 3] = np.nan
    with pytest.raises(kv.InputError, match="row 7"):
        features.fit(broken)
    features.fit(poses)
    with pytest.raises(kv.InputError, match="row 7"):
        features.transform(broken)
    with pytest.raises(kv.InputError, match=r"A must have shape \(\.\.\., 6\)"):
        features.difference(np.zeros(5), np.zeros(6))
    with pytest.raises(kv.InputError, match="B must be finite"):
        features.difference(np.zeros(6), np.full(6, np.inf))
    with pytest.raises(kv.InputError, match="broadcast"):
        features.difference(np.zeros((2, 6)), np.zeros((3, 6)))
    with pytest.raises(TypeError, match="real numbers"):
        features.checked(np.zeros(6, dtype=complex))

"""Pairs of poses: all of them, split without a leak, or with the document's."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.learning import IncrementalPairs, PoseFeatures, pair_inputs, sample


@pytest.fixture(scope="module")
def data():
    return sample(kv.load("ir361"), 70, random_state=11)


def test_seventy_poses_make_the_documents_pairs(data):
    pairs = IncrementalPairs(PoseFeatures("xyz+rpy")).make(data.q, data.T)
    assert len(pairs) == 4830 == 70 * 69
    assert pairs.X.shape == (4830, 12) and pairs.y.shape == (4830, 6)
    assert (pairs.first != pairs.second).all()
    assert len(set(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True))) == 4830


@pytest.mark.parametrize("kind", ["xyz+rpy", "xyz+quat", "xyz+matrix"])
@pytest.mark.parametrize("split", ["pose", "pair"])
def test_a_pattern_is_a_pose_the_way_to_another_and_the_way_of_the_joints(data, kind, split):
    pairs = IncrementalPairs(PoseFeatures(kind), split=split).make(data.q, data.T)
    values = pairs.features.transform(data.T)
    k = pairs.features.n_features_
    for row in (0, 1, 68, 69, 2500, 4829):
        i, j = pairs.first[row], pairs.second[row]
        assert (pairs.X[row, :k] == values[i]).all()
        assert (pairs.X[row, k:] == pairs.features.difference(values[i], values[j])).all()
        assert (pairs.y[row] == data.q[j] - data.q[i]).all()


def test_no_training_pose_is_in_a_test_pair(data):
    for seed in range(5):
        pairs = IncrementalPairs(PoseFeatures("xyz"), random_state=seed).make(data.q, data.T)
        seen = {*pairs.first[pairs.is_train], *pairs.second[pairs.is_train]}
        held = {*pairs.first[pairs.is_test], *pairs.second[pairs.is_test]}
        assert not seen & held and len(seen) == 49 and len(held) == 21
        assert pairs.is_train.sum() == 49 * 48 and pairs.is_test.sum() == 21 * 20
        assert not (pairs.is_train & pairs.is_test).any()
        assert pairs.n_mixed == 4830 - 49 * 48 - 21 * 20 == 2 * 49 * 21


def test_a_split_by_pair_uses_every_pair_and_leaks(data):
    maker = IncrementalPairs(PoseFeatures("xyz+rpy"), split="pair", random_state=3)
    pairs = maker.make(data.q, data.T)
    assert pairs.is_test.sum() == round(0.3 * 4830) and pairs.n_mixed == 0
    assert (pairs.is_train ^ pairs.is_test).all()
    # the leak: each held-out way of the joints is the sum of two that were trained on
    trained = set(zip(pairs.first[pairs.is_train], pairs.second[pairs.is_train], strict=True))
    held = zip(pairs.first[pairs.is_test], pairs.second[pairs.is_test], strict=True)
    assert all(any((i, k) in trained and (k, j) in trained for k in range(70)) for i, j in held)


def test_features_are_learned_from_the_training_poses_only():
    rpy = np.zeros((40, 3))
    rpy[:, 0] = np.random.default_rng(1).uniform(-1.0, 1.0, 40)
    T, q = kv.pose(rpy=rpy), np.zeros((40, 6))
    given = PoseFeatures("xyz+rpy")
    pairs = IncrementalPairs(given, random_state=2).make(q, T)
    poses = np.unique(pairs.first[pairs.is_train])
    assert (pairs.features.reference_ == given.clone().fit(T[poses]).reference_).all()
    assert not hasattr(given, "reference_")
    everything = IncrementalPairs(given, split="pair").make(q, T)
    assert (everything.features.reference_ == given.clone().fit(T).reference_).all()


def test_parts_are_the_rows_of_their_masks(data):
    pairs = IncrementalPairs(PoseFeatures("xyz+rpy")).make(data.q, data.T)
    for (X, y), mask in ((pairs.train, pairs.is_train), (pairs.test, pairs.is_test)):
        assert (pairs.X[mask] == X).all() and (pairs.y[mask] == y).all() and len(X) == mask.sum()
    assert repr(pairs) == "PairSet: 4830 pairs, 2352 train, 420 test, 2058 mixed"


@pytest.mark.parametrize("split", ["pose", "pair"])
def test_seeds(data, split):
    def masks(seed):
        maker = IncrementalPairs(PoseFeatures("xyz"), split=split, random_state=seed)
        return maker.make(data.q, data.T).is_train

    assert (masks(4) == masks(4)).all()
    assert (masks(None) == masks(None)).all()
    assert (masks(4) != masks(5)).any()


@pytest.mark.parametrize("split", ["pose", "pair"])
def test_without_a_test_share_everything_trains(data, split):
    maker = IncrementalPairs(PoseFeatures("xyz"), split=split, test_fraction=0.0)
    pairs = maker.make(data.q, data.T)
    assert pairs.is_train.all() and not len(pairs.test[0]) and pairs.n_mixed == 0


def test_the_loop_reads_what_the_network_was_trained_on(data):
    pairs = IncrementalPairs(PoseFeatures("xyz+rpy")).make(data.q, data.T)
    values = pairs.features.transform(data.T)
    X = pair_inputs(pairs.features, values[pairs.first[:200]], values[pairs.second[:200]])
    assert (pairs.X[:200] == X).all()
    assert (pair_inputs(pairs.features, values[0], values[1:4]) == pairs.X[:3]).all()
    assert pair_inputs(pairs.features, values[0], values[1]).shape == (1, 12)


def test_bad_input_is_refused(data):
    features = PoseFeatures("xyz")

    def make(q=data.q, T=data.T, features=features, **settings):
        return IncrementalPairs(features, **settings).make(q, T)

    with pytest.raises(kv.InputError, match="the splits are pose, pair"):
        make(split="poses")
    with pytest.raises(TypeError, match="PoseFeatures"):
        make(features="xyz")
    with pytest.raises(kv.InputError, match="q has 69 rows and T has 70"):
        make(q=data.q[:-1])
    with pytest.raises(kv.InputError, match="at least two poses"):
        make(q=data.q[:1], T=data.T[:1])
    with pytest.raises(kv.InputError, match="leaves 2 to train and 1 to test"):
        make(q=data.q[:3], T=data.T[:3])
    with pytest.raises(kv.InputError, match="shape"):
        make(q=data.q[0])
    broken = data.q.copy()
    broken[3, 2] = np.nan
    with pytest.raises(kv.InputError, match="row 3"):
        make(q=broken)
    for share in (-0.1, 1.0, np.nan, "a", True):
        with pytest.raises(kv.InputError, match=r"\[0, 1\)"):
            make(test_fraction=share)
    with pytest.raises(TypeError, match="random_state"):
        make(random_state="seed")

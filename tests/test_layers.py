"""Layers: derivatives are those of differences, the normal matrix is J^T J, first weights."""

import numpy as np
import pytest

from kinverse.networks.layers import Layers
from kinverse.networks.trainers.normal_matrix import CHUNK, normal_matrix

FORMS = [
    ((3, 5, 2), ("tansig", "purelin")),
    ((2, 4, 3), ("logsig", "purelin")),
    ((1, 1, 1), ("tansig", "purelin")),
    ((4, 3, 1), ("purelin", "purelin")),
    ((3, 4, 2), ("tansig", "logsig")),
    ((2, 4, 3, 2), ("tansig", "logsig", "purelin")),
    ((2, 3, 4, 2, 3), ("logsig", "purelin", "tansig", "tansig")),
]


def given(sizes, names, rows=30, seed=1):
    rng = np.random.default_rng(seed)
    layers = Layers(sizes, names)
    return layers, rng.uniform(-1, 1, layers.count), rng.uniform(-1, 1, (rows, sizes[0]))


def differences(layers, weights, X, eps=1e-6):
    """(N, m, P)"""
    columns = [
        (layers.forward(weights + eps * e, X) - layers.forward(weights - eps * e, X)) / (2 * eps)
        for e in np.eye(len(weights))
    ]
    return np.stack(columns, axis=2)


def lower(matrix):
    return np.tril(matrix)


@pytest.mark.parametrize(("sizes", "names"), FORMS)
def test_jacobian_is_that_of_differences(sizes, names):
    layers, weights, X = given(sizes, names)
    np.testing.assert_allclose(
        layers.jacobian(weights, X), differences(layers, weights, X), atol=1e-8
    )


@pytest.mark.parametrize(("sizes", "names"), FORMS)
def test_gradient_is_the_weighted_sum_of_the_jacobian(sizes, names):
    layers, weights, X = given(sizes, names)
    error = np.random.default_rng(2).standard_normal((len(X), sizes[-1]))
    by_differences = np.einsum("nm,nmp->p", error, differences(layers, weights, X))
    found = layers.gradient(weights, layers.outputs(weights, X), error)
    np.testing.assert_allclose(found, by_differences, atol=1e-7)


@pytest.mark.parametrize("rows", [1, 30, 2 * CHUNK + 7])
@pytest.mark.parametrize(("sizes", "names"), FORMS)
def test_normal_matrix_is_that_of_the_dense_jacobian(sizes, names, rows):
    layers, weights, X = given(sizes, names, rows)
    J = layers.jacobian(weights, X).reshape(-1, layers.count)
    dense = J.T @ J
    found = normal_matrix(layers, weights, layers.outputs(weights, X))
    np.testing.assert_allclose(found, lower(dense), atol=1e-13 * np.abs(dense).max())


def test_normal_matrix_of_many_blocks(monkeypatch):
    layers, weights, X = given((2, 4, 3, 2), ("tansig", "logsig", "tansig"), 50)
    whole = normal_matrix(layers, weights, layers.outputs(weights, X))
    cut = Layers.blocks
    monkeypatch.setattr(Layers, "blocks", lambda self, X: cut(self, X, entries=500))
    assert len(list(layers.blocks(X))) > 5
    parts = normal_matrix(layers, weights, layers.outputs(weights, X))
    np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-14)


def test_blocks_hold_every_row_once():
    layers, _, X = given((3, 5, 2), ("tansig", "purelin"), 101)
    rows = np.concatenate([np.arange(101)[rows] for rows in layers.blocks(X, entries=600)])
    np.testing.assert_array_equal(rows, np.arange(101))


@pytest.mark.parametrize(("sizes", "names"), FORMS)
def test_the_vector_and_its_layers_are_one(sizes, names):
    layers, weights, X = given(sizes, names)
    parts = layers.split(weights)
    np.testing.assert_array_equal(layers.joined(parts), weights)
    assert [W.shape for W, _ in parts] == list(zip(sizes, sizes[1:], strict=False))
    np.testing.assert_array_equal(layers.outputs(weights, X)[-1], layers.forward(weights, X))


@pytest.mark.parametrize(("name", "active"), [("tansig", 1.0), ("logsig", 2.0)])
def test_first_weights_are_nguyen_and_widrows(name, active):
    n, h = 3, 40
    layers = Layers((n, h, 2), (name, "purelin"))
    (W, b), (last, bias) = layers.split(layers.nguyen_widrow(np.random.default_rng(0)))
    norm = active * 0.7 * h ** (1 / n)
    np.testing.assert_allclose(np.linalg.norm(W, axis=0), norm)
    np.testing.assert_allclose(np.sort(b * np.sign(W[0])), norm * np.linspace(-1, 1, h))
    assert np.abs(W.mean(axis=1)).max() < 0.5 * norm  # directions all round
    assert max(np.abs(last).max(), np.abs(bias).max()) <= 0.5


def test_first_weights_of_one_unit_are_finite_and_centred():
    layers = Layers((2, 1, 1), ("tansig", "purelin"))
    (_, b), _ = layers.split(layers.nguyen_widrow(np.random.default_rng(0)))
    assert b == 0.0

"""J^T J of a feed-forward network without its Jacobian."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.activations import activation
from kinverse.networks.layers import Layers

__all__ = ["normal_matrix"]

Array = NDArray[np.float64]

CHUNK = 1000
"""Rows at a time: their block stays in the cache."""


def normal_matrix(layers: Layers, weights: Array, outputs: list[Array]) -> Array:
    """J^T J (P, P) of the outputs of all rows by the weights, its lower triangle only.

    The rows of the Jacobian (N m, P) are never held all at once.

    Args:
        layers: the form of the network.
        weights: (P,) the vector.
        outputs: what ``layers.outputs`` gave for it.

    Example:
        >>> normal_matrix(layers, weights, layers.outputs(weights, X)).shape
        (21, 21)
    """
    if len(layers.activations) == 2 and activation(layers.activations[-1]).linear:
        return _one_hidden_layer(layers, weights, outputs)
    total = np.zeros((layers.count, layers.count), order="F")
    X = outputs[0]
    for rows in layers.blocks(X):
        _add_product(total, layers.jacobian(weights, X[rows]).reshape(-1, layers.count))
    return total


def _one_hidden_layer(layers: Layers, weights: Array, outputs: list[Array]) -> Array:
    """The matrix from one symmetric product of rows [Z, a, 1], Z = [slope x_1, .., slope].

    Output k depends on hidden unit j by dy_k / dW1_ij = W2_jk Z_ij, dy_k / dW2_jk = a_j, so with
    S = W2 W2^T, repeated for every pair of inputs, the hidden weights' block is (Z^T Z) o tile(S);
    the weights of different outputs do not couple.
    """
    n, h, m = layers.sizes
    W2 = layers.split(weights)[1][0]
    split = (n + 1) * h
    product = _product(outputs[0], outputs[1], activation(layers.activations[0]).slope)
    matrix = np.zeros((layers.count, layers.count), order="F")
    tiles = np.tile(W2 @ W2.T, (n + 1, n + 1))
    np.multiply(product[:split, :split], tiles, out=matrix[:split, :split])
    for k in range(m):
        last = slice(split + k, None, m)
        matrix[last, :split] = product[split:, :split] * np.tile(W2[:, k], n + 1)
        matrix[last, last] = product[split:, split:]
    return matrix


def _product(X: Array, a: Array, derivative: Any) -> Array:
    """The lower triangle of [Z, a, 1]^T [Z, a, 1]."""
    n, h = X.shape[1], a.shape[1]
    split = (n + 1) * h
    total = np.zeros((split + h + 1, split + h + 1), order="F")
    buffer = np.empty((min(CHUNK, len(X)), len(total)))
    for k in range(0, len(X), CHUNK):
        rows = slice(k, k + CHUNK)
        block = buffer[: len(X[rows])]
        Z = block[:, :split].reshape(len(block), n + 1, h)
        Z[:, n] = derivative(a[rows])
        np.multiply(X[rows, :, None], Z[:, n, None], out=Z[:, :n])
        block[:, split:-1], block[:, -1] = a[rows], 1.0
        _add_product(total, block)
    return total


def _add_product(total: Array, rows: Array) -> None:
    """Add rows^T rows to the lower triangle of a matrix in Fortran order, in place."""
    from scipy.linalg.blas import dsyrk

    dsyrk(1.0, rows.T, beta=1.0, c=total, lower=1, overwrite_c=1)

"""A recurrent layer on one weight vector: outputs after the last step, gradient, first weights.

Step t maps x_t and the hidden state before it to h_t = f(x_t W + h_{t-1} U + b), h_0 = 0; the
output is y = h_T V + c. The weight vector holds W (n, h), b (h,), V (h, m), c (m,) as ``Layers``
does, then U (h, h).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.activations import activation
from kinverse.networks.layers import Layers

__all__ = ["Recurrent"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recurrent:
    """The form of an Elman network (Elman, Cognitive Science 14 (1990) 179).

    Args:
        n_steps: T; a row of X holds x_1, ..., x_T, (T n,).
        sizes: (n, h, m).
        name: the activation of the hidden layer; the output is linear.

    Example:
        >>> Recurrent(3, (2, 5, 1), "tansig").count
        46
    """

    n_steps: int
    sizes: tuple[int, int, int]
    name: str

    @property
    def _feed(self) -> Layers:
        """The same network without its memory."""
        return Layers(self.sizes, (self.name, "purelin"))

    @property
    def count(self) -> int:
        """Numbers in the weight vector."""
        return self._feed.count + self.sizes[1] ** 2

    def split(self, weights: Array) -> tuple[Array, Array, Array, Array, Array]:
        """W, U, b, V, c, views of the vector (P,)."""
        feed, h = self._feed, self.sizes[1]
        (W, b), (V, c) = feed.split(weights[: feed.count])
        return W, weights[feed.count :].reshape(h, h), b, V, c

    def steps(self, X: Array) -> Array:
        """Rows (N, T n) as (T, N, n)."""
        return X.reshape(len(X), self.n_steps, self.sizes[0]).transpose(1, 0, 2)

    def outputs(self, weights: Array, X: Array) -> list[Array]:
        """X, the hidden state (N, h) after each step, and the output (N, m)."""
        W, U, b, V, c = self.split(weights)
        f = activation(self.name).of
        out = [X]
        for t, x in enumerate(self.steps(X)):
            inner = x @ W + b
            out.append(f(inner + out[-1] @ U if t else inner))
        return [*out, out[-1] @ V + c]

    def forward(self, weights: Array, X: Array) -> Array:
        """Outputs (N, m) of rows X (N, T n)."""
        return self.outputs(weights, X)[-1]

    def gradient(self, weights: Array, outputs: list[Array], error: Array) -> Array:
        """Derivatives (P,) of sum(error * Y) for a fixed error (N, m), through time.

        Args:
            weights: (P,) the vector.
            outputs: what ``outputs`` gave for it.
            error: (N, m) the weight of each output.
        """
        W, U, b, V, _ = self.split(weights)
        slope = activation(self.name).slope
        X, *states, _ = outputs
        x = self.steps(X)
        by_W, by_U, by_b = np.zeros_like(W), np.zeros_like(U), np.zeros_like(b)
        back = error @ V.T
        for t in reversed(range(self.n_steps)):
            back = back * slope(states[t])
            by_W += x[t].T @ back
            by_b += back.sum(axis=0)
            if t:
                by_U += states[t - 1].T @ back
                back = back @ U.T
        feed = self._feed.joined([(by_W, by_b), (states[-1].T @ error, error.sum(axis=0))])
        return np.concatenate([feed, by_U.ravel()])

    def first_weights(self, rng: np.random.Generator) -> Array:
        """(P,) Nguyen & Widrow's for the inputs; a memory that fades, U of spectral norm 1/2."""
        h = self.sizes[1]
        U = rng.standard_normal((h, h))
        U *= 0.5 / np.linalg.norm(U, 2)
        return np.concatenate([self._feed.nguyen_widrow(rng), U.ravel()])

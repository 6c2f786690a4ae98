"""Feed-forward layers on one weight vector: outputs, gradient, Jacobian, first weights.

Layer k maps a (N, s_k) to f_k(a W_k + b_k) (N, s_{k+1}); the vector holds W_1, b_1, W_2, b_2 ...,
each W in C order.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.activations import activation

__all__ = ["Layers"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layers:
    """The form of a feed-forward network.

    Args:
        sizes: (n, h_1, ..., m) units, inputs and outputs included.
        activations: a name for each layer, the output's last.

    Example:
        >>> Layers((2, 5, 1), ("tansig", "purelin")).count
        21
    """

    sizes: tuple[int, ...]
    activations: tuple[str, ...]

    @property
    def count(self) -> int:
        """Numbers in the weight vector."""
        return sum((a + 1) * b for a, b in zip(self.sizes, self.sizes[1:], strict=False))

    def split(self, weights: Array) -> list[tuple[Array, Array]]:
        """(W, b) of each layer, views of the vector (P,)."""
        parts, at = [], 0
        for a, b in zip(self.sizes, self.sizes[1:], strict=False):
            parts.append((weights[at : at + a * b].reshape(a, b), weights[at + a * b :][:b]))
            at += (a + 1) * b
        return parts

    def joined(self, parts: Sequence[tuple[Array, Array]]) -> Array:
        """The weight vector of layers (W, b)."""
        return np.concatenate([array.ravel() for part in parts for array in part])

    def forward(self, weights: Array, X: Array) -> Array:
        """Outputs (N, m) of rows X (N, n)."""
        a = X
        for (W, b), name in zip(self.split(weights), self.activations, strict=True):
            a = a @ W
            a += b
            a = activation(name).of(a)
        return a

    def outputs(self, weights: Array, X: Array) -> list[Array]:
        """The output of every layer, X itself first."""
        out = [X]
        for (W, b), name in zip(self.split(weights), self.activations, strict=True):
            out.append(activation(name).of(out[-1] @ W + b))
        return out

    def gradient(self, weights: Array, outputs: Sequence[Array], error: Array) -> Array:
        """Derivatives (P,) of sum(error * Y) for a fixed error (N, m): back-propagation.

        With error = Y - T it is half the gradient of the sum of squared errors.

        Args:
            weights: (P,) the vector.
            outputs: what ``outputs`` gave for it.
            error: (N, m) the weight of each output.
        """
        back = error
        parts = []
        for k in reversed(range(len(self.activations))):
            W, _ = self.split(weights)[k]
            back = back * activation(self.activations[k]).slope(outputs[k + 1])
            parts.append((outputs[k].T @ back, back.sum(axis=0)))
            if k:
                back = back @ W.T
        return self.joined(parts[::-1])

    def jacobian(self, weights: Array, X: Array) -> Array:
        """Derivatives (N, m, P) of the outputs of rows X (N, n); give it blocks of rows."""
        out = self.outputs(weights, X)
        rows, m = len(X), self.sizes[-1]
        # (N, m, units of the layer): derivative of output k by the layer's inner sum
        last = activation(self.activations[-1]).slope(out[-1])
        back = np.zeros((rows, m, m))
        back[:, np.arange(m), np.arange(m)] = last
        parts: list[Array] = []
        layers = self.split(weights)
        for k in reversed(range(len(layers))):
            by_weights = out[k][:, None, :, None] * back[:, :, None, :]
            parts += [back, by_weights.reshape(rows, m, -1)]
            if k:
                slope = activation(self.activations[k - 1]).slope(out[k])
                back = (back @ layers[k][0].T) * slope[:, None, :]
        return np.concatenate(parts[::-1], axis=2)

    def blocks(self, X: Array, entries: int = 2**21) -> Iterator[slice]:
        """Slices of rows whose Jacobian has about so many entries, at least one row each."""
        step = max(1, entries // (self.sizes[-1] * self.count))
        return (slice(k, k + step) for k in range(0, len(X), step))

    def nguyen_widrow(self, rng: np.random.Generator, scale: float = 0.7) -> Array:
        """First weights (P,) for inputs in [-1, 1] (Nguyen & Widrow 1990).

        Each hidden unit's weights have a random direction and the norm scale h^(1/n), its active
        range placed evenly over [-1, 1]; layers that are linear or last begin with small weights.
        """
        parts = []
        for k, (n, h) in enumerate(zip(self.sizes, self.sizes[1:], strict=False)):
            last = k == len(self.activations) - 1
            if last or activation(self.activations[k]).linear:
                parts.append((rng.uniform(-0.5, 0.5, (n, h)), rng.uniform(-0.5, 0.5, h)))
                continue
            norm = scale * h ** (1.0 / n)
            if self.activations[k] == "logsig":
                norm *= 2.0  # its active range is [-2, 2] where tanh has [-1, 1]
            W = rng.standard_normal((n, h))
            W *= norm / np.maximum(np.linalg.norm(W, axis=0), np.finfo(np.float64).tiny)
            places = np.linspace(-1.0, 1.0, h) if h > 1 else np.zeros(1)
            parts.append((W, norm * places * np.sign(W[0])))
        return self.joined(parts)

"""How a member of a swarm holds the weights of a network: document 004, section 5.4.5."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks.layers import Layers

__all__ = ["ENCODINGS", "Encoding", "check_encoding"]

Array = NDArray[np.float64]
Stacked = list[tuple[Array, Array]]

ENCODINGS = ("vector", "matrix", "binary")


class Encoding(NamedTuple):
    """Members (D,) of a search and the networks that they stand for.

    Args:
        kind: "vector": a member is the weight vector of ``Layers``, [W1, B1, W2, B2], taken apart
            member by member; "matrix": all members are matrices at once, in the same order, so
            that the same search gives the same bits; "binary": a member is a string of bits.
        layers: the form of the network.
        bound: weights and biases lie in [-bound, bound].
        bits: of a weight, for "binary": plain binary code (not Gray), the highest bit first, from
            -bound to bound in 2**bits - 1 equal steps. The methods search real numbers: a bit is
            one in [0, 1], set from 0.5 on.

    Example:
        >>> Encoding("vector", Layers((3, 8, 5), ("logsig", "purelin")), 1.0).box.shape
        (77, 2)
    """

    kind: str
    layers: Layers
    bound: float
    bits: int = 1

    @property
    def box(self) -> Array:
        """(D, 2) the bounds of a member."""
        if self.kind == "binary":
            return np.tile([0.0, 1.0], (self.layers.count * self.bits, 1))
        return np.tile([-self.bound, self.bound], (self.layers.count, 1))

    def weights(self, members: Array) -> Array:
        """Weight vectors (K, P) of members (K, D)."""
        if self.kind != "binary":
            return members
        is_set = members.reshape(len(members), -1, self.bits) >= 0.5
        words: Array = is_set @ self._places()
        steps = 2.0**self.bits - 1.0
        return (2.0 * (words / steps) - 1.0) * self.bound

    def member(self, weights: Array) -> Array:
        """The member (D,) that stands for weights (P,), or for the nearest ones it can hold."""
        held = np.clip(weights, -self.bound, self.bound)
        if self.kind != "binary":
            return held
        steps = 2.0**self.bits - 1.0
        words = np.rint((held / self.bound + 1.0) * 0.5 * steps)
        return np.ravel(words[:, None] // self._places() % 2.0)

    def matrices(self, members: Array) -> Stacked:
        """(W (K, a, b), B (K, b)) of each layer for members (K, D)."""
        weights = self.weights(members)
        if self.kind == "vector":
            each = [self.layers.split(vector) for vector in weights]
            return [
                (np.stack([W for W, _ in layer]), np.stack([b for _, b in layer]))
                for layer in zip(*each, strict=True)
            ]
        stacked, at = [], 0
        for a, b in zip(self.layers.sizes, self.layers.sizes[1:], strict=False):
            W = weights[:, at : at + a * b].reshape(-1, a, b)
            stacked.append((W, weights[:, at + a * b :][:, :b]))
            at += (a + 1) * b
        return stacked

    def _places(self) -> Array:
        """(bits,) what each bit of a word is worth."""
        places: Array = np.ldexp(1.0, np.arange(self.bits - 1, -1, -1))
        return places


def check_encoding(kind: object) -> None:
    """Refuse what is no encoding (InputError); the message names the valid ones."""
    if kind not in ENCODINGS:
        raise InputError(f"encoding must be one of {', '.join(ENCODINGS)}, got {kind!r}")

"""What several methods draw with: rows by index, the roulette wheel, settings in a range."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["number_within", "roulette", "take"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def take(x: NDArray[Any], index: Ints) -> NDArray[Any]:
    """Members index (A, n) of x (A, K, ...): (A, n, ...)."""
    first = np.arange(len(x)).reshape(-1, 1) * x.shape[1]
    rows: NDArray[Any] = x.reshape(-1, *x.shape[2:]).take(index + first, axis=0)
    return rows


def roulette(weights: Array, u: Array) -> Ints:
    """Members (A, n) drawn by the wheel: weights (A, K) >= 0 as sectors, u (A, n) in [0, 1).

    Weights that are all zero count as equal.
    """
    most = weights.max(axis=1, keepdims=True)
    nothing = most <= 0.0
    edges = (weights / np.where(nothing, 1.0, most) + nothing).cumsum(axis=1)
    spun = u * edges[:, -1:]
    last = weights.shape[1] - 1
    first = np.arange(len(weights)).reshape(-1, 1) * (last + 1)
    flat = edges.ravel()
    picked = np.zeros(u.shape, np.int64)
    step = 1 << last.bit_length() >> 1
    while step:  # by halves: edges below the ball are passed
        probe = np.minimum(picked + step, last)
        np.copyto(picked, probe, where=flat.take(first + (probe - 1)) <= spun)
        step >>= 1
    return picked


def number_within(name: str, value: Any, least: float, most: float = np.inf) -> None:
    """Raise InputError unless value is a finite number in least..most."""
    number = isinstance(value, (int, float, np.integer, np.floating))
    if isinstance(value, bool) or not number or not least <= value <= most or value == np.inf:
        where = f"in {least:g}..{most:g}" if most < np.inf else f"of at least {least:g}"
        raise InputError(f"{name} must be a number {where}, got {value!r}")

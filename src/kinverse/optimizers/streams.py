"""One random stream for each problem: what it draws does not depend on its neighbours."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Streams"]

Array = NDArray[np.float64]


class Streams:
    """M streams drawn from together.

    Args:
        keys: one sequence of whole numbers below 2**32 for each problem; equal keys give equal
            streams.

    Example:
        >>> Streams([(1, 0), (1, 1)]).uniform(100, 6).shape
        (2, 100, 6)
    """

    def __init__(self, keys: Sequence[ArrayLike]) -> None:
        from numpy.random import SFC64, Generator, SeedSequence

        self._generators = [
            Generator(SFC64(SeedSequence(np.asarray(key, np.uint32).tolist()))) for key in keys
        ]

    def __len__(self) -> int:
        return len(self._generators)

    def uniform(self, *shape: int) -> Array:
        """(M, *shape) numbers in [0, 1)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.random(out=row)
        return out

    def normal(self, *shape: int) -> Array:
        """(M, *shape) numbers of the standard normal distribution."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_normal(out=row)
        return out

    def keep(self, rows: NDArray[np.bool_]) -> None:
        """Go on with the streams of some problems only."""
        self._generators = [g for g, kept in zip(self._generators, rows, strict=True) if kept]

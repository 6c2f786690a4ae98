"""The examples whose poses are nearest to a pose."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Neighbours"]

Array = NDArray[np.float64]

TURN_WEIGHT = 0.5
"""What an entry of the rotation matrix counts beside a position in the examples' spread."""


class Neighbours:
    """Examples in a tree; distances are positions, in their spread, and rotation matrix entries.

    Args:
        q: (K, n) joint values of the examples.
        T: (K, 4, 4) the poses they reach.
        with_rotation: whether rotations count.
    """

    def __init__(self, q: Array, T: Array, with_rotation: bool) -> None:
        self.q, self.T, self.with_rotation = q, T, with_rotation
        spread = float(np.linalg.norm(T[:, :3, 3].std(axis=0)))
        self._unit = spread if spread > 0.0 else 1.0
        self._tree: Any = None

    def __len__(self) -> int:
        return len(self.q)

    def of(self, T: Array, count: int) -> NDArray[np.int64]:
        """Rows (N, count) of the examples nearest to poses (N, 4, 4), the nearest first."""
        if self._tree is None:
            from scipy.spatial import cKDTree

            self._tree = cKDTree(self._places(self.T))
        _, rows = self._tree.query(self._places(T), k=count)
        return np.asarray(rows, dtype=np.int64).reshape(len(T), count)

    def first(self, T: Array) -> Array:
        """Joint values (N, n) of the nearest example."""
        return np.asarray(self.q[self.of(T, 1)[:, 0]])

    def _places(self, T: Array) -> Array:
        places = T[:, :3, 3] / self._unit
        if self.with_rotation:
            places = np.hstack([places, TURN_WEIGHT * T[:, :3, :3].reshape(-1, 9)])
        return np.asarray(places)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_tree": None}

"""The trained map of document 000: from a pose and a pose increment to a joint increment."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from kinverse.learning import IncrementalPairs, PoseFeatures
from kinverse.robot import Robot
from kinverse.solvers.trained.expert import packed_map, rounded, unpacked_map
from kinverse.solvers.trained.neighbours import Neighbours
from kinverse.solvers.trained.regressor import predicted, train

__all__ = ["Increments"]

Array = NDArray[np.float64]


class Increments:
    """A network over all ordered pairs of training poses.

    Args:
        network: a regressor, not fitted.
        features: what it is told of a pose; a clone is fitted to the training poses.
        q: (K, n) joint values of the training poses.
        T: (K, 4, 4) the poses.
        with_rotation: whether rotations count in what is near.
    """

    def __init__(
        self, network: Any, features: PoseFeatures, q: Array, T: Array, with_rotation: bool
    ) -> None:
        pairs = IncrementalPairs(features, test_fraction=0.0).make(q, T)
        self.network, self.features = network, pairs.features
        self.neighbours = Neighbours(q, T, with_rotation)
        train(network, *pairs.train)

    def predict(self, P: Array, dP: Array) -> Array:
        """Joint increments (N, n) for features P (N, f) of a pose and their increments (N, f)."""
        if not len(P):
            return np.empty((0, self.neighbours.q.shape[1]))
        return rounded(predicted(self.network, np.hstack([P, dP])))

    def training_error(self, robot: Robot) -> Array:
        """Joint by joint (K (K - 1), n), the increments predicted for all pairs less the true."""
        whole = IncrementalPairs(self.features, test_fraction=0.0)
        X, y = whole.make(self.neighbours.q, self.neighbours.T).train
        return np.asarray(predicted(self.network, X) - y)

    def joint_errors(self, mse: Array) -> Array:
        """Mean squared errors (E, outputs) of the network as those of joints: they are."""
        return mse

    def packed(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """A header of plain values and the arrays."""
        return packed_map(self.network, self.features, self.neighbours)

    @classmethod
    def unpacked(cls, header: Mapping[str, Any], arrays: Mapping[str, Any], where: str) -> Self:
        """The map that ``packed`` took apart."""
        made = cls.__new__(cls)
        made.network, made.features, made.neighbours = unpacked_map(header, arrays, where)
        return made

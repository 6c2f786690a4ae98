"""One trained map from poses to joint values, and the examples it learned from."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.learning import PoseFeatures, VirtualVector
from kinverse.networks import storage
from kinverse.robot import Robot
from kinverse.solvers.trained.examples import Examples
from kinverse.solvers.trained.joint_targets import JointTargets, joint_targets
from kinverse.solvers.trained.neighbours import Neighbours
from kinverse.solvers.trained.regressor import predicted, train

__all__ = ["Expert", "packed_map", "rounded", "unpacked_map", "wrapped"]

Array = NDArray[np.float64]
Arrays = Mapping[str, NDArray[Any]]

GRID = 2.0**20


class Expert:
    """A network, its inputs and outputs, and its examples.

    Args:
        robot: whose joints are predicted.
        network: a regressor, not fitted.
        features: what it is told of a pose; a clone is fitted to the examples.
        virtual: what completes a redundant arm's task space, or None.
        examples: what it learns.
        with_rotation: whether rotations count in what is near.
    """

    def __init__(
        self,
        robot: Robot,
        network: Any,
        features: PoseFeatures,
        virtual: VirtualVector | None,
        examples: Examples,
        with_rotation: bool,
    ) -> None:
        self.network, self.features, self.virtual = network, features.clone(), virtual
        self.targets: JointTargets = joint_targets(robot)
        self.neighbours = Neighbours(examples.q, examples.T, with_rotation)
        X = self.features.fit_transform(examples.T)
        if virtual is not None:
            X = np.hstack([X, virtual.of_joints(robot, examples.q)])
        train(network, X, self.targets.encode(examples.q))

    def predict(self, robot: Robot, T: Array) -> Array:
        """Predicted joint values (N, n) for poses (N, 4, 4)."""
        if not len(T):
            return np.empty((0, robot.dof))
        X = self.features.transform(T)
        if self.virtual is not None:
            values = self.virtual.of_pose(robot, T)
            if values is None:
                values = self.virtual.of_joints(robot, self.neighbours.first(T))
            X = np.hstack([X, values])
        return rounded(self.targets.decode(predicted(self.network, X)))

    def training_error(self, robot: Robot) -> Array:
        """Joint by joint (K, n), what is predicted for the examples less what they are."""
        gap = self.predict(robot, self.neighbours.T) - self.neighbours.q
        return wrapped(gap, self.targets.circular)

    def joint_errors(self, mse: Array) -> Array:
        """Mean squared errors (E, outputs) of the network as those of joints (E, n)."""
        return self.targets.joint_errors(mse)

    # Files ------------------------------------------------------------------------------------

    def packed(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """A header of plain values and the arrays; refuses what only code could hold."""
        header, arrays = packed_map(self.network, self.features, self.neighbours)
        kind = None if self.virtual is None else self.virtual.kind
        if callable(kind):
            raise InputError(
                f"{self.virtual!r} cannot be saved without code: its kind is a function"
            )
        return {**header, "virtual": kind}, {**arrays, "circular": self.targets.circular}

    @classmethod
    def unpacked(cls, header: Mapping[str, Any], arrays: Arrays, where: str) -> Self:
        """The expert that ``packed`` took apart."""
        expert = cls.__new__(cls)
        expert.network, expert.features, expert.neighbours = unpacked_map(header, arrays, where)
        expert.targets = JointTargets(arrays["circular"])
        kind = header["virtual"]
        expert.virtual = None if kind is None else VirtualVector(kind)
        return expert


def rounded(q: Array) -> Array:
    """Joint values to 2^-20 rad or m.

    A matrix product has other last bits for another number of rows, and an answer shall not depend
    on which poses are solved together.
    """
    return np.asarray(np.rint(q * GRID) / GRID)


def wrapped(gap: Array, circular: NDArray[np.bool_]) -> Array:
    """Joint differences (N, n), of circular joints by the shorter way."""
    turns = np.where(circular, np.rint(gap / (2.0 * np.pi)), 0.0)
    return np.asarray(gap - 2.0 * np.pi * turns)


def packed_map(
    network: Any, features: PoseFeatures, neighbours: Neighbours
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What every trained map has, for a file."""
    head, arrays = storage.pack(network)
    own = {"q": neighbours.q, "T": neighbours.T}
    own |= {f"network.{name}": array for name, array in arrays.items()}
    header = {
        "network": head,
        "features": features.get_params(),
        "with_rotation": neighbours.with_rotation,
    }
    return header, own


def unpacked_map(
    header: Mapping[str, Any], arrays: Arrays, where: str
) -> tuple[Any, PoseFeatures, Neighbours]:
    """Network, features and examples from a file; the features are fitted again."""
    own = {
        key.removeprefix("network."): array
        for key, array in arrays.items()
        if key.startswith("network.")
    }
    network = storage.unpack(header["network"], own, where)
    features = PoseFeatures(**header["features"]).fit(arrays["T"])
    neighbours = Neighbours(arrays["q"], arrays["T"], bool(header["with_rotation"]))
    return network, features, neighbours

"""Increments from pose to pose: the training patterns of document 000."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.learning.features import PoseFeatures
from kinverse.learning.splits import split_rows
from kinverse.settings import HasSettings

__all__ = ["IncrementalPairs", "PairSet", "pair_inputs"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SPLITS = ("pose", "pair")


@dataclass(frozen=True, eq=False)
class PairSet:
    """All ordered pairs of K poses as patterns for training, P = K (K - 1).

    Attributes:
        features: fitted to the poses that train.
        X: (P, 2k) features of the first pose, then how they change to the second.
        y: (P, n) how the joints change [rad or m], as travelled: not wrapped.
        first: (P,) number of the first pose of each pair, ascending.
        second: (P,) number of the second.
        is_train: (P,) the pairs that train.
        is_test: (P,) the pairs that test. Those that do neither are mixed.
    """

    features: PoseFeatures
    X: Array
    y: Array
    first: Ints
    second: Ints
    is_train: Bools
    is_test: Bools

    @property
    def train(self) -> tuple[Array, Array]:
        """X and y of the pairs that train.

        Example:
            >>> network.fit(*pairs.train).score(*pairs.test)
        """
        return self.X[self.is_train], self.y[self.is_train]

    @property
    def test(self) -> tuple[Array, Array]:
        """X and y of the pairs that test."""
        return self.X[self.is_test], self.y[self.is_test]

    @property
    def n_mixed(self) -> int:
        """Number of pairs of a training pose and a test pose: used for neither."""
        return int((~(self.is_train | self.is_test)).sum())

    def __len__(self) -> int:
        return len(self.X)

    def __repr__(self) -> str:
        return (
            f"PairSet: {len(self)} pairs, {int(self.is_train.sum())} train,"
            f" {int(self.is_test.sum())} test, {self.n_mixed} mixed"
        )


class IncrementalPairs(HasSettings):
    """All ordered pairs of K poses, split into those that train and those that test.

    Source: Chiddarwar & Ramesh Babu, "Comparison of RBF and MLP neural networks to solve inverse
    kinematic problem for 6R serial robot by a fusion approach", 2010, section 2.1.3: from pose i
    and the way to pose j a network learns the way of the joints. 70 poses give 4830 pairs; the
    paper prints 4890.

    Args:
        features: how poses are read; a clone of it is fitted to the poses that train.
        split: "pose": poses are held out; pairs of two training poses train, pairs of two held-out
            poses test, and the mixed ones do neither (``n_mixed`` counts them). "pair": pairs are
            held out at random, as in the paper. That leaks: the same pose is in pairs of both
            sides, and the nearest stored pair gives away the joints of a pair that is held out.
        test_fraction: share of the poses, or pairs, to test on; 0 trains on all.
        random_state: None (a fixed seed), an int >= 0 or a Generator (one draw each time).

    Example:
        >>> IncrementalPairs(PoseFeatures("xyz+rpy")).make(q, robot.fk(q))  # q (70, 6)
        PairSet: 4830 pairs, 2352 train, 420 test, 2058 mixed
    """

    def __init__(
        self,
        features: PoseFeatures,
        *,
        split: str = "pose",
        test_fraction: float = 0.3,
        random_state: Any = None,
    ) -> None:
        self.features = features
        self.split = split
        self.test_fraction = test_fraction
        self.random_state = random_state

    def make(self, q: ArrayLike, T: ArrayLike) -> PairSet:
        """The pairs of K poses.

        Args:
            q: (K, n) joint values [rad or m].
            T: (K, 4, 4) the poses they reach.

        Raises:
            TypeError: features that are none; complex, object or text data.
            InputError: an unknown split, fewer than two poses (on each side, of a split by pose),
                lengths that differ, values that cannot be used.

        Example:
            >>> pairs = IncrementalPairs(PoseFeatures("xyz+rpy"), split="pair").make(data.q, data.T)
        """
        if not isinstance(self.features, PoseFeatures):
            raise TypeError(f"features must be PoseFeatures, got {type(self.features).__name__}")
        if self.split not in SPLITS:
            raise InputError(f"unknown split {self.split!r}: the splits are {', '.join(SPLITS)}")
        poses, joints = se3.as_poses(T), _joint_rows(q)
        count = len(poses)
        if len(joints) != count:
            raise InputError(f"q has {len(joints)} rows and T has {count} poses")
        if count < 2:
            raise InputError(f"pairs need at least two poses, got {count}")
        first = np.repeat(np.arange(count), count - 1)
        second = np.tile(np.arange(count - 1), count)
        second += second >= first  # the pose itself is left out
        if self.split == "pose":
            kept, held = split_rows(count, self.test_fraction, self.random_state, "poses", 2)
            is_train = np.isin(first, kept) & np.isin(second, kept)
            is_test = np.isin(first, held) & np.isin(second, held)
        else:
            kept = np.arange(count)
            rows, _ = split_rows(len(first), self.test_fraction, self.random_state, "pairs")
            is_train = np.isin(np.arange(len(first)), rows)
            is_test = ~is_train
        features = self.features.clone().fit(poses[kept])
        values = features.transform(poses)
        X = pair_inputs(features, values[first], values[second])
        return PairSet(
            features, X, joints[second] - joints[first], first, second, is_train, is_test
        )


def pair_inputs(features: PoseFeatures, start: ArrayLike, goal: ArrayLike) -> Array:
    """What a network trained on pairs reads: where it starts, and how far it is to the goal.

    Args:
        features: fitted, as :class:`PairSet` has them.
        start: (k,) or (P, k) features of the start.
        goal: (k,) or (P, k) features of the goal, or of where the loop of document 000 asks for.

    Returns:
        (P, 2k).

    Raises:
        InputError: another width, rows that do not go together, values that are not finite.

    Example:
        >>> dq = network.predict(pair_inputs(pairs.features, values_now, values_goal))
    """
    start = np.atleast_2d(features.checked(start, "start"))
    change = np.atleast_2d(features.difference(start, goal))
    return np.hstack([np.broadcast_to(start, change.shape), change])


def _joint_rows(q: ArrayLike) -> Array:
    array = se3.as_real(q, "q")
    if array.ndim != 2 or array.shape[1] == 0:
        raise InputError(f"q must have shape (K, n), got {array.shape}")
    return se3.as_joints(array, array.shape[1])

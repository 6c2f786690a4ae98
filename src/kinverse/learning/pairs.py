"""All ordered pairs of poses: how document 000 makes many patterns of few poses."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.learning.features import PoseFeatures
from kinverse.seeds import seed_of

__all__ = ["IncrementalPairs", "PairSplit"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SPLITS = ("pose", "pair")


class PairSplit(NamedTuple):
    """Patterns to train with and patterns held out."""

    X_train: Array
    y_train: Array
    X_test: Array
    y_test: Array
    unused: int  # pairs of a training pose and a held-out one, in neither


class IncrementalPairs:
    """From a pose and the increment to another to the joints' increment between them.

    A pattern of the ordered pair (i, j): input [P_i, P_j - P_i], target q_j - q_i, angles of the
    increment wrapped. K poses give K (K - 1) patterns: 70 give 4830 (document 000 prints 4890).

    Args:
        features: a fitted ``PoseFeatures``.

    Example:
        >>> X, y = IncrementalPairs(PoseFeatures("xyz+rpy").fit(T)).all(T, q)
    """

    def __init__(self, features: PoseFeatures) -> None:
        self.features = features

    def all(self, T: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
        """Every pattern.

        Args:
            T: (K, 4, 4) poses.
            q: (K, n) the joint values that reach them.

        Returns:
            X (K (K - 1), 2 k) and y (K (K - 1), n), the pairs of pose 0 first.

        Raises:
            InputError: fewer than two poses, or different numbers of them.
        """
        poses, joints = _checked(T, q)
        return self._patterns(poses, joints, *_ordered(len(poses)))

    def split(
        self,
        T: ArrayLike,
        q: ArrayLike,
        split: str = "pose",
        test_fraction: float = 0.3,
        random_state: Any = None,
    ) -> PairSplit:
        """Patterns for training and for testing.

        Args:
            T: (K, 4, 4) poses.
            q: (K, n) joint values.
            split: "pose": the held-out patterns are the pairs of held-out poses, which the network
                has never seen; pairs of one and the other are not used. "pair": pairs are held out
                at random (document 000): their poses are known from other pairs, so that the error
                says nothing about new poses.
            test_fraction: share of the poses or pairs held out.
            random_state: None (0), an int or a Generator.

        Raises:
            InputError: an unknown split, or too few poses on one side.
        """
        if split not in SPLITS:
            raise InputError(f"split must be {' or '.join(map(repr, SPLITS))}, got {split!r}")
        if not 0.0 < test_fraction < 1.0:
            raise InputError(f"test_fraction must lie in (0, 1), got {test_fraction!r}")
        poses, joints = _checked(T, q)
        rng = np.random.default_rng(seed_of(random_state))
        i, j = _ordered(len(poses))
        total = len(poses) if split == "pose" else len(i)
        held = np.zeros(total, np.bool_)
        held[rng.permutation(total)[: round(test_fraction * total)]] = True
        train, test = (~held[i] & ~held[j], held[i] & held[j]) if split == "pose" else (~held, held)
        if not train.any() or not test.any():
            raise InputError(
                f"{len(poses)} poses are too few to hold out {test_fraction:g} by {split}"
            )
        return PairSplit(
            *self._patterns(poses, joints, i[train], j[train]),
            *self._patterns(poses, joints, i[test], j[test]),
            int((~train & ~test).sum()),
        )

    def _patterns(self, T: Array, q: Array, i: Ints, j: Ints) -> tuple[Array, Array]:
        P = self.features.transform(T)
        return np.hstack([P[i], self.features.difference(P[i], P[j])]), q[j] - q[i]


def _ordered(count: int) -> tuple[Ints, Ints]:
    i, j = np.nonzero(~np.eye(count, dtype=np.bool_))
    return i, j


def _checked(T: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
    poses, joints = se3.as_poses(T), se3.as_real(q, "q")
    if joints.ndim != 2 or len(joints) != len(poses):
        raise InputError(f"q must have shape ({len(poses)}, n), got {joints.shape}")
    if len(poses) < 2:
        raise InputError(f"pairs need at least two poses, got {len(poses)}")
    return poses, joints

"""Data sets of a robot by forward kinematics: joints drawn at random and the poses they reach."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.learning.features import PoseFeatures
from kinverse.learning.keep import Keep, asked, named
from kinverse.learning.virtual_vector import VirtualVector
from kinverse.robot import Robot
from kinverse.seeds import seed_of

__all__ = ["DataSet", "sample"]

Array = NDArray[np.float64]

MOST_DRAWN = 1000
"""Draws for each configuration asked for, on average; rarer ones are refused."""


@dataclass(frozen=True)
class DataSet:
    """Configurations, the poses they reach, and what was turned away.

    Attributes:
        robot: whose they are.
        q: (N, n) joint values [rad or m].
        T: (N, 4, 4) poses of the tool in the base frame.
        drawn: configurations drawn in all.
        rejected: how many each predicate turned away; one that fails several counts for the first.
    """

    robot: Robot
    q: Array
    T: Array
    drawn: int = 0
    rejected: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.q)

    def split(
        self, test_fraction: float = 0.3, random_state: Any = None
    ) -> tuple["DataSet", "DataSet"]:
        """Two data sets without a common row: to train with, to test with.

        Raises:
            InputError: a fraction outside (0, 1), or one side would be empty.

        Example:
            >>> train, test = sample(robot, 1000).split(0.3, random_state=1)
        """
        if not 0.0 < test_fraction < 1.0:
            raise InputError(f"test_fraction must lie in (0, 1), got {test_fraction!r}")
        count = round(test_fraction * len(self))
        if not 0 < count < len(self):
            raise InputError(f"{len(self)} rows cannot be split with {test_fraction:g} held out")
        order = np.random.default_rng(seed_of(random_state)).permutation(len(self))
        train, test = np.sort(order[count:]), np.sort(order[:count])
        return (
            DataSet(self.robot, self.q[train], self.T[train]),
            DataSet(self.robot, self.q[test], self.T[test]),
        )

    def inverse(
        self, features: PoseFeatures, virtual: VirtualVector | None = None
    ) -> tuple[Array, Array]:
        """Pose to joints: X (N, k), the virtual vector's values last, and y (N, n).

        Features that are not fitted yet are fitted to these poses; fit them to training poses only.
        """
        X = self._features(features)
        if virtual is not None:
            X = np.hstack([X, virtual.of_joints(self.robot, self.q)])
        return X, self.q

    def forward(self, features: PoseFeatures) -> tuple[Array, Array]:
        """Joints to pose: X (N, n) and y (N, k), for learning the forward kinematics."""
        return self.q, self._features(features)

    def _features(self, features: PoseFeatures) -> Array:
        if not hasattr(features, "reference_"):
            features.fit(self.T)
        return features.transform(self.T)


def sample(
    robot: Robot,
    n_samples: int,
    *,
    random_state: Any = None,
    keep: Keep = None,
    region: tuple[ArrayLike, ArrayLike] | None = None,
) -> DataSet:
    """Configurations drawn at random inside the limits, with the poses they reach.

    Args:
        robot: whose joints are drawn.
        n_samples: how many are wanted.
        random_state: None (0), an int or a Generator, which is drawn from.
        keep: a predicate q (M, n) -> bools (M,), several, or several with names: what passes all
            is kept. ``inside_limits``, ``far_from_singularity`` and ``one_branch`` make some;
            collision checks and anything else are functions of yours.
        region: (q_centre (n,), half_width (n,) or a number) [rad or m]: draw in this box, as far
            as it lies inside the limits.

    Returns:
        A ``DataSet`` of exactly ``n_samples`` rows, which tells how many were rejected.

    Raises:
        InputError: a region that misses the limits, a predicate that is none, or so few
            configurations pass that the search is given up (which predicate rejected how many).

    Example:
        >>> sample(robot, 1000, random_state=0, keep=far_from_singularity(robot)).rejected
        {'far from singularity': 112}
    """
    if isinstance(n_samples, bool) or not isinstance(n_samples, (int, np.integer)) or n_samples < 1:
        raise InputError(f"n_samples must be a whole number >= 1, got {n_samples!r}")
    rng = _generator(random_state)
    low, high = _box(robot, region)
    predicates = named(keep)
    rejected = dict.fromkeys(predicates, 0)
    kept: list[Array] = []
    have = drawn = 0
    while have < n_samples:
        size = n_samples - have
        if drawn:
            # about as many as are still needed, at the rate at which they pass
            size = min(size * drawn // max(have, 1) + 16, 100_000)
        q = rng.uniform(low, high, (int(size), robot.dof))
        drawn += len(q)
        for name, predicate in predicates.items():
            mask = asked(name, predicate, q)
            rejected[name] += int((~mask).sum())
            q = q[mask]
        kept.append(q)
        have += len(q)
        if have < n_samples and drawn > MOST_DRAWN * n_samples:
            told = ", ".join(f"{name} rejected {count}" for name, count in rejected.items())
            raise InputError(f"only {have} of {drawn} configurations pass keep: {told}")
    q = np.concatenate(kept)[:n_samples]
    return DataSet(robot, q, robot.fk(q), drawn, rejected)


def _box(robot: Robot, region: tuple[ArrayLike, ArrayLike] | None) -> tuple[Array, Array]:
    low, high = robot.limits.T
    if region is None:
        return low, high
    if not isinstance(region, (tuple, list)) or len(region) != 2:
        raise InputError(f"region must be (q_centre, half_width), got {region!r}")
    centre = se3.as_joints(region[0], robot.dof, "q_centre")
    half = np.broadcast_to(se3.as_real(region[1], "half_width"), (robot.dof,))
    if centre.ndim != 1 or not (np.isfinite(half) & (half >= 0.0)).all():
        raise InputError(
            f"region needs ({robot.dof},) joint values and half widths >= 0, got {region!r}"
        )
    box = np.maximum(low, centre - half), np.minimum(high, centre + half)
    for name, bottom, top in zip(robot.joint_names, *box, strict=True):
        if bottom > top:
            raise InputError(f"region: joint {name!r} lies wholly outside its limits")
    return box


def _generator(random_state: Any) -> np.random.Generator:
    if isinstance(random_state, np.random.Generator):
        return random_state
    return np.random.default_rng(seed_of(random_state))

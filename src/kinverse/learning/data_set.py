"""Data sets from a robot: random joints and the poses they reach, by forward kinematics."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.learning.features import PoseFeatures
from kinverse.learning.keep import BranchSolver, branch_of, mask_of, name_of
from kinverse.learning.splits import split_rows
from kinverse.learning.virtual_vector import VirtualVector
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.seeds import seed_of

__all__ = ["DataSet", "passing", "sample"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Test: TypeAlias = "Callable[[Array], ArrayLike]"
Keep: TypeAlias = "Test | Iterable[Test] | Mapping[str, Test] | None"

RAREST = 1e-4
"""A draw gives up when fewer than this share is kept ..."""
PATIENCE = 50_000
"""... of at least so many."""
MOST_AT_ONCE = 50_000


@dataclass(frozen=True, eq=False)
class DataSet:
    """N configurations of a robot and the poses they reach; the arrays are read-only.

    Args:
        robot: the arm.
        q: (N, n) joint values [rad or m], at least one row.
        rejected: how many were drawn and not kept, by the predicate that rejected them first.
        drawn: how many were drawn in all; N and the rejected ones add up to it.
        branches: (N,) branch numbers, or None; see :meth:`labelled`.

    Attributes:
        T: (N, 4, 4) poses of the tool, ``robot.fk(q)``.

    Raises:
        TypeError: complex, object or text data.
        InputError: joint values or branches of another shape, or not finite.

    Example:
        >>> data = DataSet(robot, robot.random(100))
        >>> data.T.shape
        (100, 4, 4)
    """

    robot: Robot
    q: Array
    rejected: dict[str, int] = field(default_factory=dict)
    drawn: int | None = None
    branches: Ints | None = None
    T: Array = field(init=False)

    def __post_init__(self) -> None:
        q = se3.as_joints(self.q, self.robot.dof).copy()
        if q.ndim != 2 or not len(q):
            raise InputError(f"q must have shape (N, {self.robot.dof}), N > 0, got {q.shape}")
        self._set("q", q)
        object.__setattr__(self, "rejected", dict(self.rejected))
        self._set("T", self.robot.fk(q))
        if self.drawn is None:
            object.__setattr__(self, "drawn", len(q) + sum(self.rejected.values()))
        if self.branches is not None:
            branches = np.array(self.branches)
            if branches.shape != (len(q),) or branches.dtype.kind not in "iu":
                raise InputError(
                    f"branches must be ({len(q)},) whole numbers, got {branches.shape} of"
                    f" {branches.dtype}"
                )
            self._set("branches", branches.astype(np.int64))

    def _set(self, name: str, array: NDArray[Any]) -> None:
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        lost = ", ".join(f"{name} {count}" for name, count in self.rejected.items())
        return f"DataSet: {len(self)} configurations of {self.robot.name}, {self.drawn} drawn" + (
            f"; rejected: {lost}" if lost else ""
        )

    # ------------------------------------------------------------------ patterns
    def inverse(
        self, features: PoseFeatures, virtual: VirtualVector | None = None
    ) -> tuple[Array, Array]:
        """Pose to joints: X (N, k) features, then the virtual vector, and y (N, n) joint values.

        Args:
            features: fitted, to the poses that train.
            virtual: completes the task of a redundant arm (document 003).

        Raises:
            InputError: features that are not fitted, a virtual vector that does not fit the arm.

        Example:
            >>> train, test = data.split(0.2)
            >>> features = PoseFeatures("xy").fit(train.T)
            >>> X, y = train.inverse(features, VirtualVector("cos_sin"))
        """
        X = features.transform(self.T)
        if virtual is not None:
            X = np.hstack([X, virtual.of_joints(self.robot, self.q)])
        return X, self.q

    def forward(self, features: PoseFeatures) -> tuple[Array, Array]:
        """Joints to pose: X (N, n) joint values and y (N, k) features.

        Such a learned forward kinematics is what document 004 trains beside the inverse.

        Example:
            >>> X, y = data.forward(PoseFeatures("xyz").fit(data.T))
        """
        return self.q, features.transform(self.T)

    # ------------------------------------------------------------------ parts
    def split(
        self, test_fraction: float = 0.2, random_state: Any = None
    ) -> tuple["DataSet", "DataSet"]:
        """A part to train on and a part to test on, at random.

        Counts of what was rejected stay with both: they tell of the draw that both come from.

        Args:
            test_fraction: above 0 and below 1.
            random_state: None (a fixed seed), an int >= 0 or a Generator (one draw).

        Raises:
            InputError: a share that leaves a part empty.

        Example:
            >>> train, test = data.split(1500 / 8500, random_state=3)
        """
        if test_fraction == 0:
            raise InputError("test_fraction must be above 0: without a split the data set is whole")
        train, test = split_rows(len(self), test_fraction, random_state, "configurations")
        return self.take(train), self.take(test)

    def take(self, rows: ArrayLike) -> "DataSet":
        """The configurations of these rows: numbers, or a mask (N,).

        Raises:
            InputError: no row, or rows that there are not.

        Example:
            >>> data.take(data.q[:, 0] > 0.0)
        """
        index = np.asarray(rows)
        if index.dtype == np.bool_ and index.shape == (len(self),):
            index = np.flatnonzero(index)
        if index.ndim != 1 or (index.size and index.dtype.kind not in "iu"):
            raise InputError(
                f"rows must be whole numbers or a mask ({len(self)},), got {index.shape} of"
                f" {index.dtype}"
            )
        if not len(index) or index.min() < 0 or index.max() >= len(self):
            raise InputError(f"rows must be at least one of 0 to {len(self) - 1}")
        branches = None if self.branches is None else self.branches[index]
        return replace(self, q=self.q[index], branches=branches)

    def labelled(self, solver: BranchSolver) -> "DataSet":
        """The same with ``branches`` by a closed form; -1 where it has no such solution.

        Args:
            solver: fitted, with numbered branches; see :func:`kinverse.learning.branch_of`.

        Example:
            >>> data = data.labelled(kv.Analytic().fit(robot))
            >>> parts = {b: data.take(data.branches == b) for b in np.unique(data.branches)}
        """
        return replace(self, branches=branch_of(solver, self.q))


def sample(
    robot: Robot,
    n_samples: int,
    *,
    random_state: Any = None,
    keep: Keep = None,
    region: tuple[ArrayLike, ArrayLike] | None = None,
) -> DataSet:
    """Random configurations, uniform in the limits or in a part of them, and their poses.

    Args:
        robot: the arm.
        n_samples: how many to keep.
        random_state: None (a fixed seed), an int >= 0 or a Generator (one draw).
        keep: which to keep: a predicate q (M, n) -> (M,) of bool, several of them, or {name:
            predicate}; see :mod:`kinverse.learning.keep`. Each sees only what those before it
            left: put the cheap ones first.
        region: a centre (n,) inside the limits and half widths, one or (n,) [rad or m]: joints are
            drawn from this box, as far as it lies inside the limits.

    Returns:
        ``DataSet`` with N = n_samples; the first ones drawn that every predicate keeps.

    Raises:
        InputError: a number below 1, a region that cannot be used, a predicate that returns
            another shape (it is named), or predicates that keep fewer than one in 10,000 (the one
            that rejects the greatest share is named).

    Example:
        >>> data = sample(robot, 1000, random_state=5, keep=far_from_singularity(robot))
        >>> data.drawn == 1000 + data.rejected["far_from_singularity"]
        True
    """
    whole = isinstance(n_samples, (int, np.integer)) and not isinstance(n_samples, bool)
    if not whole or n_samples < 1:
        raise InputError(f"n_samples must be a whole number of at least 1, got {n_samples!r}")
    tests = _named(keep)
    generator = np.random.default_rng(seed_of(random_state, "random_state"))
    box = robot if region is None else robot.with_limits(_box(robot, region))
    rejected = dict.fromkeys(tests, 0)
    found: list[Array] = []
    kept = drawn = 0
    while kept < n_samples:
        wanted = (n_samples - kept) * max(drawn, 1) / max(kept, 1)
        q = box.random(int(min(wanted + 16, MOST_AT_ONCE)), generator)
        fate = _fates(tests, q)
        good = np.flatnonzero(fate == len(tests))
        if kept + len(good) >= n_samples:
            # rows behind the last one needed count as not drawn: no count depends on the batches
            good = good[: n_samples - kept]
            fate = fate[: good[-1] + 1]
        for number, name in enumerate(tests):
            rejected[name] += int((fate == number).sum())
        found.append(q[good])
        kept += len(good)
        drawn += len(fate)
        if kept < n_samples and drawn >= PATIENCE and kept < RAREST * drawn:
            raise InputError(_too_rare(robot, rejected, kept, drawn))
    return DataSet(robot, np.concatenate(found), rejected, drawn)


def passing(q: ArrayLike, keep: Keep) -> NDArray[np.bool_]:
    """Which configurations (M, n) every predicate of ``keep`` keeps.

    Raises:
        InputError: a predicate that returns another shape; it is named.

    Example:
        >>> passing(q, [inside_limits(robot, 0.1), far_from_singularity(robot)]).shape
        (100,)
    """
    tests = _named(keep)
    return np.asarray(_fates(tests, np.asarray(q, dtype=np.float64)) == len(tests))


def _named(keep: Keep) -> dict[str, Test]:
    if keep is None:
        return {}
    if isinstance(keep, Mapping):
        pairs = [(str(name), test) for name, test in keep.items()]
    else:
        try:
            tests: list[Any] = [keep] if callable(keep) else list(keep)
        except TypeError:
            tests = [keep]
        pairs = [(name_of(test), test) for test in tests]
    named: dict[str, Test] = {}
    for name, test in pairs:
        if not callable(test):
            raise InputError(f"keep must be predicates q (M, n) -> (M,) of bool, got {test!r}")
        known = sum(other.partition(" #")[0] == name for other in named)
        named[f"{name} #{known + 1}" if known else name] = test
    return named


def _fates(tests: Mapping[str, Test], q: Array) -> Ints:
    """The number of the first test that rejects each row of q; of none, the number of tests."""
    fate = np.full(len(q), len(tests), dtype=np.int64)
    left = np.arange(len(q))
    for number, (name, test) in enumerate(tests.items()):
        if not len(left):
            break
        good = mask_of(test, q[left], name)
        fate[left[~good]] = number
        left = left[good]
    return fate


def _too_rare(robot: Robot, rejected: Mapping[str, int], kept: int, drawn: int) -> str:
    seen, shares = drawn, {}
    for name, count in rejected.items():
        shares[name] = count / max(seen, 1), count, seen
        seen -= count
    worst = max(shares, key=lambda name: shares[name][0])
    _, count, seen = shares[worst]
    return (
        f"predicate {worst!r} rejected {count} of the {seen} configurations of {robot.name!r} that"
        f" it saw: of {drawn} drawn {kept} were kept, fewer than one in {1 / RAREST:,.0f}"
    )


def _box(robot: Robot, region: tuple[ArrayLike, ArrayLike]) -> Array:
    if not isinstance(region, (tuple, list)) or len(region) != 2:
        raise InputError("region must be a pair: a centre (n,) and half widths, one or (n,)")
    centre = se3.as_joints(region[0], robot.dof, "the centre of the region")
    half = se3.as_real(region[1], "the half width of the region")
    low, high = robot.limits.T
    if centre.ndim != 1:
        raise InputError(
            f"the centre of the region must have shape ({robot.dof},), got {centre.shape}"
        )
    if half.shape not in ((), (robot.dof,)) or not (np.isfinite(half).all() and (half >= 0).all()):
        raise InputError(
            f"the half width of the region must be one finite number or {robot.dof}, not negative,"
            f" got {half.tolist()}"
        )
    outside = (centre < low - LIMIT_SLACK) | (centre > high + LIMIT_SLACK)
    if outside.any():
        j = int(np.argmax(outside))
        raise InputError(
            f"the centre of the region is outside the limits of joint {robot.joint_names[j]!r}:"
            f" {centre[j]:g} is not in {low[j]:g} to {high[j]:g}"
        )
    centre = np.clip(centre, low, high)
    return np.column_stack([np.maximum(low, centre - half), np.minimum(high, centre + half)])

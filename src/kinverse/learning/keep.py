"""Which configurations to learn: predicates from joint values (M, n) to a mask (M,)."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.ranking import turning
from kinverse.robot import Robot

__all__ = [
    "Keep",
    "asked",
    "far_from_singularity",
    "inside_limits",
    "named",
    "one_branch",
    "passing",
]

Array = NDArray[np.float64]
Predicate = Callable[[Array], Any]
Keep = Predicate | Sequence[Predicate] | Mapping[str, Predicate] | None
"""One predicate, several (a configuration must pass all) or several with names."""

BLOCK = 4096


def passing(q: Array, keep: Keep) -> NDArray[np.bool_]:
    """Which configurations (M, n) pass every predicate.

    Raises:
        InputError: a predicate that does not give one bool for each row; it is named.

    Example:
        >>> passing(q, [inside_limits(robot, 0.1)])
    """
    mask = np.ones(len(q), np.bool_)
    for name, predicate in named(keep).items():
        mask[mask] = asked(name, predicate, q[mask])
    return mask


def named(keep: Keep) -> dict[str, Predicate]:
    """Predicates by name.

    Raises:
        InputError: something that is no predicate.
    """
    if keep is None:
        return {}
    if isinstance(keep, Mapping):
        found = {str(name): predicate for name, predicate in keep.items()}
    else:
        several = [keep] if callable(keep) else list(keep)
        found = {}
        for predicate in several:
            name = getattr(predicate, "__name__", type(predicate).__name__)
            found[name if name not in found else f"{name} {len(found) + 1}"] = predicate
    for name, predicate in found.items():
        if not callable(predicate):
            raise InputError(f"keep: {name} is no function of joint values: {predicate!r}")
    return found


def inside_limits(robot: Robot, margin: float = 0.0) -> Predicate:
    """Joint values at least ``margin`` [rad or m] inside the limits.

    Example:
        >>> sample(robot, 100, keep=inside_limits(robot, margin=0.1))
    """
    low, high = robot.limits.T

    def inside(q: Array) -> NDArray[np.bool_]:
        return np.asarray(((q >= low + margin) & (q <= high - margin)).all(axis=1))

    inside.__name__ = "inside limits"
    return inside


def far_from_singularity(robot: Robot, least: float = 0.05) -> Predicate:
    """Configurations whose Jacobian's smallest singular value is at least ``least``.

    Lengths count in the arm's reach, so that it is a pure number; of an arm with fewer than six
    joints the smallest of as many values as it has joints.

    Example:
        >>> sample(robot, 100, keep=far_from_singularity(robot, 0.1))
    """
    rng = np.random.default_rng(0)
    places = robot.fk(robot.random(256, rng))[:, :3, 3]
    spread = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())
    unit = np.array([1.0 / spread if spread > 0.0 else 1.0] * 3 + [1.0] * 3)[:, None]

    def far(q: Array) -> NDArray[np.bool_]:
        values = [
            np.linalg.svd(robot.jacobian(q[k : k + BLOCK]) * unit, compute_uv=False)[:, -1]
            for k in range(0, len(q), BLOCK)
        ]
        return np.concatenate([np.empty(0), *values]) >= least

    far.__name__ = "far from singularity"
    return far


def one_branch(solver: Any, branch: int | str) -> Predicate:
    """Configurations on one branch of a closed form.

    A configuration lies on the branch of that solution of the pose it reaches that it equals.

    Args:
        solver: a fitted solver that numbers its branches, such as ``kv.Analytic``.
        branch: its number or its name.

    Raises:
        InputError: a branch that the solver does not have; the names are listed.

    Example:
        >>> sample(robot, 100, keep=one_branch(kv.Analytic().fit(robot), 0))
    """
    labels = tuple(solver.branch_labels_)
    number = labels.index(branch) if isinstance(branch, str) and branch in labels else branch
    if not isinstance(number, (int, np.integer)) or not 0 <= number < len(labels):
        raise InputError(f"branch must be 0..{len(labels) - 1} or one of {labels}, got {branch!r}")
    robot = solver.robot_
    turns = turning(robot)

    def on_branch(q: Array) -> NDArray[np.bool_]:
        answers = solver.solve(robot.fk(q))
        mine = answers.branch == number
        gap = answers.q[mine] - q[answers.pose_index[mine]]
        gap = np.where(turns, gap - 2.0 * np.pi * np.rint(gap / (2.0 * np.pi)), gap)
        mask = np.zeros(len(q), np.bool_)
        mask[answers.pose_index[mine][np.abs(gap).max(axis=1) < 1e-6]] = True
        return mask

    on_branch.__name__ = f"branch {labels[number]}"
    return on_branch


def asked(name: str, predicate: Predicate, q: Array) -> NDArray[np.bool_]:
    """What a predicate says of configurations (M, n), checked."""
    if not len(q):
        return np.zeros(0, np.bool_)
    mask = np.asarray(predicate(q.copy()))
    if mask.shape != (len(q),) or mask.dtype != np.bool_:
        raise InputError(
            f"keep: {name} must give {len(q)} bools, one for each configuration, got"
            f" {mask.dtype} of shape {mask.shape}"
        )
    return mask

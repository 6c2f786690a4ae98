"""Which joint values a data set keeps: predicates q (M, n) -> (M,) of bool.

Any function of that form will do; those made here have names, and go together by ``&``, ``|`` and
``~``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.geometry import axis_lines
from kinverse.ranking import rewound
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.solutions import Solutions
from kinverse.task import as_task
from kinverse.velocity import homogeneous

__all__ = [
    "BranchSolver",
    "Predicate",
    "branch_of",
    "collision_free",
    "far_from_singularity",
    "inside_limits",
    "mask_of",
    "name_of",
    "one_branch",
]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Test: TypeAlias = "Callable[[Array], ArrayLike]"

SAME = 1e-5
"""Largest joint difference [rad or m] of a solution that is the configuration asked for: where two
branches meet, rounding takes half the digits."""


NO_RANK = 1e-7
"""Below this part of the greatest singular value a direction is none, at generic postures."""


class BranchSolver(Protocol):
    """A fitted solver that numbers its branches, such as :class:`kinverse.Analytic`."""

    robot_: Robot

    def solve(self, T: Any) -> Solutions:
        """Every solution of every pose, with its branch."""


@dataclass(frozen=True)
class Predicate:
    """A test of joint values with a name.

    Args:
        name: what it is called in counts and messages.
        test: takes q (M, n), returns a mask (M,) of bool.

    Example:
        >>> high = Predicate("high", lambda q: robot.fk(q)[:, 2, 3] > 0.5)
        >>> keep = high & ~inside_limits(robot, 0.1)
    """

    name: str
    test: Test

    def __call__(self, q: Array) -> Bools:
        """The mask (M,) of q (M, n); an InputError names a test that returns something else."""
        return mask_of(self.test, q, self.name)

    def __and__(self, other: Test) -> "Predicate":
        return Predicate(f"({self.name} & {name_of(other)})", partial(_both, self, other))

    def __or__(self, other: Test) -> "Predicate":
        return Predicate(f"({self.name} | {name_of(other)})", partial(_either, self, other))

    def __invert__(self) -> "Predicate":
        return Predicate(f"~{self.name}", partial(_not, self))


def name_of(test: Test) -> str:
    """What a predicate is called: its ``name``, else that of the function or the class."""
    own = getattr(test, "name", None) or getattr(test, "__name__", None)
    return own if isinstance(own, str) else type(test).__name__


def mask_of(test: Test, q: Array, name: str | None = None) -> Bools:
    """The mask (M,) that a predicate gives for q (M, n).

    Raises:
        InputError: it returns another shape, or something that is not bool; the message names it.

    Example:
        >>> mask_of(lambda q: q[:, 0] > 0.0, np.zeros((3, 6)))
        array([False, False, False])
    """
    mask = np.asarray(test(q))
    if mask.shape != (len(q),) or mask.dtype != np.bool_:
        raise InputError(
            f"predicate {name or name_of(test)!r} must return ({len(q)},) of bool,"
            f" got {mask.shape} of {mask.dtype}"
        )
    return mask


# ---------------------------------------------------------------------------- those at hand
def inside_limits(robot: Robot, margin: ArrayLike = 0.0) -> Predicate:
    """Every joint inside its limits by a margin.

    Args:
        robot: whose limits.
        margin: one, or (n,) of them, not negative [rad or m].

    Raises:
        InputError: a margin that is negative, not finite, of another shape, or too wide for a
            joint; the message names the joint.

    Example:
        >>> inside_limits(robot, 0.1)(robot.random(5))
    """
    wide = se3.as_real(margin, "margin")
    if wide.shape not in ((), (robot.dof,)) or not (np.isfinite(wide).all() and (wide >= 0).all()):
        raise InputError(
            f"margin must be one finite number or {robot.dof}, not negative, got {wide.tolist()}"
        )
    low, high = robot.limits[:, 0] + wide, robot.limits[:, 1] - wide
    if (low > high).any():
        j = int(np.argmax(low > high))
        raise InputError(
            f"margin {np.broadcast_to(wide, low.shape)[j]:g} leaves nothing of joint"
            f" {robot.joint_names[j]!r}: its limits are {robot.limits[j, 0]:g} to"
            f" {robot.limits[j, 1]:g}"
        )
    return Predicate("inside_limits", partial(_inside, low, high))


def far_from_singularity(robot: Robot, *, least: float = 0.01, task: str = "pose") -> Predicate:
    """Postures whose Jacobian is well conditioned.

    Measured by the least singular value over the greatest (the inverse condition number; Salisbury
    & Craig, Int. J. Robotics Research 1(1), 1982) of the task's Jacobian in one unit: lengths in
    the reach of the arm (the distances from axis to axis and to the tool, added up). Directions
    that the arm never has, such as those out of the plane of a planar arm, do not count.

    Args:
        robot: the arm.
        least: smallest value to keep, above 0 and below 1.
        task: whose rows of the Jacobian, see :mod:`kinverse.task`.

    Raises:
        InputError: a value outside (0, 1), an unknown task.

    Example:
        >>> far_from_singularity(puma, least=0.05)(np.zeros((1, 6)))
        array([False])
    """
    number = not isinstance(least, bool) and isinstance(least, (int, float))
    if not (number and 0.0 < least < 1.0):
        raise InputError(f"least must lie between 0 and 1, got {least!r}")
    as_task(task)
    return Predicate("far_from_singularity", partial(_well_conditioned, robot, least, task))


def one_branch(solver: BranchSolver, branch: int | str) -> Predicate:
    """Configurations of one branch of a closed form: the map from pose to joints is then single.

    Args:
        solver: fitted; see :func:`branch_of`.
        branch: its number, or its label in ``solver.branch_labels_``.

    Raises:
        InputError: a solver that is not fitted, no such branch (the message lists them), or an arm
            with more joints than the task has components: it has no single solution in a branch.

    Example:
        >>> one_branch(kv.Analytic().fit(kr16), "shoulder+ elbow+ wrist+")
    """
    robot = _robot_of(solver)
    labels = tuple(getattr(solver, "branch_labels_", ()))
    if isinstance(branch, str):
        number = labels.index(branch) if branch in labels else -1
    else:
        whole = isinstance(branch, (int, np.integer)) and not isinstance(branch, bool)
        number = int(branch) if whole else -1
    if number < 0 or number >= (len(labels) or np.inf):
        listed = "; ".join(f"{i} {label!r}" for i, label in enumerate(labels)) or "numbers from 0"
        raise InputError(f"no branch {branch!r} of {robot.name!r}: the branches are {listed}")
    label = f" {labels[number]}" if labels else ""
    return Predicate(f"branch {number}{label}", partial(_of_branch, solver, number))


def branch_of(solver: BranchSolver, q: ArrayLike) -> NDArray[np.int64]:
    """The branch (M,) of each configuration: of the solution of its pose that equals it.

    Solutions are compared but for whole turns, to 1e-5 rad. -1 where none is equal, as in singular
    postures, whose solutions are many.

    Args:
        solver: fitted on the arm; has ``robot_`` and ``solve(T)`` with numbered branches.
        q: (M, n) joint values [rad or m].

    Raises:
        InputError: a solver that is not fitted, an arm with more joints than the task has
            components, joint values that cannot be used.

    Example:
        >>> branch_of(kv.Analytic().fit(robot), robot.random(1000))
    """
    robot = _robot_of(solver)
    joints = np.atleast_2d(se3.as_joints(q, robot.dof))
    s = solver.solve(robot.fk(joints))
    asked = joints[s.pose_index]
    away = np.abs(rewound(robot, s.q, asked, "ignore") - asked).max(axis=1, initial=0.0)
    branch = np.full(len(joints), -1, dtype=np.int64)
    rows = np.flatnonzero(away <= SAME)
    rows = rows[np.argsort(-away[rows], kind="stable")]  # the nearest is written last
    branch[s.pose_index[rows]] = s.branch[rows]
    return branch


def collision_free(free: Test) -> Predicate:
    """A collision check of your own, named so in counts and messages.

    Args:
        free: takes q (M, n), returns (M,) of bool: True where nothing touches.

    Example:
        >>> keep = collision_free(lambda q: robot.fk(q)[:, 2, 3] > 0.05)  # above the table
    """
    if not callable(free):
        raise TypeError(f"a collision check must be callable, got {type(free).__name__}")
    return Predicate("collision_free", free)


# ---------------------------------------------------------------------------- what they do
# functions of the module, not closures: predicates can be pickled
def _both(one: Test, other: Test, q: Array) -> Bools:
    return mask_of(one, q) & mask_of(other, q)


def _either(one: Test, other: Test, q: Array) -> Bools:
    return mask_of(one, q) | mask_of(other, q)


def _not(one: Test, q: Array) -> Bools:
    return ~mask_of(one, q)


def _inside(low: Array, high: Array, q: Array) -> Bools:
    return np.asarray(((q >= low - LIMIT_SLACK) & (q <= high + LIMIT_SLACK)).all(axis=1))


def _well_conditioned(robot: Robot, least: float, task: str, q: Array) -> Bools:
    values = _singular_values(robot, task, q)
    # a planar arm of four joints has four columns and three directions: the fourth value is 0
    ratio = _singular_values(robot, task, _generic(robot))
    rank = max(1, int((ratio > NO_RANK * ratio[:, :1]).sum(axis=1).max()))
    return np.asarray(values[:, rank - 1] >= least * values[:, 0])


def _generic(robot: Robot) -> Array:
    """Postures (8, n) that are singular by chance only: fractions of the golden ratio."""
    steps = np.outer(np.arange(1, 9), np.arange(1, robot.dof + 1))
    return np.asarray(np.mod(steps * 0.6180339887, 1.0) * 4.0 - 2.0)


def _singular_values(robot: Robot, task: str, q: Array) -> Array:
    """Of the task's Jacobian in one unit, (M, k) in falling order."""
    slides = np.zeros(robot.dof, dtype=np.bool_)
    slides[robot.source[[kind == "P" for kind in robot.kinds]]] = True
    reach = axis_lines(robot.frames, robot.kinds).size
    J = as_task(task).constrained(robot.jacobian(q), robot.fk(q))
    return np.asarray(np.linalg.svd(homogeneous(J, reach, task, slides), compute_uv=False))


def _of_branch(solver: BranchSolver, number: int, q: Array) -> Bools:
    return np.asarray(branch_of(solver, q) == number)


def _robot_of(solver: BranchSolver) -> Robot:
    robot = getattr(solver, "robot_", None)
    if not isinstance(robot, Robot):
        raise InputError(f"{type(solver).__name__} is not fitted: call fit(robot) first")
    size = as_task(getattr(getattr(solver, "settings_", None), "task", "pose")).size
    if robot.dof > size:
        raise InputError(
            f"{robot.name!r} has {robot.dof} joints for {size} components: a branch of it is a"
            " continuum; lock a joint first, robot.locked({joint: value})"
        )
    return robot

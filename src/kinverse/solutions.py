"""The answer to one call: every verified solution of every pose, and why a pose has none."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import ranking, se3
from kinverse.errors import InputError, NoSolution
from kinverse.evidence import Evidence
from kinverse.status import STOPS, Status
from kinverse.table import TableLike, kept, replaced, taken
from kinverse.task import Task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Intervals", "Origin", "Solutions", "Stats", "Status"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Origin(NamedTuple):
    """Where solutions come from; one object shared by all results of a fitted solver."""

    robot: "Robot"
    task: Task
    branch_labels: tuple[str, ...]
    limits: str = "hold"


class Intervals(NamedTuple):
    """Where solutions of a redundant arm are: each row a range of its free parameter, one branch.

    Everywhere from ``low`` to ``high`` the branch solves the pose inside the limits, beyond them
    it does not (to about 1e-9 rad), unless that is where the parameter's own range ends. Rows are
    grouped by pose, then by branch, and ascend. A parameter that turns round (an arm angle) has
    ``low`` in its first turn; ``high`` may lie beyond it. A branch of -1 stands for any: the roots
    of a general arm have no lasting numbers.
    """

    pose_index: Ints
    branch: NDArray[np.int32]
    low: Array
    high: Array


class Stats:
    """How each pose went: typed arrays of length N."""

    __slots__ = ("_origin", "_table")

    def __init__(self, table: TableLike, origin: Origin) -> None:
        self._table = table
        self._origin = origin

    @property
    def evaluations(self) -> Ints:
        """(N,) forward kinematics evaluations spent on each pose."""
        return self._table.evaluations

    @property
    def iterations(self) -> Ints:
        """(N,) steps of the start that is answered; -1 where a method does not iterate."""
        return self._table.iterations

    @property
    def starts(self) -> Ints:
        """(N,) starts begun, of ``Swarm`` the polishes; -1 where a method has none."""
        return self._table.starts

    @property
    def cost(self) -> Array:
        """(N,) the objective where a population method ended, before polish; NaN of others."""
        return self._table.cost

    @property
    def stop(self) -> NDArray[np.str_]:
        """(N,) why the answered start ended, one of ``kinverse.status.STOPS``, or ""."""
        return np.array([*STOPS, ""])[self._table.stop]

    @property
    def singular(self) -> Bools:
        """(N,) the pose meets a continuum, or a solution of it is where the Jacobian lost rank.

        Measured when asked for: a singular value of the task's Jacobian below 1e-6 of the greatest.
        """
        table, origin = self._table, self._origin
        flags = table.singular.copy()
        lost = ranking.has_lost_rank(origin.robot, origin.task, table.q)
        flags[table.pose_index[lost]] = True
        return flags

    @property
    def continuum(self) -> Bools:
        """(N,) the pose meets a continuum of solutions; what is returned represents it.

        Set by closed forms only: False of any other method says nothing.
        """
        return self._table.singular

    @property
    def evidence(self) -> Evidence:
        """What each status rests on, and whether solutions may be missing."""
        return Evidence(self._table)

    @property
    def best_q(self) -> Array:
        """(N, n) the best candidate of each pose, kept or not; NaN where there was none."""
        return self._table.best_q

    @property
    def best_position_error(self) -> Array:
        """(N,) position error of the best candidate [m]."""
        return self._table.best_position_error

    @property
    def best_rotation_error(self) -> Array:
        """(N,) rotation error of the best candidate [rad]."""
        return self._table.best_rotation_error

    def __repr__(self) -> str:
        return (
            f"Stats: {len(self.evaluations)} poses, {int(self.evaluations.sum())} evaluations, "
            f"{int(self.continuum.sum())} meet a continuum"
        )


class Solutions:
    """M verified solutions of N poses, in flat read-only arrays grouped by pose.

    ``len(s)`` is N; ``s[i]`` and iteration give the solutions of one pose, ``s[a:b]`` of several.
    Within a pose: by largest joint distance to ``q_seed`` if one was given, else by branch.

    Example:
        >>> s = kv.solve(robot, T)
        >>> s.q[s.pose_index == 3]          # the same as s[3].q
    """

    __slots__ = ("_origin", "_table")

    def __init__(self, table: TableLike, origin: Origin) -> None:
        self._table = table
        self._origin = origin

    @property
    def q(self) -> Array:
        """(M, n) joint values [rad or m]."""
        return self._table.q

    @property
    def pose_index(self) -> Ints:
        """(M,) the pose each solution belongs to, ascending."""
        return self._table.pose_index

    @property
    def position_error(self) -> Array:
        """(M,) measured position error [m], constrained components only."""
        return self._table.position_error

    @property
    def rotation_error(self) -> Array:
        """(M,) measured rotation error [rad], constrained components only."""
        return self._table.rotation_error

    @property
    def branch(self) -> NDArray[np.int32]:
        """(M,) number of the branch, -1 where the method knows none."""
        return self._table.branch

    @property
    def branch_labels(self) -> tuple[str, ...]:
        """``branch_labels[b]`` says in words which branch b is; empty without labels."""
        return self._origin.branch_labels

    @property
    def status(self) -> NDArray[np.uint8]:
        """(N,) a ``Status`` for each pose."""
        return self._table.status

    @property
    def count(self) -> Ints:
        """(N,) number of solutions of each pose."""
        return self._table.count

    @property
    def ok(self) -> Bools:
        """(N,) whether the pose is SOLVED."""
        return np.asarray(self._table.status == 0)

    @property
    def stats(self) -> Stats:
        """How each pose went."""
        return Stats(self._table, self._origin)

    @property
    def intervals(self) -> Intervals:
        """Where solutions of a redundant arm are; empty for solvers that give none.

        ``filter`` and ``select`` leave them as they are: they tell where solutions lie, not which
        were kept.
        """
        t = self._table
        return Intervals(t.interval_pose, t.interval_branch, t.interval_low, t.interval_high)

    @property
    def robot(self) -> "Robot":
        """The robot the solutions were verified on."""
        return self._origin.robot

    def __len__(self) -> int:
        return len(self._table.status)

    def __getitem__(self, poses: SupportsIndex | slice) -> "Solutions":
        """The solutions of one pose or of a slice of poses; pose_index counts from 0 again."""
        total = len(self)
        if isinstance(poses, slice):
            start, stop, step = poses.indices(total)
            if step != 1:
                raise InputError(f"Solutions take slices of step 1, got step {step}")
            return Solutions(taken(self._table, start, max(start, stop)), self._origin)
        index = poses.__index__()
        if not -total <= index < total:
            raise IndexError(f"pose {index} of {total}")
        index %= total
        return Solutions(taken(self._table, index, index + 1), self._origin)

    def __iter__(self) -> Iterator["Solutions"]:
        return (self[index] for index in range(len(self)))

    def nearest(self, q: ArrayLike) -> Array:
        """The solution of each pose whose largest single joint distance to q is least.

        Revolute joints come turned by whole turns to where they are nearest to q, inside the
        limits (freely for a solver with limits="ignore"): from a wrist at 190 degrees the answer
        is 200, not -160, if the limits allow it.

        Args:
            q: (n,) or (N, n) joint values [rad or m].

        Returns:
            (N, n), rows of NaN where a pose has no solution.

        Example:
            >>> s.nearest(np.zeros(6))[0]
        """
        chosen = self.select("nearest", q)._table
        rows = np.full((len(self), self.robot.dof), np.nan)
        rows[chosen.pose_index] = chosen.q
        return rows

    def select(self, rule: str, q: ArrayLike | None = None) -> "Solutions":
        """One solution a pose.

        Args:
            rule: "nearest" (least largest joint distance to q; without q the first as solved, so
                nearest q_seed if one was given), "least_motion" (the poses as a path: least sum
                of largest joint distances along it, from q if given), "mid_limits" (least
                largest distance from the middle of the limits, relative to the range) or
                "manipulability" (greatest; Yoshikawa 1985). The first two turn revolute joints by
                whole turns, as :meth:`nearest` does: towards q, or towards the pose before.
            q: (n,) or (N, n) joint values [rad or m] for the first two rules.

        Returns:
            ``Solutions`` of the same poses, each with at most one solution.

        Raises:
            InputError: an unknown rule, or q of another shape.

        Example:
            >>> path = s.select("least_motion", q_now).q
        """
        choose = ranking.RULES.get(rule) if isinstance(rule, str) else None
        if choose is None:
            raise InputError(f"unknown rule {rule!r}: the rules are {', '.join(ranking.RULES)}")
        near = None if q is None else se3.as_joints(q, self.robot.dof, "q", count=len(self))
        origin = self._origin
        rows, values = choose(self.robot, origin.task, self._table, near, origin.limits)
        return Solutions(replaced(kept(self._table, rows), q=values), origin)

    def filter(self, predicate: Callable[[Array], Any]) -> "Solutions":
        """Only the solutions a predicate accepts, such as those free of collision.

        A pose that loses all its solutions becomes NOT_FOUND: solutions inside the limits exist
        and none was kept, so neither OUT_OF_LIMITS nor UNREACHABLE would be true. ``stats`` stay
        as they were, so its best candidate is still there with its error.

        Args:
            predicate: takes q (M, n) and returns a mask (M,) of bool; not called when M is 0.

        Raises:
            InputError: the mask has another shape or is not bool.

        Example:
            >>> elbow_up = s.filter(lambda q: q[:, 2] > 0)
        """
        rows = len(self.q)
        mask = np.asarray(predicate(self.q)) if rows else np.empty(0, dtype=np.bool_)
        if mask.shape != (rows,) or mask.dtype != np.bool_:
            raise InputError(
                f"a filter must return ({rows},) of bool, got {mask.shape} of {mask.dtype}"
            )
        return Solutions(kept(self._table, mask), self._origin)

    def padded(self) -> tuple[Array, Bools]:
        """The solutions as a block.

        Returns:
            (N, K, n) with K the largest count, NaN where a pose has fewer, and the mask (N, K) of
            what is filled.

        Example:
            >>> block, filled = s.padded()
            >>> block[filled] == s.q
        """
        count = self.count
        width = int(count.max(initial=0))
        filled = np.arange(width) < count[:, None]
        block = np.full((len(self), width, self.robot.dof), np.nan)
        block[filled] = self.q
        return block, filled

    def raise_if_none(self) -> "Solutions":
        """Self, if every pose has a solution.

        Raises:
            NoSolution: names the first poses without one, why, and how near the best came.

        Example:
            >>> q = kv.solve(robot, T).raise_if_none().q
        """
        failed = np.flatnonzero(~self.ok)
        if not len(failed):
            return self
        lines = [f"{len(failed)} of {len(self)} poses have no solution of {self.robot.name}"]
        for i in failed[:5]:
            status = Status(int(self.status[i]))
            line = f"pose {i}: {status.name}, {status.text}"
            far, turned = self.stats.best_position_error[i], self.stats.best_rotation_error[i]
            if not np.isnan(far):
                line += f"; best candidate off by {far:.3g} m, {turned:.3g} rad"
            lines.append(line)
        if len(failed) > 5:
            lines.append(f"and {len(failed) - 5} more")
        raise NoSolution("\n  ".join(lines))

    def __repr__(self) -> str:
        poses, rows = len(self), len(self.q)
        head = (
            f"Solutions: {poses} pose{'s' * (poses != 1)}, {rows} solution{'s' * (rows != 1)} "
            f"of {self.robot.name}, task {self._origin.task.name}"
        )
        counts = np.bincount(self.status, minlength=4)
        states = ", ".join(f"{s.name} {counts[s]}" for s in Status if counts[s])
        lines = [head]
        if poses == 1:
            status = Status(int(self.status[0]))
            lines.append(f"{status.name}: {status.text}")
        elif poses:
            lines.append(states)
        if rows:
            far, turned = self.position_error.max(), self.rotation_error.max()
            lines.append(f"worst error {far:.2g} m, {turned:.2g} rad")
        if poses == 1:
            lines.extend(self._row(k) for k in range(min(rows, 16)))
            if rows > 16:
                lines.append(f"and {rows - 16} more")
        return "\n  ".join(lines)

    def _row(self, k: int) -> str:
        branch = int(self.branch[k])
        labels = self.branch_labels
        label = f"  {labels[branch]}" if 0 <= branch < len(labels) else ""
        values = " ".join(f"{value:9.5f}" for value in self.q[k])
        return f"{branch:3d}: {values}{label}"

    def __reduce__(self) -> tuple[Any, ...]:
        # the native table stays behind; its arrays travel
        return type(self), (replaced(self._table), self._origin)

"""A seven-joint arm with a joint held, solved by the closed form of the six joints that remain.

With an inner joint held another arm remains for each value: it is made, and its closed form found,
when the value is met. With an end joint held the arm stays and only its target moves. A general arm
numbers its roots anew at each value, so its intervals are those in which any solution exists.
"""

from collections import OrderedDict
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import NoClosedForm
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal, Solver
from kinverse.status import Status
from kinverse.table import plain_evidence

__all__ = ["HeldJoint", "end_removed"]

Array = NDArray[np.float64]
Records = NDArray[np.void]

SAMPLES = 64
"""Values of the joint that a sweep looks at first."""
END_TOLERANCE = 1e-6
"""How exactly a sweep finds the ends of intervals [rad]."""
ANY = -1
"""The branch of an interval in which some branch exists."""
KEPT = 256
"""Arms kept; the one that was not asked longest goes first."""


class HeldJoint:
    """Proposals for poses of an arm with one joint held.

    Args:
        robot: the arm.
        joint: index of the joint held.
        bounds: the values a sweep covers.
        solver: a closed-form solver, cloned for each value.
        lasting: whether branch numbers mean the same at neighbouring values.
    """

    def __init__(
        self,
        robot: Robot,
        joint: int,
        bounds: tuple[float, float],
        solver: Solver,
        lasting: bool,
    ) -> None:
        self.robot, self.joint, self.bounds, self.solver = robot, joint, bounds, solver
        self.lasting = lasting
        self._fixed: Solver | None = None
        if joint in (0, robot.dof - 1):
            self._fixed = solver.clone().fit(end_removed(robot, joint))
        self._arms: OrderedDict[float, Solver | None] = OrderedDict()
        self._lock = Lock()

    def propose_at(self, T: Array, values: Array, q_seed: Array | None) -> Proposal:
        """Every branch of poses (N, 4, 4) at values (N,)."""
        if self._fixed is not None and len(T):
            return _ordered(*self._branches(T, values, q_seed))
        q, index, branch = [np.empty((0, 7))], [np.empty(0, np.int64)], [np.empty(0, np.int32)]
        singular = np.zeros(len(T), np.bool_)
        evidence = plain_evidence("search", len(T))
        for value in np.unique(values):
            where = np.flatnonzero(values == value)
            near = None if q_seed is None else q_seed[where]
            rows, poses, number, flags, records = self._branches(T[where], float(value), near)
            q.append(rows)
            index.append(where[poses])
            branch.append(number)
            singular[where], evidence[where] = flags, records
        rows, poses, number = np.concatenate(q), np.concatenate(index), np.concatenate(branch)
        return _ordered(rows, poses, number, singular, evidence)

    def propose(self, T: Array, q_seed: Array | None) -> Proposal:
        """One solution of each interval that a sweep finds, and the intervals."""
        q, index, branch = [np.empty((0, 7))], [np.empty(0, np.int64)], [np.empty(0, np.int32)]
        found: list[tuple[int, int, float, float]] = []
        singular = np.zeros(len(T), np.bool_)
        grid = np.linspace(*self.bounds, SAMPLES)
        here = [self._exists(T, float(value)) for value in grid]
        for pose in range(len(T)):
            one = T[pose : pose + 1]
            near = None if q_seed is None else q_seed[pose : pose + 1]
            for number in sorted({b for each in here for i, b in each if i == pose}):
                ok = np.array([(pose, number) in each for each in here])
                for low, high in self._intervals(one, number, grid, ok):
                    value = 0.5 * (low + high)
                    if near is not None:
                        value = self._nearest(one, number, low, high, near[0])
                    rows, _, numbers, flags, _ = self._branches(one, value, near)
                    kept = numbers == number if self.lasting else numbers >= 0
                    q.append(rows[kept])
                    index.append(np.full(kept.sum(), pose))
                    branch.append(numbers[kept])
                    singular[pose] |= flags[0]
                    found.append((pose, number, low, high))
        columns = list(zip(*found, strict=True)) or [(), (), (), ()]
        kinds = (np.int64, np.int32, np.float64, np.float64)
        intervals = tuple(np.array(c, dtype=k) for c, k in zip(columns, kinds, strict=True))
        rows, poses, numbers = np.concatenate(q), np.concatenate(index), np.concatenate(branch)
        evidence = plain_evidence("sweep", len(T))
        return _ordered(rows, poses, numbers, singular, evidence, intervals)

    def _arm(self, value: float) -> Solver | None:
        """The solver of what remains at a value; None where it has no closed form."""
        with self._lock:
            if value in self._arms:
                self._arms.move_to_end(value)
                return self._arms[value]
        arm: Solver | None
        try:
            arm = self.solver.clone().fit(_held(self.robot, self.joint, value))
        except NoClosedForm:
            arm = None
        with self._lock:
            self._arms[value] = arm
            while len(self._arms) > KEPT:
                self._arms.popitem(last=False)
        return arm

    def _branches(
        self, T: Array, value: float | Array, q_seed: Array | None
    ) -> tuple[Array, NDArray[np.int64], NDArray[np.int32], NDArray[np.bool_], Records]:
        """Joint values, pose and branch of each solution; singular and evidence of each pose."""
        arm = self._fixed or self._arm(float(value))
        if arm is None:
            nothing = np.empty((0, 7)), np.empty(0, np.int64), np.empty(0, np.int32)
            return *nothing, np.zeros(len(T), np.bool_), plain_evidence("search", len(T))
        near = None
        if q_seed is not None:
            near = np.ascontiguousarray(np.delete(q_seed, self.joint, axis=1))
        s = arm.solve(self._target(T, value), near)
        # where all solutions are outside the limits, the best one shows it
        outside = np.flatnonzero(s.status == Status.OUT_OF_LIMITS)
        q = np.concatenate([s.q, s.stats.best_q[outside]])
        index = np.concatenate([s.pose_index, outside])
        branch = np.concatenate([s.branch, np.full(len(outside), -1, np.int32)])
        column = np.broadcast_to(value, (len(T),))[index]
        q = np.insert(q, self.joint, column, axis=1)
        return q, index, branch, s.stats.singular, s.stats.evidence.records

    def _target(self, T: Array, value: float | Array) -> Array:
        """Where the arm that remains has to go."""
        if self._fixed is None:
            return T
        before, behind = self.robot.frames[self.joint], self.robot.frames[self.joint + 1]
        moved = np.broadcast_to(np.eye(4), (*np.shape(value), 4, 4)).copy()
        if self.robot.kinds[self.joint] == "P":
            moved[..., 2, 3] = value
        else:
            moved[..., 0, 0] = moved[..., 1, 1] = np.cos(value)
            moved[..., 1, 0] = np.sin(value)
            moved[..., 0, 1] = -moved[..., 1, 0]
        held = np.linalg.inv(before @ moved @ behind)
        return np.ascontiguousarray(held @ T if self.joint == 0 else T @ held)

    def _exists(self, T: Array, value: float) -> set[tuple[int, int]]:
        """(pose, branch) of the solutions inside the limits at a value."""
        _, index, branch, _, _ = self._branches(T, value, None)
        number = branch if self.lasting else np.minimum(branch, ANY)
        rows = zip(index[branch >= 0], number[branch >= 0], strict=True)
        return {(int(i), int(b)) for i, b in rows}

    def _intervals(
        self, T: Array, branch: int, grid: Array, ok: NDArray[np.bool_]
    ) -> list[tuple[float, float]]:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], ok.astype(int), [0]])))
        found = []
        for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
            low, high = float(grid[first]), float(grid[last])
            if first > 0:
                low = self._end(T, branch, float(grid[first - 1]), low)
            if last + 1 < len(grid):
                high = self._end(T, branch, float(grid[last + 1]), high)
            found.append((low, high))
        return found

    def _end(self, T: Array, branch: int, outside: float, inside: float) -> float:
        while abs(outside - inside) > END_TOLERANCE:
            middle = 0.5 * (outside + inside)
            if (0, branch) in self._exists(T, middle):
                inside = middle
            else:
                outside = middle
        return inside

    def _nearest(self, T: Array, branch: int, low: float, high: float, q_seed: Array) -> float:
        """The value in an interval whose solution is nearest to the seed, by golden section."""

        def away(value: float) -> float:
            rows, _, numbers, _, _ = self._branches(T, value, q_seed[None])
            rows = rows[numbers == branch if self.lasting else numbers >= 0]
            return float(np.abs(rows - q_seed).max(axis=1).min()) if len(rows) else np.inf

        values = np.linspace(low, high, 17)
        best = int(np.argmin([away(float(value)) for value in values]))
        a, b = float(values[max(best - 1, 0)]), float(values[min(best + 1, 16)])
        ratio = (np.sqrt(5.0) - 1.0) / 2.0
        while b - a > END_TOLERANCE:
            c, d = b - ratio * (b - a), a + ratio * (b - a)
            if away(c) <= away(d):
                b = d
            else:
                a = c
        return min((a, float(values[best]), b), key=away)


def end_removed(robot: Robot, joint: int) -> Robot:
    """The six joints that remain without the first or the last one, which does not move them."""
    first = joint == 0
    kept = slice(1, None) if first else slice(0, -1)
    ends = [np.eye(4)[None], robot.frames[2:]] if first else [robot.frames[:-2], np.eye(4)[None]]
    return Robot(np.concatenate(ends), robot.kinds[kept], robot.limits[kept], name=robot.name)


def _held(robot: Robot, joint: int, value: float) -> Robot:
    low, high = robot.limits[joint]
    if not low <= value <= high:  # limits ignored, or a whole turn away
        robot = robot.with_limits({joint: (min(low, value), max(high, value))})
    return robot.locked({joint: value})


def _ordered(
    q: Array,
    index: NDArray[np.int64],
    branch: NDArray[np.int32],
    singular: NDArray[np.bool_],
    evidence: Records,
    intervals: tuple[NDArray[np.int64], ...] | None = None,
) -> Proposal:
    order = np.argsort(index, kind="stable")
    return Proposal(
        q=q[order],
        pose_index=index[order],
        branch=branch[order],
        singular=singular,
        intervals=intervals,
        evidence=evidence,
    )

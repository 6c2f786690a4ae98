"""Random paths in a workspace, and what can be said about following them without ``track``."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import cases, oracle
from kinverse.bench.continuation import continued, corrected
from kinverse.solvers.analytic import Analytic
from kinverse.solvers.numerical import Numerical

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["AT_ONCE", "PIECES", "Follower", "Nodes", "Spline"]

Array = NDArray[np.float64]
Nodes = tuple[Array, NDArray[np.int32]]
"""Joint values (K, n) and their branches (K,)."""

KNOTS = 4
SPREAD = 0.4
"""Joint values of the knots lie within this of the first one's [rad]."""
PIECES = 16, 1024
"""Small steps from one sample to the next; what fewer lead over is asked again with more."""
AT_ONCE = 4.0
"""A joint moves no further in one of them than so many times its even part of ``limit``."""
HELD = 64
"""Small steps in which an arm moves by itself."""
SAME = 1e-5
"""Joint values nearer than this are one [rad]: near a singularity poses tell them less exactly."""
STARTS = 300
"""Starts of the search that looks for what is said not to exist."""


class Spline:
    """A spline through the poses of four joint values near each other."""

    def __init__(self, robot: "Robot", seed: int) -> None:
        from scipy.interpolate import CubicSpline
        from scipy.spatial.transform import Rotation, RotationSpline

        rng = cases.stream(61, seed)
        low, high = robot.limits.T
        q = rng.uniform(low, high) + rng.uniform(-SPREAD, SPREAD, (KNOTS, robot.dof))
        knots = oracle.pose(robot, np.clip(q, low, high))
        u = np.linspace(0.0, 1.0, KNOTS)
        self.place = CubicSpline(u, knots[:, :3, 3])
        self.turn = RotationSpline(u, Rotation.from_matrix(knots[:, :3, :3]))

    def __call__(self, s: Array) -> Array:
        """Poses (K, 4, 4) at parameters (K,) from 0 to 1."""
        T = np.tile(np.eye(4), (len(s), 1, 1))
        T[:, :3, 3] = self.place(s)
        T[:, :3, :3] = self.turn(s).as_matrix()
        return T

    def sample(self, count: int) -> Array:
        """Samples (count, 4, 4), even in s."""
        return self(np.linspace(0.0, 1.0, count))


class Follower:
    """All nodes of all samples, and which of them a set of nodes leads to: nothing is saved."""

    def __init__(self, robot: "Robot") -> None:
        self.robot = robot
        self.solver = Analytic(windings="all").fit(robot)
        self.inside = Numerical(max_starts=STARTS).fit(robot)
        self.anywhere = Numerical(max_starts=STARTS, limits="ignore").fit(robot)

    def reached(
        self,
        path: Spline,
        s: Array,
        limit: float,
        start: Nodes | None = None,
    ) -> Nodes:
        """The nodes of the last sample that steps of at most ``limit`` lead to.

        Args:
            path: the path.
            s: (N,) its parameter at the samples.
            limit: largest joint step.
            start: nodes of the first sample; None: all of them.
        """
        T = path(s)
        found = self.solver.solve(T)
        ends = np.cumsum(found.count)
        q, branch = start or (found.q[: ends[0]], found.branch[: ends[0]])
        for k, (first, last) in enumerate(zip(ends[:-1], ends[1:], strict=True)):
            layer = found.q[first:last], found.branch[first:last]
            joined = self.joined((q, branch), layer, limit)
            joined &= self.same_side(path, s[k : k + 2], (q, branch), layer, joined, limit)
            onward = joined.any(axis=1)
            q, branch = layer[0][onward], layer[1][onward]
        return q, branch

    @staticmethod
    def joined(before: Nodes, behind: Nodes, limit: float) -> NDArray[np.bool_]:
        """Which nodes behind (rows) are within a step of which before (columns)."""
        near = np.ones((len(behind[0]), len(before[0])), np.bool_)
        for here, there in zip(behind[0].T, before[0].T, strict=True):
            near &= np.abs(here[:, None] - there) <= limit
        return near

    def same_side(
        self,
        path: Spline,
        s: Array,
        before: Nodes,
        behind: Nodes,
        asked: NDArray[np.bool_],
        limit: float,
    ) -> NDArray[np.bool_]:
        """Which of the steps that are asked about keep the branch, or change it with the path.

        What may change it: the path leads in small steps from the joint values before to those
        behind, or on the way back.

        Args:
            path: the path.
            s: (2,) its parameter at both samples.
            before: nodes of the first sample.
            behind: those of the second.
            asked: (K behind, K before) steps to look at.
            limit: largest joint step [rad].
        """
        same = np.asarray(behind[1][:, None] == before[1])
        b, a = np.nonzero(asked & ~same)
        if not len(b):
            return same
        start, end = before[0][a], behind[0][b]
        for pieces in PIECES:
            way = path(np.linspace(s[0], s[1], pieces + 1))[:, None]
            most = AT_ONCE * limit / pieces
            led = self._leads(way[1:], start, end, most)
            led |= self._leads(way[-2::-1], end, start, most)
            b, a, start, end = b[led], a[led], start[led], end[led]
            if not len(b):
                return same
        same[b, a] = True
        return same

    def _leads(self, poses: Array, start: Array, end: Array, most: float) -> NDArray[np.bool_]:
        """Whether poses (S, 1, 4, 4) lead from start to end (K, n), or to where it moves by itself.

        At the last pose an arm with a joint to spare, and any arm that is singular there, can move
        on with its tool held.
        """
        led = continued(self.robot, poses, start, most, hold_limits=False)[-1]
        share = np.linspace(0.0, 1.0, HELD + 1)[1:, None, None]
        way = led + share * (end - led)
        known = np.flatnonzero(np.isfinite(led).all(axis=1))
        good = np.zeros(len(start), np.bool_)
        if not len(known):
            return good
        there, reached = corrected(self.robot, poses[-1], way[:, known].reshape(-1, end.shape[1]))
        there = there.reshape(HELD, len(known), -1)
        moved = np.abs(np.diff(there, axis=0, prepend=led[None, known])).max(axis=(0, 2))
        even = AT_ONCE * np.abs(end - led)[known].max(axis=1) / HELD
        good[known] = reached.reshape(HELD, -1).all(axis=0) & (moved <= np.maximum(even, SAME))
        return good

    def has_none(self, T: Array) -> bool:
        """Whether a search from 300 starts finds nothing for any pose, limits ignored."""
        return not self.anywhere.solve(T).ok.any()

"""Joint values moved to where they solve a pose best: least squares on the arm itself, all at once.

A short arm cannot reach every pose nearby, so that what an extension of it finds for a pose given
in rounded numbers just misses; and an arm whose joints repeat each other meets every pose in a
continuum, of which members inside the limits are wanted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import LIMIT_SLACK, Robot

__all__ = ["MOVES", "Polish"]

Array = NDArray[np.float64]

MOVES = 1e-7
"""Singular value above which a direction of motion counts, of a Jacobian with unit columns."""

ROUNDS = 12
"""Steps at most: from a thousandth off to the last digit takes four."""

HOPELESS = 1e6
"""Errors [sizes or rad] from which no step leads back."""

MEMBER_ROUNDS = 40
"""Steps along a continuum."""


@dataclass(frozen=True)
class Polish:
    """Least squares on an arm's full pose, lengths counted in ``size``.

    Attributes:
        robot: the arm, no mimic joints.
        size: a length of the arm [m]; slides are measured in it too.
    """

    robot: Robot
    size: float

    @property
    def unit(self) -> Array:
        """(n,) of the joints [rad or m]."""
        return np.where([kind == "P" for kind in self.robot.kinds], self.size, 1.0)

    def residual(self, T: Array, q: Array) -> Array:
        """(K, 6) what is missed, position first: in sizes and rad."""
        reached = self.robot.fk(q)
        R = T[:, :3, :3] @ np.swapaxes(reached[:, :3, :3], 1, 2)
        moment = np.stack(
            [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
        )
        # sin(angle) along the axis -> 2 sin(angle / 2)
        stretch = np.sqrt(np.maximum(1.0 + np.trace(R, axis1=1, axis2=2), 1e-4))
        far = (T[:, :3, 3] - reached[:, :3, 3]) / self.size
        return np.concatenate([far, moment / stretch[:, None]], axis=1)

    def jacobian(self, q: Array) -> Array:
        """(K, 6, n) of the residual, for joints in their units."""
        J = np.array(self.robot.jacobian(q)) * self.unit
        J[:, :3] /= self.size
        return J

    def settled(self, T: Array, q: Array, heft: float = 1.0) -> Array:
        """Joint values (K, n) of least error next to q, or q where no step lessens it.

        Args:
            T: (K, 4, 4) poses.
            q: (K, n) joint values near what is wanted.
            heft: how much more than the rotation the position counts.
        """
        weight = np.repeat([heft, 1.0], 3)
        best, here = q.copy(), q.copy()
        e = self.residual(T, here) * weight
        least = np.linalg.norm(e, axis=1)
        eye = np.eye(q.shape[1])
        rows = np.arange(len(q))  # still on their way: each stops by itself, whatever is beside it
        for _ in range(ROUNDS):
            J = self.jacobian(here[rows]) * weight[:, None]
            Jt = np.swapaxes(J, 1, 2)
            H = Jt @ J
            # enough for a solvable system where joints repeat each other
            damping = 1e-3 * (e * e).sum(axis=1) + 1e-13 * (1.0 + np.trace(H, axis1=1, axis2=2))
            H = H + damping[:, None, None] * eye
            step = np.linalg.solve(H, Jt @ e[:, :, None])[:, :, 0]
            here[rows] += step * self.unit
            e = self.residual(T[rows], here[rows]) * weight
            error = np.linalg.norm(e, axis=1)
            is_better = error < least[rows]
            better = rows[is_better]
            best[better], least[better] = here[better], error[is_better]
            moves = (np.abs(step).max(axis=1) > 1e-13) & (error < HOPELESS)
            rows, e = rows[moves], e[moves]
            if not len(rows):
                break
        return best

    def error(self, T: Array, q: Array, tolerances: tuple[float, float]) -> Array:
        """(K,) the larger of the two errors, in tolerances of position [m] and rotation [rad]."""
        e = self.residual(T, q)
        far = np.linalg.norm(e[:, :3], axis=1) * (self.size / tolerances[0])
        turned = np.linalg.norm(e[:, 3:], axis=1) / tolerances[1]
        return np.asarray(np.maximum(far, turned))

    def firmness(self, q: Array) -> Array:
        """(K,) the least singular value of the Jacobian: how surely error grows with distance."""
        return np.asarray(np.linalg.svd(self.jacobian(q), compute_uv=False)[:, -1])

    def rank(self) -> int:
        """How many directions the joints move the tool in, where they stand best."""
        q = np.random.default_rng(0).uniform(0.1, 1.5, (8, self.robot.dof)) * self.unit
        J = self.jacobian(q)
        J /= np.maximum(np.linalg.norm(J, axis=1, keepdims=True), MOVES)
        return int(np.linalg.matrix_rank(J, tol=MOVES).max())

    def members(self, T: Array, q: Array, near: Array) -> Array:
        """Joint values (K, n) of the continuum next to q: inside the limits, near a place.

        Joints that would leave their limits are held there, one more at a time.

        Args:
            T: (K, 4, 4) poses.
            q: (K, n) joint values near a continuum.
            near: (K, n) where to, inside the limits.
        """
        low, high = self.robot.limits.T
        is_slide = np.array([kind == "P" for kind in self.robot.kinds])
        # a whole turn nearer where that is nearer
        q = np.where(is_slide, q, q + 2 * np.pi * np.round((near - q) / (2 * np.pi)))
        is_free = np.ones(q.shape, np.bool_)
        todo = np.arange(len(q))
        for _ in range(self.robot.dof - self.rank() + 1):
            rows = todo
            for _ in range(MEMBER_ROUNDS):
                free = is_free[rows]
                J = self.jacobian(q[rows]) * free[:, None, :]
                J_inverse = np.linalg.pinv(J, rcond=MOVES)
                step = (J_inverse @ self.residual(T[rows], q[rows])[:, :, None])[:, :, 0]
                wish = (near[rows] - q[rows]) / self.unit * free
                step += wish - (J_inverse @ (J @ wish[:, :, None]))[:, :, 0]
                length = np.abs(step).max(axis=1, keepdims=True)
                q[rows] += step / np.maximum(length, 1.0) * self.unit
                rows = rows[length[:, 0] > 1e-12]
                if not len(rows):
                    break
            outside = np.maximum(low - q[todo], q[todo] - high) / self.unit
            worst, far = outside.argmax(axis=1), outside.max(axis=1, initial=-1.0)
            is_out = far > LIMIT_SLACK
            todo, worst = todo[is_out], worst[is_out]
            if not len(todo):
                break
            is_free[todo, worst] = False
            q[todo] = np.where(is_free[todo], q[todo], np.clip(q[todo], low, high))
        return q

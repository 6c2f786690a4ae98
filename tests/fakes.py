"""Small solvers in plain Python: enough to hold the contract without the native solvers."""

import numpy as np

from kinverse import se3
from kinverse.errors import NoClosedForm
from kinverse.solvers import Proposal, Solver


class Newton(Solver):
    """Damped Gauss-Newton from the seed and a few starts drawn from (seed, the pose)."""

    def __init__(
        self,
        task="pose",
        starts=6,
        steps=40,
        tol_position=1e-6,
        tol_rotation=1e-6,
        windings="nearest",
        limits="hold",
    ):
        self.task = task
        self.starts = starts
        self.steps = steps
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits

    def _propose(self, T, q_seed, seed):
        rows, index, n = [], [], self.robot_.dof
        for i, pose in enumerate(T):
            rng = np.random.default_rng([seed, *pose.view(np.uint64).ravel().tolist()])
            starts = self.robot_.random(self.starts, rng)
            if q_seed is not None:
                starts = np.vstack([q_seed[i], starts])
            # one pose at a time: the native batch would do, but its bits are not this file's matter
            rows += [self._refine(pose[None], start[None])[0] for start in starts]
            index += [i] * len(starts)
        count = np.bincount(index, minlength=len(T)) * self.steps
        return Proposal(np.reshape(rows, (-1, n)), np.array(index, int), evaluations=count)

    def _refine(self, T, q_start):
        q = q_start.copy()
        for k in range(len(q)):
            for _ in range(self.steps):
                found, J = self.robot_.fk(q[k]), self.robot_.jacobian(q[k])
                turn = se3.rotation_log(T[k, :3, :3] @ found[:3, :3].T)
                error = np.concatenate([T[k, :3, 3] - found[:3, 3], turn])[:, None]
                task = self._origin.task
                J, error = task.constrained(J, T[k]), task.constrained(error, T[k])
                damped = J.T @ J + 1e-9 * np.eye(J.shape[1])
                q[k] += np.clip(np.linalg.solve(damped, J.T @ error)[:, 0], -1, 1)
        return q


class Says(Solver):
    """Claims one status for every pose (or for those left of x = 0) and proposes ``rows``."""

    def __init__(self, status=3, rows=None, task="pose", everywhere=True, label=None):
        self.status = status
        self.rows = rows
        self.task = task
        self.everywhere = everywhere
        self.label = label

    _common = ("task",)

    def _fit(self, robot):
        if self.label is not None:
            self.branch_labels_ = (self.label,)

    def _propose(self, T, q_seed, seed):
        q = np.zeros((0, self.robot_.dof)) if self.rows is None else np.asarray(self.rows, float)
        index = np.repeat(np.arange(len(T)), len(q))
        claimed = self.everywhere | (T[:, 0, 3] < 0)
        return Proposal(
            np.tile(q, (len(T), 1)),
            index,
            branch=np.zeros(len(index), int),
            hint=np.where(claimed, self.status, 3),
            evaluations=np.full(len(T), 7),
        )


class Formless(Says):
    """A closed-form solver that knows no family."""

    def _fit(self, robot):
        raise NoClosedForm(f"no family fits {robot.name}")

"""A solver of your own: write _propose; checking, limits, errors and status come with it."""

import numpy as np

import kinverse as kv
from kinverse.solvers import Proposal, Solver


class Newton(Solver):
    """A few Newton steps from q_seed, or from the middle of the limits."""

    def __init__(
        self, *, task="pose", steps=20, tol_position=1e-6, tol_rotation=1e-6,
        windings="nearest", limits="hold",
    ):  # fmt: skip
        self.task, self.steps = task, steps
        self.tol_position, self.tol_rotation = tol_position, tol_rotation
        self.windings, self.limits = windings, limits

    def _propose(self, T, q_seed, seed):
        robot = self.robot_
        middle = np.tile(robot.limits.mean(axis=1), (len(T), 1))
        q = middle if q_seed is None else q_seed.copy()
        for _ in range(self.steps):
            off = kv.se3.rotation_log(T[:, :3, :3] @ robot.fk(q)[:, :3, :3].transpose(0, 2, 1))
            e = np.concatenate([T[:, :3, 3] - robot.fk(q)[:, :3, 3], off], axis=1)
            q = q + (np.linalg.pinv(robot.jacobian(q), rcond=1e-3) @ e[:, :, None])[:, :, 0]
        return Proposal(q, np.arange(len(T)))


robot = kv.load("kr16")
kv.check_solver(Newton(), robot)  # the same suite every solver of kinverse passes
q = np.array([0.3, -1.2, 1.0, 0.4, 0.8, -0.2])
print(kv.solve(robot, robot.fk(q), solver=Newton(), q_seed=q + 0.1))

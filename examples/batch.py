"""Ten thousand poses in one call; what has no solution says why."""

import time

import numpy as np

import kinverse as kv

robot = kv.load("ur5")
T = robot.fk(robot.random(10_000, np.random.default_rng(7)))
T[::10, 0, 3] += 2.0  # every tenth pose is put out of reach

solver = kv.Analytic().fit(robot)
start = time.perf_counter()
s = solver.solve(T)
seconds = time.perf_counter() - start
print(f"{len(s)} poses, {len(s.q)} solutions, {1e6 * seconds / len(s):.2f} us a pose")
for status in kv.Status:
    print(f"{status.name:14s}{int((s.status == status).sum()):6d}  {status.text}")
print("worst error [m]:", s.position_error.max())

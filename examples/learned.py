"""A network for each branch learns a SCARA arm; what it predicts, and what a few steps add."""

import tempfile
from pathlib import Path

import numpy as np

import kinverse as kv
from kinverse.networks import MLP

robot = kv.load("adept_one")
solver = kv.Learned(MLP((30,), max_iter=40), n_samples=2000, random_state=1).fit(robot)

rows = solver.held_out(500)  # examples made as those that were learned, from another seed
print("raw predictions, median:")
for k, branch in enumerate(solver.branches_):
    mine = rows.network == k
    off = 1e3 * np.median(rows.position_error[mine]), np.median(rows.rotation_error[mine])
    print(f"  {solver.branch_labels_[branch]}  {off[0]:.1f} mm, {np.degrees(off[1]):.2f} deg off")

T = robot.fk(robot.random(1000, rng=12345))
s = solver.solve(T)  # refined and verified
exact = kv.solve(robot, T)
print(f"solved {100 * s.ok.mean():.1f} %, {len(s.q)} of the closed form's {len(exact.q)} solutions")
print(f"worst error {s.position_error.max():.0e} m, {s.rotation_error.max():.0e} rad")

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "adept_one.npz"
    solver.save(path)  # arrays and text, no code
    again = kv.Learned.load(path, robot)
    print("the file gives the same:", np.array_equal(again.solve(T).q, s.q))

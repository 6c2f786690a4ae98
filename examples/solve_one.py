"""One pose of a KUKA KR16: every solution, and the one nearest to where the arm is."""

import numpy as np

import kinverse as kv

robot = kv.load("kr16")
T_base_tool = kv.pose([0.9, 0.3, 1.1], rpy=[0.2, 1.7, 0.3])  # metres, radians
solutions = kv.solve(robot, T_base_tool)
print(solutions)

q_now = np.zeros(robot.dof)
q = solutions.nearest(q_now)[0]
print("nearest to zero:", np.round(q, 4))
print("off by", np.abs(robot.fk(q) - T_base_tool).max())

"""A robot of your own from Denavit-Hartenberg rows, with a tool on its flange."""

import numpy as np

import kinverse as kv

quarter = np.pi / 2
robot = kv.Robot.from_dh(
    a=[0.1, 0.5, 0.05, 0, 0, 0],
    d=[0.4, 0, 0, 0.45, 0, 0.09],
    alpha=[-quarter, 0, -quarter, quarter, -quarter, 0],
    theta=[0, -quarter, 0, 0, 0, 0],
    limits=np.radians(
        [[-170, 170], [-100, 135], [-200, 70], [-190, 190], [-120, 120], [-360, 360]]
    ),
    name="mine",
)
robot = robot.with_tool(kv.pose([0, 0, 0.15]))  # 150 mm beyond the flange
print(robot)

q = robot.random(rng=np.random.default_rng(1))
print("made from", np.round(q, 4))
print(kv.solve(robot, robot.fk(q)))

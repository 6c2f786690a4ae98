"""A URDF file, solved.

``python examples/from_urdf.py [FILE [BASE TIP]]``; without arguments the small arm beside this
program, and the UR10e of the package compas-fab if that is installed.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import kinverse as kv

arguments = sys.argv[1:]
if not arguments:
    arguments = [str(Path(__file__).with_name("small_arm.urdf")), "base_link", "tool0"]
    package = find_spec("compas_fab")
    if package is not None and package.submodule_search_locations:
        library = Path(package.submodule_search_locations[0]) / "data" / "robot_library"
        arguments[0] = str(library / "ur10e_robot" / "urdf" / "robot_description.urdf")

robot = kv.load(*arguments)
q = robot.random(rng=np.random.default_rng(3))
solutions = kv.solve(robot, robot.fk(q))
print(f"{robot.name}: {robot.dof} joints, {len(solutions.q)} solutions [deg]")
for joints, branch, error in zip(
    np.degrees(solutions.q), solutions.branch, solutions.position_error, strict=True
):
    print(" ".join(f"{v:9.3f}" for v in joints), f"  branch {branch}, off by {error:.1e} m")

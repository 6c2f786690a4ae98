"""A manufacturer's URDF, solved.

``python examples/from_urdf.py [FILE [BASE TIP]]``; without arguments the UR10e that comes with
the package compas-fab (``pip install --no-deps compas-fab``).
"""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import kinverse as kv

arguments = sys.argv[1:]
if not arguments:
    package = find_spec("compas_fab")
    if package is None or not package.submodule_search_locations:
        sys.exit("give a URDF file, or: pip install --no-deps compas-fab")
    library = Path(package.submodule_search_locations[0]) / "data" / "robot_library"
    file = library / "ur10e_robot" / "urdf" / "robot_description.urdf"
    arguments = [str(file), "base_link", "tool0"]

robot = kv.load(*arguments)
q = robot.random(rng=np.random.default_rng(3))
solutions = kv.solve(robot, robot.fk(q))
print(f"{robot.name}: {robot.dof} joints, {len(solutions.q)} solutions [deg]")
for joints, branch, error in zip(
    np.degrees(solutions.q), solutions.branch, solutions.position_error, strict=True
):
    print(" ".join(f"{v:9.3f}" for v in joints), f"  branch {branch}, off by {error:.1e} m")

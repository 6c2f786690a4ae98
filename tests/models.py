"""URDF files that the test extra brings: compas-fab's, found without importing it."""

from importlib.metadata import distribution
from pathlib import Path


def compas_urdf(robot):
    """Path of a URDF of compas-fab 2.0.1 (MIT): panda, ur5_robot, ur10e_robot, abb_irb..."""
    inside = f"compas_fab/data/robot_library/{robot}/urdf/robot_description.urdf"
    return Path(str(distribution("compas-fab").locate_file(inside)))

"""Paths: curves of poses, and what an arm can do along them.

>>> from kinverse.paths import Path
>>> Path.circle([0.6, 0.0, 0.5], 0.2, orientation="radial").sample(count=100).T.shape
(100, 4, 4)
"""

from kinverse.paths.feasible import Feasibility, Interval, feasible
from kinverse.paths.joint_curve import (
    Deviation,
    JointCurve,
    Refined,
    ToolCurve,
    deviation,
    refined,
    tool_deviation,
)
from kinverse.paths.joint_path import Gap, JointPath, Reason
from kinverse.paths.links import Link, default_links
from kinverse.paths.minimum_jerk import minimum_jerk
from kinverse.paths.named import named_path, named_samples, path_names
from kinverse.paths.orientation import Constant, Radial, Tangent
from kinverse.paths.path import Path, Samples
from kinverse.paths.planar_conditions import Condition, condition_5, condition_6
from kinverse.paths.point_to_point import point_to_point
from kinverse.paths.simulate import Simulation, simulate
from kinverse.paths.track import track
from kinverse.paths.trajectory import State, Trajectory, retime

__all__ = [
    "Condition",
    "Constant",
    "Deviation",
    "Feasibility",
    "Gap",
    "Interval",
    "JointCurve",
    "JointPath",
    "Link",
    "Path",
    "Radial",
    "Reason",
    "Refined",
    "Samples",
    "Simulation",
    "State",
    "Tangent",
    "ToolCurve",
    "Trajectory",
    "condition_5",
    "condition_6",
    "default_links",
    "deviation",
    "feasible",
    "minimum_jerk",
    "named_path",
    "named_samples",
    "path_names",
    "point_to_point",
    "refined",
    "retime",
    "simulate",
    "tool_deviation",
    "track",
]

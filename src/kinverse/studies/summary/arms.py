"""The arms and tasks of the comparison, and the situations they stand for."""

import numpy as np

from kinverse import judge
from kinverse.errors import NoClosedForm
from kinverse.robot import Robot

__all__ = ["CASES", "SITUATIONS", "reach_of", "situation_of"]

CASES: tuple[tuple[str, str], ...] = (
    *((arm, "pose") for arm in ("planar3r", "planar3r_003", "adept_one", "pioneer2", "irb6")),
    *((arm, "pose") for arm in ("puma560", "irb1400", "rx160l", "kr16", "ur5")),
    *((arm, "pose") for arm in ("panda", "iiwa14")),
    *((arm, "pose") for arm in ("ir361", "jaco2")),
    *((arm, "position") for arm in ("planar3r_003", "kr16", "panda")),
)
"""Arm and task: the documents' arms and four of today.

jaco2 stands for six joints whose equations are no chain of quadratic ones; documents 003 and 002
as printed ask for positions only.
"""

SITUATIONS = ("closed form exists", "redundant", "no closed form", "position only")


REACH_SEED, REACH_DRAWN = 8_000, 2_000


def reach_of(robot: Robot) -> float:
    """Largest distance of the tool from the first joint over many joint values [m].

    It makes position errors of small and large arms comparable.

    Example:
        >>> round(reach_of(kv.load("planar3r")), 2)
        0.22
    """
    low, high = robot.limits.T
    q = np.random.default_rng(REACH_SEED).uniform(low, high, (REACH_DRAWN, robot.dof))
    frames = judge.frames(robot, q)
    return float(np.linalg.norm(frames[-1][:, :3, 3] - frames[0][:, :3, 3], axis=1).max())


def situation_of(robot: Robot, task: str) -> str:
    """Which of ``SITUATIONS`` it is: by what ``Analytic`` says, and by counting joints.

    Where ``Analytic`` solves by elimination its branches have no names: that is no closed form.
    """
    from kinverse.solvers.analytic import Analytic

    if task == "position":
        return "position only"
    try:
        labels = Analytic(task=task).fit(robot).branch_labels_
    except NoClosedForm:
        return "no closed form"
    if labels[0].startswith("root"):
        return "no closed form"
    return "redundant" if robot.dof > 6 else "closed form exists"

"""An arm without a far base and tool: what they are is folded into the target.

A base or a tool of many times the arm's length says nothing of the arm, but drowns its axes in
rounding, and everything that is measured in the arm's length.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot

__all__ = ["BareArm", "bare_arm"]

Array = NDArray[np.float64]

FAR = 100.0
"""Times its own length from which on an arm is solved without its base and tool."""

EPSILONS = 64.0
"""Digits that transforms from base to tool may cost, in units of the last place."""

CARRIED = 1e-3
"""Rounding and what a rotation error moves, as a part of the arm's length, up to which it can still
be shown that a pose is out of reach."""


@dataclass(frozen=True)
class BareArm:
    """An arm and how its targets come from those of the arm with base and tool.

    Attributes:
        robot: the arm, base and tool as near as may be.
        before: (4, 4) what its target is multiplied by from the left.
        behind: (4, 4) and from the right.
        rounding: error [m] that the digits of far numbers explain.
        lever: length [m] at which the tool moves the arm's target when it turns.
        size: a length of the arm [m].
    """

    robot: Robot
    before: Array
    behind: Array
    rounding: float
    lever: float
    size: float

    def target(self, T: Array) -> Array:
        """Where the bare arm has to go for poses (N, 4, 4)."""
        return np.ascontiguousarray(self.before @ T @ self.behind)

    def tolerances(self, position: float, rotation: float) -> tuple[float, float]:
        """What the bare arm's target may miss [m, rad] for a pose within the tolerances."""
        return position + self.rounding + self.lever * rotation, rotation + self._turned

    def shows(self, position: float, rotation: float) -> bool:
        """Whether a target that the bare arm cannot reach shows that no pose can be met."""
        return self.tolerances(position, rotation)[0] < CARRIED * self.size

    @property
    def _turned(self) -> float:
        return EPSILONS * float(np.finfo(np.float64).eps)


def bare_arm(robot: Robot, task: str) -> BareArm | None:
    """The bare arm of a robot whose base or tool is far; None if both are near.

    A task that is not the full pose leaves the tool where it is, and the base's rotation.
    """
    slides = np.array([kind == "P" for kind in robot.kinds])
    links = float(np.linalg.norm(robot.frames[1:-1, :3, 3], axis=1).sum())
    size = links + float(np.abs(robot.limits[robot.source[slides]]).max(axis=1, initial=0.0).sum())
    size = size or 1.0
    whole = task == "pose"
    far = [float(np.linalg.norm(robot.frames[i][:3, 3])) > FAR * size for i in (0, -1)]
    if not (far[0] or (whole and far[1])):
        return None
    frames = robot.frames.copy()
    before, behind = np.eye(4), np.eye(4)
    if far[0]:
        if whole:
            before, frames[0] = _inverse(frames[0]), np.eye(4)
        else:
            before[:3, 3] = -frames[0, :3, 3]
            frames[0, :3, 3] = 0.0
    if whole and far[1]:
        behind, frames[-1] = _inverse(frames[-1]), np.eye(4)
    bare = Robot(frames, robot.kinds, robot.limits, robot.joint_names, name=robot.name)
    lever = float(np.linalg.norm(robot.frames[-1, :3, 3])) if whole and far[1] else 0.0
    distance = float(np.linalg.norm(robot.frames[[0, -1], :3, 3], axis=1).sum())
    rounding = EPSILONS * float(np.finfo(np.float64).eps) * distance
    return BareArm(bare, before, behind, rounding, lever, size)


def _inverse(T: Array) -> Array:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse

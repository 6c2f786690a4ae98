"""Functions of the joints that complete a redundant arm's task space: document 003."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.settings import HasSettings

__all__ = ["KINDS", "VirtualVector"]

Array = NDArray[np.float64]
Kind = str | tuple[str, str] | Callable[[Array], Any]

KINDS = ("angle_sum", "cos", "cos_sin", "arm_angle")
"""Kinds by name; ("joint", name) and functions are kinds too."""

PARALLEL = 1e-9
"""Largest sine between the axes of an arm that counts as planar."""


class VirtualVector(HasSettings):
    """What a network is told beside the pose, so that a pose has one answer.

    Habibkhah and Mayorga (2021, equation 3) complete the position of a planar arm by the cosine and
    sine of the sum of its joint angles. The cosine alone, as in their reference 34, cannot tell
    the sum's sign and serves a limited range only.

    Args:
        kind: for planar arms (all joints turn about parallel axes) "angle_sum" (in (-pi, pi] where
            it is read off a pose), "cos", "cos_sin" of the sum; for arms of seven turning joints
            "arm_angle", cosine and sine of the angle of the plane through the points 2, 4 and 6
            about the line from 2 to 6, counted from the plane that holds joint 1's axis, where
            point i is that of joint i's axis nearest to the axis before (shoulder, elbow and wrist
            of an arm that has them); ("joint", name), a joint's own value; or a function of joint
            values (M, n) that gives (M,) or (M, k).

    Raises:
        InputError: an unknown kind, or a robot that it does not suit.

    Example:
        >>> VirtualVector("cos_sin").of_joints(kv.load("planar3r_003"), q).shape
        (100, 2)
    """

    def __init__(self, kind: Kind) -> None:
        self.kind = kind

    def of_joints(self, robot: Robot, q: ArrayLike) -> Array:
        """Values (M, k) for joint values (M, n)."""
        rows = se3.as_joints(q, robot.dof, "q").reshape(-1, robot.dof)
        kind = self._checked()
        if callable(kind):
            return _called(kind, rows)
        if isinstance(kind, tuple):
            return rows[:, [robot._index(kind[1])]]
        if kind == "arm_angle":
            return _arm_angle(robot, rows)
        return self._of_sum(rows @ _signs(robot))

    def of_pose(self, robot: Robot, T: ArrayLike) -> Array | None:
        """Values (N, k) for poses T (N, 4, 4), or None where the pose does not tell them."""
        kind, poses = self._checked(), se3.as_poses(T)
        if callable(kind) or isinstance(kind, tuple) or kind == "arm_angle":
            return None
        _signs(robot)  # refuses what is not planar
        start = robot.fk(np.zeros(robot.dof))[:3, :3]
        axis = _joint_frames(robot, np.zeros((1, robot.dof)))[0, 0, :3, 2]
        turned = poses[:, :3, :3] @ start.T
        # the turn about the axis: sine from the skew part, cosine from the trace
        skew = np.stack(
            [
                turned[:, 2, 1] - turned[:, 1, 2],
                turned[:, 0, 2] - turned[:, 2, 0],
                turned[:, 1, 0] - turned[:, 0, 1],
            ],
            axis=1,
        )
        sine, cosine = 0.5 * skew @ axis, 0.5 * (np.trace(turned, axis1=1, axis2=2) - 1.0)
        return self._of_sum(np.arctan2(sine, cosine))

    def _of_sum(self, total: Array) -> Array:
        if self.kind == "angle_sum":
            return total[:, None]
        columns = [np.cos(total)] if self.kind == "cos" else [np.cos(total), np.sin(total)]
        return np.stack(columns, axis=1)

    def _checked(self) -> Kind:
        kind = self.kind
        named = isinstance(kind, (tuple, list)) and len(kind) == 2 and kind[0] == "joint"
        if named:
            return ("joint", str(kind[1]))  # type: ignore[index]
        if callable(kind) or (isinstance(kind, str) and kind in KINDS):
            return kind
        raise InputError(
            f"virtual must be one of {', '.join(KINDS)}, ('joint', name) or a function, got"
            f" {kind!r}"
        )


def _called(function: Callable[[Array], Any], q: Array) -> Array:
    values = np.asarray(function(q.copy()), dtype=np.float64)
    if values.ndim not in (1, 2) or len(values) != len(q):
        raise InputError(
            f"the virtual vector must give ({len(q)},) or ({len(q)}, k) values, got {values.shape}"
        )
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values.reshape(len(q), -1)).all(axis=1))[0])
        raise InputError(f"the virtual vector is not finite for q {q[row].tolist()}")
    return values.reshape(len(q), -1)


def _joint_frames(robot: Robot, q: Array) -> Array:
    """(M, m, 4, 4) frames of the moving joints, z along the axis, before each joint moves."""
    if len(robot.kinds) != robot.dof:
        raise InputError(
            f"robot {robot.name!r} has mimic joints: give a function as virtual vector"
        )
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    frames = []
    for i, kind in enumerate(robot.kinds):
        T = T @ robot.frames[i]
        frames.append(T)
        value = robot.multiplier[i] * q[:, i] + robot.offset[i]
        motion = np.tile(np.eye(4), (len(q), 1, 1))
        if kind == "R":
            motion[:, :3, :3] = se3.rotation_from_axis([0.0, 0.0, 1.0], value)
        else:
            motion[:, 2, 3] = value
        T = T @ motion
    return np.stack(frames, axis=1)


def _signs(robot: Robot) -> Array:
    """(n,) +1 or -1: which way each joint of a planar arm turns."""
    if robot.kinds != "R" * robot.dof:
        raise InputError(f"robot {robot.name!r} is no planar arm of turning joints: {robot.kinds}")
    axes = _joint_frames(robot, np.zeros((1, robot.dof)))[0, :, :3, 2]
    along = axes @ axes[0]
    across = np.linalg.norm(np.cross(axes, axes[0]), axis=1)
    if across.max() > PARALLEL:
        joint = robot.joint_names[int(across.argmax())]
        raise InputError(
            f"robot {robot.name!r} is no planar arm: the axis of joint {joint!r} is not parallel to"
            " the first"
        )
    return np.asarray(np.sign(along) * robot.multiplier)


def _arm_angle(robot: Robot, q: Array) -> Array:
    """(M, 2) cosine and sine of the arm angle; NaN never: a stretched arm counts as 0."""
    if robot.kinds != "RRRRRRR":
        raise InputError(
            f"the arm angle needs seven turning joints, {robot.name!r} has {robot.kinds}"
        )
    frames = _joint_frames(robot, q)
    place, axis = frames[:, :, :3, 3], frames[:, :, :3, 2]
    shoulder, elbow, wrist = (_foot(place, axis, i) for i in (1, 3, 5))
    line = wrist - shoulder
    line = line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), np.finfo(float).tiny)
    first = np.cross(line, axis[:, 0])  # normal of the reference plane
    second = np.cross(line, elbow - shoulder)
    cosine = (first * second).sum(axis=1)
    sine = (np.cross(first, second) * line).sum(axis=1)
    angle = np.arctan2(sine, cosine)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _foot(place: Array, axis: Array, i: int) -> Array:
    """(M, 3) the point of axis i nearest to axis i - 1; of parallel ones the joint's own place."""
    a, b = axis[:, i - 1], axis[:, i]
    gap = place[:, i - 1] - place[:, i]
    cosine = (a * b).sum(axis=1)
    sine2 = 1.0 - cosine**2
    along = ((gap * b).sum(axis=1) - cosine * (gap * a).sum(axis=1)) / np.where(
        sine2 > PARALLEL, sine2, np.inf
    )
    return np.asarray(place[:, i] + along[:, None] * b)

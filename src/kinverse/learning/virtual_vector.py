"""Functions of the joints that complete the task space of redundant arms (document 003)."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.axes import axis_pairs, meeting_triples
from kinverse.errors import InputError
from kinverse.geometry import PARALLEL, axis_lines
from kinverse.robot import Robot
from kinverse.settings import HasSettings

__all__ = ["VirtualVector"]

Array = NDArray[np.float64]
Function: TypeAlias = "Callable[[Array], ArrayLike]"

PLANAR = {
    "angle_sum": ("angle_sum",),
    "cos": ("cos(angle_sum)",),
    "cos_sin": ("cos(angle_sum)", "sin(angle_sum)"),
}
ARM_ANGLE = "arm_angle"
ARM_ANGLE_NAMES = ("cos(arm_angle)", "sin(arm_angle)")
JOINT = "joint:"


class VirtualVector(HasSettings):
    """What is added to the task so that it has as many components as the arm has joints.

    Source: Habibkhah & Mayorga, "An ANN and virtual vector function approach for the computation of
    the inverse kinematics of redundant manipulators", 2021, equation 3. A network that is told the
    position only cannot learn joints that the position does not determine; told these values too,
    it can.

    Args:
        kind: one of

            * "angle_sum", "cos", "cos_sin": the sum of the angles of all turning joints [rad], its
              cosine, or its cosine and sine, for arms whose turning axes are all parallel. A joint
              counts negative if its axis points against that of the first. It is the tool's turn
              about that axis from where it stands with all joints at zero. The cosine alone does
              not tell a sum from its negative, so it serves a limited range of the joints only;
              the sum itself jumps by a turn where ranges are wide; cosine and sine do neither.
            * "arm_angle": cosine and sine of the arm angle of seven turning joints with spherical
              shoulder and wrist: the angle of the elbow (axis 4) about the line from shoulder to
              wrist, right-handed, 0 where the elbow lies in the plane of axis 1 and that line, on
              the side axis 1 points to. It is the free parameter of :class:`kinverse.Analytic`
              (Shimizu et al., IEEE Trans. Robotics 24(5), 2008, with another reference). Undefined
              where the line runs along axis 1 and where the elbow lies on it.
            * "joint:NAME": the value of that joint [rad or m].
            * a function of joint values (M, n) that returns (M,) or (M, k).

    Example:
        >>> robot = kv.load("planar3r_003")
        >>> VirtualVector("cos_sin").of_joints(robot, [0.5, -1.0, 0.5]).round(6)
        array([[1., 0.]])
    """

    def __init__(self, kind: "str | Function" = "cos_sin") -> None:
        self.kind = kind

    def names(self, robot: Robot) -> tuple[str, ...]:
        """The names of the k values; those of a function are counted by calling it once.

        Raises:
            InputError: as :meth:`of_joints`.

        Example:
            >>> VirtualVector("joint:joint4").names(kv.load("panda"))
            ('joint4',)
        """
        kind = self._kind()
        if not isinstance(kind, str):
            own = getattr(kind, "__name__", type(kind).__name__)
            count = self.of_joints(robot, robot.limits.mean(axis=1)).shape[1]
            return (own,) if count == 1 else tuple(f"{own}[{i}]" for i in range(count))
        if kind in PLANAR:
            return PLANAR[kind]
        return ARM_ANGLE_NAMES if kind == ARM_ANGLE else (kind.removeprefix(JOINT),)

    def of_joints(self, robot: Robot, q: ArrayLike) -> Array:
        """The values (M, k) of joint values.

        Args:
            robot: the arm they belong to.
            q: (n,) or (M, n) joint values [rad or m].

        Raises:
            TypeError: complex, object or text data.
            InputError: an unknown kind, an arm it does not fit, joint values that cannot be used,
                or a function that returns another shape or values that are not finite.

        Example:
            >>> VirtualVector("arm_angle").of_joints(kv.load("iiwa14"), q).shape
            (1, 2)
        """
        kind = self._kind()
        q = np.atleast_2d(se3.as_joints(q, robot.dof))
        if q.ndim != 2:
            raise InputError(f"q must have shape ({robot.dof},) or (M, {robot.dof}), got {q.shape}")
        if not isinstance(kind, str):
            return _called(kind, q)
        if kind in PLANAR:
            return _of_angle(kind, _angle_sum(robot, kind, q))
        if kind == ARM_ANGLE:
            return _arm_angle(robot, q)
        return q[:, [_joint(robot, kind)]]

    def of_pose(self, robot: Robot, T: ArrayLike) -> Array | None:
        """The values (N, k) as far as the tool's pose tells them: of the planar kinds, else None.

        The turn of the tool about the common axis; tilts are not heeded. It is known but for whole
        turns: "angle_sum" is given in the turn about the middle of its range inside the limits, so
        it is the sum of the joints' angles if that range is a turn or less.

        Args:
            robot: the arm.
            T: (4, 4) or (N, 4, 4) poses.

        Raises:
            InputError: an unknown kind, an arm it does not fit, poses that cannot be used.

        Example:
            >>> VirtualVector("cos_sin").of_pose(robot, robot.fk(q)).shape
            (1, 2)
        """
        kind = self._kind()
        poses = se3.as_poses(T)
        if not isinstance(kind, str) or kind not in PLANAR:
            return None
        axis, sign = _common_axis(robot, kind)
        start = axis_lines(robot.frames, robot.kinds).T_zero[:3, :3]
        w, *v = se3.quat_from_rotation(poses[:, :3, :3] @ start.T).T
        turn = 2.0 * np.arctan2(axis @ np.array(v), w)
        weight, offset = _weights(robot, sign)
        middle = robot.limits.mean(axis=1) @ weight + offset
        turn += 2.0 * np.pi * np.rint((middle - turn) / (2.0 * np.pi))
        return _of_angle(kind, turn)

    def _kind(self) -> "str | Function":
        kind = self.kind
        known = isinstance(kind, str) and (kind in PLANAR or kind == ARM_ANGLE)
        if known or callable(kind) or (isinstance(kind, str) and kind.startswith(JOINT)):
            return kind
        raise InputError(
            f"unknown virtual vector {kind!r}: it may be {', '.join(PLANAR)}, {ARM_ANGLE},"
            " joint:NAME or a function of the joint values"
        )


def _called(function: Function, q: Array) -> Array:
    name = getattr(function, "__name__", type(function).__name__)
    values = se3.as_real(function(q), f"what the virtual vector {name} returns")
    if values.ndim not in (1, 2) or len(values) != len(q):
        raise InputError(
            f"the virtual vector {name} must return ({len(q)},) or ({len(q)}, k),"
            f" got {values.shape}"
        )
    if not np.isfinite(values).all():
        raise InputError(f"the virtual vector {name} must return finite values, got NaN or inf")
    return values.reshape(len(q), -1)


def _joint(robot: Robot, kind: str) -> int:
    name = kind.removeprefix(JOINT)
    if name not in robot.joint_names:
        raise InputError(
            f"virtual vector {kind!r}: robot {robot.name!r} has no free joint {name!r};"
            f" it has {', '.join(robot.joint_names)}"
        )
    return robot.joint_names.index(name)


# ---------------------------------------------------------------------------- planar arms
def _of_angle(kind: str, angle: Array) -> Array:
    columns = {"angle_sum": (angle,), "cos": (np.cos(angle),)}
    return np.column_stack(columns.get(kind, (np.cos(angle), np.sin(angle))))


def _angle_sum(robot: Robot, kind: str, q: Array) -> Array:
    weight, offset = _weights(robot, _common_axis(robot, kind)[1])
    return np.asarray(q @ weight + offset)


def _common_axis(robot: Robot, kind: str) -> tuple[Array, Array]:
    """Direction (3,) of the first turning joint, and how each moving joint counts: +-1, 0."""
    direction = axis_lines(robot.frames, robot.kinds).direction
    turns = np.array([letter == "R" for letter in robot.kinds])
    if not turns.any():
        raise InputError(f"virtual vector {kind!r}: {robot.name!r} has no turning joint")
    first = int(np.argmax(turns))
    across = np.linalg.norm(np.cross(direction, direction[first]), axis=1)
    if (across[turns] > PARALLEL).any():
        raise InputError(
            f"virtual vector {kind!r} needs turning axes that are all parallel: in {robot.name!r}"
            f" joint {int(np.argmax(turns & (across > PARALLEL))) + 1} is not parallel to joint"
            f" {first + 1}"
        )
    return direction[first], np.where(turns, np.sign(direction @ direction[first]), 0.0)


def _weights(robot: Robot, sign: Array) -> tuple[Array, float]:
    """The sum of the turns as ``q @ weight + offset``: mimic joints turn too."""
    weight = np.zeros(robot.dof)
    np.add.at(weight, robot.source, sign * robot.multiplier)
    return weight, float(sign @ robot.offset)


# ---------------------------------------------------------------------------- arm angle
def _arm_angle(robot: Robot, q: Array) -> Array:
    """Cosine and sine (M, 2); shoulder, wrist and axis 4 by forward kinematics and Jacobian."""
    shoulder, wrist_in_tool, axis1 = _spherical_ends(robot)
    T, J = robot.fk(q), robot.jacobian(q)[..., 3]
    axis4 = J[:, 3:] / np.linalg.norm(J[:, 3:], axis=1, keepdims=True)
    # the column's linear part is axis x lever: it leads from the tool point to the axis
    speed = J[:, :3] / np.linalg.norm(J[:, 3:], axis=1, keepdims=True)
    elbow = T[:, :3, 3] - np.cross(speed, axis4)
    wrist = T[:, :3, :3] @ wrist_in_tool[:3] + T[:, :3, 3]
    line = wrist - shoulder
    length = np.linalg.norm(line, axis=1, keepdims=True)
    line /= np.where(length == 0.0, 1.0, length)  # folded up: no line, and finite all the same
    side = np.cross(axis4, line)
    side *= np.where(((elbow - shoulder) * side).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    up = axis1 - line * (line @ axis1)[:, None]
    c, s = (up * side).sum(axis=1), (np.cross(line, up) * side).sum(axis=1)
    angle = np.arctan2(s, c)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _spherical_ends(robot: Robot) -> tuple[Array, Array, Array]:
    """The shoulder (3,) in the base, the wrist (4,) in the tool frame, the direction of axis 1."""
    why = f"virtual vector {ARM_ANGLE!r} needs seven turning joints"
    if robot.kinds != "R" * 7 or robot.dof != 7:
        raise InputError(f"{why}, none of them a mimic: {robot.name!r} has {robot.kinds}")
    lines = axis_lines(robot.frames, robot.kinds)
    triples = {triple.joints: triple for triple in meeting_triples(lines, robot.kinds)}
    meet = [pair.relation == "meet" for pair in axis_pairs(lines, robot.kinds)]
    for joints, part in (((0, 1, 2), "shoulder"), ((4, 5, 6), "wrist")):
        if joints not in triples or not (meet[joints[0]] and meet[joints[1]]):
            numbers = ", ".join(str(joint + 1) for joint in joints)
            raise InputError(
                f"{why} with a spherical shoulder and wrist: of {robot.name!r} axes {numbers}"
                f" ({part}) do not meet in one point; hold a joint instead, by {JOINT}NAME"
            )
    shoulder, wrist = np.array(triples[0, 1, 2].point), np.array(triples[4, 5, 6].point)
    for point, part in ((shoulder, "shoulder"), (wrist, "wrist")):
        if np.linalg.norm(np.cross(lines.direction[3], point - lines.point[3])) < (
            PARALLEL * lines.size
        ):
            raise InputError(f"{why}: axis 4 of {robot.name!r} goes through its {part}")
    in_tool = se3.inverse(lines.T_zero) @ np.append(wrist, 1.0)
    return shoulder, in_tool, lines.direction[0]

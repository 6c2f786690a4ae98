"""Arms with seven joints: what the free parameter is, and the form that solves at a value of it.

Holding the last (or first) joint leaves an arm of six joints that does not depend on the value:
only its target does. Holding a joint between them leaves another arm for each value. Where the
first three axes meet and the last three meet, the arm angle serves all branches alike: the angle of
the elbow about the line from shoulder to wrist, 0 where the elbow lies in the plane of axis 1 and
that line, on the side axis 1 points to (Shimizu et al., IEEE Trans. Robotics 24(5), 2008, with
another reference).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError, NoClosedForm
from kinverse.geometry import PARALLEL, Links, axis_lines, links_between
from kinverse.robot import Robot
from kinverse.solvers.closed_form.families import ClosedFormSpec, Family, Regional, closed_form_spec
from kinverse.solvers.closed_form.held import end_removed

__all__ = ["ARM_ANGLE", "RedundantForm", "arm_angle", "redundant_form"]

Array = NDArray[np.float64]

ARM_ANGLE = "arm_angle"
FIRST, LAST, ANGLE = range(3)  # FreeParameter of the core
DOF = 7


@dataclass(frozen=True)
class RedundantForm:
    """How an arm with seven joints is solved at a value of its free parameter.

    Attributes:
        redundancy: index of the joint held, or "arm_angle".
        parameter: the core's number for it; None before a general arm, and for an inner joint.
        spec: the arm that remains (six rows), or all seven rows for the arm angle; None if it
            depends on the value.
        before: (4, 4) fixed transform in front of the joint held.
        behind: (4, 4) fixed transform behind it.
        branch_labels: names of the branch numbers.
        lasting: whether a branch number means the same at neighbouring values.
        perpendicular: whether the axes of shoulder and of wrist stand at right angles, exactly.
        elbow_side: +-1, the side of axis 4 the elbow is on in the branch elbow+.
    """

    redundancy: int | str
    parameter: int | None
    spec: ClosedFormSpec | None
    before: Array
    behind: Array
    branch_labels: tuple[str, ...]
    perpendicular: tuple[bool, bool] = (False, False)
    elbow_side: float = 1.0
    lasting: bool = True


def redundant_form(robot: Robot, redundancy: int | str | None) -> RedundantForm:
    """The form of a robot with seven joints.

    Args:
        robot: seven joints, none of them a mimic.
        redundancy: a joint (index or name) or "arm_angle"; None chooses: the arm angle if shoulder
            and wrist are spherical, else the last or first joint if the arm that remains is of a
            family with quadratic equations, else the joint nearest the tool of which this is true,
            else the last joint. Of an arm with slides a slide is preferred, such as its rail.

    Raises:
        InputError: no such joint or name, or an arm angle for an arm without one.
        NoClosedForm: a joint is a mimic.
    """
    plain = np.array_equal(robot.source, np.arange(DOF)) and len(robot.kinds) == DOF
    if not (plain and (robot.multiplier == 1.0).all() and (robot.offset == 0.0).all()):
        raise NoClosedForm(
            f"{robot.name} ({robot.kinds}): seven joints have a closed form here if none is a"
            " mimic; use Numerical"
        )
    if redundancy is None:
        return _chosen(robot) if "P" not in robot.kinds else _chosen_with_slides(robot)
    if redundancy == ARM_ANGLE:
        form = _arm_angle_form(robot)
        if form is None:
            raise InputError(
                f"redundancy 'arm_angle' needs a spherical shoulder and wrist: of {robot.name} axes"
                " 1, 2, 3 or 5, 6, 7 do not meet; name a joint instead:"
                f" {', '.join(robot.joint_names)} (or 0 to 6)"
            )
        return form
    return _joint_form(robot, _joint(robot, redundancy))


def arm_angle(robot: Robot, form: RedundantForm, q: Array) -> Array:
    """The arm angle (N,) of joint values q (N, 7)."""
    links = form.spec.links if form.spec else links_between(axis_lines(robot.frames, robot.kinds))
    theta = links.sign * q + links.offset
    R = np.eye(3)
    rotation = np.broadcast_to(R, (len(q), 3, 3))
    for i in range(3):
        rotation = rotation @ _rot_z(theta[:, i])
        if i < 2:
            rotation = rotation @ _rot_x(links.cos_alpha[i], links.sin_alpha[i])
    v, axis, bend = _elbow(links, theta[:, 3])
    line = v / np.linalg.norm(v, axis=1, keepdims=True)
    side = form.elbow_side * np.where(bend < 0, -1.0, 1.0)[:, None]
    y = side * (axis - line * (line @ axis)[:, None])
    x = np.einsum("nij,nj->ni", rotation, np.cross(y, line))
    n = np.einsum("nij,nj->ni", rotation, line)
    across = np.hypot(n[:, 0], n[:, 1])
    on_axis = across < 1e-14
    c = np.where(on_axis, 1.0, n[:, 0]) / np.where(on_axis, 1.0, across)
    s = np.where(on_axis, 0.0, n[:, 1]) / np.where(on_axis, 1.0, across)
    up = np.column_stack([-n[:, 2] * c, -n[:, 2] * s, across])
    level = np.column_stack([s, -c, np.zeros(len(q))])
    return np.asarray(np.arctan2((level * x).sum(axis=1), (up * x).sum(axis=1)))


def _joint(robot: Robot, redundancy: int | str) -> int:
    names = ", ".join(robot.joint_names)
    if isinstance(redundancy, str) and redundancy in robot.joint_names:
        return robot.joint_names.index(redundancy)
    number = isinstance(redundancy, (int, np.integer)) and not isinstance(redundancy, bool)
    if number and 0 <= int(redundancy) < DOF:
        return int(redundancy)
    raise InputError(
        f"redundancy must be a joint of {robot.name} ({names}, or 0 to 6), 'arm_angle' or None,"
        f" got {redundancy!r}"
    )


def _chosen(robot: Robot) -> RedundantForm:
    arm_angle_form = _arm_angle_form(robot)
    if arm_angle_form is not None:
        return arm_angle_form
    last = _end_joint_form(robot, DOF - 1)
    if last.lasting:
        return last
    first = _end_joint_form(robot, 0)
    if first.lasting:
        return first
    for joint in reversed(range(1, DOF - 1)):
        form = _inner_joint_form(robot, joint)
        if form.lasting:
            return form
    return last


def _chosen_with_slides(robot: Robot) -> RedundantForm:
    """A slide, at an end if there is one, that leaves an arm of a family; else an end joint."""
    ends = (0, DOF - 1)
    slides = [joint for joint in range(DOF) if robot.kinds[joint] == "P"]
    order = sorted({*slides, *ends}, key=lambda j: (j not in slides, j not in ends, j))
    forms = [_joint_form(robot, joint) for joint in order]
    return next((form for form in forms if form.lasting), forms[0])


def _joint_form(robot: Robot, joint: int) -> RedundantForm:
    return (_end_joint_form if joint in (0, DOF - 1) else _inner_joint_form)(robot, joint)


def _end_joint_form(robot: Robot, joint: int) -> RedundantForm:
    """The joint held, and one arm for all its values: what moves is the target."""
    spec = closed_form_spec(end_removed(robot, joint))
    lasting = spec.family is not Family.GENERAL_6R
    # the native sweep turns; slides are held one value at a time
    is_native = lasting and "P" not in robot.kinds
    parameter = (LAST if joint else FIRST) if is_native else None
    before, behind = robot.frames[joint], robot.frames[joint + 1]
    labels = spec.branch_labels
    return RedundantForm(joint, parameter, spec, before, behind, labels, lasting=lasting)


def _inner_joint_form(robot: Robot, joint: int) -> RedundantForm:
    """The joint held, and another arm for each value; tried at two that mean nothing to any arm."""
    low, high = robot.limits[joint]
    for share in (0.3819660113, 0.7320508076):
        spec = closed_form_spec(robot.locked({joint: low + share * (high - low)}))
        lasting = spec.family is not Family.GENERAL_6R
        if not lasting:
            break
    one = np.eye(4)
    return RedundantForm(joint, None, None, one, one, spec.branch_labels, lasting=lasting)


def _arm_angle_form(robot: Robot) -> RedundantForm | None:
    if "P" in robot.kinds:
        return None
    lines = axis_lines(robot.frames, robot.kinds)
    links = links_between(lines)
    tiny = PARALLEL * lines.size
    a, d = np.abs(links.a), np.abs(links.d)
    twisted = np.abs(links.sin_alpha) >= PARALLEL
    shoulder = a[0] < tiny and a[1] < tiny and d[1] < tiny and twisted[0] and twisted[1]
    wrist = a[4] < tiny and a[5] < tiny and d[5] < tiny and twisted[4] and twisted[5]
    if not (shoulder and wrist):
        return None
    # axis 4 through the shoulder or the wrist: bending it does not change their distance
    upper = np.hypot(links.a[2], links.d[2] * links.sin_alpha[2])
    fore = np.hypot(links.a[3], links.d[4] * links.sin_alpha[3])
    if min(upper, fore) < tiny:
        return None
    c = np.abs(links.cos_alpha) < 1e-14
    order = np.arange(DOF, dtype=np.int32)
    spec = ClosedFormSpec(
        Family.SPHERICAL_WRIST, Regional.PARALLEL_23, False, links, order, lines.size
    )
    if not spec.fits(robot):
        return None
    return RedundantForm(
        ARM_ANGLE,
        ANGLE,
        spec,
        np.eye(4),
        np.eye(4),
        spec.branch_labels,
        (bool(c[0] and c[1]), bool(c[4] and c[5])),
        _elbow_side(links),
    )


def _elbow(links: Links, theta: Array) -> tuple[Array, Array, Array]:
    """Shoulder to wrist (N, 3) and axis 4 (3,) behind joint 3, and the sign of the elbow's root."""
    f, g = _forearm(links), _upper_arm(links)
    v = np.einsum("nij,j->ni", _rot_x(links.cos_alpha[2], links.sin_alpha[2]) @ _rot_z(theta), f)
    v = v + np.array([links.a[2], 0.0, links.d[2]])
    axis = np.array([0.0, -links.sin_alpha[2], links.cos_alpha[2]])
    along, across = g[0] * f[0] + g[1] * f[1], g[1] * f[0] - g[0] * f[1]
    return v, axis, along * np.sin(theta) - across * np.cos(theta)


def _forearm(links: Links) -> Array:
    s, c = links.sin_alpha[3], links.cos_alpha[3]
    return np.array([links.a[3], -links.d[4] * s, links.d[3] + links.d[4] * c])


def _upper_arm(links: Links) -> Array:
    s, c = links.sin_alpha[2], links.cos_alpha[2]
    return np.array([links.a[2], links.d[2] * s, links.d[2] * c])


def _elbow_side(links: Links) -> float:
    """The sign that puts the elbow at the arm angle, in the branch elbow+ and half bent."""
    f, g = _forearm(links), _upper_arm(links)
    along, across = g[0] * f[0] + g[1] * f[1], g[1] * f[0] - g[0] * f[1]
    v, axis, _ = _elbow(links, np.array([np.arctan2(along, -across)]))
    elbow = np.array([links.a[2], 0.0, links.d[2]])
    return 1.0 if np.cross(axis, v[0]) @ elbow >= 0 else -1.0


def _rot_z(angle: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    return np.asarray(np.moveaxis(np.array(rows), -1, 0))


def _rot_x(c: float, s: float) -> Array:
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])

"""What kind of arm a robot is: how it can be solved, and where it stands in the usual classes.

Classes by degrees of freedom, motion and regional structure follow the thesis of Jha (NIT Rourkela
2015), sections 1.3.2 to 1.3.6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.axes import (
    AxisMeeting,
    AxisPair,
    axis_pairs,
    meeting_triples,
    nearest_point,
    parallel_runs,
)
from kinverse.errors import NoClosedForm
from kinverse.geometry import PARALLEL, AxisLines, axis_lines
from kinverse.regional import RegionalStructure, regional_structure
from kinverse.robot import Robot
from kinverse.singular_search import found_singularities
from kinverse.singularities import Singularity, seven_joint_singularity, singularities
from kinverse.solvers.closed_form.families import ClosedFormSpec, closed_form_spec
from kinverse.solvers.closed_form.redundant import ARM_ANGLE, redundant_form
from kinverse.solvers.registry import AUTO_CLOSED_FORM_DOF

__all__ = ["RobotClass", "robot_class"]

Array = NDArray[np.float64]

HYPER = 3
"""Joints beyond the task from which an arm counts as hyper-redundant; the thesis (1.3.2 b) still
calls arms of seven or eight joints redundant."""

BOUNDS = {0: 16, 1: 16, 2: 8, 3: 2}
"""Most branches of a six-joint chain by its number of slides (Raghavan & Roth, J. Mechanical Design
115, 1993); a chain of fewer joints is one of these with joints held."""


@dataclass(frozen=True)
class RobotClass:
    """The classes of an arm. Joint indices count from 0; words count axes from 1.

    Attributes:
        name: the robot's name.
        family: the closed form's family in words, or None.
        why_no_family: the reason where there is none.
        free_parameter: what ``Analytic`` holds to give every branch of a seven-joint arm: "the arm
            angle" or a joint's name; None where there is no such form.
        auto: the solver that "auto" asks first for a full pose.
        pairs: neighbouring axes.
        meetings: three neighbouring axes through one point.
        parallel: groups of three or more revolute joints that stay parallel.
        max_branches: the greatest number of isolated solutions of a full pose, limits ignored; an
            upper bound where there is no closed form; None: infinitely many, or no general bound.
        singularities: conditions; all there are by the closed form's family, or kinds that a search
            found, as the text then says; empty where there is none in words.
        singularities_text: what else is to say about them.
        mobility: degrees of freedom by Grübler's formula (1.2).
        rank: largest rank of the Jacobian: independent directions of tool motion.
        redundancy: "deficient", "general", "redundant" or "hyper-redundant".
        motion: "planar", "spherical" or "spatial".
        regional: structure, workspace and axes of the joints that place the wrist.
        wrist_joints: the joints behind them.
        wrist: what kind of wrist they make.
    """

    name: str
    family: str | None
    why_no_family: str
    free_parameter: str | None
    auto: str
    pairs: tuple[AxisPair, ...]
    meetings: tuple[AxisMeeting, ...]
    parallel: tuple[tuple[int, ...], ...]
    max_branches: int | None
    singularities: tuple[Singularity, ...]
    singularities_text: str
    mobility: int
    rank: int
    redundancy: str
    motion: str
    regional: RegionalStructure
    wrist_joints: tuple[int, ...]
    wrist: str


def robot_class(robot: Robot) -> RobotClass:
    """Look at an arm's axes and say what it is.

    Args:
        robot: any chain. Axes are compared as they are built: a mimic joint ties joints together
            and leaves their axes in place.

    Example:
        >>> robot_class(kv.load("ur5")).max_branches
        8
    """
    lines = axis_lines(robot.frames, robot.kinds)
    spec, reason = _spec(robot)
    rank = _rank(robot, lines)
    meetings = meeting_triples(lines, robot.kinds)
    first = regional_structure(lines, robot.kinds)
    behind = _wrist_joints(robot, meetings, len(first.joints))
    known = _singularities(robot, spec, meetings)
    found = () if known or not _free(robot) else found_singularities(robot, rank, lines.size)
    free = _free_parameter(robot)
    if free is not None:
        reason = f"seven joints are of no family: Analytic solves them at a value of {free}"
    return RobotClass(
        name=robot.name,
        family=_family(spec) if spec else None,
        why_no_family=reason,
        free_parameter=free,
        auto="Analytic" if spec and robot.dof <= AUTO_CLOSED_FORM_DOF else "Numerical",
        pairs=axis_pairs(lines, robot.kinds),
        meetings=meetings,
        parallel=parallel_runs(lines, robot.kinds),
        max_branches=_max_branches(robot, spec, rank, meetings),
        singularities=known or found,
        singularities_text=_singularities_text(robot, rank, bool(known), bool(found)),
        mobility=_mobility(robot, _motion(lines, robot.kinds)),
        rank=rank,
        redundancy=_redundancy(robot.dof, rank),
        motion=_motion(lines, robot.kinds),
        regional=first,
        wrist_joints=behind,
        wrist=_wrist(lines, robot.kinds, behind, meetings),
    )


def _spec(robot: Robot) -> tuple[ClosedFormSpec | None, str]:
    try:
        return closed_form_spec(robot), ""
    except NoClosedForm as reason:
        return None, str(reason)


def _free_parameter(robot: Robot) -> str | None:
    if robot.dof != 7:
        return None
    try:
        held = redundant_form(robot, None).redundancy
    except NoClosedForm:
        return None
    return "the arm angle" if held == ARM_ANGLE else robot.joint_names[int(held)]


def _family(spec: ClosedFormSpec) -> str:
    words = spec.family.name.lower().replace("_", " ")
    return f"{words}, seen from the tool" if spec.is_reversed else words


def _rank(robot: Robot, lines: AxisLines) -> int:
    """Largest rank over generic postures, limits ignored: a singular one is met by chance only."""
    # fractions of the golden ratio: as good as random, and the same each time
    q = np.mod(np.outer(np.arange(1, 9), np.arange(1, robot.dof + 1)) * 0.6180339887, 1.0) * 4 - 2
    J = robot.jacobian(q)
    J[..., :3, :] /= lines.size
    J = J / np.maximum(np.linalg.norm(J, axis=-2, keepdims=True), 1e-300)
    values = np.linalg.svd(J, compute_uv=False)
    return int((values > 1e-7).sum(axis=-1).max())


def _mobility(robot: Robot, motion: str) -> int:
    """``lambda (N - J - 1) + sum F``, less one for each joint that must follow another."""
    joints = len(robot.kinds)
    links = joints + 1
    space = 6 if motion == "spatial" else 3
    return space * (links - joints - 1) + joints - (joints - robot.dof)


def _redundancy(dof: int, rank: int) -> str:
    if dof - rank >= HYPER:
        return "hyper-redundant"
    if dof > rank:
        return "redundant"
    return "general" if rank == 6 else "deficient"


def _motion(lines: AxisLines, kinds: str) -> str:
    turning = np.array([kind == "R" for kind in kinds])
    turns, slides = lines.direction[turning], lines.direction[~turning]
    if not len(turns):
        return "planar" if np.linalg.matrix_rank(slides, tol=PARALLEL) < 3 else "spatial"
    parallel = np.linalg.norm(np.cross(turns, turns[0]), axis=1).max() < PARALLEL
    if parallel and np.abs(slides @ turns[0]).max(initial=0.0) < PARALLEL:
        return "planar"
    if not len(slides):
        _, distance = nearest_point(turns, lines.point)
        if distance < PARALLEL * lines.size:
            return "spherical"
    return "spatial"


def _max_branches(
    robot: Robot, spec: ClosedFormSpec | None, rank: int, meetings: tuple[AxisMeeting, ...]
) -> int | None:
    if robot.dof > rank or len(robot.kinds) != robot.dof:
        return None
    if spec is not None:
        return min(len(spec.branch_labels), BOUNDS[robot.kinds.count("P")])
    spherical = any(meeting.joints in ((0, 1, 2), (3, 4, 5)) for meeting in meetings)
    if robot.kinds == "RRRRRR" and spherical:
        return 8  # Pieper 1968: four ways to place the wrist centre, two to turn the hand
    return BOUNDS.get(robot.kinds.count("P"))


def _singularities(
    robot: Robot, spec: ClosedFormSpec | None, meetings: tuple[AxisMeeting, ...]
) -> tuple[Singularity, ...]:
    if spec is not None:
        return singularities(spec)
    ends = {meeting.joints for meeting in meetings}
    if robot.kinds == "RRRRRRR" and robot.dof == 7 and {(0, 1, 2), (4, 5, 6)} <= ends:
        return (seven_joint_singularity(),)
    return ()


def _free(robot: Robot) -> bool:
    """Whether every joint moves on its own."""
    own = np.arange(len(robot.kinds))
    return (
        robot.dof == len(own)
        and not (robot.source != own).any()
        and bool((robot.multiplier == 1).all())
    )


def _singularities_text(robot: Robot, rank: int, known: bool, found: bool) -> str:
    if found:
        return "these kinds were met in a search, limits ignored; there may be more"
    if robot.dof > rank:
        also = "also " if known else ""
        return f"{also}where the {robot.dof} joint screws span less than {rank} dimensions"
    if not known:
        complex_ = " (they belong to one linear complex)" if robot.dof == 6 else ""
        return f"where the {robot.dof} joint screws become linearly dependent{complex_}"
    if robot.dof == 5:
        return "branches of the first joints meet there; the Jacobian may keep its rank"
    return ""


def _wrist_joints(
    robot: Robot, meetings: tuple[AxisMeeting, ...], regional: int
) -> tuple[int, ...]:
    m = len(robot.kinds)
    last = (m - 3, m - 2, m - 1)
    if m > 6 and any(meeting.joints == last for meeting in meetings):
        return last
    return tuple(range(regional, m))


def _wrist(
    lines: AxisLines, kinds: str, joints: tuple[int, ...], meetings: tuple[AxisMeeting, ...]
) -> str:
    if not joints:
        return "none"
    names = ", ".join(str(joint + 1) for joint in joints)
    if "P" in (kinds[joint] for joint in joints):
        return f"axes {names}, with a slide among them"
    if len(joints) == 1:
        return f"one axis, {names}"
    point, distance = nearest_point(lines.direction[list(joints)], lines.point[list(joints)])
    square = all(abs(lines.direction[i] @ lines.direction[i + 1]) < PARALLEL for i in joints[:-1])
    corners = ", neighbours square to each other" if square else ""
    if distance < PARALLEL * lines.size:
        kind = "spherical: " if len(joints) == 3 else ""
        return f"{kind}axes {names} meet in one point{corners}"
    return f"offset: axes {names} do not meet in one point{corners}"

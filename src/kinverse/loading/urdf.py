"""URDF: the chain between two links of a tree of joints."""

import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import ModelError
from kinverse.loading.chain import Moving, assemble
from kinverse.loading.text import choices, numbers
from kinverse.loading.tree import path_between
from kinverse.robot import Robot

__all__ = ["read_urdf"]

Array = NDArray[np.float64]

MOVING = {"revolute": "R", "continuous": "R", "prismatic": "P"}
REFUSED = ("floating", "planar", "spherical")
TYPES = ("fixed", *MOVING, *REFUSED)


@dataclass(frozen=True)
class Joint:
    """One <joint>: its numbers are read only if it lies in the chain asked for."""

    name: str
    type: str
    parent: str
    child: str
    element: Element
    where: str


def read_urdf(root: Element, where: str, stem: str, base: str | None, tip: str | None) -> Robot:
    """The robot between two links of a URDF.

    Meshes, <transmission>, <gazebo> and everything else without influence on kinematics are
    ignored.

    Args:
        root: the <robot> element.
        where: the file, for messages.
        stem: the robot's name if the file gives none.
        base: first link; None: the root of the tree.
        tip: last link; None: the only leaf below base.

    Raises:
        ModelError: anything that does not make a chain of revolute, continuous, prismatic and
            fixed joints; names the joint or link.
    """
    links = _links(root, where)
    joints = _joints(root, links, where)
    above: dict[str, Joint] = {}
    for joint in joints.values():
        if joint.child in above:
            first = above[joint.child].name
            raise ModelError(
                f"{where}: link {joint.child!r} is the child of two joints, {first!r} and"
                f" {joint.name!r}: closed chains are not supported"
            )
        above[joint.child] = joint
    parents = {link: above[link].parent if link in above else None for link in links}
    chain = [above[link] for link in path_between(parents, base, tip, where, "link")]

    moving: list[Moving] = []
    before = np.eye(4)
    for joint in chain:
        before = before @ _origin(joint)
        if joint.type == "fixed":
            continue
        if joint.type in REFUSED:
            raise ModelError(
                f"{joint.where} has type {joint.type!r}: only {', '.join(MOVING)} and fixed joints"
                f" can be in the chain"
            )
        driver, multiplier, offset = _drive(joint, joints)
        kind = MOVING[joint.type]
        axis = _axis(joint)
        if driver is None:
            # the value is constant: the joint is as good as fixed
            before = before @ _held(kind, axis, offset)
            continue
        if driver not in {other.name for other in chain}:
            raise ModelError(
                f"{joint.where} mimics {driver!r}, which moves but is not in the chain;"
                f" the chain has {', '.join(other.name for other in chain)}"
            )
        own = driver == joint.name
        moving.append(
            Moving(
                joint.name,
                kind,
                before,
                axis,
                _limits(joint),
                None if own else driver,
                multiplier,
                offset,
            )
        )
        before = np.eye(4)
    ends = f"{chain[0].parent} to {chain[-1].child}" if chain else "an empty chain"
    name = root.get("name") or stem
    return assemble(moving, before, where, name, f"URDF {where}, {ends}")


def _links(root: Element, where: str) -> list[str]:
    links: list[str] = []
    for element in root.findall("link"):
        name = element.get("name")
        if not name:
            raise ModelError(f"{where}: link number {len(links) + 1} has no name")
        if name in links:
            raise ModelError(f"{where}: two links are named {name!r}")
        links.append(name)
    if not links:
        xacro = any("xacro" in element.tag for element in root.iter())
        hint = "; it looks like xacro: expand it to URDF first" if xacro else ""
        raise ModelError(f"{where}: the file holds no <link>{hint}")
    return links


def _joints(root: Element, links: list[str], where: str) -> dict[str, Joint]:
    joints: dict[str, Joint] = {}
    known = set(links)
    for element in root.findall("joint"):
        name = element.get("name")
        if not name:
            raise ModelError(f"{where}: joint number {len(joints) + 1} has no name")
        here = f"{where}: joint {name!r}"
        if name in joints:
            raise ModelError(f"{where}: two joints are named {name!r}")
        kind = element.get("type", "")
        if kind not in TYPES:
            raise ModelError(f"{here} has unknown type {kind!r}; {choices(kind, TYPES)}")
        ends = []
        for tag in ("parent", "child"):
            end = element.find(tag)
            link = None if end is None else end.get("link")
            if link is None:
                raise ModelError(f'{here} has no <{tag} link="...">')
            if link not in known:
                raise ModelError(
                    f"{here} has {tag} {link!r}, but no such link; {choices(link, links, 'links')}"
                )
            ends.append(link)
        joints[name] = Joint(name, kind, ends[0], ends[1], element, here)
    return joints


def _numbers(joint: Joint, tag: str, attribute: str, default: str, count: int) -> list[float]:
    element = joint.element.find(tag)
    text = default if element is None else element.get(attribute, default)
    return numbers(text, count, f"{joint.where}, <{tag} {attribute}>")


def _origin(joint: Joint) -> Array:
    rpy = _numbers(joint, "origin", "rpy", "0 0 0", 3)
    return se3.transform(se3.rotation_from_rpy(rpy), _numbers(joint, "origin", "xyz", "0 0 0", 3))


def _axis(joint: Joint) -> list[float]:
    axis = _numbers(joint, "axis", "xyz", "1 0 0", 3)
    if not any(axis):
        raise ModelError(f"{joint.where} has the axis 0 0 0")
    return axis


def _limits(joint: Joint) -> tuple[float, float]:
    if joint.type == "continuous":
        return -math.pi, math.pi
    if joint.element.find("limit") is None:
        raise ModelError(f"{joint.where} is {joint.type} and needs <limit lower= upper=>")
    (low,) = _numbers(joint, "limit", "lower", "0", 1)
    (high,) = _numbers(joint, "limit", "upper", "0", 1)
    if low > high:
        raise ModelError(f"{joint.where} has limits upside down: {low:g} > {high:g}")
    return low, high


def _drive(joint: Joint, joints: dict[str, Joint]) -> tuple[str | None, float, float]:
    """Follow <mimic> to (driving joint, multiplier, offset); no driver: the value is constant."""
    multiplier, offset, seen = 1.0, 0.0, [joint.name]
    while True:
        mimic = joint.element.find("mimic")
        if joint.type == "fixed":
            return None, 0.0, offset
        if mimic is None:
            break
        (m,) = _numbers(joint, "mimic", "multiplier", "1", 1)
        (o,) = _numbers(joint, "mimic", "offset", "0", 1)
        multiplier, offset = multiplier * m, multiplier * o + offset
        target = mimic.get("joint", "")
        if target not in joints:
            raise ModelError(
                f"{joint.where} mimics {target!r}, but no such joint;"
                f" {choices(target, joints, 'joints')}"
            )
        if target in seen:
            raise ModelError(f"{joint.where}: mimic goes in a circle: {' -> '.join(seen)}")
        seen.append(target)
        joint = joints[target]
    if multiplier == 0.0:
        return None, 0.0, offset
    if len(seen) > 1 and joint.type in ("revolute", "prismatic"):
        low, high = _limits(joint)
        if low == high:
            return None, 0.0, multiplier * low + offset
    return joint.name, multiplier, offset


def _held(kind: str, axis: list[float], value: float) -> Array:
    if kind == "R":
        return se3.transform(se3.rotation_from_axis(axis, value))
    return se3.transform(None, np.asarray(axis) / np.linalg.norm(axis) * value)

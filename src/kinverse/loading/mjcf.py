"""MJCF: the chain between two bodies, or a body and a site, of a MuJoCo model.

Of the format we read what decides kinematics: <compiler>, <default>, <include> and, inside
<worldbody>, <body>, <frame>, <joint>, <freejoint> and <site>. Elements that would change the chain
and are not read (<replicate>, <attach>, equality constraints on its joints, ...) are refused by
name; geometry, actuators, sensors and keyframes are ignored.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.dh import motion
from kinverse.errors import ModelError
from kinverse.loading.chain import Moving, assemble, z_to_axis
from kinverse.loading.mjcf_parts import Compiler, Defaults, placed, with_includes
from kinverse.loading.text import choices, numbers
from kinverse.loading.tree import path_between
from kinverse.robot import Robot

__all__ = ["read_mjcf"]

Array = NDArray[np.float64]

WORLD = "world"
REFUSED = ("replicate", "attach", "composite", "flexcomp")
MOVING = {"hinge": "R", "slide": "P"}
DEEPEST = 200
"""Nesting of bodies; deeper files are mistakes, and reading them would exhaust the stack."""


@dataclass
class Body:
    """One body, or a site, which is a body without joints for our purpose."""

    name: str
    parent: str | None
    placed: Array
    joints: list[dict[str, str]] = field(default_factory=list)
    site: bool = False


def read_mjcf(root: Element, path: Path, base: str | None, tip: str | None) -> Robot:
    """The robot between two bodies of an MJCF model.

    Args:
        root: the <mujoco> element.
        path: the file; included files must lie in its folder or below.
        base: first body; None: the world.
        tip: last body or site (``site:NAME`` or ``body:NAME`` where both exist); None: the only
            body without a body inside.

    Raises:
        ModelError: anything that does not make a chain of hinge and slide joints; names it.
    """
    root = with_includes(root, path)
    where = path.name
    compiler = Compiler.of(root, where)
    bodies = _Reader(compiler, Defaults.of(root, where), where).read(root)
    tip = _tip(bodies, tip, where)
    # a site is a leaf only if it is asked for
    parents = {key: body.parent for key, body in bodies.items() if not body.site or key == tip}
    keys = path_between(parents, base, tip, where, "body")
    chain = [bodies[key] for key in keys]
    _no_constraints(root, chain, where)

    moving: list[Moving] = []
    before = np.eye(4)
    for body in chain:
        before = before @ body.placed
        for number, attributes in enumerate(body.joints, start=1):
            name = attributes.get("name", f"{body.name}_joint{number}")
            joint, after = _joint(name, attributes, compiler, before, where)
            moving.append(joint)
            before = after
    ends = f"{base or WORLD} to {tip or (keys[-1] if keys else WORLD)}"
    name = root.get("model") or path.stem
    return assemble(moving, before, where, name, f"MJCF {where}, {ends}")


def _joint(
    name: str, attributes: dict[str, str], compiler: Compiler, before: Array, where: str
) -> tuple[Moving, Array]:
    """A joint and the fixed transform behind it (back from its anchor, its ref taken off)."""
    here = f"{where}: joint {name!r}"
    kind = attributes.get("type", "hinge")
    if kind not in MOVING:
        raise ModelError(
            f"{here} has type {kind!r}: only {' and '.join(MOVING)} joints can be in the chain;"
            f" choose a base= below it"
        )
    turns = kind == "hinge"
    axis = numbers(attributes.get("axis", "0 0 1"), 3, f"{here}, axis")
    if not any(axis):
        raise ModelError(f"{here} has the axis 0 0 0")
    anchor = se3.transform(None, numbers(attributes.get("pos", "0 0 0"), 3, f"{here}, pos"))
    (ref,) = numbers(attributes.get("ref", "0"), 1, f"{here}, ref")
    scale = compiler.angle if turns else 1.0
    # the model is drawn with every joint at its ref, so that the joint moves by q - ref
    turn = se3.transform(z_to_axis(axis))
    drawn = turn @ motion(MOVING[kind], -ref * scale) @ se3.inverse(turn)
    limits = _limits(attributes, turns, compiler, scale, here)
    joint = Moving(name, MOVING[kind], before @ anchor, axis, limits)
    return joint, drawn @ se3.inverse(anchor)


def _limits(
    attributes: dict[str, str], turns: bool, compiler: Compiler, scale: float, here: str
) -> tuple[float, float]:
    limited = attributes.get("limited", "auto")
    if limited not in ("true", "false", "auto"):
        raise ModelError(f"{here}: limited must be true, false or auto, got {limited!r}")
    if limited == "auto" and "range" in attributes:
        if not compiler.autolimits:
            raise ModelError(f"{here} has a range; with autolimits off it needs limited=")
        limited = "true"
    if limited == "true":
        if "range" not in attributes:
            raise ModelError(f"{here} is limited and has no range")
        low, high = numbers(attributes["range"], 2, f"{here}, range")
        if low > high:
            raise ModelError(f"{here} has limits upside down: {low:g} > {high:g}")
        return low * scale, high * scale
    if not turns:
        raise ModelError(f"{here} slides without limits: it needs range=")
    return -math.pi, math.pi


def _tip(bodies: dict[str, Body], tip: str | None, where: str) -> str | None:
    """The key of a tip given by name: sites are kept under ``site:NAME``."""
    if tip is None or tip.startswith("site:"):
        key = tip
    elif tip.startswith("body:"):
        key = tip.removeprefix("body:")
    elif f"site:{tip}" in bodies:
        if tip in bodies:
            raise ModelError(
                f"{where}: both a body and a site are named {tip!r}: use body:{tip} or site:{tip}"
            )
        key = f"site:{tip}"
    else:
        key = tip
    if key is not None and key not in bodies:
        raise ModelError(f"{where}: tip {tip!r} is no body or site; {choices(tip, bodies)}")
    return key


class _Reader:
    """Walks <worldbody> and lists its bodies and sites by name."""

    def __init__(self, compiler: Compiler, defaults: Defaults, where: str) -> None:
        self.compiler, self.defaults, self.where = compiler, defaults, where
        self.bodies = {WORLD: Body(WORLD, None, np.eye(4))}
        self.joint_names: set[str] = set()
        self.unnamed = 0

    def read(self, root: Element) -> dict[str, Body]:
        for worldbody in root.findall("worldbody"):
            self._inside(worldbody, WORLD, np.eye(4), None, 0)
        return self.bodies

    def _inside(
        self, element: Element, parent: str, placed_here: Array, childclass: str | None, depth: int
    ) -> None:
        if depth > DEEPEST:
            raise ModelError(f"{self.where}: bodies are nested more than {DEEPEST} deep")
        for part in element:
            if part.tag in REFUSED:
                raise ModelError(f"{self.where}: <{part.tag}> in body {parent!r} is not supported")
            if part.tag in ("body", "site", "frame"):
                here = f"{self.where}: {part.tag} {part.get('name', '')!r}"
                # a body's class concerns its content, its own placement has no default
                given = dict(part.attrib)
                if part.tag == "site":
                    given = self.defaults.apply("site", part, childclass, here)
                T = placed_here @ placed(given, self.compiler, here)
            if part.tag == "frame":
                inner = part.get("childclass", childclass)
                self._inside(part, parent, T, inner, depth + 1)
            elif part.tag == "site" and part.get("name"):
                self._add(Body(f"site:{part.get('name')}", parent, T, site=True))
            elif part.tag == "body":
                name = part.get("name") or self._new_name(parent)
                self._add(Body(name, parent, T))
                inner = part.get("childclass", childclass)
                self._inside(part, name, np.eye(4), inner, depth + 1)
            elif part.tag in ("joint", "freejoint"):
                self._joint(part, element, parent, childclass)

    def _joint(self, part: Element, element: Element, body: str, childclass: str | None) -> None:
        name = part.get("name", "")
        here = f"{self.where}: joint {name!r} of body {body!r}"
        if element.tag != "body":
            raise ModelError(f"{here} stands in <{element.tag}>, it must stand in a <body>")
        if name and name in self.joint_names:
            raise ModelError(f"{self.where}: two joints are named {name!r}")
        self.joint_names.add(name)
        if part.tag == "freejoint":
            attributes = {**part.attrib, "type": "free"}
        else:
            attributes = self.defaults.apply("joint", part, childclass, here)
        self.bodies[body].joints.append(attributes)

    def _new_name(self, parent: str) -> str:
        self.unnamed += 1
        return f"{parent}/unnamed{self.unnamed}"

    def _add(self, body: Body) -> None:
        if body.name in self.bodies:
            raise ModelError(f"{self.where}: two bodies or sites are named {body.name!r}")
        self.bodies[body.name] = body


def _no_constraints(root: Element, chain: list[Body], where: str) -> None:
    """Refuse equality constraints that tie a body or joint of the chain to anything."""
    bodies = {body.name for body in chain}
    joints = {joint["name"] for body in chain for joint in body.joints if "name" in joint}
    tendons = {
        tendon.get("name"): {part.get("joint") for part in tendon}
        for section in root.findall("tendon")
        for tendon in section
    }
    sites = {
        site.get("name"): body.get("name")
        for body in root.iter("body")
        for site in body.findall("site")
    }
    for section in root.findall("equality"):
        for constraint in section:
            if constraint.get("active", "true") == "false":
                continue
            given = constraint.attrib
            tied = {given.get("joint1"), given.get("joint2")} & joints
            for key in ("tendon1", "tendon2"):
                tied |= tendons.get(given.get(key), set()) & joints
            for key in ("site1", "site2"):
                tied |= {sites.get(given.get(key))} & bodies
            tied |= {given.get("body1"), given.get("body2")} & bodies
            if tied:
                raise ModelError(
                    f"{where}: the equality constraint <{constraint.tag}> ties"
                    f" {', '.join(sorted(map(str, tied)))}, which the chain needs free;"
                    f" such constraints are not supported"
                )

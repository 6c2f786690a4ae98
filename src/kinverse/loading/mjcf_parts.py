"""MJCF beside the tree of bodies: <compiler>, <default>, <include> and placements."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import ModelError
from kinverse.loading.text import choices, numbers, parse_xml, read_bytes

__all__ = ["Compiler", "Defaults", "placed", "with_includes"]

Array = NDArray[np.float64]

DEEPEST = 200
ROTATIONS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}


@dataclass(frozen=True)
class Compiler:
    """The settings of <compiler> that matter: radians per angle unit, sequence, limits."""

    angle: float = math.pi / 180.0
    eulerseq: str = "xyz"
    autolimits: bool = True

    @classmethod
    def of(cls, root: Element, where: str) -> "Compiler":
        """Read all <compiler> elements; later ones win, as in MuJoCo."""
        given: dict[str, str] = {}
        for element in root.findall("compiler"):
            given.update(element.attrib)
        for key, valid in (
            ("angle", ("degree", "radian")),
            ("autolimits", ("true", "false")),
            ("coordinate", ("local",)),
        ):
            if given.get(key, valid[0]) not in valid:
                raise ModelError(
                    f"{where}: compiler {key}={given[key]!r} is not supported;"
                    f" valid: {', '.join(valid)}"
                )
        seq = given.get("eulerseq", "xyz")
        if len(seq) != 3 or set(seq) - set("xyzXYZ"):
            raise ModelError(f"{where}: compiler eulerseq={seq!r} must be three of xyzXYZ")
        unit = 1.0 if given.get("angle") == "radian" else math.pi / 180.0
        return cls(unit, seq, given.get("autolimits", "true") == "true")


class Defaults:
    """Attributes that <default> classes give to joints and sites."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}

    @classmethod
    def of(cls, root: Element, where: str) -> "Defaults":
        """Read all <default> sections; a nested class starts as a copy of the one around it."""
        self = cls(where)
        for element in root.findall("default"):
            self._read(element, "main", None, 0)
        return self

    def _read(self, element: Element, name: str, around: str | None, depth: int) -> None:
        if depth > DEEPEST:
            raise ModelError(f"{self.where}: defaults are nested more than {DEEPEST} deep")
        if around is not None:
            if name in self.classes:
                raise ModelError(f"{self.where}: two default classes are named {name!r}")
            self.classes[name] = {tag: dict(v) for tag, v in self.classes[around].items()}
        for part in element:
            if part.tag in ("joint", "site"):
                self.classes[name].setdefault(part.tag, {}).update(part.attrib)
        for part in element.findall("default"):
            inner = part.get("class")
            if not inner:
                raise ModelError(f"{self.where}: a <default> inside class {name!r} has no class=")
            self._read(part, inner, name, depth + 1)

    def apply(
        self, tag: str, element: Element, childclass: str | None, here: str
    ) -> dict[str, str]:
        """An element's attributes over those of its class, or the childclass around it."""
        name = element.get("class") or childclass or "main"
        if name not in self.classes:
            raise ModelError(
                f"{here} has no such class {name!r}; {choices(name, self.classes, 'classes')}"
            )
        return _over(self.classes[name].get(tag, {}), element.attrib)


def _over(default: Mapping[str, str], own: Mapping[str, str]) -> dict[str, str]:
    # an own rotation replaces a default one even if it is written in another way
    turned = any(key in own for key in ROTATIONS)
    kept = {k: v for k, v in default.items() if not (turned and k in ROTATIONS)}
    return {**kept, **own}


def placed(given: Mapping[str, str], compiler: Compiler, here: str) -> Array:
    """The placement (4, 4) of a body, frame or site in the one around it.

    Raises:
        ModelError: malformed numbers, two rotations, directions or quaternions of length 0.
    """
    xyz = numbers(given.get("pos", "0 0 0"), 3, f"{here}, pos")
    found = [key for key in ROTATIONS if key in given]
    if len(found) > 1:
        raise ModelError(f"{here} gives its rotation twice: {' and '.join(found)}")
    if not found:
        return se3.transform(None, xyz)
    (key,) = found
    values = numbers(given[key], ROTATIONS[key], f"{here}, {key}")
    return se3.transform(_rotation(key, values, compiler, f"{here}, {key}"), xyz)


def _rotation(key: str, values: list[float], compiler: Compiler, here: str) -> Array:
    if key == "euler":
        R = np.eye(3)
        for letter, value in zip(compiler.eulerseq, values, strict=True):
            axis = np.eye(3)["xyz".index(letter.lower())]
            turn = se3.rotation_from_axis(axis, value * compiler.angle)
            # a small letter turns about the moved axis, a capital about the fixed one
            R = R @ turn if letter.islower() else turn @ R
        return R
    if key == "quat":
        _not_zero(values, here)
        return se3.rotation_from_quat(values)
    if key == "axisangle":
        _not_zero(values[:3], here)
        return se3.rotation_from_axis(values[:3], values[3] * compiler.angle)
    if key == "zaxis":
        z = _unit(values, here)
        across = np.array([-z[1], z[0], 0.0])  # z axis x target: the shortest turn
        sine = float(np.hypot(z[0], z[1]))
        if sine == 0.0:
            across = np.array([1.0, 0.0, 0.0])
        return se3.rotation_from_axis(across, math.atan2(sine, z[2]))
    x = _unit(values[:3], here)
    y = np.array(values[3:]) / max(map(abs, values[3:]), default=1.0) if any(values[3:]) else x
    y = y - (x @ y) * x
    if np.linalg.norm(y) < 1e-9:
        raise ModelError(f"{here}: the two axes are parallel or zero")
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _not_zero(values: list[float], here: str) -> None:
    if not any(values):
        raise ModelError(f"{here} must not be all zero")


def _unit(values: list[float], here: str) -> Array:
    _not_zero(values, here)
    v = np.array(values) / max(map(abs, values))
    return np.asarray(v / np.linalg.norm(v))


def with_includes(root: Element, path: Path) -> Element:
    """Put the content of included files in the place of each <include>.

    Raises:
        ModelError: a file outside the model's folder, missing, or included twice.
    """
    folder = path.resolve().parent
    _expand(root, folder, {path.resolve()}, path.name, 0)
    return root


def _expand(element: Element, folder: Path, seen: set[Path], where: str, depth: int) -> None:
    if depth > 2 * DEEPEST:
        raise ModelError(f"{where}: elements are nested more than {2 * DEEPEST} deep")
    parts: list[Element] = []
    for part in element:
        if part.tag != "include":
            _expand(part, folder, seen, where, depth + 1)
            parts.append(part)
            continue
        name = part.get("file", "")
        try:
            target = (folder / name).resolve()
        except (OSError, ValueError, RuntimeError) as error:
            raise ModelError(f"{where}: cannot include {name!r}: {error}") from error
        if not name or not target.is_relative_to(folder):
            raise ModelError(f"{where}: include {name!r} does not stay in the model's folder")
        if target in seen:
            raise ModelError(f"{where}: {name!r} is included twice or includes itself")
        seen.add(target)
        inner = parse_xml(read_bytes(target), name)
        _expand(inner, folder, seen, name, depth + 1)
        parts.extend(inner)
    element[:] = parts

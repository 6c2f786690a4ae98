"""kinverse's own robot files: Denavit-Hartenberg rows in TOML."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import dh, se3
from kinverse.errors import InputError, ModelError
from kinverse.loading.text import LARGEST_NUMBER, choices
from kinverse.robot import Robot

__all__ = ["read_toml"]

LENGTHS = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
ANGLES = ("rad", "deg")
KEYS = (
    "kind",
    "name",
    "convention",
    "units",
    "rows",
    "base",
    "tool",
    "source",
    "notes",
    "unverified",
)
ROW_KEYS = ("joint", "name", "theta", "d", "a", "alpha", "limits", "mimic")
MIMIC_KEYS = ("joint", "multiplier", "offset")
POSE_KEYS = ("xyz", "rpy")


def read_toml(data: bytes, where: str, stem: str) -> Robot:
    """The robot of a TOML file.

    The file says ``kind = "dh"``, ``convention = "standard"`` or ``"modified"``, optionally
    ``name``, ``units = { length = "m" | "cm" | "mm", angle = "rad" | "deg" }``, ``base`` and
    ``tool`` as ``{ xyz = [...], rpy = [...] }``, ``source`` (text), ``notes`` and ``unverified``
    (lists of texts), and ``rows``, a list of ``{ joint = "R" | "P" | "F", name, theta, d, a,
    alpha, limits = [low, high] }``. Numbers left out are 0; limits left out are +-pi for R. A row
    that follows another has ``mimic = { joint = NAME, multiplier, offset }`` in place of limits.

    Args:
        data: the content of the file.
        where: the file, for messages.
        stem: the robot's name if the file gives none.

    Raises:
        ModelError: malformed TOML (with its line), unknown or missing keys, values of the wrong
            type, or rows that make no robot.
    """
    import tomllib

    try:
        table = tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise ModelError(f"{where}: not a text file in UTF-8") from error
    except RecursionError as error:
        raise ModelError(f"{where}: nested too deeply") from error
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        raise ModelError(f"{where}: not well-formed TOML: {error}") from error
    _known(table, KEYS, where)
    _one_of(table.get("kind"), ("dh",), f"{where}: kind")
    convention = _one_of(table.get("convention"), dh.CONVENTIONS, f"{where}: convention")
    units = _table(table.get("units", {}), ("length", "angle"), f"{where}: units")
    per_metre = LENGTHS[_one_of(units.get("length", "m"), LENGTHS, f"{where}: units.length")]
    degrees = _one_of(units.get("angle", "rad"), ANGLES, f"{where}: units.angle") == "deg"

    def length(value: Any, key: str) -> float:
        return _number(value, key) / per_metre

    def angle(value: Any, key: str) -> float:
        number = _number(value, key)
        return float(np.deg2rad(number)) if degrees else number

    def placed(key: str) -> NDArray[np.float64] | None:
        if key not in table:
            return None
        part = _table(table[key], POSE_KEYS, f"{where}: {key}")
        xyz = [length(v, f"{where}: {key}.xyz") for v in _list(part, "xyz", 3, f"{where}: {key}")]
        rpy = [angle(v, f"{where}: {key}.rpy") for v in _list(part, "rpy", 3, f"{where}: {key}")]
        return se3.transform(se3.rotation_from_rpy(rpy), xyz)

    rows = table.get("rows")
    if not isinstance(rows, list) or not rows:
        raise ModelError(f"{where}: rows must be a list of at least one row")
    joints = ""
    moving: list[_Row] = []
    values: dict[str, list[float]] = {"a": [], "d": [], "alpha": [], "theta": []}
    for number, row in enumerate(rows, start=1):
        here = f"{where}: row {number}"
        row = _table(row, ROW_KEYS, here)
        kind = _one_of(row.get("joint"), ("R", "P", "F"), f"{here}: joint")
        for key, column in values.items():
            unit = length if key in ("d", "a") else angle
            column.append(unit(row.get(key, 0.0), f"{here}: {key}"))
        joints += kind
        if kind == "F":
            if row.keys() & {"limits", "name", "mimic"}:
                raise ModelError(f"{here} is fixed (F) and takes no name, limits or mimic")
            continue
        unit = angle if kind == "R" else length
        joint = _Row(_text(row.get("name", f"joint{len(moving) + 1}"), f"{here}: name"))
        if "limits" in row:
            joint.limits = [unit(v, f"{here}: limits") for v in _list(row, "limits", 2, here)]
        if "mimic" in row:
            mimic = _table(row["mimic"], MIMIC_KEYS, f"{here}: mimic")
            if "limits" in row:
                raise ModelError(f"{here} mimics another joint and takes no limits")
            joint.driver = _text(mimic.get("joint", ""), f"{here}: mimic.joint")
            joint.multiplier = _number(mimic.get("multiplier", 1.0), f"{here}: mimic.multiplier")
            joint.offset = unit(mimic.get("offset", 0.0), f"{here}: mimic.offset")
        moving.append(joint)
    named = [joint.name for joint in moving]
    if len(set(named)) != len(named):
        raise ModelError(f"{where}: joint names must differ, got {', '.join(named)}")
    free = [joint.name for joint in moving if joint.driver is None]
    for joint in moving:
        if joint.driver is not None and joint.driver not in free:
            raise ModelError(
                f"{where}: joint {joint.name!r} mimics {joint.driver!r};"
                f" {choices(joint.driver, free, 'free joints')}"
            )
    source = _text(table.get("source", ""), f"{where}: source")
    try:
        frames, kinds = dh.frames(
            **values, joints=joints, convention=convention, base=placed("base"), tool=placed("tool")
        )
        return Robot(
            frames,
            kinds,
            limits=[joint.limits for joint in moving if joint.driver is None],
            joint_names=free,
            source=[free.index(joint.driver or joint.name) for joint in moving],
            multiplier=[joint.multiplier for joint in moving],
            offset=[joint.offset for joint in moving],
            name=_text(table.get("name", stem), f"{where}: name"),
            source_note="\n".join([source, *_texts(table, "notes", where)]),
            unverified=_texts(table, "unverified", where),
        )
    except ModelError:
        raise
    except InputError as error:
        raise ModelError(f"{where}: {error}") from error


@dataclass
class _Row:
    name: str
    limits: list[float] | None = None
    driver: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


def _known(table: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            raise ModelError(f"{where}: unknown key {key!r}; {choices(key, keys, 'keys')}")


def _table(value: Any, keys: tuple[str, ...], where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ModelError(f"{where} must be a table {{ {', '.join(keys)} }}, got {value!r}")
    _known(value, keys, where)
    return value


def _one_of(value: Any, valid: Any, where: str) -> str:
    if not isinstance(value, str) or value not in valid:
        raise ModelError(f"{where} must be one of {', '.join(valid)}, got {value!r}")
    return value


def _number(value: Any, where: str) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = np.inf
        if abs(number) <= LARGEST_NUMBER:
            return number
    raise ModelError(f"{where} must be a finite number, got {str(value)[:40]}")


def _list(table: dict[str, Any], key: str, length: int, where: str) -> list[Any]:
    value = table.get(key, [0.0] * length)
    if not isinstance(value, list) or len(value) != length:
        raise ModelError(f"{where}: {key} must be a list of {length} numbers, got {value!r}")
    return value


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.isprintable():
        raise ModelError(f"{where} must be a text of one line, got {value!r}")
    return value


def _texts(table: dict[str, Any], key: str, where: str) -> list[str]:
    value = table.get(key, [])
    if not isinstance(value, list):
        raise ModelError(f"{where}: {key} must be a list of texts, got {value!r}")
    return [_text(item, f"{where}: {key}") for item in value]

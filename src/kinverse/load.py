"""The verb that makes a robot from a name or a file."""

import os
from typing import TYPE_CHECKING

from kinverse.errors import InputError, ModelError
from kinverse.robot import Robot

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["load", "names"]

SUFFIXES = (".urdf", ".xml", ".mjcf", ".toml")


def names() -> list[str]:
    """Names of the robots that come with kinverse, sorted.

    Example:
        >>> "kr16" in names()
        True
    """
    from importlib.resources import files

    found = (entry.name for entry in files("kinverse").joinpath("robots").iterdir())
    return sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml"))


def load(robot: str | os.PathLike[str], base: str | None = None, tip: str | None = None) -> Robot:
    """Load a robot.

    Args:
        robot: a name of the catalogue (:func:`names`) in letters of either case, or the
            path of a file: URDF (``.urdf``, ``.xml``), MJCF (``.xml``, ``.mjcf``) or kinverse's
            TOML (``.toml``).
        base: link (URDF) or body (MJCF) at which the chain starts; None: the root.
        tip: link, body or site at which it ends; None: the only leaf.

    Returns:
        The frozen robot. Its ``source_note`` says where the numbers come from, its ``unverified``
        what about them could not be checked.

    Raises:
        ModelError: an unknown name, a file that cannot be read or holds no usable chain; the
            message names the part and what is valid.
        InputError: base or tip given for a robot that is one chain already.

    Example:
        >>> load("kr16").dof
        6
    """
    known = names()
    if isinstance(robot, str) and robot in known:
        from importlib.resources import files

        _no_chain(base, tip, f"catalogue robot {robot!r}")
        data = files("kinverse").joinpath("robots", f"{robot}.toml").read_bytes()
        from kinverse.loading.toml import read_toml

        return read_toml(data, f"{robot}.toml", robot)
    from pathlib import Path

    path = Path(robot)
    suffix = path.suffix.lower()
    if isinstance(robot, str) and robot.lower() in known and not _exists(path):
        return load(robot.lower(), base, tip)
    if isinstance(robot, str) and suffix not in SUFFIXES and not _exists(path):
        from kinverse.loading.text import choices

        raise ModelError(
            f"no robot or file {robot!r}; {choices(robot.lower(), known, 'the catalogue has')};"
            f" files end in {', '.join(SUFFIXES)}"
        )
    return _from_file(path, suffix, base, tip)


def _from_file(path: "Path", suffix: str, base: str | None, tip: str | None) -> Robot:
    from kinverse.loading.text import parse_xml, read_bytes

    data = read_bytes(path)
    if suffix not in SUFFIXES:
        raise ModelError(f"{path}: cannot read {suffix or 'no suffix'}; use {', '.join(SUFFIXES)}")
    if suffix == ".toml":
        from kinverse.loading.toml import read_toml

        _no_chain(base, tip, path.name)
        return read_toml(data, path.name, path.stem)
    root = parse_xml(data, path.name)
    # the root element tells URDF from MJCF whatever the suffix
    if root.tag == "robot":
        from kinverse.loading.urdf import read_urdf

        return read_urdf(root, path.name, path.stem, base, tip)
    if root.tag == "mujoco":
        from kinverse.loading.mjcf import read_mjcf

        return read_mjcf(root, path, base, tip)
    raise ModelError(
        f"{path.name}: root element <{root.tag}> is neither URDF (<robot>) nor MJCF (<mujoco>)"
    )


def _exists(path: "Path") -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name too long or with a null character
        return False


def _no_chain(base: str | None, tip: str | None, what: str) -> None:
    if base is not None or tip is not None:
        raise InputError(f"base and tip choose a chain in a URDF or MJCF file; {what} is one chain")

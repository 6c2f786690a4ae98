"""The joints that place the wrist: structure and workspace by the classes of document 004.

Thesis of Jha (NIT Rourkela 2015), tables 1.2 and 1.4, figure 1.6: Cartesian, cylindrical,
spherical, SCARA and articulated arms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.axes import nearest_point
from kinverse.geometry import PARALLEL, AxisLines

__all__ = ["RegionalStructure", "regional_structure"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RegionalStructure:
    """The regional structure of an arm.

    Attributes:
        joints: indices of its joints, from 0.
        structure: letters along the chain, such as "RPP", or "SCARA".
        name: Cartesian, cylindrical, spherical, SCARA, articulated, ... or "general".
        workspace: what the wrist's place sweeps if no limit and no link stands in the way.
        axes: the notation of table 1.4, such as "Rz Ry Ry": directions in the base frame while
            the joints stand at zero; "*" for one that is along none of x, y, z.
    """

    joints: tuple[int, ...]
    structure: str
    name: str
    workspace: str
    axes: str


def regional_structure(lines: AxisLines, kinds: str) -> RegionalStructure:
    """The class of the first joints of an arm.

    Example:
        >>> regional_structure(axis_lines(robot.frames, robot.kinds), robot.kinds).workspace
        'box'
    """
    count = min(3, len(kinds))
    if _is_scara(lines, kinds):
        # the slide may come after the third turn: RRRP
        count = 4 if kinds[:4] == "RRRP" else 3
        structure, name, workspace = "SCARA", "SCARA", "cylinder, hollow if the links differ"
    else:
        structure = kinds[:count]
        name, workspace = _class(lines, structure)
    joints = tuple(range(count))
    axes = " ".join(kinds[i] + _letter(lines.direction[i]) for i in joints)
    return RegionalStructure(joints, structure, name, workspace, axes)


def _letter(z: Array) -> str:
    k = int(np.argmax(np.abs(z)))
    return "xyz"[k] if abs(z[k]) > 1.0 - PARALLEL else "*"


def _parallel(lines: AxisLines, i: int, j: int) -> bool:
    across = np.cross(lines.direction[i], lines.direction[j])
    return bool(np.linalg.norm(across) < PARALLEL)


def _square(lines: AxisLines, i: int, j: int) -> bool:
    return bool(abs(lines.direction[i] @ lines.direction[j]) < PARALLEL)


def _is_scara(lines: AxisLines, kinds: str) -> bool:
    """Two or three turns and a slide, all parallel, and the turns on different axes."""
    n = 4 if kinds[:4] == "RRRP" else 3
    if kinds[:n] not in ("RRP", "PRR", "RPR", "RRRP"):
        return False
    turns = [i for i in range(n) if kinds[i] == "R"]
    return all(_parallel(lines, 0, i) for i in range(1, n)) and not _meet(lines, *turns[:2])


def _meet(lines: AxisLines, *joints: int) -> bool:
    """Axes through one point, or on one line."""
    chosen = list(joints)
    if all(_parallel(lines, chosen[0], i) for i in chosen[1:]):
        apart = lines.point[chosen] - lines.point[chosen[0]]
        z = lines.direction[chosen[0]]
        return bool(np.linalg.norm(np.cross(apart, z), axis=1).max() < PARALLEL * lines.size)
    _, distance = nearest_point(lines.direction[chosen], lines.point[chosen])
    return distance < PARALLEL * lines.size


def _class(lines: AxisLines, structure: str) -> tuple[str, str]:
    if len(structure) < 3:
        return _short(lines, structure)
    if structure == "PPP":
        return _cartesian(lines)
    if structure.count("P") == 2:
        return _cylindrical(lines, structure)
    if structure == "RRP":
        return _spherical(lines)
    if structure == "RRR":
        return _articulated(lines)
    return _general(structure)


def _general(structure: str) -> tuple[str, str]:
    if structure[0] == "R":
        return "general", "solid of revolution about axis 1"
    return "general", "what the joints behind it reach, swept along axis 1"


def _short(lines: AxisLines, structure: str) -> tuple[str, str]:
    if len(structure) == 1:
        return "one joint", "circle" if structure == "R" else "line"
    parallel = _parallel(lines, 0, 1)
    if structure == "PP":
        return ("degenerate", "line") if parallel else ("Cartesian", "plane rectangle")
    if structure == "RR":
        if _meet(lines, 0, 1):
            return ("degenerate", "circle") if parallel else ("pointing", "part of a sphere")
        return ("planar", "disc or ring") if parallel else ("general", "torus")
    if parallel:
        return "cylindrical", "surface of a cylinder"
    return ("polar", "disc or ring") if _square(lines, 0, 1) else ("general", "surface")


def _cartesian(lines: AxisLines) -> tuple[str, str]:
    """Table 1.2; three slides that are not independent move in a plane or along a line."""
    rank = int(np.linalg.matrix_rank(lines.direction[:3], tol=PARALLEL))
    if rank < 3:
        return "degenerate", "plane" if rank == 2 else "line"
    square = _square(lines, 0, 1) and _square(lines, 1, 2) and _square(lines, 0, 2)
    return "Cartesian", "box" if square else "parallelepiped"


def _cylindrical(lines: AxisLines, structure: str) -> tuple[str, str]:
    """One slide along the turning axis, one square to it and carried round by it."""
    turn = structure.index("R")
    along = [i for i in range(3) if i != turn and _parallel(lines, turn, i)]
    across = [i for i in range(3) if i != turn and _square(lines, turn, i)]
    if len(along) == 1 and len(across) == 1 and across[0] > turn:
        return "cylindrical", "cylinder, hollow if the radial slide stops short of the axis"
    if len(along) == 2:
        return "degenerate", "surface of a cylinder"
    return _general(structure)


def _spherical(lines: AxisLines) -> tuple[str, str]:
    """Two turns that meet at a right angle, and a slide square to the second."""
    if _meet(lines, 0, 1) and _square(lines, 0, 1) and _square(lines, 1, 2):
        return "spherical", "sphere, hollow if the slide stops short of its centre"
    return _general("RRP")


def _articulated(lines: AxisLines) -> tuple[str, str]:
    """Section 1.3.4 e."""
    if _parallel(lines, 0, 1) and _parallel(lines, 1, 2):
        return "planar", "disc or ring in a plane"
    if _meet(lines, 0, 1, 2):
        return "spherical shoulder", "hollow sphere, its radius set by the joint behind"
    if _square(lines, 0, 1) and _parallel(lines, 1, 2):
        return "articulated", "crescent swept about axis 1, between two spheres"
    return _general("RRR")

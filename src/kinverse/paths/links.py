"""What the links of an arm weigh: given, or by a stated default."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.robot import Robot

__all__ = ["Link", "default_links", "links_of"]

Array = NDArray[np.float64]

PER_METRE = 40.0
"""Mass of a link for each metre that it bridges [kg/m]: between a light arm's and a heavy one's."""
LEAST_MASS = 1.0
"""A link that bridges nothing (a wrist) weighs at least so much [kg] ..."""
RADIUS = 0.06
"""... and is a ball or a rod of this radius [m], both for an arm that reaches a metre."""


class Link(NamedTuple):
    """One moving body.

    Attributes:
        mass: [kg].
        centre: (3,) centre of mass in the frame of the joint that moves it [m].
        inertia: (3, 3) about the centre of mass, axes of that frame [kg m^2].
    """

    mass: float
    centre: Array
    inertia: Array

    def scaled(self, factor: float) -> "Link":
        """The same body of another density."""
        return Link(self.mass * factor, self.centre, self.inertia * factor)


def default_links(robot: Robot) -> list[Link]:
    """A rod from each joint to the next: stated, not measured.

    40 kg for each metre bridged, at least 1 kg; rods of 60 mm radius. Lengths below count in the
    arm's reach and masses with its cube, so that a small arm is light.

    Example:
        >>> sum(link.mass for link in default_links(kv.load("kr16")))
    """
    reach = float(sum(np.linalg.norm(frame[:3, 3]) for frame in robot.frames))
    unit = reach if reach > 0.0 else 1.0
    links = []
    for frame in robot.frames[1:]:
        end = frame[:3, 3]
        length = float(np.linalg.norm(end))
        mass = max(PER_METRE * length / unit, LEAST_MASS) * unit**3
        radius = RADIUS * unit
        along = end / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
        # a radius longer than the bridge, so that no link is a flat disk
        across = mass * (3.0 * radius**2 + (length + radius) ** 2) / 12.0
        about = 0.5 * mass * radius**2
        inertia = across * np.eye(3) + (about - across) * np.outer(along, along)
        links.append(Link(mass, 0.5 * end, inertia))
    return links


def links_of(robot: Robot, links: Sequence[Link] | None) -> list[Link]:
    """The given links, checked, or the default ones.

    Raises:
        InputError: another number of links, or values that no body has; the link is named.
    """
    if links is None:
        return default_links(robot)
    if len(links) != len(robot.kinds):
        raise InputError(f"{robot.name!r} has {len(robot.kinds)} moving links, got {len(links)}")
    checked = []
    for k, (mass, centre, inertia) in enumerate(links):
        c, matrix = np.asarray(centre, np.float64), np.asarray(inertia, np.float64)
        if not (np.isfinite(mass) and mass > 0.0):
            raise InputError(f"link {k + 1}: mass must be positive and finite [kg], got {mass!r}")
        if c.shape != (3,) or not np.isfinite(c).all():
            raise InputError(f"link {k + 1}: centre must be (3,) finite [m], got {centre!r}")
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise InputError(f"link {k + 1}: inertia must be (3, 3) finite [kg m^2]")
        values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
        symmetric = np.abs(matrix - matrix.T).max() <= 1e-9 * np.abs(matrix).max()
        if not symmetric or values[0] <= 0.0 or values[2] > (values[0] + values[1]) * (1.0 + 1e-9):
            raise InputError(
                f"link {k + 1}: no body has the inertia {matrix.tolist()}: it must be symmetric,"
                " positive, and no principal moment above the sum of the others"
            )
        checked.append(Link(float(mass), c, 0.5 * (matrix + matrix.T)))
    return checked

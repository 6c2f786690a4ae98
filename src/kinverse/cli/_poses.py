"""Poses from the command line; those from files are read as paths read them."""

import math
from collections.abc import Sequence

import numpy as np

from kinverse import se3
from kinverse.paths.files import Poses, from_csv, from_matrix

__all__ = ["Poses", "from_csv", "from_matrix", "from_numbers"]


def from_numbers(values: Sequence[float], degrees: bool) -> Poses:
    """One pose from x y z [m] and roll pitch yaw [rad, or deg], or from x y z alone."""
    first = np.array([1])
    if len(values) == 3:
        return Poses(se3.pose(values)[None], first)
    rpy = [math.radians(v) for v in values[3:]] if degrees else list(values[3:])
    T = se3.pose(values[:3], rpy=rpy)[None]
    return Poses(T, first, largest=max(values[3:], key=abs))

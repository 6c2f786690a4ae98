"""The arm of document 003 and the poses of its trajectories, told apart by what is possible."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.paths import condition_5, named_samples
from kinverse.studies.data import printed

__all__ = [
    "CLASSES",
    "IN_RANGES",
    "NOT_FEASIBLE",
    "OUTSIDE_RANGES",
    "STUDY_NAME",
    "TRAJECTORIES",
    "Trajectory",
    "arm",
    "lengths",
    "parameter",
    "trajectory",
]

Array = NDArray[np.float64]

STUDY_NAME = "habibkhah2021"
TRAJECTORIES = (1, 2, 3, 4)
IN_RANGES = "feasible, inside (4)"
OUTSIDE_RANGES = "feasible, outside (4)"
NOT_FEASIBLE = "not feasible"
CLASSES = (IN_RANGES, OUTSIDE_RANGES, NOT_FEASIBLE)
"""Of a pose: condition (5) and the ranges (4) hold, only (5) holds, (5) does not hold."""


class Trajectory(NamedTuple):
    """Poses T (N, 4, 4) at s (N,), and the joint values q (N, 3) [rad] inside the ranges (4).

    ``feasible`` (N,) tells whether condition (5) holds; ``kind`` (N,) is one of ``CLASSES``. Rows
    of q are NaN where there is no solution inside the ranges.
    """

    T: Array
    s: Array
    q: Array
    feasible: NDArray[np.bool_]
    kind: NDArray[np.str_]


def arm() -> kv.Robot:
    """Links of 10, 7 and 5 with the joint ranges (4)."""
    return kv.load("planar3r_003")


def parameter(name: str) -> float:
    """A printed parameter by its name in ``parameters.csv``."""
    return float(printed(STUDY_NAME, "parameters").where("parameter", name).text("value")[0])


def lengths() -> list[float]:
    """Lengths of the three links, as printed."""
    return [parameter(name) for name in ("l1", "l2", "l3")]


def trajectory(number: int) -> Trajectory:
    """Trajectory 1 to 4 in the printed step, with the closed form's answers."""
    T, s = named_samples(f"habibkhah_{number}")
    feasible = condition_5(lengths(), T).holds
    found = kv.Analytic(task="planar").fit(arm()).solve(T)
    kind = np.where(feasible, np.where(found.ok, IN_RANGES, OUTSIDE_RANGES), NOT_FEASIBLE)
    return Trajectory(T, s, found.nearest(np.zeros(3)), feasible, kind)

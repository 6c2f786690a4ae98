"""Poses of document 000: away from collisions and singularities, in the workspace or a part of it.

A region is a box of joint values about a centre, half as wide as its name says; the document takes
poses from all of the workspace.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.errors import InputError
from kinverse.learning import (
    DataSet,
    Predicate,
    collision_free,
    far_from_singularity,
    sample,
)
from kinverse.paths.collision import Capsules
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["REGIONS", "WHOLE", "arm", "draw", "path_joints", "predicates", "region", "region_name"]

Array = NDArray[np.float64]

WHOLE = 180.0
REGIONS = (2.0, 5.0, 10.0, 30.0, WHOLE)
"""Half widths of regions [deg]; the last stands for all inside the limits."""
RADIUS = 0.06
"""Of the capsules about the links [m]."""
FLOORS = {"ir361": 0.0, "puma560": -0.66}
"""Height of the floor [m]: the robots stand on it."""
FLOOR_FROM = 2
"""First link the floor is for: the column before it stands there."""
LEAST, CENTRE_LEAST = 0.005, 0.05
"""Least inverse condition number of a pose, and of the centre of a region."""
STEEPEST = np.radians(60.0)
"""Pitch of a region's centre, at most: at 90 deg roll and yaw are not defined."""
CENTRES = 40_000
"""First seed of centres."""
TRIES = 500


def arm(name: str) -> kv.Robot:
    """A robot of the study by its name."""
    return kv.load(name)


def predicates(robot: kv.Robot) -> list[Predicate]:
    """What a pose must meet: away from singularities, its links clear of the floor and each other.

    Joint limits are held by ``sample``.
    """
    free = Capsules(robot, RADIUS, floor=FLOORS[robot.name], floor_from=FLOOR_FROM)
    return [far_from_singularity(robot, least=LEAST), collision_free(free)]


def region(robot: kv.Robot, half: float, seed: int) -> tuple[Array, Array] | None:
    """Centre and half width of a region; None: all of the workspace.

    The centre lies in the middle halves of the limits, far from singularities and from a pitch of
    90 deg.
    """
    if half == WHOLE:
        return None
    level = Predicate("pitch", lambda q: np.abs(robot.fk(q)[:, 2, 0]) < np.sin(STEEPEST))
    keep = [far_from_singularity(robot, least=CENTRE_LEAST), level, predicates(robot)[1]]
    box = robot.limits.mean(axis=1), 0.25 * np.ptp(robot.limits, axis=1)
    centre = sample(robot, 1, random_state=CENTRES + seed, keep=keep, region=box).q[0]
    return centre, np.full(robot.dof, np.radians(half))


@cache
def _region(name: str, half: float, seed: int) -> tuple[Array, Array] | None:
    return region(arm(name), half, seed)


def draw(robot: kv.Robot, count: int, half: float, seed: int, random_state: int) -> DataSet:
    """Poses of a region.

    Args:
        robot: of the study.
        count: how many.
        half: of the region [deg].
        seed: of the region's centre.
        random_state: of the poses.
    """
    return sample(
        robot,
        count,
        random_state=random_state,
        keep=predicates(robot),
        region=_region(robot.name, half, seed),
    )


def path_joints(robot: kv.Robot, half: float, seed: int, random_state: int) -> Array:
    """Joint values (6, n): where a path starts, then its five poses, evenly on the way.

    Raises:
        InputError: no pair of configurations was found whose way is free.
    """
    ends = draw(robot, 2 * TRIES, half, seed, random_state).q
    share = np.linspace(0.0, 1.0, int(parameter("path poses")) + 1)[:, None]
    for a, b in zip(ends[::2], ends[1::2], strict=True):
        q: Array = a + share * (b - a)
        if all(np.asarray(test(q)).all() for test in predicates(robot)):
            return q
    raise InputError(f"no free path of {robot.name!r} among {TRIES} in {region_name(half)}")


def region_name(half: float) -> str:
    """As tables call it."""
    return "whole workspace" if half == WHOLE else f"±{half:g} deg"

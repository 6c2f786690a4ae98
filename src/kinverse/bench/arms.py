"""Arms that no special family solves: random ones, two of today, almost special and short ones.

The catalogue (``kinverse.load``) holds robots with limits and a source for every number; what is
here are test pieces, with limits of a turn where nothing else is said.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from kinverse.load import load
from kinverse.robot import Robot

__all__ = [
    *("ALMOST", "GENERAL", "SEVEN", "SHORT", "SIX", "SLIDING", "SQUARE", "TODAY"),
    *("almost_puma", "almost_ur5", "gofa", "random_arm", "random_seven"),
]

HALF = np.pi / 2
TURN = (-np.pi, np.pi)

Make = Callable[[], Robot]


def random_arm(seed: int, kinds: str = "RRRRRR") -> Robot:
    """Six joints of which no two neighbouring axes meet or are parallel."""
    rng = np.random.default_rng(seed)
    return Robot.from_dh(
        a=rng.uniform(0.05, 0.6, 6),
        d=rng.uniform(-0.5, 0.5, 6),
        alpha=rng.uniform(0.2, np.pi - 0.2, 6) * rng.choice([-1, 1], 6),
        theta=rng.uniform(-3, 3, 6),
        joints=kinds,
        limits=[TURN if kind == "R" else (-1.0, 1.0) for kind in kinds],
        name=f"random {kinds} {seed}",
    )


def gofa() -> Robot:
    """ABB CRB 15000-5/0.95, an offset wrist.

    Lengths of two public models that agree: model_GoFa.m of SHLD2022/Simple-Robot-Simulation, and
    ABB_CRB_15000 of robotkinematicscatalogue.
    """
    return Robot.from_dh(
        a=[0, 0.444, 0.11, 0, 0.08, 0],
        d=[0.265, 0, 0, 0.47, 0, 0.101],
        alpha=[-HALF, 0, -HALF, HALF, -HALF, 0],
        theta=[0, -HALF, 0, 0, 0, 0],
        joints="R" * 6,
        name="gofa",
    )


def crx10() -> Robot:
    """FANUC CRX-10iA: z1 = x1 = 540, y1 = 150, x2 = 160 mm.

    Table of mattj23/crx-kinematics after Abbes & Poisson, Robotics 13 (2024) 91.
    """
    return Robot.from_dh(
        a=[0, 0.54, 0, 0, 0, 0],
        d=[0, 0, 0, -0.54, 0.15, -0.16],
        alpha=[-HALF, np.pi, -HALF, HALF, -HALF, np.pi],
        joints="R" * 6,
        name="crx10",
    )


def almost_puma(offset: float) -> Robot:
    """A spherical wrist missed by ``offset`` [m]."""
    return Robot.from_dh(
        a=[0, 0.4318, 0.0203, offset, 0, 0],
        d=[0, 0, 0.15005, 0.4318, offset, 0],
        alpha=[HALF, 0, -HALF, HALF, -HALF, 0],
        joints="R" * 6,
        name=f"almost puma {offset:g}",
    )


def almost_ur5(offset: float) -> Robot:
    """Axes 5 and 6 pass each other at ``offset`` [m]."""
    return Robot.from_dh(
        a=[0, -0.425, -0.39225, 0, offset, 0],
        d=[0.089159, 0, 0, 0.10915, 0.09465, 0.0823],
        alpha=[HALF, 0, 0, HALF, -HALF, 0],
        joints="R" * 6,
        name=f"almost ur5 {offset:g}",
    )


def square_slides() -> Robot:
    """Two slides in an arm whose axes are square to each other, but never meet."""
    return Robot.from_dh(
        a=[0.3, 0.08, 0.3, 0, 0.3, 0.27],
        d=[0.2, 0, 0, 0, -0.26, 0],
        alpha=[HALF, -HALF, -HALF, HALF, -HALF, HALF],
        theta=[0.24, HALF, HALF, 0, HALF, 0],
        joints="PRRRPR",
        limits=[(-1, 1), (-3, 3), (-3, 3), (-3, 3), (-1, 1), (-3, 3)],
        name="square PRRRPR",
    )


def gantry() -> Robot:
    """Three square slides and a wrist."""
    return Robot.from_dh(
        a=0,
        d=[0, 0, 0, 0, 0, 0.1],
        alpha=[HALF, HALF, 0, -HALF, HALF, 0],
        theta=[0, HALF, 0, 0, 0, 0],
        joints="PPPRRR",
        limits=[(-5, 5)] * 3 + [(-3, 3)] * 3,
        name="gantry",
    )


def random_seven() -> Robot:
    """Seven turning joints in general position."""
    rng = np.random.default_rng(77)
    return Robot.from_dh(
        a=rng.uniform(0.05, 0.4, 7),
        d=rng.uniform(-0.4, 0.4, 7),
        alpha=rng.uniform(0.2, np.pi - 0.2, 7) * rng.choice([-1, 1], 7),
        joints="R" * 7,
        name="general RRRRRRR",
    )


def random_short(kinds: str) -> Robot:
    """One to five joints in general position."""
    rng = np.random.default_rng(sum(map(ord, kinds)) + len(kinds))
    n = len(kinds)
    return Robot.from_dh(
        a=rng.uniform(0.1, 0.5, n),
        d=rng.uniform(-0.3, 0.3, n),
        alpha=rng.uniform(-2, 2, n),
        theta=rng.uniform(-2, 2, n),
        joints=kinds,
        limits=[(-3, 3) if kind == "R" else (0.1, 1.0) for kind in kinds],
        name=kinds,
    )


def planar2r() -> Robot:
    """Two links in a plane."""
    return Robot.from_dh([0.3, 0.2], 0, 0, joints="RR", name="planar2r")


def cylindrical() -> Robot:
    """A turn, a rise and a reach."""
    limits = [(-3, 3), (0.1, 1), (0.1, 1)]
    alpha = [0, -HALF, 0]
    return Robot.from_dh(0, [0.5, 0.2, 0], alpha, joints="RPP", limits=limits, name="cylindrical")


def cartesian() -> Robot:
    """Three slides at right angles."""
    return Robot.from_dh(
        0,
        0,
        [HALF, HALF, 0],
        [0, HALF, 0],
        joints="PPP",
        limits=[(0.1, 1)] * 3,
        name="cartesian",
    )


def spherical() -> Robot:
    """Two turns that meet and a reach."""
    limits = [(-3, 3), (-1.5, 1.5), (0.1, 1)]
    alpha = [-HALF, HALF, 0]
    return Robot.from_dh(0, [0.5, 0, 0], alpha, joints="RRP", limits=limits, name="spherical")


def elbow() -> Robot:
    """A waist, a shoulder and an elbow."""
    return Robot.from_dh([0, 0.4, 0.3], [0.5, 0, 0], [HALF, 0, 0], joints="RRR", name="elbow")


SIX: dict[str, Make] = {f"general_{k}": partial(random_arm, k) for k in range(10)}
"""Ten random arms with six turning joints."""

SLIDING: dict[str, Make] = {
    kinds: partial(random_arm, 20 + k, kinds)
    for k, kinds in enumerate(["RRPRRR", "PRRRRR", "RRRRPR", "RPRRPR", "PRRPRR"])
}
"""Five with one or two slides among them."""

SQUARE: dict[str, Make] = {
    "PRRRRP": partial(random_arm, 104, "PRRRRP"),
    "square PRRRPR": square_slides,
    "gantry": gantry,
}
"""Slides at both ends, at right angles, and three of them."""

TODAY: dict[str, Make] = {
    "jaco2": partial(load, "jaco2"),
    "xarm6": partial(load, "xarm6"),
    "gofa": gofa,
    "crx10": crx10,
}
"""Arms that are built and sold."""

ALMOST: dict[str, Make] = {
    **{f"almost_puma {d:g}": partial(almost_puma, d) for d in (1e-9, 1e-8, 1e-6)},
    **{f"almost_ur5 {d:g}": partial(almost_ur5, d) for d in (1e-9, 1e-6, 1e-4)},
}
"""Arms that miss a special family by a hair."""

GENERAL: dict[str, Make] = SIX | SLIDING | SQUARE | TODAY | ALMOST
"""Every arm with six joints here."""

SHORT: dict[str, Make] = {
    kinds: partial(random_short, kinds)
    for kinds in (
        *("R", "P", "RR", "RP", "PP", "RRR", "RPP", "RRP", "PPP"),
        *("RRRR", "RPRP", "RRRRR", "PRRRR", "RRPRR"),
    )
} | {make.__name__: make for make in (planar2r, cylindrical, cartesian, spherical, elbow)}
"""One to five joints, in general position and as they are built."""

SEVEN: dict[str, Make] = {name: partial(load, name) for name in ("iiwa14", "panda")}
"""Seven joints with a closed form of their own."""

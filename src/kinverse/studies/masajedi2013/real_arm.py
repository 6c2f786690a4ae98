"""Arms that are not what they are said to be, for the error models of section 5."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import judge

__all__ = ["POINT", "WORLDS", "RealArm", "real_arm"]

Array = NDArray[np.float64]

POINT = (0.05, 0.02, 0.1)
"""What is measured, in the flange's frame [m]: off the last axis, so that all six joints show."""
LENGTH, ANGLE = 3e-4, np.radians(0.02)
"""Standard deviations of the errors of lengths [m] and angles [rad]."""
WAVE, HARMONICS = 5e-5, 2
"""Amplitude [m] and number of waves that each joint adds at the tool."""
SAG, REACH = 2e-4, 1.83
"""How far the tool hangs down [m] at full reach [m]."""
NOISE = 2e-5
"""Of a measurement, each axis [m]."""
WORLDS = ("sums of single joints", "links, gears and sag")
"""What errors are like: as equation 25 assumes, or as inexact links and gears make them."""


@dataclass(frozen=True)
class RealArm:
    """One arm drawn at random; ``wave`` (harmonics, joints, 3) and ``phase`` of its gears."""

    robot: kv.Robot
    wave: Array
    phase: Array
    sag: float

    def position(self, q: Array) -> Array:
        """Where the measured point is (N, 3) at joint values (N, 6)."""
        p = judge.pose(self.robot, q)[:, :3, 3]
        order = np.arange(1, len(self.wave) + 1)[:, None, None]
        waves = np.sin(order * q + self.phase[:, None])
        p = p + np.einsum("hnj,hjx->nx", waves, self.wave)
        # a cantilever's moment and its arm both grow with the distance
        p[:, 2] -= self.sag * (p[:, :2] ** 2).sum(axis=1) / REACH**2
        return np.asarray(p)

    def measured(self, q: Array, rng: np.random.Generator) -> Array:
        """The same with the noise of a measuring device (N, 3)."""
        return np.asarray(self.position(q) + rng.normal(0.0, NOISE, (len(q), 3)))


def real_arm(world: str, rng: np.random.Generator) -> RealArm:
    """An arm of one of ``WORLDS``: its true numbers."""
    tool = kv.pose(POINT)
    waves = rng.normal(size=(HARMONICS, 6, 3))
    waves *= WAVE / np.linalg.norm(waves, axis=2, keepdims=True)
    phase = rng.uniform(0.0, 2.0 * np.pi, (HARMONICS, 6))
    if world == WORLDS[0]:
        # as large together as the errors of links, so that the two worlds compare
        return RealArm(kv.load("kr16").with_tool(tool), waves * (LENGTH / WAVE), phase, 0.0)
    a = np.array([0.26, 0.68, -0.035, 0.0, 0.0, 0.0])
    d = np.array([0.675, 0.0, 0.0, 0.67, 0.0, 0.115])
    alpha = np.radians([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0])
    theta = np.radians([0.0, 0.0, -90.0, 0.0, 0.0, 0.0])
    robot = kv.Robot.from_dh(
        a=a + rng.normal(0.0, LENGTH, 6),
        d=d + rng.normal(0.0, LENGTH, 6),
        alpha=alpha + rng.normal(0.0, ANGLE, 6),
        theta=theta + rng.normal(0.0, ANGLE, 6),
        joints="RRRRRR",
        limits=kv.load("kr16").limits,
        name="kr16 as it is",
    ).with_tool(tool)
    return RealArm(robot, waves, phase, SAG)

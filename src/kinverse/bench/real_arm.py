"""A KR16 as it might really be, to be measured: it shares no code with what is to find it out.

Not exact in any part that is built or driven: every Denavit-Hartenberg parameter is off, gears run
out of true, and gravity pulls the tool down.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["GEARS", "TARGET_POINT", "RealArm", "nominal", "real_arm"]

Array = NDArray[np.float64]

MM, DEGREE = 1e-3, np.pi / 180.0
# standard rows, document 002 and the public description of the arm
D = np.array([675.0, 0.0, 0.0, 670.0, 0.0, 115.0]) * MM
A = np.array([260.0, 680.0, -35.0, 0.0, 0.0, 0.0]) * MM
ALPHA = np.array([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0]) * DEGREE
THETA = np.array([0.0, 0.0, -90.0, 0.0, 0.0, 0.0]) * DEGREE

TARGET_POINT = np.array([50.0, 20.0, 100.0]) * MM
"""The reflector that is measured, in the flange's frame."""
REACH = 1.83
"""Horizontal distance [m] of the reflector from joint 1 with the arm stretched out, about."""
LEVER = np.array([1.83, 1.57, 0.89, 0.222, 0.222, 0.054])
"""Distance [m] of the reflector from each joint's axis at its largest, about."""

LENGTH_ERROR, ANGLE_ERROR = 0.3 * MM, 0.02 * DEGREE
GEAR_ERROR, SAG, NOISE = 0.05 * MM, 0.2 * MM, 0.02 * MM

GEARS = ("joint", "tool")
"""How gears show: as angles of their joint, or as displacements of the tool (document 002, 25)."""


class RealArm(NamedTuple):
    """The true numbers of one arm."""

    d: Array
    a: Array
    alpha: Array
    theta: Array
    gears: str
    gear: float
    """Amplitude [m] of each harmonic of each joint."""
    phase: Array
    direction: Array
    sag: float
    """How far [m] the tool hangs down at full reach."""

    def pose(self, q: Array) -> Array:
        """Where the reflector's frame is (N, 4, 4) at joint values (N, 6)."""
        harmonics = np.arange(1, 3)[:, None, None]
        waves = self.gear * np.sin(harmonics * q + self.phase[:, None])
        turned = q + self.theta
        if self.gears == "joint":
            turned = turned + waves.sum(axis=0) / LEVER
        T = np.tile(np.eye(4), (len(q), 1, 1))
        for k in range(6):
            T = T @ _row(turned[:, k], self.d[k], self.a[k], self.alpha[k])
        T[:, :3, 3] += T[:, :3, :3] @ TARGET_POINT
        # a cantilever's moment and its arm both grow with the distance
        T[:, 2, 3] -= self.sag * (T[:, :2, 3] ** 2).sum(axis=1) / REACH**2
        if self.gears == "tool":
            T[:, :3, 3] += np.einsum("hnj,hjx->nx", waves, self.direction)
        return T

    def position(self, q: Array) -> Array:
        """Where the reflector is (N, 3) at joint values (N, 6)."""
        points: Array = self.pose(q)[:, :3, 3]
        return points

    def measured(self, q: Array, rng: np.random.Generator) -> Array:
        """What a measuring device says (N, 3)."""
        points: Array = self.position(q) + rng.normal(0.0, NOISE, (len(q), 3))
        return points


def real_arm(rng: np.random.Generator, gears: str = "joint") -> RealArm:
    """One arm drawn at random: normal errors of 0.3 mm and 0.02 degrees in every parameter."""
    direction = rng.normal(size=(2, 6, 3))
    return RealArm(
        D + rng.normal(0.0, LENGTH_ERROR, 6),
        A + rng.normal(0.0, LENGTH_ERROR, 6),
        ALPHA + rng.normal(0.0, ANGLE_ERROR, 6),
        THETA + rng.normal(0.0, ANGLE_ERROR, 6),
        gears,
        GEAR_ERROR,
        rng.uniform(0.0, 2.0 * np.pi, (2, 6)),
        direction / np.linalg.norm(direction, axis=2, keepdims=True),
        SAG,
    )


def nominal() -> RealArm:
    """The arm as it is said to be."""
    none = np.zeros((2, 6))
    return RealArm(D, A, ALPHA, THETA, "joint", 0.0, none, np.zeros((2, 6, 3)), 0.0)


def _row(theta: Array, d: float, a: float, alpha: float) -> Array:
    c, s = np.cos(theta), np.sin(theta)
    ca, sa = np.cos(alpha), np.sin(alpha)
    M = np.zeros((len(theta), 4, 4))
    M[:, 0] = np.stack([c, -s * ca, s * sa, a * c], axis=1)
    M[:, 1] = np.stack([s, c * ca, -c * sa, a * s], axis=1)
    M[:, 2, 1:] = [sa, ca, d]
    M[:, 3, 3] = 1.0
    return M

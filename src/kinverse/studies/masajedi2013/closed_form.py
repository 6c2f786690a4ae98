"""Section 4 of document 002: equations 5 to 22 as printed, and corrected (ERRATA of the sources).

Frames are those of the arm ``kr16``: z upwards, where the document has y; its theta5 is minus ours.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import judge

__all__ = ["EQUATIONS", "eight", "measured"]

Array = NDArray[np.float64]

D1, A1, L2, ELBOW, L34, L5F = 0.675, 0.260, 0.680, 0.035, 0.670, 0.115
"""Lengths of the KR16 [m]: L34 = l3 + l4 and L5F = l5 + lF of the document; ELBOW is not in it."""
FOREARM = float(np.hypot(L34, ELBOW))
MM = 1000.0


def eight(T: Array) -> Array:
    """All solutions of poses (N, 4, 4), limits ignored: (N, 8, 6) [rad], NaN where there is none.

    The corrected equations: theta1 by (6), phi by (8) with the elbow's offset and anew for each
    theta1, theta2 by (11) with the square, the wrist by (18) and (20) to (22) with their signs.
    """
    w = T[:, :3, 3] - L5F * T[:, :3, 2]
    out = np.full((len(T), 8, 6), np.nan)
    for k in range(8):
        shoulder, elbow, wrist = (1 - 2 * (k >> bit & 1) for bit in (2, 1, 0))
        t1 = np.arctan2(shoulder * w[:, 1], shoulder * w[:, 0])
        u = shoulder * np.hypot(w[:, 0], w[:, 1]) - A1
        v = D1 - w[:, 2]
        with np.errstate(invalid="ignore"):
            b = elbow * np.arccos((u**2 + v**2 - L2**2 - FOREARM**2) / (2.0 * L2 * FOREARM))
        t2 = np.arctan2(v, u) - np.arctan2(FOREARM * np.sin(b), L2 + FOREARM * np.cos(b))
        t3 = b - np.arctan2(L34, -ELBOW)
        W = np.swapaxes(_arm_rotation(t1, t2, t3), 1, 2) @ T[:, :3, :3]
        t4 = np.arctan2(wrist * W[:, 1, 2], wrist * W[:, 0, 2])
        t5 = -np.arctan2(wrist * np.hypot(W[:, 0, 2], W[:, 1, 2]), W[:, 2, 2])
        t6 = np.arctan2(wrist * W[:, 2, 1], -wrist * W[:, 2, 0])
        out[:, k] = np.stack([t1, t2, t3 + np.pi / 2, t4, t5, t6], axis=1)
    return out


def measured(q: Array) -> dict[str, tuple[float, str]]:
    """Largest error of every equation over joint values (N, 6), and its unit.

    Keys are those of ``EQUATIONS``: a number and a reading.
    """
    robot = kv.load("kr16")
    known = _Known(robot, q)
    return {name: (float(np.max(check(known))), unit) for name, (check, unit) in EQUATIONS.items()}


class _Known:
    """What is known where the joint values are: places and directions along the arm."""

    def __init__(self, robot: kv.Robot, q: Array) -> None:
        self.q = q
        stops = judge.frames(robot, q)
        self.T = stops[-1]
        # a standard row puts the joint's frame behind its link: the elbow is where joint 3 stands
        self.shoulder, self.elbow = stops[1][:, :3, 3], stops[2][:, :3, 3]
        self.wrist = stops[4][:, :3, 3]
        self.w = self.T[:, :3, 3] - L5F * self.T[:, :3, 2]
        self.reach = np.linalg.norm(self.wrist - self.shoulder, axis=1)
        self.z4 = stops[3][:, :3, 2]
        self.R4 = _arm_rotation(q[:, 0], q[:, 1], q[:, 2] - np.pi / 2)
        self.W = np.swapaxes(self.R4, 1, 2) @ self.T[:, :3, :3]
        self.wrist_angles = q[:, 3], -q[:, 4], q[:, 5]


def _theta1(at: _Known) -> Array:
    t1 = np.arctan2(at.w[:, 1], at.w[:, 0])
    best: Array = np.minimum(_turned(t1 - at.q[:, 0]), _turned(t1 + np.pi - at.q[:, 0]))
    return best


def _phi_straight(at: _Known) -> Array:
    """As if the forearm ran straight from the elbow to the wrist."""
    phi = _arccos((L2**2 + L34**2 - at.reach**2) / (2.0 * L2 * L34))
    return _off(phi, _angle(at.shoulder - at.elbow, at.wrist - at.elbow))


def _phi(at: _Known) -> Array:
    phi = _arccos((L2**2 + FOREARM**2 - at.reach**2) / (2.0 * L2 * FOREARM))
    return _off(phi, _angle(at.shoulder - at.elbow, at.wrist - at.elbow))


def _one_phi(at: _Known) -> Array:
    """By how much |p14| differs between theta1 and theta1 + pi [mm]."""
    rho, height = np.hypot(at.w[:, 0], at.w[:, 1]), at.w[:, 2] - D1
    return MM * _off(np.hypot(rho - A1, height), np.hypot(rho + A1, height))


def _beta2_printed(at: _Known) -> Array:
    """Lengths in millimetres, as the document's figure 3 has them: |p14| is not squared."""
    reach = MM * at.reach
    beta2 = _arccos((MM**2 * (L2**2 - FOREARM**2) + reach) / (2.0 * MM * L2 * reach))
    return _off(beta2, _angle(at.elbow - at.shoulder, at.wrist - at.shoulder))


def _beta2(at: _Known) -> Array:
    beta2 = _arccos((L2**2 - FOREARM**2 + at.reach**2) / (2.0 * L2 * at.reach))
    return _off(beta2, _angle(at.elbow - at.shoulder, at.wrist - at.shoulder))


def _theta5(at: _Known) -> Array:
    return _off(_angle(at.z4, at.T[:, :3, 2]), np.abs(at.q[:, 4]))


def _arm_rotations(at: _Known) -> Array:
    """How many different 0R4 the arm's four postures have at each pose; printed: two."""
    answers = eight(at.T)[:, ::2]
    R = np.stack(
        [_arm_rotation(*answers[:, k, :3].T - [[0.0], [0.0], [np.pi / 2]]) for k in range(4)], 1
    )
    apart = np.abs(R[:, :, None] - R[:, None]).max(axis=(3, 4)) > 1e-6
    first = ~np.tril(~apart & ~np.isnan(apart), -1).any(axis=2)
    return np.asarray((first & ~np.isnan(R[:, :, 0, 0])).sum(axis=1), np.float64)


def _as_rotation_printed(at: _Known) -> Array:
    return _largest(at.R4 @ at.T[:, :3, :3] - at.W)


def _matrix_printed(at: _Known) -> Array:
    return _largest(_zyz(*at.wrist_angles, sign=-1.0) - at.W)


def _matrix(at: _Known) -> Array:
    return _largest(_zyz(*at.wrist_angles) - at.W)


def _triple_printed(at: _Known) -> Array:
    t4 = np.arctan2(at.W[:, 1, 2], at.W[:, 0, 2])
    t6 = np.arctan2(-at.W[:, 2, 1], at.W[:, 2, 0])
    return _largest(_zyz(t4, np.arccos(np.clip(at.W[:, 2, 2], -1, 1)), t6) - at.W)


def _triple(at: _Known) -> Array:
    """Both signs of theta5, the worse of the two."""
    found = []
    for sign in (1.0, -1.0):
        t4 = np.arctan2(sign * at.W[:, 1, 2], sign * at.W[:, 0, 2])
        t5 = np.arctan2(sign * np.hypot(at.W[:, 0, 2], at.W[:, 1, 2]), at.W[:, 2, 2])
        t6 = np.arctan2(sign * at.W[:, 2, 1], -sign * at.W[:, 2, 0])
        found.append(_largest(_zyz(t4, t5, t6) - at.W))
    return np.maximum(*found)


EQUATIONS: dict[str, tuple[Callable[[_Known], Array], str]] = {
    "(5)-(6) theta1": (_theta1, "rad"),
    "(8) phi, forearm straight": (_phi_straight, "rad"),
    "(8) phi, with the elbow's offset": (_phi, "rad"),
    "(7)-(9) one phi for both theta1": (_one_phi, "mm"),
    "(11) beta2, p14 not squared": (_beta2_printed, "rad"),
    "(11) beta2, p14 squared": (_beta2, "rad"),
    "(13), (16) theta5": (_theta5, "rad"),
    "(14)-(19) number of different 0R4": (_arm_rotations, "rotations, two printed"),
    "(17) 4R7 = 0R4 0R7": (_as_rotation_printed, "-"),
    "(18) element (2,2) as printed": (_matrix_printed, "-"),
    "(18) with + c4 c6": (_matrix, "-"),
    "(20)-(22) the triple as printed": (_triple_printed, "-"),
    "(20)-(22) with their signs": (_triple, "-"),
}
"""Readings by name, in the order of the list of checked equations in the study's data."""


def _arm_rotation(t1: Array, t2: Array, t3: Array) -> Array:
    """0R3 (N, 3, 3), which is the document's 0R4 with theta4 = 0; angles of the plain rows."""
    R = np.eye(3)[None]
    for angle, alpha in ((t1, -1.0), (t2, 0.0), (t3, -1.0)):
        c, s, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
        ca, sa = 1.0 - abs(alpha), alpha
        row = [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [zero, zero + sa, zero + ca]]
        R = R @ np.moveaxis(np.array(row), 2, 0)
    return R


def _zyz(t4: Array, t5: Array, t6: Array, sign: float = 1.0) -> Array:
    """Equation 18; ``sign`` of c4 c6 in element (2,2), printed as -1."""
    c4, s4, c5, s5, c6, s6 = (f(t) for t in (t4, t5, t6) for f in (np.cos, np.sin))
    row = [
        [c4 * c5 * c6 - s4 * s6, -c4 * c5 * s6 - s4 * c6, c4 * s5],
        [s4 * c5 * c6 + c4 * s6, -s4 * c5 * s6 + sign * c4 * c6, s4 * s5],
        [-s5 * c6, s5 * s6, c5],
    ]
    return np.moveaxis(np.array(row), 2, 0)


def _largest(difference: Array) -> Array:
    return np.asarray(np.abs(difference).max(axis=(1, 2)))


def _off(a: Array, b: Array) -> Array:
    return np.asarray(np.abs(a - b))


def _arccos(value: Array) -> Array:
    # what lies beyond has no angle: the nearest that has one
    return np.asarray(np.arccos(np.clip(value, -1.0, 1.0)))


def _angle(a: Array, b: Array) -> Array:
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)))


def _turned(angle: Array) -> Array:
    return np.asarray(np.abs((angle + np.pi) % (2.0 * np.pi) - np.pi))

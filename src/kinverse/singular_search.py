"""Singular postures of arms whose determinant has no known factors: found first, described after.

Postures where the joint screws are dependent are solved for from a spread of starts, limits
ignored. What the ones found have in common becomes words. Where words say that joint values
suffice, that was tried; what they say of lines follows from the linear dependence of lines
(Merlet, Int. J. Robotics Research 8(5), 1989). A search can miss a kind: it never says "all".
"""

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.singularities import Singularity

__all__ = ["Postures", "found_singularities", "singular_postures"]

Array = NDArray[np.float64]

STARTS = 32
ITERATIONS = 16
SOLVED = 1e-11
"""Residual of the dependence between unit screws."""
CLEAR = 1e-3
"""Second smallest singular value below which a posture lies where kinds of singularity cross."""
NOTHING = 1e-7
"""Shares in a dependence, slopes, pitches and differences of angles that count as none."""
ALIKE = 1e-4
"""Joint values of one kind that count as one: double roots are found to half the digits."""


class Postures(NamedTuple):
    """Postures in which one dimension of motion is lost; lengths in sizes of the arm.

    Attributes:
        q: (k, n) joint values [rad or sizes].
        motion: (k, n) joint speeds that leave the tool at rest; nothing for redundant arms.
        wrench: (k, 6) moment about the base's origin and force that no joint feels.
        slope: (k, n) derivatives of the lost motion by the joints: zero for those that the surface
            det J = 0 does not depend on; of use to arms of six joints.
    """

    q: Array
    motion: Array
    wrench: Array
    slope: Array


def found_singularities(robot: Robot, rank: int, size: float) -> tuple[Singularity, ...]:
    """What singular postures of an arm have in common, in words; nothing where none was found.

    Args:
        robot: an arm without mimic joints.
        rank: largest rank of its Jacobian.
        size: a length of the arm [m].
    """
    if robot.dof > rank and rank < 6:
        return ()  # what no joint can do would be found everywhere
    postures = singular_postures(robot, rank, size)
    said: dict[str, Singularity] = {}
    for alike in _kinds(robot, rank, postures):
        one = Postures(*(values[alike] for values in postures))
        found = _describe(robot, rank, size, one)
        said.setdefault(found.condition, found)
    return tuple(said.values())


def singular_postures(robot: Robot, rank: int, size: float) -> Postures:
    """Postures that lose one dimension, by damped Newton steps from a spread of starts."""
    n = robot.dof
    turning = np.array([kind == "R" for kind in robot.kinds])
    primes = np.array([2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53] * 2)[:n]
    spread = np.mod(np.outer(np.arange(1, STARTS + 1), np.sqrt(primes)), 1.0) * 2.0 - 1.0
    q = spread * np.where(turning, np.pi, 1.0)
    redundant = n > rank
    S = _screws(robot, q, size)
    U, _, Vt = np.linalg.svd(S, full_matrices=False)
    x = U[:, :, -1] if redundant else Vt[:, -1, :]
    for _ in range(ITERATIONS):
        # S x = 0, or S^T x = 0 for redundant arms, and |x| = 1; unknown are q and x
        own = S.transpose(0, 2, 1) if redundant else S
        pattern = "kaij,ka->kij" if redundant else "kaij,ki->kaj"
        A = np.concatenate([np.einsum(pattern, _slopes(S), x), own], axis=-1)
        unit = np.concatenate([np.zeros_like(q), x], axis=-1)
        A = np.concatenate([A, unit[:, None, :]], axis=1)
        F = np.append(np.einsum("kai,ki->ka", own, x), ((x * x).sum(1)[:, None] - 1.0) / 2, axis=1)
        miss = np.minimum((F * F).sum(axis=1), 1.0)
        if miss.max() < SOLVED**2:
            break
        M = A @ A.transpose(0, 2, 1)
        M += (1e-14 + 1e-2 * miss)[:, None, None] * np.eye(M.shape[-1])
        step = -(A.transpose(0, 2, 1) @ np.linalg.solve(M, F[..., None]))[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step[:, :n]).max(axis=1), 0.5))[:, None]
        q, x = q + step[:, :n], x + step[:, n:]
        S = _screws(robot, q, size)
    U, s, Vt = np.linalg.svd(S)
    lost = min(n, rank) - 1
    good = (s[:, lost] < SOLVED) & (s[:, lost - 1] > CLEAR)
    q, U, Vt, S = q[good], U[good], Vt[good], S[good]
    q[:, turning] = np.mod(q[:, turning] + np.pi, 2 * np.pi) - np.pi
    wrench, motion = U[:, :, lost], Vt[:, lost, :]
    return Postures(q, motion, wrench, np.einsum("ka,kaij,ki->kj", wrench, _slopes(S), motion))


def _screws(robot: Robot, q: Array, size: float) -> Array:
    """Joint screws (..., 6, n) about the base's origin; lengths, in q too, in sizes of the arm."""
    unit = np.array([1.0 if kind == "R" else size for kind in robot.kinds])
    J, p = robot.jacobian(q * unit) * unit, robot.fk(q * unit)[..., :3, 3]
    turn = J[..., 3:, :]
    slide = J[..., :3, :] - np.cross(turn, p[..., :, None], axis=-2)
    return np.concatenate([turn, slide / size], axis=-2)


def _slopes(S: Array) -> Array:
    """Derivative of screw i by joint j, (k, 6, i, j): the Lie bracket [s_j, s_i] for j before i."""
    w, v = S[..., :3, :], S[..., 3:, :]

    def by(a: Array, b: Array) -> Array:
        return np.cross(a[..., :, None, :], b[..., :, :, None], axis=-3)

    return np.concatenate([by(w, w), by(w, v) + by(v, w)], axis=-3) * np.tri(S.shape[-1], k=-1)


def _kinds(robot: Robot, rank: int, postures: Postures) -> list[NDArray[np.intp]]:
    """Postures of one kind together, the most frequent kind first; a single one is no kind."""
    if robot.dof == rank == 6:
        largest = np.abs(postures.slope).max(axis=1, keepdims=True, initial=1e-300)
        marks = np.abs(postures.slope) > NOTHING * largest
    else:
        marks = _recurring(robot, postures.q, NOTHING)
    _, kind = np.unique(marks, axis=0, return_inverse=True)
    groups = [np.flatnonzero(kind.ravel() == k) for k in range(kind.max(initial=-1) + 1)]
    return sorted((g for g in groups if len(g) > 1), key=lambda g: -len(g))


def _recurring(robot: Robot, q: Array, near: float) -> NDArray[np.bool_]:
    """Which joint values come back in other postures, half turns apart or not: not by chance."""
    apart = q[:, None, :] - q[None, :, :]
    turning = np.array([kind == "R" for kind in robot.kinds])
    apart = np.where(turning, np.mod(apart + np.pi / 2, np.pi) - np.pi / 2, apart)
    return np.asarray((np.abs(apart) < near).sum(axis=1) > 1)


def _describe(robot: Robot, rank: int, size: float, one: Postures) -> Singularity:
    fixed = np.flatnonzero(_recurring(robot, one.q, ALIKE).all(axis=0))
    values = [_different(one.q[:, joint].tolist()) for joint in fixed]
    name, words = _lines(robot, rank, one)
    if len(fixed):
        also = [_with_half_turns(v, robot.kinds[j]) for j, v in zip(fixed, values, strict=True)]
        for several in (also, values):
            if _suffices(robot, rank, size, fixed, several):
                where = _where(robot, size, fixed, several)
                return Singularity(name or "joint values", "; ".join(filter(None, (where, words))))
    if name in ("in line", "one plane"):
        return Singularity(name, words)
    if robot.dof == rank == 6:
        on = np.flatnonzero((np.abs(one.slope) > NOTHING).any(axis=0))
        over = f"a surface over joints {_listed(on)}" if len(on) > 1 else "postures"
        where = f"{over} where det J = 0"
    elif len(fixed):
        where = f"{_where(robot, size, fixed, values)}, with a further condition on other joints"
    else:
        where = "postures in which no joint stands at one value"
    return Singularity(name or "general", f"{where}; {words or 'no simple geometric condition'}")


def _lines(robot: Robot, rank: int, one: Postures) -> tuple[str, str]:
    """What dependent screws say about axes, where all of them are lines."""
    moved = np.flatnonzero((np.abs(one.motion) > NOTHING).any(axis=0))
    if robot.dof <= rank and {robot.kinds[joint] for joint in moved} == {"R"}:
        if len(moved) == 2:
            return "in line", f"axes {_listed(moved)} are in line"
        if len(moved) == 3:
            return "one plane", f"axes {_listed(moved)} lie in one plane and meet or are parallel"
    if rank < 6 or "P" in robot.kinds:  # some wrench is without effect in any posture
        return "", ""
    moment, force = one.wrench[:, :3], one.wrench[:, 3:]
    if np.abs(force).max() < NOTHING:
        return "parallel to a plane", "all axes are parallel to one plane"
    if np.abs((moment * force).sum(axis=1)).max() < NOTHING:
        across = "one line meets or is parallel to every axis"
        return "one line", f"{across}: the tool cannot move along it"
    return "", ""


def _suffices(
    robot: Robot, rank: int, size: float, fixed: NDArray[np.intp], values: list[list[float]]
) -> bool:
    """Whether these joint values, one of each, are singular whatever the other joints do."""
    chosen = np.array(list(product(*values)))
    q = np.mod(np.outer(np.arange(1, 5), np.arange(1, robot.dof + 1)) * 0.6180339887, 1.0) * 4 - 2
    q = np.repeat(q[None], len(chosen), axis=0)
    q[:, :, fixed] = chosen[:, None, :]
    s = np.linalg.svd(_screws(robot, q, size), compute_uv=False)
    return bool((s[..., min(robot.dof, rank) - 1] < 10 * NOTHING).all())


def _with_half_turns(values: list[float], kind: str) -> list[float]:
    if kind == "P":
        return values
    turned = (v - np.pi if v > 0 else v + np.pi for v in values)
    return _different([*values, *turned])


def _different(values: list[float]) -> list[float]:
    """One for each cluster: a quarter turn where it is one, -pi as pi."""
    ordered = np.sort(values)
    clusters = np.split(ordered, np.flatnonzero(np.diff(ordered) > ALIKE) + 1)
    return sorted({_rounded(float(np.median(cluster))) for cluster in clusters})


def _rounded(value: float) -> float:
    quarter = round(value / (np.pi / 2))
    if abs(value - quarter * np.pi / 2) < ALIKE:
        return float((2 if quarter == -2 else quarter) * np.pi / 2)
    return value


def _where(robot: Robot, size: float, fixed: NDArray[np.intp], values: list[list[float]]) -> str:
    def said(joint: int, value: float) -> str:
        return _angle(value) if robot.kinds[joint] == "R" else f"{value * size:.4g} m"

    return " and ".join(
        f"joint {joint + 1} at {' or '.join(said(joint, v) for v in several)}"
        for joint, several in zip(fixed, values, strict=True)
    )


def _angle(value: float) -> str:
    words = {-1: "-pi/2", 0: "0", 1: "pi/2", 2: "pi"}
    k = round(value / (np.pi / 2))
    return words[k] if k in words and value == k * np.pi / 2 else f"{value:.4f}"


def _listed(joints: NDArray[np.intp]) -> str:
    names = [str(joint + 1) for joint in joints]
    return ", ".join(names[:-1]) + (" and " if names[1:] else "") + names[-1]

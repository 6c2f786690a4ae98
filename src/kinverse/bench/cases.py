"""Targets: random, singular, at the edge, out of reach, along a path. No solver's seed is used."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import geometry, oracle

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["SINGULAR", "SPECIAL", "around", "beyond", "path", "rank_deficient", "reachable"]

Array = NDArray[np.float64]
SEED = 0x6B76
"""First word of every stream here, so that targets share nothing with a solver's draws."""


def stream(*key: int) -> np.random.Generator:
    """A generator of its own for every kind of case."""
    return np.random.default_rng([SEED, *key])


def reachable(robot: "Robot", count: int, seed: int = 1) -> tuple[Array, Array]:
    """Joint values uniform inside the limits, and their poses: (N, n), (N, 4, 4)."""
    low, high = robot.limits.T
    q = stream(seed).uniform(low, high, (count, robot.dof))
    return q, oracle.pose(robot, q)


# ---------------------------------------------------------------------------- singular and special
def wrist_singular(robot: "Robot", count: int) -> Array | None:
    """Axes 4 and 6 of a six-axis arm in line."""
    if robot.kinds != "RRRRRR" or robot.dof != 6:
        return None
    probe = np.zeros((3, 6))
    probe[:, 4] = 0.0, np.pi / 2, np.pi
    joints = oracle.frames(robot, probe)
    cosines = np.sum(joints[3][:, :3, 2] * joints[5][:, :3, 2], axis=1)
    angles = geometry.extremes(cosines)
    if abs(np.ptp([cosines[0], cosines[2]])) < 1e-9 and abs(cosines[1] - cosines[0]) < 1e-9:
        return None
    return _with(robot, count, 4, lambda q: [np.full(len(q), a) for a in angles], key=11)


def stretched(robot: "Robot", count: int) -> Array | None:
    """The elbow straight, or folded where the limits allow it."""
    arm = geometry.read(robot)
    if arm is None:
        return None
    shoulder, elbow = arm.planar[:2]
    angles = _reach_angles(arm, elbow, shoulder, hinges=2)
    return _with(robot, count, elbow, lambda q: [np.full(len(q), a) for a in angles], key=12)


def shoulder_singular(robot: "Robot", count: int) -> Array | None:
    """The wrist's centre in the plane of axes 1 and 2 (on axis 1 if there is no lateral offset)."""
    arm = geometry.read(robot)
    if arm is None or not arm.waist:
        return None
    hinge = arm.planar[0]

    def roots(q: Array) -> list[Array]:
        # the radial coordinate of c is A + B cos t + C sin t in the shoulder's angle t
        values = []
        for t in (0.0, np.pi / 2, np.pi):
            probe = q.copy()
            probe[:, hinge] = t
            joints = oracle.frames(robot, probe)
            across = np.cross(joints[hinge][:, :3, 2], arm.axis)
            offset = arm.point(joints[-1]) - arm.axis_point
            values.append(np.sum(offset * across, axis=1))
        middle = 0.5 * (values[0] + values[2])
        b, c = values[0] - middle, values[1] - middle
        with np.errstate(invalid="ignore"):
            half = np.arccos(-middle / np.hypot(b, c))
        top = np.arctan2(c, b)
        return [top + half, top - half]

    return _with(robot, count, hinge, roots, key=13)


def at_limits(robot: "Robot", count: int) -> Array | None:
    """One joint exactly at one of its limits."""
    rng = stream(14)
    low, high = robot.limits.T
    q = rng.uniform(low, high, (count, robot.dof))
    joint = rng.integers(robot.dof, size=count)
    side = rng.integers(2, size=count)
    q[np.arange(count), joint] = robot.limits[joint, side]
    return q


def right_angles(robot: "Robot", count: int) -> Array | None:
    """Turning joints exactly at 0, +-pi/2 or +-pi: one of them, or all."""
    rng = stream(15)
    low, high = robot.limits.T
    q = rng.uniform(low, high, (count, robot.dof))
    exact = np.array([0.0, np.pi / 2, -np.pi / 2, np.pi, -np.pi])[
        rng.integers(5, size=(count, robot.dof))
    ]
    chosen = rng.random((count, robot.dof)) < np.where(rng.random(count) < 0.5, 0.2, 1.0)[:, None]
    turns = np.array([k == "R" for k in robot.kinds])[
        [list(robot.source).index(j) for j in range(robot.dof)]
    ]
    chosen &= turns & (exact >= low) & (exact <= high)
    return np.where(chosen, exact, q)


def rank_deficient(robot: "Robot", count: int) -> Array | None:
    """Joint values (N, n) inside the limits at which the Jacobian has lost rank.

    Its smallest singular value (of those that are not zero everywhere; lengths in arm lengths) is
    at most 1e-12 of its largest. From random joint values, Newton steps on the part of the Jacobian
    between the last singular vectors of both sides: smooth where the singular value has a kink, and
    not bound to square matrices as det J is. None where next to no start ends in such a place: arms
    of few joints mostly have none.
    """
    rng = stream(16)
    low, high = robot.limits.T
    length = np.linalg.norm(robot.frames[:, :3, 3], axis=1).sum() or 1.0
    slides = np.array([kind == "P" for kind in robot.kinds])[
        [list(robot.source).index(j) for j in range(robot.dof)]
    ]

    def scaled(q: Array) -> Array:
        J = oracle.jacobian(robot, q)
        J[:, :3] /= length
        J[:, :, slides] *= length
        return J

    probe = np.linalg.svd(scaled(rng.uniform(low, high, (32, robot.dof))), compute_uv=False)
    last = int((probe > 1e-9 * probe[:, :1]).sum(axis=1).max()) - 1
    found = np.empty((0, robot.dof))
    for _ in range(10):
        q = rng.uniform(low, high, (max(count, 256), robot.dof))
        for _ in range(40):
            U, values, Vt = np.linalg.svd(scaled(q))
            left, right = U[:, :, last:], np.swapaxes(Vt, 1, 2)[:, :, last:]
            rest = np.swapaxes(left, 1, 2) @ scaled(q) @ right
            slopes = np.empty((*rest.shape, robot.dof))
            for k, step in enumerate(np.eye(robot.dof) * 1e-5):
                change = (scaled(q + step) - scaled(q - step)) / 2e-5
                slopes[..., k] = np.swapaxes(left, 1, 2) @ change @ right
            rows = slopes.reshape(len(q), -1, robot.dof)
            move = np.linalg.pinv(rows, rcond=1e-6) @ rest.reshape(len(q), -1, 1)
            q = q - np.clip(move[..., 0], -0.3, 0.3)
            turns = 2 * np.pi * np.round((q - 0.5 * (low + high)) / (2 * np.pi))
            q = np.clip(np.where(slides, q, q - turns), low, high)
        values = np.linalg.svd(scaled(q), compute_uv=False)
        kept = values[:, last] <= 1e-12 * values[:, 0]
        found = np.concatenate([found, q[kept]])
        if len(found) >= count:
            return found[:count]
        if len(found) < 0.002 * len(q):
            break
    return None


Special = Callable[["Robot", int], Array | None]
SINGULAR: dict[str, Special] = {
    "wrist singular": wrist_singular,
    "arm stretched": stretched,
    "shoulder singular": shoulder_singular,
}
SPECIAL: dict[str, Special] = SINGULAR | {
    "a joint at a limit": at_limits,
    "joints at 0, +-pi/2, pi": right_angles,
}


def _reach_angles(arm: geometry.Arm, joint: int, origin: int, hinges: int) -> tuple[float, float]:
    """Angles of a planar joint at which the point behind it is farthest from another joint."""
    probe = np.zeros((3, arm.robot.dof))
    probe[:, joint] = 0.0, np.pi / 2, np.pi
    joints = oracle.frames(arm.robot, probe)
    end = arm.planar[hinges] if hinges < len(arm.planar) else None
    tip = arm.point(joints[-1]) if end is None else joints[end][:, :3, 3]
    normal = joints[origin][0, :3, 2]
    v = tip - joints[origin][:, :3, 3]
    v = v - (v @ normal)[:, None] * normal
    return geometry.extremes(np.sum(v * v, axis=1))


def _with(
    robot: "Robot", count: int, joint: int, angles: Callable[[Array], list[Array]], key: int
) -> Array | None:
    """Random joint values with one joint set to one of its special values inside the limits."""
    rng = stream(key)
    low, high = robot.limits.T
    found = np.empty((0, robot.dof))
    for _ in range(40):
        q = rng.uniform(low, high, (count, robot.dof))
        choices = angles(q)
        value = np.array(choices)[rng.integers(len(choices), size=count), np.arange(count)]
        turn = 2 * np.pi * np.round((q[:, joint] - value) / (2 * np.pi))
        q[:, joint] = value + turn
        good = (q[:, joint] >= low[joint]) & (q[:, joint] <= high[joint])
        found = np.concatenate([found, q[good]])
        if len(found) >= count:
            return found[:count]
    return None


# ---------------------------------------------------------------------------- out of reach
def around(robot: "Robot", count: int) -> tuple[Array, int]:
    """Poses (N, 4, 4) in and around the workspace, and how many of the first are reachable.

    Half are those of random joint values, turns of any angle; a quarter are such poses moved by a
    twentieth of the workspace's size and turned by 0.1 rad (standard deviations); a quarter lie
    anywhere in a box a fifth larger than the workspace, turned at random.
    """
    rng = stream(22)
    slides = oracle.slides(robot)
    low, high = np.where(slides, robot.limits.T, np.array([[-np.pi], [np.pi]]))
    T = oracle.pose(robot, rng.uniform(low, high, (count, robot.dof)))
    ends = T[:, :3, 3].min(axis=0), T[:, :3, 3].max(axis=0)
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    size = float(np.linalg.norm(half)) or 1.0
    inside, moved = count // 2, count // 4
    near = T[inside : inside + moved]
    near[:, :3, 3] += 0.05 * size * rng.normal(size=(moved, 3))
    near[:, :3, :3] = _turns(0.1 * rng.normal(size=(moved, 3))) @ near[:, :3, :3]
    free = T[inside + moved :]
    # a box around a flat workspace has a thickness too
    half = 1.2 * np.maximum(half, 0.05 * size)
    free[:, :3, 3] = rng.uniform(middle - half, middle + half, (len(free), 3))
    axis = rng.normal(size=(len(free), 4))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    angle = 2.0 * np.arctan2(np.linalg.norm(axis[:, 1:], axis=1), axis[:, 0])
    axis = axis[:, 1:] / np.linalg.norm(axis[:, 1:], axis=1)[:, None]
    free[:, :3, :3] = _turns(angle[:, None] * axis)
    return T, inside


def _turns(vectors: Array) -> Array:
    """Rotations (N, 3, 3) by vectors (N, 3): Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T / np.maximum(angle[:, 0, 0], 1e-300)
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))


def beyond(robot: "Robot", count: int) -> dict[str, Array]:
    """Poses 1-50 mm outside the outer and the inner boundary, limits ignored.

    Each is shown to be out of reach by ``geometry.Arm.clearance``. A boundary that the arm does
    not have (or a hole of less than 1 mm) is left out.
    """
    arm = geometry.read(robot)
    if arm is None:
        return {}
    made = {"outer": _gather(arm, count, _outer), "inner": _gather(arm, count, _inner)}
    return {name: T for name, T in made.items() if T is not None}


def _gather(
    arm: geometry.Arm, count: int, draw: Callable[[geometry.Arm, int, np.random.Generator], Array]
) -> Array | None:
    rng = stream(21)
    found = np.empty((0, 4, 4))
    for _ in range(60):
        T = draw(arm, count, rng)
        gap = arm.clearance(T)
        found = np.concatenate([found, T[(gap >= 1e-3) & (gap <= 50e-3)]])
        if len(found) >= count:
            return found[:count]
    return None


def _outer(arm: geometry.Arm, count: int, rng: np.random.Generator) -> Array:
    low, high = arm.robot.limits.T
    q = rng.uniform(low, high, (count, arm.robot.dof))
    for k in range(len(arm.planar) - 1, 0, -1):
        if arm.links[k] > 1e-9:
            q[:, arm.planar[k]] = _straight(arm, q[0], k)
    joints = oracle.frames(arm.robot, q)
    T = joints[-1].copy()
    hinge = joints[arm.planar[0]]
    normal = hinge[:, :3, 2]
    out = arm.point(T) - hinge[:, :3, 3]
    out -= np.sum(out * normal, axis=1)[:, None] * normal
    out /= np.linalg.norm(out, axis=1)[:, None]
    T[:, :3, 3] += rng.uniform(1e-3, 50e-3, (count, 1)) * out
    return T


def _straight(arm: geometry.Arm, q: Array, k: int) -> float:
    # the planar joint k at which c is farthest from planar joint k - 1, joints behind as in q
    probe = np.tile(q, (3, 1))
    probe[:, arm.planar[k]] = 0.0, np.pi / 2, np.pi
    joints = oracle.frames(arm.robot, probe)
    origin, normal = joints[arm.planar[k - 1]][0, :3, 3], joints[arm.planar[k - 1]][0, :3, 2]
    v = arm.point(joints[-1]) - origin
    v = v - (v @ normal)[:, None] * normal
    return geometry.extremes(np.sum(v * v, axis=1))[0]


def _inner(arm: geometry.Arm, count: int, rng: np.random.Generator) -> Array:
    """Around axis 1: inside the cylinder the lateral offset leaves, or the hole of two links."""
    _, T = _random(arm, count, rng)
    offset = arm.point(T) - arm.axis_point
    along = offset @ arm.axis
    hole = abs(arm.lateral) if arm.waist else arm.reach[0]
    around = offset - along[:, None] * arm.axis
    around /= np.linalg.norm(around, axis=1)[:, None]
    radius = np.maximum(hole - rng.uniform(1e-3, 50e-3, count), 0.0)
    if arm.waist and hole < 1e-3:
        # no cylinder: a ball about the shoulder that links of unequal lengths cannot fold into
        low = arm.reach[0]
        turn = rng.uniform(-np.pi, np.pi, count)
        deep = np.maximum(low - rng.uniform(1e-3, 50e-3, count), 0.0)
        radius = np.abs(arm.a1 + deep * np.cos(turn))
        along = arm.height + deep * np.sin(turn)
    place = arm.axis_point + along[:, None] * arm.axis + radius[:, None] * around
    T[:, :3, 3] += place - arm.point(T)
    return T


def _random(arm: geometry.Arm, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    low, high = arm.robot.limits.T
    q = rng.uniform(low, high, (count, arm.robot.dof))
    return q, oracle.pose(arm.robot, q)


# ---------------------------------------------------------------------------- paths
def path(robot: "Robot", count: int = 500, step: float = 0.02, seed: int = 1) -> Array:
    """A smooth path (N, n) inside the limits, joint steps up to ``step``, clear of singularities.

    Two sines a joint, each with its own phase; drawn again until the Jacobian's least singular
    value stays above 0.03 along it.
    """
    rng = stream(31, seed)
    low, high = robot.limits.T
    t = np.linspace(0.0, 1.0, count)[:, None]
    q = np.empty((count, robot.dof))
    for _ in range(2000):
        middle = rng.uniform(low + 0.3 * (high - low), high - 0.3 * (high - low))
        waves = rng.uniform(1.0, 3.0, (2, robot.dof)) * np.array([[1.0], [2.0]])
        phase = rng.uniform(0.0, 2 * np.pi, (2, robot.dof))
        shape = sum(np.sin(2 * np.pi * w * t + p) for w, p in zip(waves, phase, strict=True))
        size = step / np.abs(np.diff(shape, axis=0)).max()
        q = middle + np.minimum(size, 0.14 * (high - low)) * shape
        least = np.linalg.svd(oracle.jacobian(robot, q), compute_uv=False)[:, -1]
        if least.min() > 0.03 and oracle.inside(robot, q).all():
            return np.asarray(q)
    raise ValueError(f"no smooth path found for {robot.name}")

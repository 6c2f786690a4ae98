"""From joints with any axis to the canonical chain, in which every axis is z."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError, ModelError
from kinverse.robot import Robot

__all__ = ["Moving", "assemble", "z_to_axis"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moving:
    """A moving joint of a chain, as a file describes it.

    Args:
        name: the joint's name.
        kind: "R" or "P".
        before: (4, 4) from the frame after the joint before it to the joint's own frame.
        axis: (3,) direction in the joint's frame, not zero.
        limits: lower and upper value [rad or m].
        driver: name of the free joint it follows; None: it is free itself.
        multiplier: of a follower.
        offset: of a follower [rad or m].
    """

    name: str
    kind: str
    before: Array
    axis: Sequence[float]
    limits: tuple[float, float]
    driver: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


def z_to_axis(axis: Sequence[float]) -> Array:
    """A rotation (3, 3) that turns z into a direction; a signed permutation where it can be."""
    direction = np.asarray(axis, dtype=np.float64)
    direction = direction / np.abs(direction).max()
    direction = direction / np.linalg.norm(direction)
    k = int(np.argmax(np.abs(direction)))
    # the next axis round stays orthogonal to an axis along a coordinate: x, y, z to y, z, x
    u = np.zeros(3)
    u[(k + 1) % 3] = 1.0
    u -= direction * (direction @ u)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(direction, u), direction], axis=1) + 0.0


def assemble(
    joints: Sequence[Moving], tool: Array, where: str, name: str, source_note: str
) -> Robot:
    """The robot of a chain of joints and a last fixed transform.

    A follower's own limits narrow those of the joint that drives it, so that no value inside the
    limits breaks either.

    Raises:
        ModelError: no moving joint, a driver that is not in the chain, limits that leave nothing.
    """
    if not joints:
        raise ModelError(f"{where}: no joint moves between base and tip")
    names = [joint.name for joint in joints]
    if len(set(names)) != len(names):
        raise ModelError(f"{where}: joint names must differ, got {', '.join(names)}")
    free = [joint.name for joint in joints if joint.driver is None]
    limits = {joint.name: joint.limits for joint in joints if joint.driver is None}
    frames, back = [], np.eye(4)
    for joint in joints:
        turn = se3.transform(z_to_axis(joint.axis))
        frames.append(back @ joint.before @ turn)
        back = se3.inverse(turn)
        if joint.driver is not None:
            limits[joint.driver] = _narrowed(limits[joint.driver], joint, where)
    frames.append(back @ tool)
    try:
        return Robot(
            frames=np.stack(frames),
            kinds="".join(joint.kind for joint in joints),
            limits=[limits[joint] for joint in free],
            joint_names=free,
            source=[free.index(joint.driver or joint.name) for joint in joints],
            multiplier=[joint.multiplier for joint in joints],
            offset=[joint.offset for joint in joints],
            name=name,
            source_note=source_note,
        )
    except InputError as error:
        raise ModelError(f"{where}: {error}") from error


def _narrowed(limits: tuple[float, float], joint: Moving, where: str) -> tuple[float, float]:
    ends = sorted((bound - joint.offset) / joint.multiplier for bound in joint.limits)
    low, high = max(limits[0], ends[0]), min(limits[1], ends[1])
    if low > high:
        raise ModelError(
            f"{where}: joint {joint.name!r} mimics {joint.driver!r}, but no value of that joint"
            f" keeps both inside their limits"
        )
    return low, high

"""A spline through a joint path that has no gaps."""

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.joint_curve import JointCurve

if TYPE_CHECKING:
    from kinverse.paths.joint_path import JointPath

__all__ = ["curve_of"]

Array = NDArray[np.float64]

STANDS = 1e-12
"""Joints that move less than this from sample to sample [rad or m] do not move."""
TURNED = 0.1
"""Where the path has no parameter: the way [m] that a turn by 1 rad counts as."""
PLACES = 7
"""Looked at between two samples."""


def curve_of(joint_path: "JointPath", degree: int) -> JointCurve:
    """The spline through all samples, by the path's parameter, or by the way of the tool.

    Warns (UserWarning) where the path was tracked to a tolerance that the spline does not keep, as
    at a corner.

    Raises:
        InputError: the path has gaps (the first is named), or too few different samples.
    """
    if joint_path.gaps:
        raise InputError(
            "a joint path with gaps is no one motion: segments() gives its runs, each for itself;"
            f" {joint_path.first_gap}"
        )
    q, s = joint_path.q, joint_path.s
    if s is None:
        s = _way(joint_path.T)
        # a pose that repeats the one before: the arm stands
        moves = np.append(True, (np.diff(s) > 0.0) & (np.abs(np.diff(q, axis=0)).max(1) > STANDS))
        q, s = q[moves], s[moves]
    curve = JointCurve(s, q, degree)
    if joint_path.tolerance == joint_path.tolerance:
        swing = _swing(joint_path, curve)
        # the tool may be so far off between straight joint motions; the spline is at least...
        strays = swing - joint_path.deviation
        if strays > joint_path.tolerance:
            warnings.warn(
                f"the tool of the spline strays by {strays:.2g} m or more, the path was tracked to"
                f" {joint_path.tolerance:g} m: at a corner a spline swings. Round the corner"
                " (blend=), track to a smaller tolerance, or time each piece for itself",
                UserWarning,
                stacklevel=3,
            )
    return curve


def _way(T: Array) -> Array:
    """(N,) way of the tool [m] along poses (N, 4, 4), turns counted in."""
    turn = se3.rotation_log(np.swapaxes(T[:-1, :3, :3], 1, 2) @ T[1:, :3, :3])
    moved = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    return np.append(0.0, np.cumsum(np.hypot(moved, TURNED * np.linalg.norm(turn, axis=1))))


def _swing(joint_path: "JointPath", curve: JointCurve) -> float:
    """Largest distance [m] of the spline's tool from that of straight joint motions."""
    share = np.arange(1.0, PLACES + 1.0) / (PLACES + 1.0)
    a, b = curve.values[:-1, None], curve.values[1:, None]
    straight = a + share[:, None] * (b - a)
    splined = curve(curve.s[:-1, None] + share * np.diff(curve.s)[:, None])
    fk = joint_path.robot.fk
    return float(np.linalg.norm((fk(splined) - fk(straight))[..., :3, 3], axis=-1).max())

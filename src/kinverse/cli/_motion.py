"""A tracked path in time: a spline through it, as fast as limits let it, for a controller."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinverse.cli._joint_curve import joined
from kinverse.cli._path import Given
from kinverse.paths import retime, wanted
from kinverse.paths.motion_file import motion_csv

if TYPE_CHECKING:
    from kinverse.cli._joint_curve import Joined
    from kinverse.paths import JointPath, Trajectory

__all__ = ["TimedPath", "timed"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TimedPath:
    """A motion along a whole path, ready to print.

    Attributes:
        joint_path: what was tracked.
        spline: through its samples, with those that were added.
        trajectory: the motion.
        tolerance: of the tool from the path [m], None if none was asked for.
        rate: rows of a file a second [1/s].
        degrees: joints are told in degrees.
    """

    joint_path: "JointPath"
    spline: "Joined"
    trajectory: "Trajectory"
    tolerance: float | None
    rate: float
    degrees: bool

    @property
    def ok(self) -> bool:
        """The tolerance is kept, and so are the joint limits."""
        beyond = self.spline.beyond
        return self._is_near and (beyond is None or beyond.amount <= wanted.BEYOND)

    @property
    def _is_near(self) -> bool:
        return self.tolerance is None or self.spline.position <= self.tolerance

    def csv(self) -> str:
        """See ``motion_csv``."""
        return motion_csv(self.trajectory, self.joint_path.robot, self.rate, self.degrees)

    def record(self) -> dict[str, Any]:
        """The figures for JSON, in seconds and metres."""
        spline = self.spline
        return {
            "duration": self.trajectory.duration,
            "deviation": spline.position,
            "samples_added": spline.added,
            "beyond_limits": spline.beyond.amount if spline.beyond else 0.0,
        }

    def lines(self) -> list[str]:
        """What to print."""
        spline = self.spline
        more = f", {spline.added} samples added" if spline.added else ""
        told = [
            f"in time: {self.trajectory.duration:.4g} s, along a joint spline whose tool strays"
            f" {1e3 * spline.position:.3g} mm from the path{more}"
        ]
        if not self._is_near and self.tolerance is not None:
            told.append(
                f"warning: the motion does not keep the tolerance of {1e3 * self.tolerance:.3g} mm"
            )
        if spline.beyond is not None:
            told.append(f"warning: between the samples {spline.beyond.text}")
        return told


def timed(
    found: "JointPath",
    given: Given,
    limits: tuple[Array, Array],
    task: str,
    tolerance: float | None,
    rate: float,
    degrees: bool,
) -> TimedPath:
    """The fastest motion along a joint path without gaps.

    Args:
        found: what was tracked.
        given: the path it was tracked along.
        limits: speeds and accelerations (n,) of the joints [rad/s or m/s, and per s^2].
        task: which part of the poses must hold.
        tolerance: of the tool from the path [m]; None: a tenth of the distance of two poses.
        rate: rows of a file a second [1/s].
        degrees: joints are told in degrees.
    """
    samples = Given(found.T, given.s if found.s is None else found.s, given.path)
    spline = joined(found, samples, (0, len(found)), task, tolerance)
    motion = retime(spline.curve, *limits)
    return TimedPath(found, spline, motion, tolerance, rate, degrees)

"""The answer to one path: joint values, where they are continuous, and why not elsewhere."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.joint_curve import JointCurve
from kinverse.paths.path_curve import curve_of

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Angle", "Gap", "JointPath", "Reason", "SampleNumber"]

Array = NDArray[np.float64]

SHOWN = 5
"""Gaps that are printed."""
SAME_POSE = 1e-6
"""Poses that differ by less [m, and in the entries of the rotation] are one."""


class Reason(IntEnum):
    """Why a path is not followed; ``text`` says it in a sentence.

    Example:
        >>> Reason.COLLISION.text
        'every solution is refused by keep'
    """

    OUT_OF_REACH = 0
    OUT_OF_LIMITS = 1
    NOT_FOUND = 2
    COLLISION = 3
    STEP = 4
    SINGULARITY = 5
    NOT_CLOSED = 6

    @property
    def text(self) -> str:
        """One sentence for people."""
        return _TEXTS[self]


_TEXTS = (
    "out of reach",
    "solutions exist, none inside the joint limits",
    "the search found no solution; that does not show that there is none",
    "every solution is refused by keep",
    "the samples lie too far apart for the largest joint step",
    "the branch ends at a singularity, and no other continues it",
    "the joints do not end where they begin",
)


class Angle(float):
    """An angle [rad] in the words of a gap, told in the unit that is asked for."""


class SampleNumber(int):
    """A sample in the words of a gap, counted from 0."""


@dataclass(frozen=True, slots=True, repr=False)
class Gap:
    """Samples ``start`` .. ``end - 1`` that are not tracked, and why.

    With ``end == start`` no sample is lost: the joints cannot get from sample ``start - 1`` to
    sample ``start``, both of which are tracked. Before sample 0 the arm is at ``q_start``; where a
    path is to be closed, the first sample comes behind the last.

    Attributes:
        start: first sample.
        end: behind the last sample.
        code: a ``Reason``.
        words: the reason in words, with its numbers: a text, or parts of one.
        barrier: of a break, the last sample that the run before could have come to; -1 else. The
            run may end earlier, where it is cheaper to go over to the next.
    """

    start: int
    end: int
    code: Reason
    words: Sequence[str | Angle | SampleNumber]
    barrier: int = -1

    @property
    def text(self) -> str:
        """The reason in words, with its numbers: angles in rad, samples counted from 0."""
        return self.told()

    def told(self, degrees: bool = False, rows: bool = False) -> str:
        """The same, if wanted with angles in degrees and with samples as rows, counted from 1.

        Example:
            >>> Gap(0, 0, Reason.STEP, ("joint 'a' moves ", Angle(0.5))).told(degrees=True)
            "joint 'a' moves 28.6 deg"
        """
        return "".join(_told(part, degrees, rows) for part in self.words)

    def __repr__(self) -> str:
        return f"Gap: {_line(self)}"

    @property
    def is_break(self) -> bool:
        """Whether the gap lies between two samples that are both tracked."""
        return self.start == self.end


def _told(part: str | Angle | SampleNumber, degrees: bool, rows: bool) -> str:
    if isinstance(part, Angle):
        return f"{math.degrees(part):.3g} deg" if degrees else f"{part:.3g} rad"
    if isinstance(part, SampleNumber):
        return f"row {part + 1}" if rows else f"sample {int(part)}"
    return part


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Joint values along a path; arrays are read-only.

    Attributes:
        robot: whose joints they are.
        T: (N, 4, 4) the poses, with those that were added [m].
        q: (N, n) joint values [rad or m]; NaN rows where a sample is not tracked.
        branch: (N,) number of the branch, -1 where there is none or the method knows none.
        ok: (N,) the sample is tracked.
        cost: sum of the metric over all steps (and over the way from ``q_start``).
        intervals: (start, end) of the runs of samples that are followed without a break.
        gaps: ``Gap`` objects, what lies between these.
        s: (N,) the path's parameter at each sample, None if it has none.
        branch_labels: ``branch_labels[b]`` says in words which branch b is; may be empty.
        deviation: largest distance [m] of the tool from the path between samples, joints moving in
            a straight line and the parameter evenly; NaN if it was not asked for.
        tolerance: what was asked of the deviation [m]; NaN likewise.

    Example:
        >>> joint_path = track(robot, T)
        >>> joint_path.q[joint_path.ok], [gap.text for gap in joint_path.gaps]
    """

    robot: "Robot"
    T: Array
    q: Array
    branch: NDArray[np.int32]
    ok: NDArray[np.bool_]
    cost: float
    intervals: tuple[tuple[int, int], ...]
    gaps: tuple[Gap, ...]
    s: Array | None = None
    branch_labels: tuple[str, ...] = ()
    deviation: float = float("nan")
    tolerance: float = float("nan")

    def __post_init__(self) -> None:
        for name in ("T", "q", "branch", "ok", "s"):
            array = getattr(self, name)
            if array is not None:
                array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.q)

    @property
    def is_whole(self) -> bool:
        """Whether every sample is tracked without a break, from ``q_start`` on if it was given."""
        return not self.gaps

    @property
    def closure(self) -> float:
        """How far from their start the joints end where the pose does not: NaN on open paths.

        The largest difference of a joint between the last sample and the first [rad or m], whole
        turns counted: an arm with joints to spare, one that passes a singularity or winds up comes
        back to the pose otherwise. A pose within 1e-6 [m, and in the entries of the rotation] of
        the first one is the same; NaN too where one of the two is not tracked.

        Example:
            >>> track(robot, Path.circle([0.5, 0, 0.5], 0.1)).closure
        """
        if not len(self) or np.abs(self.T[-1] - self.T[0]).max() > SAME_POSE:
            return float("nan")
        return float(np.abs(self.q[-1] - self.q[0]).max())

    @property
    def largest_step(self) -> float:
        """Largest movement of any joint between two samples of a run [rad or m]; 0 without any."""
        steps = [np.abs(np.diff(q, axis=0)).max(initial=0.0) for q in self.segments()]
        return float(max(steps, default=0.0))

    def segments(self) -> tuple[Array, ...]:
        """The joint values (K, n) of each run of ``intervals``.

        Example:
            >>> [len(q) for q in joint_path.segments()]
        """
        return tuple(self.q[start:end] for start, end in self.intervals)

    def curve(self, degree: int = 5) -> JointCurve:
        """The spline through all samples, for ``retime``, ``deviation`` or ``minimum_jerk``.

        By the path's parameter, or where it has none by the way of the tool. A UserWarning says
        where the path was tracked to a tolerance that the spline does not keep, as at corners.

        Raises:
            InputError: there are gaps (the first is named), or too few samples for the degree.

        Example:
            >>> track(robot, path, tolerance=1e-4).curve()
        """
        return curve_of(self, degree)

    @property
    def first_gap(self) -> str:
        """Where the first gap lies and why it is there, in a line; empty if there is none."""
        return _line(self.gaps[0]) if self.gaps else ""

    def __repr__(self) -> str:
        lines = [
            f"JointPath: {int(self.ok.sum())} of {len(self)} samples of {self.robot.name} in"
            f" {len(self.intervals)} runs, cost {self.cost:.6g},"
            f" largest step {self.largest_step:.3g}"
        ]
        if self.closure > SAME_POSE:
            lines.append(f"the path is closed, the joints end {self.closure:.3g} from their start")
        if self.deviation > self.tolerance:
            lines.append(
                f"the tool strays {self.deviation:.3g} m, more than the tolerance"
                f" {self.tolerance:.3g} m"
            )
        lines += [_line(gap) for gap in self.gaps[:SHOWN]]
        if len(self.gaps) > SHOWN:
            lines.append(f"and {len(self.gaps) - SHOWN} gaps more")
        return "\n  ".join(lines)


def _line(gap: Gap) -> str:
    if gap.code is Reason.NOT_CLOSED:
        where = "at the end"
    elif gap.is_break:
        where = f"before sample {gap.start}"
    else:
        last = gap.end - 1
        where = f"sample {last}" if gap.start == last else f"samples {gap.start} to {last}"
    return f"{where}: {gap.code.name}, {gap.text}"

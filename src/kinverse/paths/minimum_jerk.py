"""Along a joint curve in a given time, as smoothly as can be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.paths.checks import as_length
from kinverse.paths.joint_curve import JointCurve
from kinverse.paths.trajectory import State, Trajectory

__all__ = ["minimum_jerk"]

Array = NDArray[np.float64]


def minimum_jerk(curve: JointCurve, duration: float) -> Trajectory:
    """The motion along a curve, from rest to rest, whose parameter has the least jerk.

    Flash & Hogan 1985: the share of the way is ``10 x^3 - 15 x^4 + 6 x^5`` of the share x of the
    time; speed and acceleration of both ends are zero. No limit is held: :func:`retime` does that.

    Args:
        curve: joint values by way.
        duration: [s].

    Raises:
        InputError: another curve, or a duration that is not positive and finite.

    Example:
        >>> minimum_jerk(curve, 2.0)(1.0).q
    """
    if not isinstance(curve, JointCurve):
        raise InputError(f"curve must be a JointCurve, got {type(curve).__name__}")
    seconds = as_length(duration, "duration", least=1e-300)
    return Trajectory(seconds, _Blend(curve, seconds))


@dataclass(frozen=True, eq=False)
class _Blend:
    curve: JointCurve
    duration: float

    def __call__(self, t: Array) -> State:
        first, last = self.curve.s[0], self.curve.s[-1]
        x = (t / self.duration)[:, None]
        share = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        speed = (last - first) / self.duration * 30.0 * (x * (1.0 - x)) ** 2
        pull = (last - first) / self.duration**2 * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        s = np.clip(first + share[:, 0] * (last - first), first, last)
        by_way, bent = self.curve(s, 1), self.curve(s, 2)
        return State(self.curve(s), by_way * speed, bent * speed**2 + by_way * pull)

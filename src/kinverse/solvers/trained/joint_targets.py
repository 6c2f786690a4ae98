"""Joint values as what a network is asked for."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.ranking import turning
from kinverse.robot import Robot

__all__ = ["JointTargets", "joint_targets"]

Array = NDArray[np.float64]

WHOLE_TURN = 2.0 * np.pi - 1e-6


class JointTargets(NamedTuple):
    """A joint that can turn all the way round is asked for as (cos, sin), any other as it is.

    The angle of the first kind jumps where it is wrapped, its cosine and sine do not.
    """

    circular: NDArray[np.bool_]  # (n,)

    def encode(self, q: Array) -> Array:
        """Joint values (N, n) as targets (N, n + circular joints)."""
        turning = q[:, self.circular]
        return np.hstack([q[:, ~self.circular], np.cos(turning), np.sin(turning)])

    def decode(self, targets: Array) -> Array:
        """Targets as joint values (N, n), circular ones in (-pi, pi]."""
        plain = int((~self.circular).sum())
        turning = len(self.circular) - plain
        q = np.empty((len(targets), len(self.circular)))
        q[:, ~self.circular] = targets[:, :plain]
        cosine, sine = targets[:, plain : plain + turning], targets[:, plain + turning :]
        q[:, self.circular] = np.arctan2(sine, cosine)
        return q

    def joint_errors(self, mse: Array) -> Array:
        """Mean squared errors (E, targets) as those of joints (E, n).

        A circular joint's are those of its cosine and sine together, the squared chord, which is
        the squared angle while that is small.
        """
        plain = int((~self.circular).sum())
        turning = len(self.circular) - plain
        errors = np.empty((len(mse), len(self.circular)))
        errors[:, ~self.circular] = mse[:, :plain]
        errors[:, self.circular] = mse[:, plain : plain + turning] + mse[:, plain + turning :]
        return errors


def joint_targets(robot: Robot) -> JointTargets:
    """The targets that suit a robot's limits.

    Example:
        >>> joint_targets(kv.load("kr16")).circular
        array([ True, False, False,  True, False,  True])
    """
    return JointTargets(turning(robot) & (np.ptp(robot.limits, axis=1) >= WHOLE_TURN))

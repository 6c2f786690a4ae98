"""What is followed: the samples of a path, what solves them, and the rules of steps."""

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.branches import Branches
from kinverse.paths.tracking.continuum import with_members
from kinverse.paths.tracking.layers import Keep, Layers, kept
from kinverse.paths.tracking.samples import Samples

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Problem", "Steps"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """What a step costs and how large it may be.

    Attributes:
        max_step: (n,) largest step of each joint [rad or m].
        weight: (n,) factors of the joint steps in the cost.
        squares: the cost is the root of the sum of squares; else the largest.
        q_start: (n,) joint values before the path, or None.
    """

    max_step: Array
    weight: Array
    squares: bool = False
    q_start: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A path for a robot: what it is solved with, and the rules of its steps.

    Attributes:
        branches: what gives the solutions.
        samples: the poses.
        steps: what a step costs and how large it may be.
        keep: predicate of joint values to keep.
        tolerance: a step past a singularity may lead the tool so far [m] from the path half-way.
    """

    branches: Branches
    samples: Samples
    steps: Steps
    keep: Keep | None = None
    tolerance: float = 0.0

    @property
    def robot(self) -> "Robot":
        """The robot, whose limits hold."""
        return self.branches.robot

    def layers(self) -> Layers:
        """The solutions of all samples."""
        layers = self.branches.layers(self.samples.T)
        layers = with_members(self.branches, self.samples, layers, self.steps.max_step)
        return self._with_between(kept(self.robot, layers, self.keep))

    def _with_between(self, layers: Layers) -> Layers:
        """Where ``keep`` refuses all that a grid holds, what is between its values is tried too."""
        for level in itertools.count():
            lost = np.flatnonzero((np.diff(layers.start) == 0) & (layers.removed > 0))
            more = self.branches.between(self.samples.T[lost], level) if len(lost) else None
            if more is None:
                break
            more = kept(self.robot, more, self.keep)
            layers.removed[lost] += more.removed
            at = lost[more.sample]
            layers = layers.with_rows(at, more.q, more.branch, more.side, more.fixed)
        return layers

"""Differential evolution: Storn & Price, J. Glob. Optim. 11 (1997) 341."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, real_number
from kinverse.optimizers.run import Run

__all__ = ["DifferentialEvolution"]

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

STRATEGIES = ("rand1bin", "best1bin", "currenttobest1bin", "randtobest1bin")
RENEWED = 0.1
"""How often an adaptive member's F, and its CR, are drawn anew: tau of jDE."""


class DifferentialEvolution(Optimizer):
    """Members that try steps cut to the measure of the distances between other members.

    For each member x, three others a, b, c and the best g give a donor::

        rand1bin            a + F (b - c)
        best1bin            g + F (a - b)
        currenttobest1bin   x + F (g - x) + F (a - b)
        randtobest1bin      a + F (g - a) + F (b - c)

    Each component of the donor replaces x's with probability ``crossover``, one drawn component
    always; what leaves the box is drawn anew in it, component by component. The trial takes x's
    place unless it is worse. F is drawn anew for every generation (dither). The others are the
    next three in a fresh shuffle of the population: never x itself nor each other, each choice
    equally likely.

    The default is a strong one on the pose error of robot arms: best1bin is sharper where it
    succeeds but loses more often, and the paper's own ``strategy="rand1bin", mutation=0.5`` is
    slower. The crossover is not applied in turned axes, so a ``crossover`` below 1 favours
    objectives that are sums over the variables.

    With ``adaptive`` every member has an F and a CR of its own (jDE: Brest et al., IEEE T. Evol.
    Comput. 10 (2006) 646), at first the middle of ``mutation`` and ``crossover``: for a trial each
    is, with probability 0.1, drawn anew, in ``mutation`` and in [0, 1), and stays if the trial
    does. This finds the low CR that sums over the variables call for (Rastrigin, Griewank) and
    still solves arms.

    Args:
        population: members, at least 4.
        strategy: how the donor is made.
        mutation: F, or (low, high) to draw it from.
        crossover: probability of a donor's component, CR.
        adaptive: whether members find F and CR by themselves.

    Example:
        >>> minimize(f, bounds, DifferentialEvolution(), max_evals=20_000).x
    """

    least_population = 4

    def __init__(
        self,
        *,
        population: int = 100,
        strategy: str = "randtobest1bin",
        mutation: float | tuple[float, float] = (0.5, 0.8),
        crossover: float = 0.9,
        adaptive: bool = False,
    ) -> None:
        self.population = population
        self.strategy = strategy
        self.mutation = mutation
        self.crossover = crossover
        self.adaptive = adaptive

    def _check(self, dimensions: int) -> None:
        if self.strategy not in STRATEGIES:
            names = ", ".join(STRATEGIES)
            raise InputError(f"strategy must be one of {names}, got {self.strategy!r}")
        low, high = self._dither()
        for value in (low, high):
            real_number("mutation", value, 0.0, 2.0)
        if not 0.0 < low <= high:
            raise InputError(f"mutation must be above 0 and rise, got {self.mutation!r}")
        real_number("crossover", self.crossover, 0.0, 1.0)
        if not isinstance(self.adaptive, (bool, np.bool_)):
            raise InputError(f"adaptive must be True or False, got {self.adaptive!r}")

    def _dither(self) -> tuple[float, float]:
        if not isinstance(self.mutation, (tuple, list)):
            return self.mutation, self.mutation
        if len(self.mutation) != 2:
            raise InputError(f"mutation must be a number or (low, high), got {self.mutation!r}")
        return self.mutation[0], self.mutation[1]

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        s.x, s.f = x, f
        if self.adaptive:
            s.own = np.empty((*f.shape, 2))  # F and CR of each member
            s.own[:] = 0.5 * sum(self._dither()), self.crossover

    def _ask(self, run: Run) -> Array:
        s = run.state
        _, count, dimensions = s.x.shape
        scale, crossover = self._controls(run)
        u = run.uniform((2 + dimensions) * count)
        trial = self._donors(run, u[:, :count].argsort(axis=1), scale)
        kept = u[:, 2 * count :].reshape(s.x.shape) >= crossover
        forced = (u[:, count : 2 * count] * dimensions).astype(np.intp)
        kept &= forced[:, :, None] != np.arange(dimensions)
        np.copyto(trial, s.x, where=kept)
        outside = (trial < run.low) | (trial > run.high)
        np.copyto(trial, run.scatter(count), where=outside)
        return trial

    def _controls(self, run: Run) -> tuple[Array, Array | float]:
        """F and CR, (A, 1, 1) for all or (A, K, 1) for each member."""
        low, high = self._dither()
        if not self.adaptive:
            return low + (high - low) * run.uniform(1, 1), self.crossover
        s = run.state
        u = run.uniform(2, s.x.shape[1], 2)
        fresh = u[:, 1]
        fresh *= (high - low, 1.0)
        fresh += (low, 0.0)
        s.tried = np.where(u[:, 0] < RENEWED, fresh, s.own)
        return s.tried[:, :, :1], s.tried[:, :, 1:]

    def _donors(self, run: Run, order: Ints, scale: Array) -> Array:
        """Donors (A, K, D), where the others are those that come next in a circle ``order``."""
        x, best = run.state.x, run.leader
        problems, count, dimensions = x.shape
        order += count * np.arange(problems)[:, None]
        following = np.empty(problems * count, np.intp)
        following[order] = np.roll(order, -1, axis=1)
        members = x.reshape(-1, dimensions)
        first = following.reshape(problems, count)
        second = following[first]
        step: Array = members[first]
        base = x
        if self.strategy.startswith("rand"):
            base, step = step, members[second] - members[following[second]]
        else:
            step -= members[second]
        if self.strategy == "best1bin":
            base = best
        elif self.strategy.endswith("tobest1bin"):
            step += best - base
        step *= scale
        step += base
        return step

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        better = f <= s.f
        np.copyto(s.x, x, where=better[:, :, None])
        np.copyto(s.f, f, where=better)
        if self.adaptive:
            np.copyto(s.own, s.tried, where=better[:, :, None])

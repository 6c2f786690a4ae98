"""Differential evolution: Storn & Price, J. Glob. Optim. 11 (1997) 341."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, real_number
from kinverse.optimizers.run import Run

__all__ = ["DifferentialEvolution"]

Array = NDArray[np.float64]

STRATEGIES = ("rand1bin", "best1bin", "currenttobest1bin", "randtobest1bin")


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

    Args:
        population: members, at least 4.
        strategy: how the donor is made.
        mutation: F, or (low, high) to draw it from.
        crossover: probability of a donor's component, CR.

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
    ) -> None:
        self.population = population
        self.strategy = strategy
        self.mutation = mutation
        self.crossover = crossover

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

    def _dither(self) -> tuple[float, float]:
        if not isinstance(self.mutation, (tuple, list)):
            return self.mutation, self.mutation
        if len(self.mutation) != 2:
            raise InputError(f"mutation must be a number or (low, high), got {self.mutation!r}")
        return self.mutation[0], self.mutation[1]

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        run.state.x, run.state.f = x, f

    def _ask(self, run: Run) -> Array:
        s = run.state
        problems, count, dimensions = s.x.shape
        u = run.uniform((2 + dimensions) * count + 1)
        order = u[:, :count].argsort(axis=1)
        order += count * np.arange(problems)[:, None]
        low, high = self._dither()
        scale = low + (high - low) * u[:, -1, None, None]
        trial: Array = np.empty_like(s.x)
        shuffled = s.x.reshape(-1, dimensions)[order]
        trial.reshape(-1, dimensions)[order] = self._donors(run, shuffled, scale)
        kept = u[:, 2 * count : -1].reshape(s.x.shape) >= self.crossover
        forced = (u[:, count : 2 * count] * dimensions).astype(np.intp)
        kept &= forced[:, :, None] != np.arange(dimensions)
        np.copyto(trial, s.x, where=kept)
        outside = (trial < run.low) | (trial > run.high)
        np.copyto(trial, run.scatter(count), where=outside)
        return trial

    def _donors(self, run: Run, x: Array, scale: Array) -> Array:
        best = run.leader
        a, b, c = (np.roll(x, -k, axis=1) for k in (1, 2, 3))
        base, step = (a, b - c) if self.strategy.startswith("rand") else (x, a - b)
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

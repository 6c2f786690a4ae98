"""Firefly algorithm: Yang, "Firefly algorithms for multimodal optimization", SAGA (2009) 169."""

import numpy as np
from numpy.typing import NDArray

from kinverse.optimizers._base import Optimizer
from kinverse.optimizers.run import Run
from kinverse.optimizers.tools import number_within, take

__all__ = ["Firefly"]

Array = NDArray[np.float64]


class Firefly(Optimizer):
    """Fireflies drawn to every brighter one, less so to distant ones.

    In units of the box, a firefly visits all brighter ones y in turn, the brightest first:
    x = x + beta exp(-gamma |y - x|^2) (y - x), the x of one visit being that of the next. Then it
    takes a random step, alpha (u - 1/2) with u in [0, 1) for every variable; alpha shrinks by
    ``decay`` a step of the swarm (Yang's later advice; 1 keeps it).

    All fireflies move at once: the y are where the fireflies stood before. The paper adds the
    random step at every visit; here it comes once, behind the last, which saves most of the random
    numbers. The brightest has nobody to visit: its random step counts only if it gets brighter.
    The visits are computed relative to the brightest and in single precision, so a point is
    rounded by about 1e-7 of its distance to the brightest, the random step is not.

    Visits grow with the square of the population.

    Args:
        population: fireflies.
        attraction: beta, the share of the way to a firefly close by, 0 to 2.
        absorption: gamma; the larger, the less of each other distant ones see.
        noise: alpha at the start, as a fraction of the range.
        decay: factor of alpha from step to step.
        greedy: a firefly goes back to where it was unless it got brighter; not in the paper, and
            a good deal better.

    Example:
        >>> minimize(f, bounds, Firefly(absorption=10.0, greedy=True), max_evals=20_000).x
    """

    def __init__(
        self,
        *,
        population: int = 100,
        attraction: float = 1.0,
        absorption: float = 1.0,
        noise: float = 0.2,
        decay: float = 0.97,
        greedy: bool = False,
    ) -> None:
        self.population = population
        self.attraction = attraction
        self.absorption = absorption
        self.noise = noise
        self.decay = decay
        self.greedy = greedy

    def _check(self, dimensions: int) -> None:
        name = type(self).__name__
        number_within(f"{name}: attraction", self.attraction, 0.0, 2.0)
        number_within(f"{name}: absorption", self.absorption, 0.0, 1e6)
        number_within(f"{name}: noise", self.noise, 0.0, 1.0)
        number_within(f"{name}: decay", self.decay, 0.0, 1.0)

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        run.state.x, run.state.f, run.state.alpha = x, f, self.noise

    def _ask(self, run: Run) -> Array:
        s = run.state
        order = s.f.argsort(axis=1, kind="stable")
        s.x, s.f = take(s.x, order), take(s.f, order)
        best = s.x[:, :1]
        x = self._visit((s.x - best) / run.span)
        step = run.uniform(*x.shape[1:])
        step -= 0.5
        step *= s.alpha
        s.alpha *= self.decay
        x += step
        x *= run.span
        x += best
        return run.clip(x)

    def _visit(self, x: Array) -> Array:
        """Everybody x (A, K, D), brightest first, at all brighter ones in turn."""
        # Variables first and problems last: the long runs of memory are what makes this fast.
        stood = np.ascontiguousarray(x.transpose(2, 1, 0), dtype=np.float32)
        now = stood.copy()
        room, squares = np.empty_like(stood), np.empty_like(stood)
        for j in range(x.shape[1] - 1):
            dimmer = now[:, j + 1 :]
            way, square = room[:, j + 1 :], squares[:, j + 1 :]
            np.subtract(stood[:, j : j + 1], dimmer, out=way)
            np.multiply(way, way, out=square)
            r = square[0]
            for part in square[1:]:  # one after the other: the same bits however many problems
                r += part
            r *= -self.absorption
            np.exp(r, out=r)
            r *= self.attraction
            way *= r
            dimmer += way
        return np.ascontiguousarray(now.transpose(2, 1, 0), dtype=np.float64)

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        stays = f >= s.f
        if not self.greedy:
            stays[:, 1:] = False
        s.x, s.f = np.where(stays[:, :, None], s.x, x), np.where(stays, s.f, f)

"""Biogeography-based optimization: Simon, IEEE Trans. Evolutionary Computation 12 (2008) 702."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, whole_number
from kinverse.optimizers.run import Run
from kinverse.optimizers.tools import number_within, take

__all__ = ["BiogeographyBased"]

Array = NDArray[np.float64]


class BiogeographyBased(Optimizer):
    """Habitats: good ones send their variables out, bad ones take variables in.

    The habitat of rank r (1 the best) of K emigrates at the rate mu = (K + 1 - r)/(K + 1) and
    immigrates at lambda = 1 - mu. Each of its variables is replaced with the probability lambda
    by the same variable of another habitat (or itself), drawn with weights mu; then it mutates, to
    a uniform value, with the probability m (1 - P/P_max), P the chance of its number of species.
    For these rates P is binomial (the paper's theorem 1), so that all but the middle ranks mutate
    at about m. The paper prints m ((1 - P)/P_max), which exceeds m. All migrate at once, from the
    habitats as they stood; then the elites take the places of the worst.

    Variables move from habitat to habitat unchanged, so new values come from mutation alone: the
    search is coarse, and best where variables can be set one by one.

    Args:
        population: habitats.
        mutation: m, the largest rate of mutation.
        elites: best habitats kept for sure.
        greedy: a habitat changes only for the better, as some libraries have it; the paper's
            always changes. The greedy one finds better points.

    Example:
        >>> minimize(f, bounds, BiogeographyBased(greedy=True), max_evals=20_000).x
    """

    def __init__(
        self,
        *,
        population: int = 100,
        mutation: float = 0.01,
        elites: int = 2,
        greedy: bool = False,
    ) -> None:
        self.population = population
        self.mutation = mutation
        self.elites = elites
        self.greedy = greedy

    def _check(self, dimensions: int) -> None:
        name = type(self).__name__
        number_within(f"{name}: mutation", self.mutation, 0.0, 1.0)
        whole_number(f"{name}: elites", self.elites, 0)
        if self.elites > self.population:
            raise InputError(
                f"{name}: elites must not exceed the population {self.population},"
                f" got {self.elites}"
            )

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        self._keep(run, x, f)

    def _ask(self, run: Run) -> Array:
        s = run.state
        _, size, dimensions = s.x.shape
        u = run.uniform(2, size, dimensions)
        immigration = np.arange(1.0, size + 1)[:, None] / (size + 1)
        migrates = u[:, 0] < immigration
        u[:, 0] /= immigration  # uniform again where it counts
        # The wheel of falling weights K, K-1, ..., 1: the sum of the first i is i (2K + 1 - i)/2.
        twice = 2.0 * size + 1.0
        spun = np.sqrt(twice * twice - 4.0 * size * (size + 1) * np.minimum(u[:, 0], 1.0))
        source = np.minimum((0.5 * (twice - spun)).astype(np.int64), size - 1)
        source *= dimensions
        source += np.arange(dimensions)
        source += np.arange(len(source))[:, None, None] * (size * dimensions)
        x = s.x.copy()
        np.copyto(x, s.x.reshape(-1).take(source), where=migrates)

        rate = self._mutation_rates()[:, None]
        on = np.flatnonzero(u[:, 1] < rate)
        variable, rank = on % dimensions, on // dimensions % size
        fresh = u[:, 1].reshape(-1).take(on) / rate.take(rank)
        x.reshape(-1)[on] = run.low.take(variable) + fresh * run.span.take(variable)
        return run.clip(x)

    def _mutation_rates(self) -> Array:
        rank = np.arange(1.0, self.population)  # K + 1 - rank of K + 1 possible species
        growth = np.log((self.population + 1 - rank) / (rank + 1.0))
        log_chance = np.concatenate([[0.0], growth.cumsum()])
        rates: Array = self.mutation * (1.0 - np.exp(log_chance - log_chance.max()))
        return rates

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        if self.greedy:  # the elites among them
            keeps = f >= s.f
            x, f = np.where(keeps[:, :, None], s.x, x), np.where(keeps, s.f, f)
        elif self.elites:
            best = f.argsort(axis=1, kind="stable")[:, : self.population - self.elites]
            x = np.concatenate([s.x[:, : self.elites], take(x, best)], axis=1)
            f = np.concatenate([s.f[:, : self.elites], take(f, best)], axis=1)
        self._keep(run, x, f)

    def _keep(self, run: Run, x: Array, f: Array) -> None:
        order = f.argsort(axis=1, kind="stable")
        run.state.x, run.state.f = take(x, order), take(f, order)

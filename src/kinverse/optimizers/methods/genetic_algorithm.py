"""Genetic algorithm: Holland (1975); operators: Baker (1987), Deb & Agrawal (1995)."""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, whole_number
from kinverse.optimizers.run import Run
from kinverse.optimizers.tools import number_within, roulette, take

__all__ = ["GeneticAlgorithm"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

VARIANTS = ("scattered", "binary", "simulated_binary")
_CROSSOVER = {"scattered": 0.8, "binary": 0.8, "simulated_binary": 0.9}


class GeneticAlgorithm(Optimizer):
    """Selection, crossover and mutation, in three published forms.

    ``"scattered"``: real numbers, the operators of the toolbox that the thesis ran. A member of
    rank r has the weight 1/sqrt(r); parents are drawn by stochastic universal sampling (Baker,
    Proc. ICGA (1987) 14) and shuffled; the elites stay; of the rest a share ``crossover`` takes
    each variable from one of two parents at random; the others are a parent plus normal noise,
    sigma = scale (1 - shrink t/T) range. The steps after the first evaluate population - elites
    points. The toolbox's other mutation for bounded variables is not published in enough detail;
    here the noise is cut at the box, which in early steps puts many mutants on its edges.

    ``"binary"``: document 004's own text, section 6.2.1. A variable is a word of ``bits`` bits;
    parents come from the roulette wheel, p_i = g_i / sum g (equation 6.5); with probability
    ``crossover`` a pair swaps its strings' tails behind one random point; each bit is turned with
    probability ``mutation``. The document maximises and leaves g open; here g_i is the worst
    finite value of the population minus f_i. Nothing finer than range / (2**bits - 1) is seen.

    ``"simulated_binary"``, the strongest: Deb & Agrawal, Complex Systems 9 (1995) 115. Parents
    win tournaments of two; a pair crosses with probability ``crossover``, and then each variable
    with probability 1/2: (a + b)/2 -+ spread (a - b)/2 with spread = (2 u)^(1/(n+1)) below
    u = 1/2, (1/(2 (1 - u)))^(1/(n+1)) above. Each variable then mutates with probability
    ``mutation`` by range times (2 u)^(1/(m+1)) - 1 or its mirror image. The best of parents and
    children together survive, of twins only one (libraries add that; it keeps the herd diverse).
    For a six-axis arm mutation=0.5 with spread_index=(2.0, 40.0) finds about three times better
    points than the published numbers, which are the defaults.

    Args:
        population: members.
        variant: one of the three.
        elites: members kept for sure; None: 5 % (rounded up), none if binary. Simulated binary
            keeps every member that is good enough and heeds no elites.
        crossover: see above; None: 0.8, simulated binary 0.9.
        mutation: see above; None: one in a string's bits, or one in the variables. Scattered
            mutates the members it does not cross.
        scale: scattered: noise at the start, as a fraction of the range.
        shrink: scattered: how much of it is gone at the end, 0 to 1.
        bits: binary: length of a word. The document draws six, which on a full turn are 5.7 deg.
        spread_index: simulated binary: (n of the crossover, m of the mutation); larger ones stay
            nearer to the parents.

    Example:
        >>> minimize(f, bounds, GeneticAlgorithm(variant="simulated_binary"), max_evals=20_000).x
    """

    def __init__(
        self,
        *,
        population: int = 100,
        variant: str = "scattered",
        elites: int | None = None,
        crossover: float | None = None,
        mutation: float | None = None,
        scale: float = 1.0,
        shrink: float = 1.0,
        bits: int = 16,
        spread_index: tuple[float, float] = (15.0, 20.0),
    ) -> None:
        self.population = population
        self.variant = variant
        self.elites = elites
        self.crossover = crossover
        self.mutation = mutation
        self.scale = scale
        self.shrink = shrink
        self.bits = bits
        self.spread_index = spread_index

    def _check(self, dimensions: int) -> None:
        name = type(self).__name__
        if self.variant not in VARIANTS:
            raise InputError(
                f"{name}: variant must be one of {', '.join(VARIANTS)}, got {self.variant!r}"
            )
        if self.elites is not None:
            whole_number(f"{name}: elites", self.elites, 0)
            if self.elites >= self.population:
                raise InputError(
                    f"{name}: elites must lie below the population {self.population},"
                    f" got {self.elites}"
                )
        for setting in ("crossover", "mutation", "shrink"):
            value = getattr(self, setting)
            if value is not None:
                number_within(f"{name}: {setting}", value, 0.0, 1.0)
        number_within(f"{name}: scale", self.scale, 0.0)
        whole_number(f"{name}: bits", self.bits, 1)
        number_within(f"{name}: bits", self.bits, 1, 52)
        if len(self.spread_index) != 2:
            raise InputError(f"{name}: spread_index must be a pair, got {self.spread_index!r}")
        for index in self.spread_index:
            number_within(f"{name}: spread_index", index, 0.0)

    # The population is kept with the best first -------------------------------------------------

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        if self.variant == "binary":
            steps = 2**self.bits - 1
            run.state.words = np.rint((x - run.low) / run.span * steps).astype(np.int64)
        self._keep(run, x, f)

    def _ask(self, run: Run) -> Array:
        if self.variant == "scattered":
            return self._scattered(run)
        return self._binary(run) if self.variant == "binary" else self._simulated_binary(run)

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        kept = len(s.x[0]) if self.variant == "simulated_binary" else self._elites()
        x = np.concatenate([s.x[:, :kept], x], axis=1)
        f = np.concatenate([s.f[:, :kept], f], axis=1)
        if self.variant == "binary":
            s.words = np.concatenate([s.words[:, :kept], s.children], axis=1)
        self._keep(run, x, f)

    def _keep(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        order = f.argsort(axis=1, kind="stable")
        if self.variant == "simulated_binary":
            order = _twins_last(x, f, order)
        order = order[:, : self.population]
        s.x, s.f = take(x, order), take(f, order)
        if self.variant == "binary":
            s.words = take(s.words, order)

    def _elites(self) -> int:
        if self.elites is not None:
            return int(self.elites)
        return 0 if self.variant == "binary" else ceil(0.05 * self.population)

    def _crossover(self) -> float:
        return _CROSSOVER[self.variant] if self.crossover is None else self.crossover

    # The three ways to the next points ----------------------------------------------------------

    def _scattered(self, run: Run) -> Array:
        s = run.state
        dimensions = len(run.low)
        rest = self.population - self._elites()
        crossed = round(self._crossover() * rest)
        parents = rest + crossed
        u = run.uniform(1 + parents + crossed * dimensions)
        start, keys, mask = np.split(u, (1, 1 + parents), axis=1)
        wheel = (1.0 / np.sqrt(np.arange(1.0, self.population + 1))).cumsum()
        at = (start + np.arange(parents)) / parents * wheel[-1]
        picked = np.searchsorted(wheel[:-1], at, side="right")
        picked = take(picked, keys.argsort(axis=1))
        chosen = take(s.x, picked)
        points = chosen[:, crossed:]
        mask = mask.reshape(len(mask), crossed, dimensions)
        np.copyto(points[:, :crossed], chosen[:, :crossed], where=mask < 0.5)
        noise = run.normal(rest - crossed, dimensions)
        noise *= self.scale * (1.0 - self.shrink * run.elapsed) * run.span
        points[:, crossed:] += noise
        return run.clip(np.ascontiguousarray(points))

    def _binary(self, run: Run) -> Array:
        s = run.state
        dimensions, bits = len(run.low), self.bits
        children = self.population - self._elites()
        pairs = (children + 1) // 2
        u = run.uniform(4 * pairs)
        finite = np.isfinite(s.f)
        worst = np.where(finite, s.f, -np.inf).max(axis=1, keepdims=True)
        fitness = 0.5 * np.where(finite, worst, 0.0) - 0.5 * np.where(finite, s.f, 0.0)
        ball, cut, crosses = np.split(u, (2 * pairs, 3 * pairs), axis=1)
        words = take(s.words, roulette(fitness, ball))
        point = 1 + (cut * (dimensions * bits - 1)).astype(np.int64)
        point[crosses >= self._crossover()] = dimensions * bits
        tail = bits - np.clip(point[:, :, None] - bits * np.arange(dimensions), 0, bits)
        tails = (np.int64(1) << tail) - 1
        swapped = (words[:, :pairs] ^ words[:, pairs:]) & tails
        words[:, :pairs] ^= swapped
        words[:, pairs:] ^= swapped
        rate = 1.0 / (bits * dimensions) if self.mutation is None else self.mutation
        turned = np.flatnonzero(run.uniform(2 * pairs, dimensions, bits) < rate)
        flips = np.bincount(turned // bits, 2.0 ** (turned % bits), words.size)
        words ^= flips.astype(np.int64).reshape(words.shape)
        s.children = np.ascontiguousarray(words[:, :children])
        return run.clip(s.children / (2.0**bits - 1.0) * run.span + run.low)

    def _simulated_binary(self, run: Run) -> Array:
        s = run.state
        size, dimensions = self.population, len(run.low)
        pairs = (size + 1) // 2
        rounds = ceil(4 * pairs / size)
        u = run.uniform(rounds * size + pairs + 3 * pairs * dimensions)
        keys, crosses, u = np.split(u, (rounds * size, rounds * size + pairs), axis=1)
        entrants = keys.reshape(-1, rounds, size).argsort(axis=2).reshape(len(u), -1)
        winners = entrants[:, : 4 * pairs].reshape(len(u), -1, 2).min(axis=2)
        u = u.reshape(-1, 3 * pairs, dimensions)

        # A variable crosses where its number u is below 1/2; 4 u is then a side plus a fresh u.
        points = np.concatenate([take(s.x, winners[:, :pairs]), take(s.x, winners[:, pairs:])])
        first, second = points.reshape(2, -1)
        r = u[:, :pairs].reshape(-1)
        on = np.flatnonzero((u[:, :pairs] < 0.5) & (crosses < self._crossover())[:, :, None])
        r = 4.0 * r.take(on)
        side = r >= 1.0
        r -= side
        a, b = first.take(on), second.take(on)
        spread = np.where(r < 0.5, 2.0 * r, 0.5 / (1.0 - r))
        spread **= 1.0 / (self.spread_index[0] + 1.0)
        middle, half = 0.5 * (a + b), np.where(side, 0.5, -0.5) * (a - b) * spread
        first[on], second[on] = middle + half, middle - half

        points = np.concatenate(np.split(points, 2), axis=1)
        run.clip(points)
        rate = 1.0 / dimensions if self.mutation is None else self.mutation
        r = u[:, pairs:].reshape(-1)
        on = np.flatnonzero(r < rate)
        r = 2.0 * r.take(on) / rate
        up = r >= 1.0
        jump = np.where(up, 2.0 - r, r) ** (1.0 / (self.spread_index[1] + 1.0)) - 1.0
        points.reshape(-1)[on] += np.where(up, -jump, jump) * run.span.take(on % dimensions)
        return run.clip(np.ascontiguousarray(points[:, :size]))


def _twins_last(x: Array, f: Array, order: Ints) -> Ints:
    """The order with members behind all others whose equal stands before them."""
    ranked = take(f, order)
    row, at = np.nonzero((ranked[:, 1:] == ranked[:, :-1]) & (ranked[:, 1:] < np.inf))
    same = (x[row, order[row, at]] == x[row, order[row, at + 1]]).all(axis=1)
    ranked[row[same], at[same] + 1] = np.inf
    return take(order, ranked.argsort(axis=1, kind="stable")) if same.any() else order

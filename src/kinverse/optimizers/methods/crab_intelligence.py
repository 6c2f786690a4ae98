"""Crab intelligence (CIBO): Jha, PhD thesis, NIT Rourkela (2015), equations 6.13-6.23, as read."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, whole_number
from kinverse.optimizers.run import Run

__all__ = ["CrabIntelligence"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

ENOUGH, GAIN, WANDER = 15, 1e-3, 0.1
"""Steps without a gain of 0.1 % until a swarm crosses, and how far from a leader it arrives."""


class CrabIntelligence(Optimizer):
    """Crabs in swarms look for shells between themselves and their leader.

    **This is our reading of the thesis, not its algorithm**: its equations leave too much open to
    be run, and results got with it say nothing about the results printed there. Each step, crab i
    at x_i looks at V shells, v = 0 .. V-1, with O the place of its swarm's best crab::

        L = x_i - O,  R = |L|,  u = L / R                                                 (6.13)
        P_0 = R u                                                                         (6.14)
        P_v = R alpha (cos(delta) u + sin(delta) w)                                       (6.15)
        shell_v = O + rho1 L + rho2 P_v                                                   (6.16)

    with alpha in [0, 1), delta in [-4 pi, 4 pi) and w a random unit vector orthogonal to u. It
    takes the best of them if that is better than what it has (6.17-6.22).

    What the thesis leaves open, and what is done here:

    - Places are pairs (x1, x2) and turned in their plane: here in the plane of u and a random w.
      With one variable there is none: w = 0.
    - R is the length "from origin". In ``reading="leader"`` the origin is the swarm's leader and
      lengths are fractions of the box. In ``reading="literal"`` it is the coordinates' origin and
      lengths are in the variables' own units: every shell of a crab far out lies within R
      (rho1 + rho2) of the origin, half of the time nearer than the crab, so that a minimum at the
      origin is found with ease and any other hardly. In the first reading the leader itself
      (R = 0) has the mean R of its swarm and a random u.
    - rho1, rho2 "positional constants in [0, 1]": drawn anew for every shell. z "integer": 1.
    - The number of shells V is not given: 2, the least that has both kinds. Nor are the swarms:
      crab i is in swarm i mod Z, Z = population // swarm_size. "More than 5" crabs a swarm
      (condition 2; its symbols say at most 5).
    - 6.20 asks for a greater suitability while minimising: read as a lower value. The sizes
      gamma of crabs and shells (condition 1) have no law: the value stands for them.
    - Muscular power (conditions 3, 4) decides between two crabs of one swarm that want shells less
      than ``min_distance`` apart: with ``synchronous=True`` the one with the greater random M_p
      takes its shell, the other keeps what it has. Asynchronous crabs do not contend.
    - Crossing has no equation: a swarm whose leader has not gained 0.1 % in 15 steps, if it is not
      the best swarm, sends its strong crabs (M_p > 1/2) to places normally distributed round the
      leader of a random swarm, with 0.1 of the box as deviation.
    - The end, all crabs housed (6.23), has no measure: a run ends by its budget, its target or its
      patience.

    Known biases: shells lie between a crab and its leader more often than beyond them, so swarms
    draw together early, and a minimum in the middle of the box is found more easily than one
    towards its edges. The literal reading's pull to the origin is told above.

    Args:
        population: crabs.
        swarm_size: crabs of a swarm, at least 6; what is left over joins the first swarms.
        shells: V, shells that each crab looks at in a step: a step has V x population points.
        reading: "leader" or "literal".
        synchronous: whether crabs of a swarm contend for shells.
        min_distance: mu, as a fraction of the box; heeded if synchronous.

    Example:
        >>> minimize(f, bounds, CrabIntelligence(), max_evals=20_000).x
    """

    least_population: ClassVar[int] = 6

    def __init__(
        self,
        *,
        population: int = 100,
        swarm_size: int = 10,
        shells: int = 2,
        reading: str = "leader",
        synchronous: bool = False,
        min_distance: float = 0.01,
    ) -> None:
        self.population = population
        self.swarm_size = swarm_size
        self.shells = shells
        self.reading = reading
        self.synchronous = synchronous
        self.min_distance = min_distance

    def _check(self, dimensions: int) -> None:
        whole_number("CrabIntelligence: swarm_size", self.swarm_size, self.least_population)
        whole_number("CrabIntelligence: shells", self.shells, 1)
        if self.reading not in ("leader", "literal"):
            raise InputError(f"reading must be one of leader, literal, got {self.reading!r}")
        if not 0.0 <= self.min_distance <= 1.0:
            raise InputError(f"min_distance must lie in 0..1, got {self.min_distance!r}")

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        s.x, s.f = x, f
        s.power = np.zeros(f.shape)
        s.record = np.full((len(f), self._swarms()), np.inf)
        s.stalled = np.zeros(s.record.shape, np.int64)
        s.crossing = np.zeros(s.record.shape, bool)
        self._rest(run)

    def _ask(self, run: Run) -> Array:
        s = run.state
        shells, crabs, swarms = self.shells, self.population, self._swarms()
        swarm = np.arange(crabs) % swarms
        drawn = run.uniform((4 * shells + 1) * crabs + swarms)
        alpha, delta, rho1, rho2 = np.moveaxis(
            drawn[:, : 4 * shells * crabs].reshape(-1, 4, shells, crabs), 1, 0
        )
        s.power = drawn[:, 4 * shells * crabs : -swarms]
        g = run.normal(shells, crabs, len(run.low))
        leader = s.x[np.arange(len(g))[:, None], self._leaders(s.f)]
        if self.reading == "leader":
            origin, unit = leader[:, swarm], run.span
        else:
            origin, unit = np.zeros_like(s.x), np.ones_like(run.span)

        u = (s.x - origin) / unit
        R = np.sqrt((u * u).sum(axis=2))
        alone = R == 0.0
        u /= np.where(alone, 1.0, R)[:, :, None]
        if self.reading == "leader":
            R = np.where(alone, self._mean(R)[:, swarm], R)
        alpha[:, 0] = 1.0
        delta = 8.0 * np.pi * delta - 4.0 * np.pi
        delta[:, 0] = 0.0
        # a crab on its origin has no u: its w is any direction, and its P_v lies along it
        along = R[:, None] * (rho1 + rho2 * alpha * np.cos(delta))
        aside = R[:, None] * (rho2 * alpha * np.where(alone[:, None], 1.0, np.sin(delta)))
        # w = (g - (g u) u) / |g - (g u) u|, so that along u + aside w = (along - ..) u + .. g
        gu = (g * u[:, None]).sum(axis=3)
        length = np.sqrt(np.maximum((g * g).sum(axis=3) - gu * gu, 0.0))
        aside /= np.where(length > 0.0, length, np.inf)
        points = (along - aside * gu)[..., None] * u[:, None]
        points += aside[..., None] * g
        points *= unit
        points += origin[:, None]

        away = s.crossing[:, swarm] & (s.power > 0.5)
        if away.any():
            where = (swarms * drawn[:, -swarms:]).astype(np.int64)
            i, crab = np.nonzero(away)
            near = leader[i, where[i, swarm[crab]]]
            points[i, :, crab] = near[:, None] + (WANDER * run.span) * g[i, :, crab]
            s.f = np.where(away, np.inf, s.f)
        return run.clip(points.reshape(len(g), shells * crabs, -1))

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        each = f.reshape(len(f), self.shells, self.population)
        best = each.argmin(axis=1)
        rows = np.arange(len(f))[:, None]
        at = best * self.population + np.arange(self.population)
        value, shell = f[rows, at], x[rows, at]
        takes = value < s.f
        if self.synchronous:
            takes &= ~self._beaten(takes, shell / run.span, s.power)
        s.x = np.where(takes[:, :, None], shell, s.x)
        s.f = np.where(takes, value, s.f)
        self._rest(run)

    def _swarms(self) -> int:
        return max(self.population // self.swarm_size, 1)

    def _by_swarm(self, values: Array, fill: float) -> Array:
        """(A, P, ...) to (A, n, Z, ...): crab i is number i // Z of swarm i % Z."""
        swarms = self._swarms()
        missing = -self.population % swarms
        if missing:
            rest = np.full((len(values), missing, *values.shape[2:]), fill)
            values = np.concatenate([values, rest], axis=1)
        return values.reshape(len(values), -1, swarms, *values.shape[2:])

    def _leaders(self, f: Array) -> Ints:
        """(A, Z) number of each swarm's best crab."""
        swarms = self._swarms()
        first = self._by_swarm(f, np.inf).argmin(axis=1)
        return np.asarray(first * swarms + np.arange(swarms))

    def _mean(self, R: Array) -> Array:
        """(A, Z) mean over each swarm."""
        sizes = np.bincount(np.arange(self.population) % self._swarms())
        return np.asarray(self._by_swarm(R, 0.0).sum(axis=1) / sizes)

    def _beaten(self, wants: NDArray[np.bool_], shell: Array, power: Array) -> NDArray[np.bool_]:
        """(A, P) which crabs want a shell too close to that of a stronger one of their swarm."""
        places = self._by_swarm(shell, 0.0)
        strength = self._by_swarm(np.where(wants, power, -1.0), -1.0)
        apart = places[:, :, None] - places[:, None]
        close = (apart * apart).sum(axis=4) < self.min_distance**2
        lost = (close & (strength[:, :, None] < strength[:, None])).any(axis=2)
        return np.asarray(lost.reshape(len(lost), -1)[:, : self.population])

    def _rest(self, run: Run) -> None:
        """Which swarms have stalled and cross at the next step."""
        s = run.state
        leading = self._by_swarm(s.f, np.inf).min(axis=1)
        known = np.where(np.isfinite(s.record), s.record, 0.0)
        bar = np.where(np.isfinite(s.record), known - GAIN * np.abs(known), s.record)
        gained = leading < bar
        s.record = np.where(gained, leading, s.record)
        s.stalled = np.where(gained, 0, s.stalled + 1)
        best = leading.argmin(axis=1)[:, None] == np.arange(leading.shape[1])
        s.crossing = (s.stalled >= ENOUGH) & ~best
        s.record[s.crossing] = np.inf
        s.stalled[s.crossing] = 0

"""Artificial bee colony: Karaboga, TR06 (2005); Karaboga & Basturk, J. Glob. Opt. 39 (2007) 459."""

import numpy as np
from numpy.typing import NDArray

from kinverse.optimizers._base import Optimizer, whole_number
from kinverse.optimizers.run import Run
from kinverse.optimizers.tools import roulette, take

__all__ = ["ArtificialBeeColony"]

Array = NDArray[np.float64]


class ArtificialBeeColony(Optimizer):
    """Food sources worked by employed bees, revisited by onlookers, given up for a scout's.

    Steps take turns. Employed: one bee at every source. Onlookers: as many bees, each at a source
    drawn by the wheel with the weight 1/(1 + f), or 1 + |f| below zero. A bee tries
    v_j = x_j + phi (x_j - y_j), phi uniform in -1..1, y another source, for one variable j drawn
    at random; the source moves to v if that is better, and counts a trial if not.

    All bees of a step fly from where the sources stood before it; of several onlookers at one
    source the best counts, and if none succeeds each counts a trial (the paper lets one bee fly
    after the other). A source with more than ``limit`` trials is given up: in the next employed
    step its bee goes to a random point instead, the scout's, and stays there whatever it is worth;
    one source a cycle, the most tried. So a scout costs no evaluation beyond the step's own.

    The weights depend on the scale of f and of a constant added to it: far above 1 all sources
    weigh about the same.

    Args:
        population: food sources; a cycle of two steps evaluates twice as many points.
        limit: trials before a source is given up; None: population times variables.

    Example:
        >>> minimize(f, bounds, ArtificialBeeColony(), max_evals=20_000).x
    """

    def __init__(self, *, population: int = 100, limit: int | None = None) -> None:
        self.population = population
        self.limit = limit

    def _check(self, dimensions: int) -> None:
        if self.limit is not None:
            whole_number(f"{type(self).__name__}: limit", self.limit, 1)

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        s.x, s.f = x, f
        s.trials = np.zeros(f.shape, np.int64)
        s.employed = False

    def _ask(self, run: Run) -> Array:
        s = run.state
        problems, sources, dimensions = s.x.shape
        s.employed = not s.employed
        u = run.uniform(4 * sources + dimensions)
        wheel, partner, which, phi = np.split(u[:, : 4 * sources], 4, axis=1)
        if s.employed:
            s.source = np.broadcast_to(np.arange(sources), s.f.shape)
        else:
            low, high = np.minimum(s.f, 0.0), np.maximum(s.f, 0.0)
            s.source = roulette(1.0 / (1.0 + high) - low, wheel)
        other = (s.source + 1 + (partner * (sources - 1)).astype(np.int64)) % sources
        variable = (which * dimensions).astype(np.int64)
        first = np.arange(problems)[:, None] * sources
        flat = s.x.reshape(-1)
        here = flat.take((first + s.source) * dimensions + variable)
        there = flat.take((first + other) * dimensions + variable)
        points = take(s.x, s.source)
        cell = (first + np.arange(sources)) * dimensions + variable
        points.reshape(-1)[cell] = here + (2.0 * phi - 1.0) * (here - there)
        if s.employed:
            limit = sources * dimensions if self.limit is None else self.limit
            worn = s.trials.argmax(axis=1)
            problem = np.flatnonzero(s.trials.max(axis=1) > limit)
            worn = worn[problem]
            scouted = run.low + u[problem, 4 * sources :] * run.span
            points[problem, worn] = s.x[problem, worn] = scouted
            s.f[problem, worn] = np.inf
            s.trials[problem, worn] = 0
        return run.clip(points)

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        visits = np.ones(f.shape, np.int64)
        if not s.employed:  # the best of the bees at a source speaks for it: the last one written
            source = s.source + np.arange(len(f))[:, None] * f.shape[1]
            visits = np.bincount(source.ravel(), minlength=f.size).reshape(f.shape)
            order = (-f).argsort(axis=1, kind="stable")
            speaker = np.zeros(f.size, np.int64)
            speaker[take(source, order).ravel()] = order.ravel()
            bee = speaker.reshape(f.shape)
            x, f = take(x, bee), np.where(visits > 0, take(f, bee), np.inf)
        better = f < s.f
        np.copyto(s.x, x, where=better[:, :, None])
        np.copyto(s.f, f, where=better)
        s.trials += visits
        s.trials[better] = 0

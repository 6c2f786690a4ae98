"""Grey wolf optimizer: Mirjalili, Mirjalili & Lewis, Adv. Eng. Softw. 69 (2014) 46."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer
from kinverse.optimizers.run import Run

__all__ = ["GreyWolf"]

Array = NDArray[np.float64]

ORIGINS = ("zero", "middle")


class GreyWolf(Optimizer):
    """Wolves that close in on the three best places found so far.

    For each leader L of the three, with fresh r1, r2 in [0, 1) for every wolf and component::

        A = 2 a r1 - a,  C = 2 r2,  D = |C L - x|,  x_L = L - A D,  x = mean of the three x_L

    (equations 3.1 to 3.7), where a falls linearly from 2 to 0 over the budget. A wolf moves
    wherever this leads, moved into the box; with ``elitist`` it moves only to better places.

    Known bias: C multiplies the leader's coordinates themselves, so steps shrink where these are
    near 0, and an optimum at the origin of the coordinates is found far better than the same
    optimum elsewhere (Niu et al., Knowl.-Based Syst. 171 (2019) 37). ``origin="middle"`` measures
    all coordinates from the middle of the box: the search then does not depend on where zero
    lies, and favours the middle instead.

    Args:
        population: wolves.
        elitist: whether a wolf keeps its place unless the new one is better; not in the paper.
        origin: "zero" (as published) or "middle" (of the box).

    Example:
        >>> minimize(f, bounds, GreyWolf(elitist=True), max_evals=20_000).x
    """

    least_population = 3

    def __init__(
        self, *, population: int = 100, elitist: bool = False, origin: str = "zero"
    ) -> None:
        self.population = population
        self.elitist = elitist
        self.origin = origin

    def _check(self, dimensions: int) -> None:
        if not isinstance(self.elitist, (bool, np.bool_)):
            raise InputError(f"elitist must be True or False, got {self.elitist!r}")
        if self.origin not in ORIGINS:
            raise InputError(f"origin must be one of {', '.join(ORIGINS)}, got {self.origin!r}")

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        run.state.x, run.state.f = x, f
        self._follow(run, x, f)

    def _ask(self, run: Run) -> Array:
        s = run.state
        zero = 0.5 * (run.low + run.high) if self.origin == "middle" else 0.0
        x, leaders = s.x - zero, s.leaders - zero
        r = run.uniform(2, 3, *x.shape[1:])
        steps = np.zeros_like(x)
        for k in range(3):
            distance = r[:, 1, k]
            distance *= 2.0 * leaders[:, k, None]
            distance -= x
            np.abs(distance, out=distance)
            share = r[:, 0, k]
            share -= 0.5
            share *= distance
            steps += share
        steps *= -4.0 / 3.0 * (1.0 - run.elapsed)  # A = 2 a (r1 - 1/2) with a = 2 (1 - elapsed)
        steps += (s.leaders[:, 0] + s.leaders[:, 1] + s.leaders[:, 2])[:, None] / 3.0
        return run.clip(steps)

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        if self.elitist:
            better = f < s.f
            np.copyto(s.x, x, where=better[:, :, None])
            np.copyto(s.f, f, where=better)
            self._follow(run, s.x, s.f)
        else:
            s.x, s.f = x, f
            all_x = np.concatenate([s.leaders, x], axis=1)
            self._follow(run, all_x, np.concatenate([s.led, f], axis=1))

    def _follow(self, run: Run, x: Array, f: Array) -> None:
        """Take the best three of the places x (A, K, D) for leaders, in no order."""
        best = f.argpartition(2, axis=1)[:, :3]
        run.state.leaders = np.take_along_axis(x, best[:, :, None], axis=1)
        run.state.led = np.take_along_axis(f, best, axis=1)

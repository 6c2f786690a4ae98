"""Functions with a known minimum for the population methods, on arrays of points (..., D).

The lowest value is 0. ``shifted`` moves it: with the minimum at the origin, or in the middle of
the box, a method that is drawn there looks better than it is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["FUNCTIONS", "Function", "moved", "off_centre", "shifted"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Function:
    """A function of any number of variables, its box and where it is 0.

    Attributes:
        name: what it is called.
        values: points (..., D) to values (...).
        low: lower bound of every variable, a number or (D,).
        high: upper bound.
        minimum: where the value is 0, a number for all variables or (D,).
    """

    name: str
    values: Callable[[Array], Array]
    low: float | Array
    high: float | Array
    minimum: float | Array = 0.0

    def __call__(self, x: Array) -> Array:
        """(..., D) to (...)."""
        return self.values(x)

    def bounds(self, dimensions: int) -> Array:
        """(D, 2) the box."""
        sides = [np.broadcast_to(side, dimensions) for side in (self.low, self.high)]
        return np.stack(sides, axis=1).astype(np.float64)

    def best(self, dimensions: int) -> Array:
        """(D,) where it is 0."""
        return np.broadcast_to(np.asarray(self.minimum, dtype=np.float64), dimensions).copy()


def shifted(function: Function, shift: float | Array) -> Function:
    """The function with its minimum moved by shift, in the same box."""
    values = function.values
    return replace(
        function, values=lambda x: values(x - shift), minimum=np.asarray(function.minimum) + shift
    )


def moved(function: Function, shift: float | Array) -> Function:
    """The function moved together with its box: the same search, elsewhere."""
    low, high = np.asarray(function.low) + shift, np.asarray(function.high) + shift
    return replace(shifted(function, shift), low=low, high=high)


def off_centre(function: Function, dimensions: int, seed: int = 20) -> Array:
    """(D,) a shift that takes the minimum away from the middle of the box, in each variable anew.

    It comes to lie between 0.2 and 0.8 of the way from the middle to one of the edges.
    """
    rng = np.random.default_rng((seed, dimensions))
    away = rng.uniform(0.2, 0.8, dimensions) * rng.choice([-1.0, 1.0], dimensions)
    low, high = function.bounds(dimensions).T
    place = 0.5 * (low + high) + 0.5 * away * (high - low)
    return np.asarray(place - function.best(dimensions))


def _sphere(x: Array) -> Array:
    return np.asarray((x * x).sum(axis=-1))


def _rosenbrock(x: Array) -> Array:
    ahead, here = x[..., 1:], x[..., :-1]
    return np.asarray((100.0 * (ahead - here * here) ** 2 + (1.0 - here) ** 2).sum(axis=-1))


def _rastrigin(x: Array) -> Array:
    # 10 (1 - cos 2 pi x) = 20 sin^2 pi x: no digits lost near the minimum
    return np.asarray((x * x + 20.0 * np.sin(np.pi * x) ** 2).sum(axis=-1))


def _ackley(x: Array) -> Array:
    far = -20.0 * np.expm1(-0.2 * np.sqrt((x * x).mean(axis=-1)))
    waves = -np.e * np.expm1((-2.0 * np.sin(np.pi * x) ** 2).mean(axis=-1))
    return np.asarray(far + waves)


def _griewank(x: Array) -> Array:
    root = np.sqrt(np.arange(1.0, x.shape[-1] + 1.0))
    return np.asarray((x * x).sum(axis=-1) / 4000.0 - np.cos(x / root).prod(axis=-1) + 1.0)


FUNCTIONS = {
    function.name: function
    for function in (
        Function("sphere", _sphere, -100.0, 100.0),
        Function("rosenbrock", _rosenbrock, -30.0, 30.0, 1.0),
        Function("rastrigin", _rastrigin, -5.12, 5.12),
        Function("ackley", _ackley, -32.0, 32.0),
        Function("griewank", _griewank, -600.0, 600.0),
    )
}
"""By name, in the boxes that are customary."""

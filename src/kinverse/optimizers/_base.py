"""The base of every swarm method: settings in, a run out; methods know no robots.

A new method writes ``__init__`` (settings stored untouched) and three hooks::

    class Mine(Optimizer):
        def __init__(self, *, population=50, pull=0.5): ...

        def _begin(self, run, x, f):      # the first population (A, K, D) and its values (A, K)
            run.state.x, run.state.f = x, f

        def _ask(self, run):              # the next points (A, K, D)
            return run.clip(run.state.x + self.pull * (run.leader - run.state.x))

        def _tell(self, run, x, f):       # their values
            run.state.x, run.state.f = x, f

Arrays run over the problems, the population and the dimensions: (A, K, D). What ``run.state`` holds
as an array has the problems on its first axis: problems that end are taken out of it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import not_nan, real_array, real_number, whole_number
from kinverse.optimizers.run import Run
from kinverse.optimizers.streams import Streams
from kinverse.seeds import seed_of
from kinverse.settings import HasSettings

if TYPE_CHECKING:
    from numpy.random import Generator

__all__ = ["Optimizer", "checked_bounds", "real_number", "whole_number"]

Array = NDArray[np.float64]


class Optimizer(HasSettings):
    """Settings of a population method; ``start`` makes a run.

    Attributes:
        population: points of the first step, and of most methods' every step.
        least_population: fewest that the method can work with.
    """

    population: int
    least_population: ClassVar[int] = 2

    # What a method writes -----------------------------------------------------------------------

    def _check(self, dimensions: int) -> None:
        """Raise InputError for settings of its own that cannot be used."""

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        """Keep what is needed of the first population x (A, K, D) with values f (A, K)."""
        raise NotImplementedError(f"{type(self).__name__} has no _begin")

    def _ask(self, run: Run) -> Array:
        """The next points (A, K, D), inside the box."""
        raise NotImplementedError(f"{type(self).__name__} has no _ask")

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        """Heed the values f (A, K) of the points x (A, K, D) asked for."""
        raise NotImplementedError(f"{type(self).__name__} has no _tell")

    def _members(self, run: Run) -> tuple[Array, Array]:
        """The population as it stands, (A, K, D), and its values (A, K).

        Asked for at any time after ``_begin``, between ``_ask`` and ``_tell`` too: the last step of
        a run may be cut and never told. The values must be those of the points.
        """
        return run.state.x, run.state.f

    # What a user calls --------------------------------------------------------------------------

    def start(
        self,
        bounds: ArrayLike,
        *,
        max_evals: int,
        rng: "int | Generator | None" = None,
        problems: int = 1,
        keys: Sequence[ArrayLike] | None = None,
        x0: ArrayLike | None = None,
        target: float = -np.inf,
        patience: int | None = None,
    ) -> Run:
        """Begin to search a box.

        Args:
            bounds: (D, 2) lower and upper bound of each variable.
            max_evals: evaluations each problem may spend; at least the population.
            rng: None (a fixed seed), an int >= 0 or a Generator (one draw).
            problems: how many searches run side by side, each with its own random stream.
            keys: (problems) sequences of whole numbers below 2**32, of one length, that key the
                streams beside ``rng``; None: the problem's number.
            x0: (D,), (P, D) or (problems, P, D) points that take the place of the first of the
                first population, moved into the box.
            target: a problem ends when its best value is not above this.
            patience: a problem ends after this many steps without a better value; None: never.

        Raises:
            InputError: a setting or an argument that cannot be used.
            TypeError: complex numbers, text or objects where numbers are due; a strange ``rng``.

        Example:
            >>> run = GreyWolf().start([(-1, 1)] * 3, max_evals=5000)
        """
        box = checked_bounds(bounds)
        name = type(self).__name__
        least = self.least_population
        whole_number(f"{name}: population", self.population, least)
        self._check(len(box))
        whole_number("problems", problems, 1)
        whole_number("max_evals", max_evals, 1)
        if max_evals < self.population:
            raise InputError(
                f"{name}: max_evals must be at least one generation, {self.population}"
                f" evaluations, got {max_evals}"
            )
        if patience is not None:
            whole_number("patience", patience, 1)
        target = not_nan("target", target)
        streams = Streams(_keys(seed_of(rng), problems, keys))
        first = None if x0 is None else _first(x0, box, problems, self.population)
        return Run(self, box, streams, int(max_evals), first, target, patience)


def checked_bounds(bounds: ArrayLike) -> Array:
    """Bounds as (D, 2) float64.

    Raises:
        InputError: none at all, not pairs, not finite, or a lower one that is not below the upper.
        TypeError: complex numbers, text or objects.
    """
    box = real_array("bounds", bounds)
    if box.size == 0:
        raise InputError("bounds must be (D, 2) pairs (low, high) with D at least 1, got none")
    if box.ndim != 2 or box.shape[1] != 2:
        raise InputError(f"bounds must be (D, 2) pairs (low, high), got shape {box.shape}")
    for k, (low, high) in enumerate(box.tolist()):
        if not (np.isfinite(low) and np.isfinite(high)):
            raise InputError(f"bounds of variable {k} must be finite, got ({low}, {high})")
        if not low < high:
            raise InputError(f"bounds of variable {k} must rise, got ({low}, {high})")
        if not np.isfinite(high - low):
            raise InputError(f"bounds of variable {k} are too far apart, got ({low}, {high})")
    return box


def _keys(seed: int, problems: int, keys: Sequence[ArrayLike] | None) -> list[NDArray[np.int64]]:
    own = [np.array([k]) for k in range(problems)]
    if keys is not None:
        own = [np.atleast_1d(key) for key in keys]
    if len(own) != problems:
        raise InputError(f"keys must hold one key for each of {problems} problems, got {len(own)}")
    for k, key in enumerate(own):
        whole = key.ndim == 1 and key.dtype.kind in "iu"
        if not whole or len(key) != len(own[0]) or ((key < 0) | (key >= 2**32)).any():
            raise InputError(
                f"key {k} must hold whole numbers in 0..2**32-1, as many as the others, got {key!r}"
            )
    words = np.array([seed & 0xFFFFFFFF, seed >> 32])
    return [np.concatenate([words, key.astype(np.int64)]) for key in own]


def _first(x0: ArrayLike, box: Array, problems: int, population: int) -> Array:
    points = real_array("x0", x0)
    if points.ndim == 1:
        points = points[None]
    if points.ndim == 2:
        points = np.broadcast_to(points, (problems, *points.shape))
    if points.ndim != 3 or points.shape[0] != problems or points.shape[2] != len(box):
        raise InputError(
            f"x0 must have shape (P, {len(box)}) or ({problems}, P, {len(box)}), got {points.shape}"
        )
    if points.shape[1] > population:
        raise InputError(
            f"x0 holds {points.shape[1]} points, more than the population {population}"
        )
    if not np.isfinite(points).all():
        raise InputError("x0 must be finite")
    return np.clip(points, box[:, 0], box[:, 1])

"""A search under way: ask for points, tell their values, until it is done."""

from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import real_array
from kinverse.optimizers.streams import Streams

if TYPE_CHECKING:
    from kinverse.optimizers._base import Optimizer

__all__ = ["MESSAGES", "Run"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MESSAGES = (
    "running",
    "the target was reached",
    "the evaluations are spent",
    "no improvement for as many generations as patience allows",
)
"""What ``Run.stop`` says of a problem, by number."""
REACHED, SPENT, STAGNANT = 1, 2, 3


class Run:
    """M searches in one box, all by the same method, each with a random stream of its own.

    Made by ``Optimizer.start``. The points of a step are one array over the problems that still
    run, so a thousand small searches cost little more than their evaluations. A problem's search
    does not depend on the others; it ends when it has reached ``target``, spent ``max_evals``
    (exactly: the last step is cut to what is left) or not improved for ``patience`` steps.
    Runs can be pickled at any step and go on with the same numbers.

    Attributes:
        optimizer: the method and its settings.
        low, high, span: (D,) the box and its size.
        max_evals: evaluations each problem may spend.
        active: (A,) the problems that still run, ascending.
        generation: steps told so far.
        x_best: (M, D) best point of each problem so far; the first one tried if all were worst.
        f_best: (M,) its value.
        evaluations: (M,) values told.
        bad_values: (M,) how many of them were NaN or -inf and counted as worst.
        stop: (M,) number of a text in ``MESSAGES``.
        state: arrays of the method, problems on the first axis; numbers shared by all.

    Example:
        >>> run = ParticleSwarm().start([(-1, 1)] * 2, max_evals=2000)
        >>> while not run.done:
        ...     run.tell((run.ask() ** 2).sum(axis=2))
    """

    def __init__(
        self,
        optimizer: "Optimizer",
        bounds: Array,
        streams: Streams,
        max_evals: int,
        first: Array | None,
        target: float,
        patience: int | None,
    ) -> None:
        problems, dimensions = len(streams), len(bounds)
        self.optimizer = optimizer
        self.low, self.high = bounds[:, 0].copy(), bounds[:, 1].copy()
        self.span = self.high - self.low
        self.max_evals, self.target, self.patience = max_evals, target, patience
        self.active: Ints = np.arange(problems)
        self.generation = 0
        self.x_best = np.full((problems, dimensions), np.nan)
        self.f_best = np.full(problems, np.inf)
        self.evaluations: Ints = np.zeros(problems, np.int64)
        self.bad_values: Ints = np.zeros(problems, np.int64)
        self.stop: Ints = np.zeros(problems, np.int64)
        self.state = SimpleNamespace()
        self._streams = streams
        self._first = first
        self._points: Array | None = None
        self._ended: list[tuple[Ints, Array, Array]] = []
        self._whole = True
        self._spent = 0
        self._last_gain: Ints = np.zeros(problems, np.int64)

    # What a caller sees -------------------------------------------------------------------------

    @property
    def done(self) -> bool:
        """Whether every problem has ended."""
        return len(self.active) == 0

    def ask(self) -> Array:
        """(A, K, D) points whose values are wanted, inside the box; K may differ from step to step.

        Asking again before ``tell`` gives the same points. They are read-only: the method may hold
        the same array.

        Raises:
            InputError: the run is done.
        """
        if self.done:
            raise InputError("this run is done: there is nothing left to ask")
        if self._points is None:
            points = self.optimizer._ask(self) if self.generation else self._first_points()
            room = self.max_evals - self._spent
            self._whole = points.shape[1] <= room
            self._points = points if self._whole else np.ascontiguousarray(points[:, :room])
        shown = self._points.view()
        shown.flags.writeable = False
        return shown

    def tell(self, values: ArrayLike) -> None:
        """The values (A, K) of the points asked for; NaN and -inf count as worst.

        Raises:
            InputError: values of another shape, or nothing was asked.
            TypeError: complex numbers, text or objects.
        """
        if self._points is None:
            raise InputError("tell without ask: there are no points to tell values of")
        x = self._points
        f = real_array("the values told", values).copy()
        if f.shape != x.shape[:2]:
            raise InputError(f"tell needs values of shape {x.shape[:2]}, got {f.shape}")
        self._points = None
        self._spent += x.shape[1]
        self._count_bad(f)
        self._remember(x, f)
        if self._whole:
            hook = self.optimizer._tell if self.generation else self.optimizer._begin
            hook(self, x, f)
        self.generation += 1
        self._end()

    def members(self) -> tuple[Array, Array]:
        """The populations (M, K, D) and their values (M, K), also of the problems that have ended.

        Each problem's is the one it has now or had at its end. Where one holds fewer points than
        another, NaN and inf fill up.

        Raises:
            InputError: nothing was told yet.
        """
        if not self.generation:
            raise InputError("no members yet: ask for points and tell their values first")
        parts = list(self._ended)
        if not self.done:
            parts.append((self.active, *self.optimizer._members(self)))
        count = max(values.shape[1] for _, _, values in parts)
        x = np.full((len(self.f_best), count, len(self.low)), np.nan)
        f = np.full((len(self.f_best), count), np.inf)
        for which, points, values in parts:
            x[which, : values.shape[1]] = points
            f[which, : values.shape[1]] = values
        return x, f

    # What a method uses -------------------------------------------------------------------------

    @property
    def elapsed(self) -> float:
        """How much of the budget behind the first population is spent, 0 to 1: t / T."""
        first = self.optimizer.population
        return (self._spent - first) / max(self.max_evals - first, 1)

    @property
    def leader(self) -> Array:
        """(A, 1, D) best point of each running problem."""
        return self.x_best[self.active, None]

    def uniform(self, *shape: int) -> Array:
        """(A, *shape) random numbers in [0, 1)."""
        return self._streams.uniform(*shape)

    def normal(self, *shape: int) -> Array:
        """(A, *shape) standard normal random numbers."""
        return self._streams.normal(*shape)

    def scatter(self, count: int) -> Array:
        """(A, count, D) points uniform in the box."""
        points = self.uniform(count, len(self.low))
        points *= self.span
        points += self.low
        return self.clip(points)  # a rounded sum may stand an ulp outside

    def clip(self, x: Array) -> Array:
        """Points (..., D) moved into the box, in place."""
        np.maximum(x, self.low, out=x)
        return np.minimum(x, self.high, out=x)

    # How it works -------------------------------------------------------------------------------

    def _first_points(self) -> Array:
        points = self.scatter(self.optimizer.population)
        if self._first is not None:
            points[:, : self._first.shape[1]] = self._first
        return points

    def _count_bad(self, f: Array) -> None:
        bad = ~(f > -np.inf)
        if bad.any():
            f[bad] = np.inf
            self.bad_values[self.active] += bad.sum(axis=1)

    def _remember(self, x: Array, f: Array) -> None:
        rows = np.arange(len(f))
        lowest = f.argmin(axis=1)
        value = f[rows, lowest]
        better = value < self.f_best[self.active]
        if not self.generation:
            better[:] = True  # if all are worst there is a leader all the same
        which = self.active[better]
        self.f_best[which] = value[better]
        self.x_best[which] = x[rows, lowest][better]
        self._last_gain[which] = self.generation
        self.evaluations[self.active] = self._spent

    def _end(self) -> None:
        stop = np.zeros(len(self.active), np.int64)
        if self.patience is not None:
            idle = self.generation - 1 - self._last_gain[self.active]
            stop[idle >= self.patience] = STAGNANT
        if self._spent >= self.max_evals:
            stop[:] = SPENT
        stop[self.f_best[self.active] <= self.target] = REACHED
        on = stop == 0
        if on.all():
            return
        x, f = self.optimizer._members(self)
        self._ended.append((self.active[~on], x[~on], f[~on]))
        self.stop[self.active] = stop
        self.active = self.active[on]
        self._streams.keep(on)
        for name, value in vars(self.state).items():
            if isinstance(value, np.ndarray):
                setattr(self.state, name, value[on])

"""What a search looked like on its way: a callback that writes it down."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import whole_number
from kinverse.optimizers.run import Run

__all__ = ["History"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class History:
    """Evaluations, best and median value after each step; call it with the run after each ``tell``.

    It works for one problem and for many side by side; of a problem that has ended it repeats the
    last figures. A second run written into it (the rounds of ``Augmented``) goes on counting the
    evaluations; the values are then those of the merit function of each round.

    Memory is bounded: with ``most`` records it drops every second one and goes on with twice the
    distance between steps.

    Args:
        every: write down every that many steps, the first and the last of a run always.
        population: keep the points and their values too.
        most: most records kept; at least 2.

    Example:
        >>> history = History(every=5)
        >>> while not run.done:
        ...     run.tell(cost(run.ask()))
        ...     history(run)
        >>> history.best[-1]
    """

    def __init__(self, *, every: int = 1, population: bool = False, most: int = 1000) -> None:
        whole_number("every", every, 1)
        whole_number("most", most, 2)
        self.every, self.most = int(every), int(most)
        self.keeps_population = population
        self._stride = self.every
        self._rows: list[tuple[Ints, Array, Array]] = []
        self._members: list[tuple[Array, Array]] = []
        self._before: Ints | int = 0  # evaluations of the runs that came before this one
        self._seen: Ints | int = 0
        self._written = 0  # generation of the newest record

    def __call__(self, run: Run) -> None:
        """Write this step down if its turn has come.

        Raises:
            InputError: the run has another number of problems than the records.
        """
        if run.generation == 1:
            self._before, self._written = self._seen, 0
        if self._rows and len(self._rows[0][1]) != len(run.f_best):
            raise InputError(
                f"this history holds {len(self._rows[0][1])} problems, the run {len(run.f_best)}"
            )
        self._seen = self._before + run.evaluations
        if (run.generation - 1) % self._stride == 0 or run.done:
            self.record(run)

    def __len__(self) -> int:
        return len(self._rows)

    def record(self, run: Run) -> None:
        """Write this step down, whether or not its turn has come; once."""
        if run.generation == self._written:
            return
        x, f = run.members()
        spent = self._before + run.evaluations
        self._rows.append((spent, run.f_best.copy(), np.median(f, axis=1)))
        if self.keeps_population:
            self._members.append((x, f))
        self._written = run.generation
        if len(self._rows) > self.most:
            last = len(self._rows) % 2 == 0  # the newest is not among every second
            self._rows = self._rows[::2] + self._rows[-1:] * (last and run.done)
            self._members = self._members[::2] + self._members[-1:] * (last and run.done)
            self._stride *= 2
            if last and not run.done:
                self._written = 0

    @property
    def evaluations(self) -> Ints:
        """(S, M) evaluations spent of each problem at each of S records."""
        return np.array([spent for spent, _, _ in self._rows], dtype=np.int64)

    @property
    def best(self) -> Array:
        """(S, M) best value so far."""
        return np.array([best for _, best, _ in self._rows])

    @property
    def median(self) -> Array:
        """(S, M) median value of the population."""
        return np.array([median for _, _, median in self._rows])

    @property
    def population(self) -> Array:
        """(S, M, K, D) the populations, if they were asked for; NaN where one was smaller.

        Raises:
            InputError: they were not.
        """
        self._need_population()
        count = max(f.shape[1] for _, f in self._members)
        return np.array([_filled(x, count, np.nan) for x, _ in self._members])

    @property
    def population_values(self) -> Array:
        """(S, M, K) their values.

        Raises:
            InputError: they were not asked for.
        """
        self._need_population()
        count = max(f.shape[1] for _, f in self._members)
        return np.array([_filled(f, count, np.inf) for _, f in self._members])

    def _need_population(self) -> None:
        if not self.keeps_population:
            raise InputError("this history keeps no population: make it with population=True")


def _filled(array: Array, count: int, with_what: float) -> Array:
    """An array (M, K, ...) made (M, count, ...): populations may grow and shrink."""
    whole = np.full((len(array), count, *array.shape[2:]), with_what)
    whole[:, : array.shape[1]] = array
    return whole

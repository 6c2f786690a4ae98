"""Teaching-learning-based optimization: Rao et al., Comput.-Aided Des. 43 (2011) 303."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, real_number
from kinverse.optimizers.run import Run

__all__ = ["TeachingLearning"]

Array = NDArray[np.float64]


class TeachingLearning(Optimizer):
    """Learners that heed a teacher, then each other; two steps of the run are one iteration.

    Teacher phase, with the best point as the teacher and the mean of all learners m::

        x + r (teacher - TF m),  TF one of ``teaching_factors``

    Learner phase, with a random other learner y::

        x + r (x - y) if x is better than y, else x + r (y - x)

    A learner keeps its place unless the new one is better. The paper leaves open what is drawn
    anew: here r in [0, 1) for every component and TF for every learner; all learners move before
    any is looked at again (synchronous).

    Known bias: TF = 2 makes teacher - 2 m out of teacher - m by taking the mean's own coordinates
    off once more, a pull to the origin of the coordinates (Pickard, Carretero & Bhavsar, Appl.
    Soft Comput. 46 (2016) 115). ``teaching_factors=(1,)`` is free of it.

    Args:
        population: learners.
        teaching_factors: numbers that TF is drawn from, each equally likely.

    Example:
        >>> minimize(f, bounds, TeachingLearning(), max_evals=20_000).x
    """

    def __init__(
        self, *, population: int = 100, teaching_factors: tuple[float, ...] = (1, 2)
    ) -> None:
        self.population = population
        self.teaching_factors = teaching_factors

    def _check(self, dimensions: int) -> None:
        if not isinstance(self.teaching_factors, (tuple, list)) or not self.teaching_factors:
            raise InputError(
                f"teaching_factors must be one or more numbers, got {self.teaching_factors!r}"
            )
        for factor in self.teaching_factors:
            real_number("teaching_factors", factor)

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        s.x, s.f, s.teaching = x, f, True

    def _ask(self, run: Run) -> Array:
        s = run.state
        u = run.uniform(s.x.shape[1], s.x.shape[2] + 1)
        share, draw = u[:, :, :-1], u[:, :, -1]
        step = self._taught(run, draw) if s.teaching else self._learnt(run, draw)
        step *= share
        step += s.x
        return run.clip(step)

    def _taught(self, run: Run, draw: Array) -> Array:
        factors = np.asarray(self.teaching_factors, dtype=np.float64)
        factor = factors[(draw * len(factors)).astype(np.intp)]
        mean = run.state.x.mean(axis=1, keepdims=True)
        step: Array = run.leader - factor[:, :, None] * mean
        return step

    def _learnt(self, run: Run, draw: Array) -> Array:
        x, f = run.state.x, run.state.f
        problems, count, dimensions = x.shape
        other = (draw * (count - 1)).astype(np.intp)
        other += other >= np.arange(count)
        other += count * np.arange(problems)[:, None]
        step: Array = x - x.reshape(-1, dimensions)[other]
        step *= np.where(f < f.reshape(-1)[other], 1.0, -1.0)[:, :, None]
        return step

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        better = f < s.f
        np.copyto(s.x, x, where=better[:, :, None])
        np.copyto(s.f, f, where=better)
        s.teaching = not s.teaching

"""How ``minimize`` deals with constraints: by a penalty or by an augmented Lagrangian.

Minimise F(x) subject to G_i(x) = a_i and H_j(x) <= b_j, in the box.

The thesis (document 004) prints, as equations 6.1 and 6.2,

    L(x, lambda, mu) = F + sum_i lambda_i (a_i - G_i) + sum_j mu_j (b_j - H_j)
    dF - sum_i lambda_i dG_i - sum_j mu_j dH_j = 0,  mu_j (H_j - b_j) = 0,  mu_j >= 0,

and writes its second kind of constraint as H_j = b_j. These signs are kept here as a quotation
only: for a minimum with H_j <= b_j the multipliers of that L obey mu_j <= 0 (mu_j >= 0 belongs to a
maximum, or to H_j >= b_j). What is computed uses the signs of most text books,

    L(x, lambda, mu) = F + sum_i lambda_i (G_i - a_i) + sum_j mu_j (H_j - b_j),  mu_j >= 0,

so that ``multipliers`` in a result are the thesis' ones times -1, and minus the rate at which the
best value changes with a_i or b_j.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import real_number, whole_number
from kinverse.optimizers.constraints import Rows
from kinverse.optimizers.run import Run
from kinverse.settings import HasSettings

__all__ = ["Augmented", "Handling", "Merit", "Penalty", "handling"]

Array = NDArray[np.float64]


class Handling(HasSettings):
    """How constraints are dealt with; ``Penalty`` and ``Augmented`` are the two ways.

    A new one writes ``merit``.
    """

    constraints: Any
    tolerance: float

    def merit(self, rows: Rows) -> "Merit":
        """What a search is to minimise in place of the objective."""
        raise NotImplementedError(f"{type(self).__name__} has no merit")

    def _check(self) -> None:
        real_number(f"{type(self).__name__}: tolerance", self.tolerance, 0.0)


class Penalty(Handling):
    """One search of F + weight * (the sum of the squared violations).

    The plain way. Its minimum lies outside by about multiplier / (2 weight): a small weight misses
    the tolerance, a great one makes a narrow valley that methods follow badly.

    Args:
        constraints: one constraint or a sequence, as ``minimize`` takes them.
        weight: of the squared violation; in units of F per unit of the constraint squared.
        tolerance: largest violation that counts as met.

    Example:
        >>> minimize(f, bounds, max_evals=20_000, constraints=Penalty([Equal(g)], weight=1e6))
    """

    def __init__(self, constraints: Any, *, weight: float = 1e6, tolerance: float = 1e-6) -> None:
        self.constraints = constraints
        self.weight = weight
        self.tolerance = tolerance

    def merit(self, rows: Rows) -> "Merit":
        """F plus the weighted squares."""
        self._check()
        real_number("Penalty: weight", self.weight, 0.0)
        merit = Merit(rows)
        merit.weight = 2.0 * float(self.weight)
        return merit


class Augmented(Handling):
    """A sequence of searches of the augmented Lagrangian, with better multipliers each time.

    Round by round the method minimises

        F + w/2 sum_i (c_i + lambda_i / w)^2 + w/2 sum_j max(0, d_j + mu_j / w)^2

    with c = G - a and d = H - b; then, at the point found, lambda += w c, mu = max(0, mu + w d),
    and w grows if the violation did not fall to half. (Powell 1969; Hestenes 1969; Rockafellar
    1973; Nocedal & Wright, Numerical Optimization, 2nd ed., algorithm 17.4; the first w and the
    test of progress after Birgin & Martinez 2014.) A population ends a round spread over some
    distance; w does not grow for a violation within the spread of its last points, which would
    only turn their noise into multipliers.

    The first round has the whole box and a quarter of the evaluations. Each later one starts from
    the best members of the one before in a box about the best point, at the least half as wide as
    the last and never narrower than four times the way the best point went; it opens again where
    that point reaches its edge. Together the rounds spend ``max_evals`` exactly.

    Args:
        constraints: one constraint or a sequence, as ``minimize`` takes them.
        weight: the first w; None: from the spread of the first population's values and violations.
        growth: what w is multiplied by.
        rounds: searches after the first; fewer if not each can have two generations.
        tolerance: largest violation that counts as met.

    Example:
        >>> minimize(f, bounds, max_evals=20_000, constraints=Augmented([Equal(g), AtMost(h)]))
    """

    def __init__(
        self,
        constraints: Any,
        *,
        weight: float | None = None,
        growth: float = 10.0,
        rounds: int = 30,
        tolerance: float = 1e-6,
    ) -> None:
        self.constraints = constraints
        self.weight = weight
        self.growth = growth
        self.rounds = rounds
        self.tolerance = tolerance

    def merit(self, rows: Rows) -> "Merit":
        """The augmented Lagrangian."""
        self._check()
        if self.weight is not None:
            real_number("Augmented: weight", self.weight, 0.0)
            if self.weight == 0:
                raise InputError("Augmented: weight must be above 0, got 0")
        real_number("Augmented: growth", self.growth, 1.0)
        whole_number("Augmented: rounds", self.rounds, 1)
        return AugmentedMerit(rows, self)


class Merit:
    """F plus weight/2 times the squared violations; one round."""

    def __init__(self, rows: Rows) -> None:
        self.rows = rows
        self.weight = 0.0

    def __call__(self, f: Array, rows: Array) -> Array:
        """(K,) what the search minimises, of values f (K,) and constraint rows (K, m)."""
        with np.errstate(all="ignore"):  # what overflows is worst
            squares: Array = (self.rows.violation(rows) ** 2).sum(axis=1)
            return f + 0.5 * self.weight * squares

    def evals(self, left: int, population: int) -> int:
        """How many of the evaluations that are left the next round spends."""
        return left

    def learn(self, run: Run, box: Array) -> tuple[Array, Array] | None:
        """After a round: the box (D, 2) of the next and its first points; None: no next."""
        return None

    @property
    def multipliers(self) -> list[Array]:
        """For each constraint those of its rows; none here."""
        return []


class AugmentedMerit(Merit):
    """The augmented Lagrangian and what is learned from round to round."""

    def __init__(self, rows: Rows, settings: Augmented) -> None:
        super().__init__(rows)
        self._settings = settings
        self._started = False
        self._multipliers = np.zeros(0)
        self._round = 0
        self._max_evals = 0
        self._lowest, self._rows_lowest, self._rows_last = np.inf, np.zeros(0), np.zeros((1, 0))
        self._violation = np.inf
        self._x: Array | None = None
        self._width = 1.0

    def __call__(self, f: Array, rows: Array) -> Array:
        """(K,) the augmented Lagrangian."""
        if not self._started:
            self._started = True
            self._multipliers = np.zeros(rows.shape[1])
            given = self._settings.weight
            self.weight = self._first_weight(f, rows) if given is None else float(given)
        with np.errstate(all="ignore"):  # what overflows is worst
            shifted = rows + self._multipliers / self.weight
            shifted = np.where(self.rows.equal, shifted, np.maximum(shifted, 0.0))
            values: Array = f + 0.5 * self.weight * (shifted**2).sum(axis=1)
        self._rows_last = rows
        sound = np.where(values > -np.inf, values, np.inf)  # as a run reads them
        k = int(sound.argmin())
        if sound[k] < self._lowest:
            self._lowest, self._rows_lowest = float(sound[k]), rows[k]
        return values

    def evals(self, left: int, population: int) -> int:
        """A quarter first, then equal parts of at least two generations."""
        if self._round == 0:
            self._max_evals = left
            part = left // 4
        else:
            part = (self._max_evals - self._max_evals // 4) // self._settings.rounds
        part = max(part, 2 * population)
        self._round += 1
        # no remainder that is too small for a round of its own
        return part if left - part >= population else left

    def learn(self, run: Run, box: Array) -> tuple[Array, Array] | None:
        """Better multipliers; a narrower box about the best point, the best members in it."""
        if self._lowest < np.inf:
            self._update_multipliers()
        self._lowest = np.inf
        low, high = box.T
        span, best = high - low, run.x_best[0]
        if self._x is None:
            self._width = 0.5
        else:
            moved = float((np.abs(best - self._x) / span).max())
            margin = 1e-3 * run.span
            on_edge = ((best - run.low < margin) & (run.low > low)).any() or (
                (run.high - best < margin) & (run.high < high)
            ).any()
            if on_edge:
                self._width = min(1.0, 2.0 * self._width)
            else:
                self._width = min(self._width, max(4.0 * moved, 0.5 * self._width, 1e-7))
        self._x = best
        half = 0.5 * self._width * span
        near = np.stack([np.maximum(low, best - half), np.minimum(high, best + half)], axis=1)
        whole = ~(near[:, 0] < near[:, 1])  # a span below the resolution of the numbers
        near[whole] = box[whole]
        x, f = run.members()
        order = np.argsort(f[0], kind="stable")[: max(1, f.shape[1] // 10)]
        first = x[0, order]
        first[0] = best
        return near, first[np.isfinite(first).all(axis=1)]

    @property
    def multipliers(self) -> list[Array]:
        """For each constraint those of its rows."""
        return self.rows.split(self._multipliers)

    def _update_multipliers(self) -> None:
        rows, equal = self._rows_lowest, self.rows.equal
        least = -self._multipliers / self.weight
        missed = np.abs(np.where(equal, rows, np.maximum(rows, least)))
        raised = self._multipliers + self.weight * rows
        self._multipliers = np.where(equal, raised, np.maximum(raised, 0.0))
        # a violation within the spread of the last points says nothing about the weight
        with np.errstate(invalid="ignore"):
            resolved = (missed > np.median(np.abs(self._rows_last - rows), axis=0)).any()
        largest = float(missed.max(initial=0.0))
        if resolved and largest > max(0.5 * self._violation, 0.1 * self._settings.tolerance):
            self.weight = min(self.weight * self._settings.growth, 1e15)
        self._violation = largest

    def _first_weight(self, f: Array, rows: Array) -> float:
        with np.errstate(all="ignore"):
            squares = (self.rows.violation(rows) ** 2).sum(axis=1)
        sound = np.isfinite(f) & np.isfinite(squares)
        if not sound.any():
            self._started = False  # the next population may be better
            return 1.0
        low, high = np.percentile(f[sound], [25, 75])
        typical = float(np.median(squares[sound])) or float(squares[sound].mean())
        if not (high > low and typical > 0.0):
            return 1.0
        return float(np.clip(2.0 * (high - low) / typical, 1e-9, 1e9))


def handling(constraints: Any) -> Handling | None:
    """What ``minimize`` was given as ``constraints``: settings of a way to deal with them."""
    if isinstance(constraints, Handling):
        return constraints
    if isinstance(constraints, Sequence) and len(constraints) == 0:
        return None
    return Augmented(constraints)

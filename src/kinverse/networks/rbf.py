"""Radial basis function network: Gaussian units at training rows, a linear layer behind them."""

import math
import warnings
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import NetworkRegressor, check_number, check_whole
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.radial.gaussian_units import gaussian_units, output_layer, responses
from kinverse.networks.radial.selection import (
    Choice,
    in_order,
    largest_residual,
    orthogonal_least_squares,
)

__all__ = ["RBFNetwork"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SELECTIONS = ("ols", "residual", "random", "exact")
GREEDY = ("ols", "residual")
GOAL_KINDS = ("mse", "sse")
MOST_ENTRIES = 2**27
"""Of the matrix of rows and candidates, unless ``n_candidates`` is set: 1 GiB."""


class RBFNetwork(NetworkRegressor):
    """Gaussian units with centres among the training rows, output weights by least squares.

    The network of document 000 (12-68-6): its text describes random centres and the d_max rule
    (``selection="random"``); it was built by adding a neuron at a time at a spread of 0.75 until
    the sum of squared errors was 0.001: ``RBFNetwork(68, spread=0.75, goal=0.001,
    goal_kind="sse", scaling=None)``.

    Args:
        n_neurons: units at most. None: as many as the goal takes if there is one and the selection
            is greedy; all distinct rows for "exact"; else 100, but no more than half of the rows.
        selection: how rows become centres. "ols": the one that lowers the error most (orthogonal
            least squares, Chen, Cowan & Grant 1991); "residual": the one with the largest error;
            "random": distinct rows drawn at random; "exact": every distinct row, so that the
            network goes through all targets (N rows cost an N x N least squares; the goal has no
            effect).
        spread: distance from its centre at which a unit answers 1/2, in scaled units of the inputs
            (their range is 2) unless scaling is None; or "dmax" ("random" and "exact" only): the
            standard deviation d_max / sqrt(2 M), d_max the largest distance between the M centres.
            None: "dmax" for "random", else 1.0. With many inputs the rule gives units so narrow
            that rows far from all centres get little but the bias.
        goal: add no more units at an error not above this [squared units of y].
        goal_kind: of what the goal is told: "mse" (mean over rows and outputs) or "sse" (sum).
        n_candidates: rows, drawn at random, among which "ols" and "residual" choose; all rows are
            fitted. None: all, unless a matrix of all rows would be above 1 GiB (11,585 rows); then
            a warning says how many.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None, as the
            program of document 000 does.
        callback: called with ``Progress`` after each unit; True ends the training.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        centers_: (M, n) centres, in the units of X.
        center_indices_: (M,) the rows of X they are, in the order they were chosen.
        spread_: the spread of all units, as the argument is told.
        n_neurons_: M.
        output_weights_, bias_: (M, m) and (m,), of scaled targets.
        units_: (M, n + 2) what predictions are computed with (``gaussian_units``).
        sse_path_: (E,) sum of squared errors after each unit, in squared units of y; E = 1 for
            "exact".
        training_mse_: (E, m) mean squared error of each output after each unit, squared units of y.
        n_iter_: E.
        stop_reason_: why no more units were added.

    Example:
        >>> RBFNetwork(68, spread=1.5).fit(X, y).score(X, y) > 0.99
        True
    """

    def __init__(
        self,
        n_neurons: int | None = None,
        *,
        selection: str = "ols",
        spread: float | str | None = None,
        goal: float = 0.0,
        goal_kind: str = "mse",
        n_candidates: int | None = None,
        scaling: str | None = "minmax",
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.n_neurons = n_neurons
        self.selection = selection
        self.spread = spread
        self.goal = goal
        self.goal_kind = goal_kind
        self.n_candidates = n_candidates
        self.scaling = scaling
        self.callback = callback
        self.random_state = random_state

    def _check_settings(self) -> None:
        for name, value, valid in (
            ("selection", self.selection, SELECTIONS),
            ("goal_kind", self.goal_kind, GOAL_KINDS),
        ):
            if not isinstance(value, str) or value not in valid:
                raise InputError(f"{name} must be one of {', '.join(valid)}, got {value!r}")
        if self.n_neurons is not None:
            check_whole("n_neurons", self.n_neurons, 1)
            if self.selection == "exact":
                raise InputError(
                    "selection 'exact' takes every distinct row: n_neurons must be None, got"
                    f" {self.n_neurons!r}"
                )
        if self.n_candidates is not None:
            check_whole("n_candidates", self.n_candidates, 1)
        if isinstance(self.spread, str):
            if self.spread != "dmax" or self.selection in GREEDY:
                raise InputError(
                    "spread must be a number > 0 or, with selection 'random' or 'exact', 'dmax',"
                    f" got {self.spread!r} with selection {self.selection!r}"
                )
        elif self.spread is not None:
            check_number("spread", self.spread, 0.0, open_ends=True)
        check_number("goal", self.goal, 0.0)
        if self.callback is not None and not callable(self.callback):
            raise InputError(f"callback must be a function, got {self.callback!r}")

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return 0 if self.n_neurons is None else (self.n_neurons + 1) * n_outputs

    def _train(self, X: Array, Y: Array, rng: np.random.Generator) -> None:
        if self.selection == "exact":
            self._interpolate(X, Y)
            return
        most = self._most(len(X))
        monitor = self._monitor(most, len(Y))
        monitor.stop("as many units as allowed")
        chosen: list[int] = []
        for row, left in islice(self._choices(X, Y, most, rng), most):
            chosen.append(row)
            if monitor.epoch(None, np.mean(left**2, axis=0)):
                break
        else:
            if len(chosen) < most:
                monitor.stop("no row is left that would lower the error")
        if not chosen:  # the bias alone explains all that units could
            chosen = [0]
            monitor.epoch(None, np.var(Y, axis=0))
        self._keep(X, Y, np.array(chosen), monitor)

    def _output(self, X: Array) -> Array:
        out: Array = responses(X, self.units_) @ self.output_weights_
        out += self.bias_
        return out

    # How it works -----------------------------------------------------------------------------

    def _most(self, rows: int) -> int:
        if self.n_neurons is not None:
            return int(self.n_neurons)
        if self.goal > 0.0 and self.selection in GREEDY:
            return rows
        return min(100, rows // 2)

    def _monitor(self, most: int, rows: int) -> Monitor:
        goal = self.goal / (rows * self.n_outputs_) if self.goal_kind == "sse" else self.goal
        return Monitor(max_epochs=most, unit=self.output_unit_, goal=goal, callback=self.callback)

    def _choices(self, X: Array, Y: Array, most: int, rng: np.random.Generator) -> Iterator[Choice]:
        """The rows that become centres, in their order; sets ``spread_``."""
        if self.selection == "random":
            rows = rng.permutation(_distinct(X))[:most]
            self.spread_ = self._width(X[rows])
            return in_order(X, Y, self.spread_, rows.tolist())
        self.spread_ = self._width(X[:1])
        candidates = self._candidates(len(X), rng)
        choose = orthogonal_least_squares if self.selection == "ols" else largest_residual
        return choose(X, Y, self.spread_, candidates)

    def _candidates(self, rows: int, rng: np.random.Generator) -> Ints:
        if self.n_candidates is not None:
            count = min(int(self.n_candidates), rows)
        elif self.selection == "residual" or rows**2 <= MOST_ENTRIES:
            count = rows
        else:
            count = max(1, MOST_ENTRIES // rows)
            warnings.warn(
                f"RBFNetwork: a matrix of {rows} x {rows} would be above 1 GiB: the centres are"
                f" chosen among {count} rows drawn at random; n_candidates sets their number",
                UserWarning,
                stacklevel=6,
            )
        if count == rows:
            return np.arange(rows)
        return np.sort(rng.permutation(rows)[:count])

    def _width(self, centers: Array) -> float:
        by_rule = self.spread == "dmax" or (self.spread is None and self.selection == "random")
        if not by_rule:
            return 1.0 if self.spread is None else float(self.spread)
        from scipy.spatial.distance import pdist

        furthest = float(pdist(centers).max(initial=0.0))
        if furthest == 0.0:
            warnings.warn(
                "RBFNetwork: the d_max rule needs two distinct centres, there is one: its spread"
                " is 1.0",
                UserWarning,
                stacklevel=6,
            )
            return 1.0
        return furthest * math.sqrt(math.log(2.0) / len(centers))  # sigma times 1.17741

    def _interpolate(self, X: Array, Y: Array) -> None:
        rows = _distinct(X)
        self.spread_ = self._width(X[rows])
        monitor = self._monitor(1, len(Y))
        monitor.stop("every distinct row is a centre")
        self._keep(X, Y, rows, monitor)
        error = self._output(X) - Y
        monitor.epoch(None, np.mean(error**2, axis=0))
        self._record(monitor, len(Y))
        worst = float(np.abs(error).max())
        if worst > 1e-6:
            again = len(X) - len(rows)
            why = (
                f"{again} rows occur more than once" if again else "the units are nearly dependent"
            )
            warnings.warn(
                f"RBFNetwork: the targets are missed by up to {worst:.1g} (scaled): {why}",
                UserWarning,
                stacklevel=5,
            )

    def _keep(self, X: Array, Y: Array, chosen: Ints, monitor: Monitor) -> None:
        self.center_indices_ = chosen
        self.n_neurons_ = len(chosen)
        self.units_ = gaussian_units(X[chosen], self.spread_)
        self.centers_ = self._inputs.inverse(X[chosen])
        self.output_weights_, self.bias_ = output_layer(responses(X, self.units_), Y)
        self._record(monitor, len(Y))

    def _record(self, monitor: Monitor, rows: int) -> None:
        self.training_mse_ = monitor.training_mse
        self.sse_path_ = self.training_mse_.sum(axis=1) * rows
        self.n_iter_ = monitor.epochs
        self.stop_reason_ = monitor.reason


def _distinct(X: Array) -> Ints:
    """(K,) the first of equal rows each, ascending."""
    return np.sort(np.unique(X, axis=0, return_index=True)[1])

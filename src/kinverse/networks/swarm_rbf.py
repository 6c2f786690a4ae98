"""A radial basis function network whose centres and widths a swarm finds."""

from collections.abc import Callable
from math import ceil
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_whole
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.radial.gaussian_units import gaussian_units, output_layer, responses
from kinverse.optimizers import Optimizer, make_optimizer

__all__ = ["SwarmRBF", "population_mse"]

Array = NDArray[np.float64]

ENTRIES = 2**20
"""Answers of units that are dealt with at a time: 8 MB."""
RIDGE = 1e-10
"""Of the normal equations, as a share of their trace; the network kept is solved without one."""
NARROWEST, WIDEST = 0.02, 2.0
"""Spreads that are searched, as shares of the diagonal of the box of the inputs."""


class SwarmRBF(IterativeNetwork):
    """Gaussian units found by a population method, output weights by least squares.

    Document 004 (chapter 8) names it as work to come. A member of the population holds the centre
    of each unit, anywhere in the box of the training rows, and its spread; its value is the mean
    squared error with the output weights that are best for it. The first population has training
    rows as centres.

    Args:
        n_neurons: units.
        optimizer: a short name of ``kinverse.optimizers.NAMES`` or a method with settings.
        max_evals: networks to evaluate; all are, unless something below ends the search.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: generations without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: put the units of the last ``fit`` into the first generation.
        callback: called with ``Progress`` after each generation, whose ``max_epochs`` is how many
            there will be as far as is known; True ends the search.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        evaluations_: networks evaluated.
        n_iter_: generations.
        training_mse_: (E, m) errors of the best network so far, after each generation.
        centers_: (M, n) centres, in the units of X.
        spreads_: (M,) distance at which each unit answers 1/2, in scaled units of the inputs.

    Example:
        >>> net = SwarmRBF(n_neurons=10, optimizer="gwo", max_evals=2000).fit(X, y)
        >>> net.evaluations_
        2000
    """

    max_iter: int | None = None  # the budget is told in evaluations

    def __init__(
        self,
        n_neurons: int = 10,
        *,
        optimizer: str | Optimizer = "pso",
        max_evals: int = 5000,
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 50,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.n_neurons = n_neurons
        self.optimizer = optimizer
        self.max_evals = max_evals
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    @property
    def centers_(self) -> Array:
        """(M, n) centres, in the units of X."""
        return self._inputs.inverse(self._split(self.weights_)[0])

    @property
    def spreads_(self) -> Array:
        """(M,) distance from its centre at which each unit answers 1/2, in scaled units."""
        return self._split(self.weights_)[1]

    def _check_settings(self) -> None:
        super()._check_settings()
        check_whole("n_neurons", self.n_neurons, 1)
        check_whole("max_evals", self.max_evals, 1)
        # what the method objects to is said before anything is learned
        self._method().start([(0.0, 1.0)], max_evals=self.max_evals)

    def _method(self) -> Optimizer:
        if isinstance(self.optimizer, Optimizer):
            return self.optimizer
        if not isinstance(self.optimizer, str):
            raise InputError(f"optimizer must be a name or an Optimizer, got {self.optimizer!r}")
        return make_optimizer(self.optimizer)

    def _epochs(self) -> int:
        return self.max_evals

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return self.n_neurons * (n_inputs + 1 + n_outputs) + n_outputs

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        method = self._method()
        self.shape_ = np.array([X.shape[1], self.n_neurons, Y.shape[1]])
        box = _Box.around(X)
        rows = rng.integers(len(X), size=(method.population, self.n_neurons))
        first = box.members(X[rows], box.spreads(rng.uniform(-1.0, 1.0, rows.shape)))
        if start is not None and len(start) == self._count_parameters(X.shape[1], Y.shape[1]):
            centers, spreads, _, _ = self._split(start)
            first[0] = box.members(centers[None], spreads[None])[0]
        bounds = np.tile([-1.0, 1.0], (first.shape[1], 1))
        run = method.start(bounds, max_evals=self.max_evals, rng=rng, x0=first)
        best, promised, errors = None, np.inf, np.full(Y.shape[1], np.inf)
        self.evaluations_ = 0
        while not run.done:
            members = run.ask()[0]
            centers, spreads = box.units(members, self.n_neurons)
            values = population_mse(centers, spreads, X, Y)
            run.tell(values[None])
            self.evaluations_ = int(run.evaluations[0])
            k = int(values.argmin())
            if best is None or values[k] < promised:
                promised = values[k]
                weights = self._solved(centers[k], spreads[k], X, Y)
                error = np.mean((self._forward(weights, X) - Y) ** 2, axis=0)
                # without the ridge the order of two networks that are nearly alike may differ
                if best is None or error.sum() < errors.sum():
                    best, errors = weights, error
            left = self.max_evals - self.evaluations_
            monitor.max_epochs = monitor.epochs + 1 + ceil(left / len(members))
            if run.done:
                monitor.stop("the evaluations are spent")
            if monitor.epoch(best, errors):
                return

    def _forward(self, weights: Array, X: Array) -> Array:
        centers, spreads, W, b = self._split(weights)
        out: Array = responses(X, gaussian_units(centers, spreads)) @ W
        out += b
        return out

    def _solved(self, centers: Array, spreads: Array, X: Array, Y: Array) -> Array:
        W, b = output_layer(responses(X, gaussian_units(centers, spreads)), Y)
        return np.concatenate([centers.ravel(), spreads, W.ravel(), b])

    def _split(self, weights: Array) -> tuple[Array, Array, Array, Array]:
        """Centres (M, n), spreads (M,), output weights (M, m) and bias (m,) of the vector."""
        n, M, m = self.shape_.tolist()
        centers, spreads, W, b = np.split(weights, np.cumsum([M * n, M, M * m]))
        return centers.reshape(M, n), spreads, W.reshape(M, m), b


class _Box(NamedTuple):
    """Centres and spreads as numbers in [-1, 1]; some methods favour the middle of their box."""

    middle: Array  # (n,)
    half: Array  # (n,)
    diagonal: float

    @classmethod
    def around(cls, X: Array) -> Self:
        low, high = X.min(axis=0), X.max(axis=0)
        diagonal = float(np.linalg.norm(high - low))
        return cls(low + 0.5 * (high - low), 0.5 * (high - low), diagonal or 1.0)

    def members(self, centers: Array, spreads: Array) -> Array:
        """Members (K, M (n + 1)) of centres (K, M, n) and spreads (K, M)."""
        still = self.half == 0.0  # a constant column: any number stands for the constant
        places = (centers - self.middle) / np.where(still, 1.0, self.half)
        share = np.log(spreads / (NARROWEST * self.diagonal)) / np.log(WIDEST / NARROWEST)
        return np.concatenate([places.reshape(len(places), -1), 2.0 * share - 1.0], axis=1)

    def units(self, members: Array, count: int) -> tuple[Array, Array]:
        """Centres (K, M, n) and spreads (K, M) of members."""
        places, widths = members[:, :-count], members[:, -count:]
        centers = self.middle + self.half * places.reshape(len(members), count, -1)
        return centers, self.spreads(widths)

    def spreads(self, widths: Array) -> Array:
        """Spreads of numbers in [-1, 1]: even in their logarithm."""
        narrowest = NARROWEST * self.diagonal
        spreads: Array = narrowest * (WIDEST / NARROWEST) ** (0.5 * (widths + 1.0))
        return spreads


def population_mse(centers: Array, spreads: Array, X: Array, Y: Array) -> Array:
    """Mean squared errors (K,) of K networks, each with the output weights that are best for it.

    Args:
        centers: (K, M, n).
        spreads: (K, M).
        X: (N, n) rows.
        Y: (N, m) targets.

    Example:
        >>> population_mse(np.zeros((50, 10, 3)), np.ones((50, 10)), X, Y).shape
        (50,)
    """
    K, M, n = centers.shape
    units = gaussian_units(centers, spreads)
    values = np.empty(K)
    step = max(1, ENTRIES // (len(X) * (M + 1)))
    for k in range(0, K, step):
        some = units[k : k + step]
        answers = responses(X, some.reshape(-1, n + 2)).reshape(len(X), -1, M)
        phi = np.ones((len(some), len(X), M + 1))
        phi[:, :, :M] = answers.transpose(1, 0, 2)
        turned = phi.transpose(0, 2, 1)
        normal = turned @ phi
        ridge = RIDGE * np.trace(normal, axis1=1, axis2=2)
        normal[:, np.arange(M + 1), np.arange(M + 1)] += ridge[:, None]
        error = phi @ np.linalg.solve(normal, turned @ Y)
        error -= Y
        values[k : k + step] = np.einsum("knm,knm->k", error, error) / Y.size
    return values

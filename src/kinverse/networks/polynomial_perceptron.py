"""Polynomial perceptron: one layer on all monomials of the inputs."""

import math
from collections.abc import Callable
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_whole
from kinverse.networks.activations import activation
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.trainers import Task, find_trainer

__all__ = ["PolynomialPerceptron", "exponents", "monomials"]

Array = NDArray[np.float64]

MOST_TERMS = 100_000


class PolynomialPerceptron(IterativeNetwork):
    """y = f(W phi(x)), phi all monomials up to a degree (document 004, equations 5.7 to 5.10).

    There are C(n + r, r) of them for n inputs and degree r, the constant included. With the
    linear output the weights are exact least squares of the smallest norm, found in one epoch;
    with a sigmoid output they are trained by limited-memory BFGS.

    Args:
        degree: r.
        output: "purelin", "tansig" or "logsig". With scaling, targets of the latter go to [0, 1].
        max_iter: epochs at most, of a sigmoid output.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: epochs without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: go on from the weights of the last ``fit``.
        callback: called with ``Progress`` after each epoch; True ends the training.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        exponents_: (C(n + r, r) - 1, n) of each monomial but the constant.
        coef_, intercept_: weights (C(n + r, r) - 1, m) and constants (m,), in scaled units.

    Example:
        >>> PolynomialPerceptron(degree=3).fit(X, y).coef_.shape
        (19, 2)
    """

    def __init__(
        self,
        degree: int = 2,
        *,
        output: str = "purelin",
        max_iter: int = 1000,
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 10,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.degree = degree
        self.output = output
        self.max_iter = max_iter
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    @property
    def coef_(self) -> Array:
        """(C(n + r, r) - 1, m) weights of the monomials."""
        return self._layer().split(self.weights_)[0][0]

    @property
    def intercept_(self) -> Array:
        """(m,) constants."""
        return self._layer().split(self.weights_)[0][1]

    def _check_settings(self) -> None:
        super()._check_settings()
        check_whole("degree", self.degree, 1)
        activation(self.output)

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        count = math.comb(n_inputs + self.degree, self.degree)
        if count > MOST_TERMS:
            raise InputError(
                f"{n_inputs} inputs with degree={self.degree} make {count:,} monomials, more than"
                f" {MOST_TERMS:,}: take a lower degree or fewer inputs"
            )
        return n_outputs * count

    def _scale(self, X: Array, Y: Array) -> None:
        super()._scale(X, Y)
        if self.scaling is not None and self.output == "logsig":
            self.output_middle_, self.output_unit_ = self._outputs.from_zero()

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        self.degree_, self.output_ = self.degree, self.output
        self.exponents_ = exponents(X.shape[1], self.degree)
        phi, layer = monomials(X, self.degree), self._layer()
        if self.output == "purelin":
            regressors = np.hstack([phi, np.ones((len(phi), 1))])
            weights = np.linalg.lstsq(regressors, Y, rcond=None)[0].astype(np.float64).ravel()
            error = layer.forward(weights, phi) - Y
            monitor.epoch(weights, np.mean(error * error, axis=0))
            monitor.stop("the least squares are exact")
            return
        if start is not None and len(start) != layer.count:
            start = None
        find_trainer("lbfgs").train(Task(layer, phi, Y, start, rng, 0.0, 0.0), monitor)

    def _forward(self, weights: Array, X: Array) -> Array:
        return self._layer().forward(weights, monomials(X, self.degree_))

    def _layer(self) -> Layers:
        return Layers((len(self.exponents_), self.n_outputs_), (self.output_,))


def exponents(inputs: int, degree: int) -> NDArray[np.int64]:
    """Exponents (C(n + r, r) - 1, n) of all monomials of degree 1 to r, in the order of monomials.

    Example:
        >>> exponents(2, 2).tolist()
        [[1, 0], [0, 1], [2, 0], [1, 1], [0, 2]]
    """
    each = np.arange(inputs)
    return np.array(
        [
            np.equal.outer(each, chosen).sum(axis=1)
            for power in range(1, degree + 1)
            for chosen in combinations_with_replacement(range(inputs), power)
        ],
        dtype=np.int64,
    )


def monomials(X: Array, degree: int) -> Array:
    """All monomials of degree 1 to r of rows X (N, n): (N, C(n + r, r) - 1).

    Example:
        >>> monomials(np.array([[2.0, 3.0]]), 2)
        array([[2., 3., 4., 6., 9.]])
    """
    inputs = X.shape[1]
    powers = [X]
    starts = list(range(inputs))  # where those whose first factor is input j begin
    for _ in range(degree - 1):
        last = powers[-1]
        parts = [X[:, j : j + 1] * last[:, starts[j] :] for j in range(inputs)]
        powers.append(np.hstack(parts))
        starts = np.cumsum([0, *(part.shape[1] for part in parts)])[:-1].tolist()
    return np.hstack(powers)

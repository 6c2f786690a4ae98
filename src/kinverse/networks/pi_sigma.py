"""Pi-sigma network: products of weighted sums."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_number, check_whole
from kinverse.networks.activations import activation
from kinverse.networks.monitor import Monitor, Progress

__all__ = ["RULES", "PiSigma", "descended"]

Array = NDArray[np.float64]

RULES = ("asynchronous", "simultaneous")
"""What ``rule=`` may be."""


class PiSigma(IterativeNetwork):
    """y = f(prod_k h_k), h_k = w_k . x + w_k0 (Shin & Ghosh 1991; document 004, 5.11 and 5.12).

    Every output has summing units of its own; only their weights are trained. The document leaves
    the biases out; without them the network knows products of exactly K inputs only.

    Args:
        order: K summing units for each output.
        output: "logsig" (with scaling, the targets go to [0, 1]), "tansig" or "purelin".
        rule: "asynchronous" moves one unit after another and computes the output anew each time,
            "simultaneous" moves all at once and needs a smaller rate.
        learning_rate: of one pattern's gradient; "purelin" needs a smaller one.
        batch_size: patterns whose gradients are added up before the weights move; 1 is the rule as
            published, slower by about this factor.
        max_iter: epochs at most, each over all patterns in a new order.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: epochs without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: go on from the weights of the last ``fit``.
        callback: called with ``Progress`` after each epoch; True ends the training.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        coef_: (m, K, n + 1) weights of the summing units, the bias last, in scaled units.

    Example:
        >>> PiSigma(order=2, random_state=0).fit(X, y).coef_.shape
        (3, 2, 4)
    """

    def __init__(
        self,
        order: int = 3,
        *,
        output: str = "logsig",
        rule: str = "asynchronous",
        learning_rate: float = 0.05,
        batch_size: int = 16,
        max_iter: int = 200,
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 10,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.order = order
        self.output = output
        self.rule = rule
        self.learning_rate = learning_rate
        self.batch_size = batch_size
        self.max_iter = max_iter
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # a product of sums cannot say what scikit-learn's test asks for in its few epochs
        tags.regressor_tags.poor_score = True
        return tags

    @property
    def coef_(self) -> Array:
        """(m, K, n + 1) weights of the summing units, the bias last."""
        return self._units(self.weights_)

    def _check_settings(self) -> None:
        super()._check_settings()
        check_whole("order", self.order, 1)
        check_whole("batch_size", self.batch_size, 1)
        activation(self.output)
        check_number("learning_rate", self.learning_rate, 0.0)
        if self.rule not in RULES:
            raise InputError(f"rule must be one of {', '.join(RULES)}, got {self.rule!r}")

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return n_outputs * self.order * (n_inputs + 1)

    def _scale(self, X: Array, Y: Array) -> None:
        super()._scale(X, Y)
        if self.scaling is not None and self.output == "logsig":
            self.output_middle_, self.output_unit_ = self._outputs.from_zero()

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        self.output_ = self.output
        shape = (Y.shape[1], self.order, X.shape[1] + 1)
        first = rng.uniform(-0.5, 0.5, shape)
        if start is not None and len(start) == first.size:
            first = start.reshape(shape)
        weights, ended = first, False
        # a rate too high ends in infinities: the monitor sees them and ends the training
        with np.errstate(over="ignore", invalid="ignore"):
            while not ended:
                order = rng.permutation(len(X))
                for k in range(0, len(X), self.batch_size):
                    rows = order[k : k + self.batch_size]
                    weights = descended(
                        weights,
                        X[rows],
                        Y[rows],
                        self.learning_rate,
                        output=self.output,
                        rule=self.rule,
                    )
                error = self._forward(weights.ravel(), X) - Y
                ended = monitor.epoch(weights.ravel(), np.mean(error * error, axis=0))
        if not np.isfinite(monitor.training_mse[0]).all():
            monitor.best = first.ravel()
            warnings.warn(
                "PiSigma: the first epoch diverged and the weights are those before it: try a"
                f" learning_rate below {self.learning_rate:g}",
                UserWarning,
                stacklevel=5,
            )

    def _forward(self, weights: Array, X: Array) -> Array:
        units = _sums(self._units(weights), X)
        return activation(self.output_).of(units.prod(axis=1)).T

    def _units(self, weights: Array) -> Array:
        return weights.reshape(self.n_outputs_, -1, self.n_features_in_ + 1)


def descended(weights: Array, X: Array, Y: Array, rate: float, *, output: str, rule: str) -> Array:
    """The weights (m, K, n + 1) after a step down the gradient of the sum of squared errors.

    A unit's gradient holds the product of the other units: of those before it, which have moved
    under the asynchronous rule, times those behind it. Nothing is divided by a unit's sum.

    Args:
        weights: (m, K, n + 1), the bias last.
        X: (N, n) the patterns of one step.
        Y: (N, m) their targets.
        rate: the step is this times the gradient.
        output: the activation.
        rule: one of ``RULES``.
    """
    f = activation(output)
    sums, targets = _sums(weights, X), Y.T
    behind = [np.ones_like(targets)]
    for k in reversed(range(1, weights.shape[1])):
        behind.append(behind[-1] * sums[:, k])
    before = np.ones_like(targets)
    moved = weights.copy()
    for k, after in enumerate(reversed(behind)):
        others = before * after
        y = f.of(others * sums[:, k])
        back = 2.0 * (y - targets) * f.slope(y) * others
        moved[:, k, :-1] -= rate * back @ X
        moved[:, k, -1] -= rate * back.sum(axis=1)
        asynchronous = rule == "asynchronous"
        before = before * (_sums(moved[:, k : k + 1], X)[:, 0] if asynchronous else sums[:, k])
    return moved


def _sums(weights: Array, X: Array) -> Array:
    """What the summing units say: (m, K, N)."""
    out: Array = weights[:, :, :-1] @ X.T
    out += weights[:, :, -1:]
    return out

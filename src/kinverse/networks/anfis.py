"""Adaptive network-based fuzzy inference system."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_number, check_whole
from kinverse.networks.fuzzy.hybrid import StepSize, least_squares
from kinverse.networks.fuzzy.membership import find_membership
from kinverse.networks.fuzzy.rules import Rules
from kinverse.networks.monitor import Monitor, Progress

__all__ = ["ANFIS"]

Array = NDArray[np.float64]


MANY_RULES = 1100
"""Above ten inputs of two sets, or three of ten, an epoch takes seconds and more."""


class ANFIS(IterativeNetwork):
    """Sugeno fuzzy rules on a grid, tuned by hybrid learning (Jang 1993; document 004, 5.3).

    Every output has a model of its own, as the document has one for each joint: its own fuzzy
    sets, its own consequents. An epoch finds the consequents by least squares, then moves the
    fuzzy sets one step of fixed length down the gradient of the squared error. Of each output the
    epoch with the lowest error is kept.

    The configuration printed in the document (343 rules, 343 linear and 63 nonlinear parameters,
    734 nodes) is ``ANFIS(7, mf="gbell", order=0)`` with three inputs.

    Args:
        n_mfs: fuzzy sets of each input, one number or one for each. The rules are their product.
        mf: "gbell" (three parameters a set), "gauss" (two) or "tri" (three). Where no triangle of
            an input fires, the one nearest by does.
        order: of the consequents: 0 a constant, 1 linear in the inputs.
        ridge: weight of the squared consequents beside the sum of squared errors. Rules that few
            rows reach are held down by it: near 0, as in plain least squares, they may answer with
            many times the range of the targets.
        max_iter: epochs at most.
        step_size: length of the first step, in scaled units of all of an output's sets together.
        step_increase: factor after four reductions of the error in a row.
        step_decrease: factor after two combinations of an increase and a reduction in a row.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back, judge by them, and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: epochs without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: go on from the fuzzy sets of the last ``fit``.
        callback: called with ``Progress`` after each epoch; True ends the training.
        random_state: chooses the rows held back; nothing else is random.

    Attributes:
        n_mfs_: (n,) fuzzy sets of each input.
        n_rules_: rules of each output.
        n_linear_parameters_, n_nonlinear_parameters_: numbers in consequents and premises of each
            output.
        n_nodes_: nodes of the network of each output.
        premises_: (m, M, p) parameters of all sets, the first input's first, in scaled units.
        consequents_: (m, R, 1) or (m, R, n + 1), the constant last, in scaled units.

    Example:
        >>> ANFIS(3, mf="gauss", order=1).fit(X, y).n_rules_
        27
    """

    def __init__(
        self,
        n_mfs: int | Sequence[int] = 2,
        *,
        mf: str = "gbell",
        order: int = 1,
        ridge: float = 1e-4,
        max_iter: int = 10,
        step_size: float = 0.01,
        step_increase: float = 1.1,
        step_decrease: float = 0.9,
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 10,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.n_mfs = n_mfs
        self.mf = mf
        self.order = order
        self.ridge = ridge
        self.max_iter = max_iter
        self.step_size = step_size
        self.step_increase = step_increase
        self.step_decrease = step_decrease
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    @property
    def n_rules_(self) -> int:
        """Rules of each output."""
        return self._rules().n_rules

    @property
    def n_linear_parameters_(self) -> int:
        """Numbers in the consequents of each output."""
        return self._rules().n_linear

    @property
    def n_nonlinear_parameters_(self) -> int:
        """Numbers in the fuzzy sets of each output."""
        return self._rules().n_nonlinear

    @property
    def n_nodes_(self) -> int:
        """Nodes of the network of each output: n + 2 M + 2 R + 3."""
        return self._rules().n_nodes

    @property
    def premises_(self) -> Array:
        """(m, M, p) parameters of the fuzzy sets, in scaled units."""
        return np.stack([premises for premises, _ in self._models(self.weights_)])

    @property
    def consequents_(self) -> Array:
        """(m, R, 1) or (m, R, n + 1) consequents, in scaled units."""
        return np.stack([consequents for _, consequents in self._models(self.weights_)])

    def membership(self, input: int, x: ArrayLike, output: int = 0) -> Array:
        """The membership functions of one input, for a plot.

        Args:
            input: which column of X.
            x: (L,) values of that column, in its own units.
            output: which column of y the model is for.

        Returns:
            (k, L) values in [0, 1], a row for each fuzzy set.

        Raises:
            InputError: no such input or output, or x is not a row of finite numbers.
            sklearn.exceptions.NotFittedError: ``fit`` comes first.

        Example:
            >>> net.membership(0, np.linspace(-0.5, 0.5, 100)).shape
            (7, 100)
        """
        check_is_fitted(self)
        for name, value, count in (
            ("input", input, self.n_features_in_),
            ("output", output, self.n_outputs_),
        ):
            check_whole(name, value, 0)
            if value >= count:
                raise InputError(f"{name} must be one of 0 to {count - 1}, got {value}")
        values = np.asarray(x, dtype=np.float64)
        if values.ndim != 1 or not np.isfinite(values).all():
            raise InputError(f"x must be a row of finite numbers, got shape {values.shape}")
        rows = np.zeros((len(values), self.n_features_in_))
        rows[:, input] = values
        start = int(self.n_mfs_[:input].sum())
        of_all = self._rules().values(self.premises_[output], self._inputs.forward(rows))
        return of_all[:, start : start + int(self.n_mfs_[input])].T

    def _check_settings(self) -> None:
        super()._check_settings()
        find_membership(self.mf)
        counts = self.n_mfs
        for count in (counts,) if not isinstance(counts, Sequence | np.ndarray) else counts:
            check_whole("n_mfs", count, 1)
        check_whole("order", self.order, 0)
        if self.order > 1:
            raise InputError(f"order must be 0 or 1, got {self.order!r}")
        check_number("ridge", self.ridge, 0.0)
        check_number("step_size", self.step_size, 0.0)
        check_number("step_increase", self.step_increase, 1.0)
        check_number("step_decrease", self.step_decrease, 0.0, 1.0, open_ends=True)

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        rules = Rules.of(self.n_mfs, n_inputs, self.mf, self.order)
        return n_outputs * (rules.n_linear + rules.n_nonlinear)

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        rules = Rules.of(self.n_mfs, X.shape[1], self.mf, self.order)
        if rules.n_rules > MANY_RULES:
            warnings.warn(
                f"ANFIS: {rules.n_rules} rules for each output, the product of the fuzzy sets of"
                f" {X.shape[1]} inputs, are slow to train: three or four inputs suit it",
                UserWarning,
                stacklevel=5,
            )
        first, least = rules.first(X)
        premises = [first] * Y.shape[1]
        if start is not None and self._rules() == rules:
            premises = [before for before, _ in self._models(start)]
        self.n_mfs_, self.mf_, self.order_ = np.array(rules.counts), rules.mf, rules.order
        steps = [StepSize(self.step_size, self.step_increase, self.step_decrease) for _ in premises]
        best, lowest = np.zeros(0), np.full(Y.shape[1], np.inf)
        while True:
            consequents = [
                least_squares(rules, sets, X, y, self.ridge)
                for sets, y in zip(premises, Y.T, strict=True)
            ]
            weights = _joined(premises, consequents)
            errors = self._forward(weights.ravel(), X) - Y
            mse = np.mean(errors * errors, axis=0)
            ended = monitor.epoch(weights.ravel(), mse)
            judged = (monitor.validation_mse if self.early_stopping else monitor.training_mse)[-1]
            # the outputs are models of their own: each keeps its own best epoch
            best = np.where((judged < lowest)[:, None], weights, best if best.size else weights)
            lowest = np.minimum(judged, lowest)
            monitor.best = best.ravel()
            if ended:
                return
            for k, (sets, theta) in enumerate(zip(premises, consequents, strict=True)):
                slope = rules.gradient(sets, theta, X, errors[:, k])
                length, norm = steps[k].after(float(mse[k])), np.linalg.norm(slope)
                if norm > 0.0:
                    premises[k] = rules.kind.kept(sets - length / norm * slope, least)

    def _forward(self, weights: Array, X: Array) -> Array:
        rules = self._rules()
        return np.stack([rules.output(*model, X) for model in self._models(weights)], axis=1)

    def _rules(self) -> Rules:
        return Rules(tuple(self.n_mfs_.tolist()), self.mf_, self.order_)

    def _models(self, weights: Array) -> list[tuple[Array, Array]]:
        """Premises (M, p) and consequents of each output."""
        rules = self._rules()
        return [
            (
                row[: rules.n_nonlinear].reshape(-1, len(rules.kind.parameters)),
                row[rules.n_nonlinear :].reshape(rules.n_rules, -1),
            )
            for row in weights.reshape(-1, rules.n_nonlinear + rules.n_linear)
        ]


def _joined(premises: list[Array], consequents: list[Array]) -> Array:
    """A row of weights for each output."""
    pairs = zip(premises, consequents, strict=True)
    return np.stack([np.concatenate([one.ravel(), two.ravel()]) for one, two in pairs])

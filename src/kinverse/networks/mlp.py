"""Multilayer perceptron, by several trainers."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_number, check_whole
from kinverse.networks.activations import activation
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.trainers import TRAINERS, Task, find_trainer
from kinverse.networks.trainers.damping import make_damping

__all__ = ["MLP"]

Array = NDArray[np.float64]


class MLP(IterativeNetwork):
    """Feed-forward layers with sigmoid hidden units (documents 000, 003 and 004).

    Args:
        hidden: units of each hidden layer.
        activation: of the hidden layers: "logsig", "tansig" or "purelin", one name or one for each
            layer.
        output_activation: of the output layer. "logsig" and "tansig" bound the scaled outputs.
        trainer: "varpro" (variable projection, the quickest; linear output only), "bayes"
            (Levenberg-Marquardt with Bayesian regularisation), "lm" (Levenberg-Marquardt), "gdm"
            (gradient descent with momentum), "gdx" (the same with an adaptive rate), "oss"
            (one-step secant), "lbfgs".
        max_iter: epochs at most; None: what suits the trainer.
        learning_rate, momentum: of "gdm" and "gdx".
        damping: of "lm" and "bayes": "tenfold" (the schedule of the documents' program) or
            "nielsen", which refuses fewer steps and is several times quicker on document 003's set.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: epochs without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: go on from the weights of the last ``fit``.
        callback: called with ``Progress`` after each epoch; True ends the training.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        layers_, activations_: (n, h_1, ..., m), and the activation of each layer.
        coefs_, intercepts_: weights and biases of each layer, as scikit-learn names them.
        effective_parameters_: of trainer "bayes": how many parameters the data determine.

    Example:
        >>> MLP(hidden=(140,), random_state=0).fit(X, y).score(X, y) > 0.99
        True
    """

    def __init__(
        self,
        hidden: Sequence[int] = (30,),
        *,
        activation: str | Sequence[str] = "tansig",
        output_activation: str = "purelin",
        trainer: str = "varpro",
        max_iter: int | None = None,
        learning_rate: float = 0.01,
        momentum: float = 0.9,
        damping: str = "tenfold",
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 10,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.hidden = hidden
        self.activation = activation
        self.output_activation = output_activation
        self.trainer = trainer
        self.max_iter = max_iter
        self.learning_rate = learning_rate
        self.momentum = momentum
        self.damping = damping
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    @property
    def coefs_(self) -> list[Array]:
        """The weights of each layer, (units before, units)."""
        return [W for W, _ in self._layers().split(self.weights_)]

    @property
    def intercepts_(self) -> list[Array]:
        """The biases of each layer, (units,)."""
        return [b for _, b in self._layers().split(self.weights_)]

    def _check_settings(self) -> None:
        super()._check_settings()
        _hidden(self.hidden)
        for name in (*self._names(), self.output_activation):
            activation(name)
        check_number("learning_rate", self.learning_rate, 0.0)
        check_number("momentum", self.momentum, 0.0, 1.0)
        make_damping(self.damping, 1.0)
        trainer = find_trainer(self.trainer)
        if trainer.linear_output and self.output_activation != "purelin":
            others = ", ".join(name for name, each in TRAINERS.items() if not each.linear_output)
            raise InputError(
                f"trainer {self.trainer!r} needs output_activation 'purelin', got"
                f" {self.output_activation!r}: {others} take any"
            )

    def _epochs(self) -> int:
        return find_trainer(self.trainer).epochs if self.max_iter is None else self.max_iter

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return self._form(n_inputs, n_outputs).count

    def _form(self, n_inputs: int, n_outputs: int) -> Layers:
        names = (*self._names(), self.output_activation)
        return Layers((n_inputs, *_hidden(self.hidden), n_outputs), names)

    def _layers(self) -> Layers:
        return Layers(tuple(self.layers_.tolist()), tuple(self.activations_.tolist()))

    def _names(self) -> tuple[str, ...]:
        depth = len(_hidden(self.hidden))
        if isinstance(self.activation, str):
            return (self.activation,) * depth
        names = tuple(self.activation) if np.iterable(self.activation) else ()
        if len(names) != depth:
            raise InputError(
                f"activation must be one name or one for each of {depth} hidden layers, got"
                f" {self.activation!r}"
            )
        return names

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        layers = self._form(X.shape[1], Y.shape[1])
        if start is not None and len(start) != layers.count:
            start = None
        self.layers_ = np.array(layers.sizes)
        self.activations_ = np.array(layers.activations)
        task = Task(layers, X, Y, start, rng, self.learning_rate, self.momentum, self.damping)
        self.__dict__.pop("effective_parameters_", None)  # another trainer's
        find_trainer(self.trainer).train(task, monitor)

    def _forward(self, weights: Array, X: Array) -> Array:
        return self._layers().forward(weights, X)


def _hidden(hidden: Any) -> tuple[int, ...]:
    whole = isinstance(hidden, (int, np.integer))
    several = np.iterable(hidden) and not isinstance(hidden, str)
    units = (hidden,) if whole else tuple(hidden) if several else ()
    if not units:
        raise InputError(f"hidden must name at least one layer, (h_1, ...) or h, got {hidden!r}")
    for count in units:
        check_whole("hidden units", count, 1)
    return tuple(int(count) for count in units)

"""A perceptron whose weights a swarm finds: the hybrid networks of document 004."""

from collections.abc import Callable, Sequence
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_number, check_one_layer, check_whole
from kinverse.networks.activations import activation
from kinverse.networks.encoding import Encoding, Stacked, check_encoding
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor, Progress
from kinverse.optimizers import GeneticAlgorithm, Optimizer, make_optimizer

__all__ = ["SwarmMLP", "population_mse"]

Array = NDArray[np.float64]

ROWS, ENTRIES = 4096, 2**16
"""Rows, and numbers in the hidden layers, that are dealt with at a time: half a megabyte."""


class SwarmMLP(IterativeNetwork):
    """One hidden layer, its weights and biases found by a population method (document 004, 5.4).

    MLP-PSO, -GA, -GWO, -TLBO and -CIBO by ``optimizer="pso"``, "ga", "gwo", "tlbo", "cibo". The
    method minimises E = (1/q) sum_k sum_i (o - y)^2 on the scaled rows (equations 5.37 to 5.39); a
    whole generation is evaluated at once. Biases are added: the document subtracts them, which in
    bounds that are alike on both sides describes the same networks. The first generation fills the
    bounds; the document draws it in [0, 1]. It learns far less well than ``MLP``: it is here to be
    compared.

    Args:
        hidden: units of the hidden layer, (h,) or h.
        activation: of the hidden layer: "logsig", "tansig" or "purelin". The output is linear.
        optimizer: a short name of ``kinverse.optimizers.NAMES`` or a method with settings.
        encoding: "vector", "matrix" (the same bits) or "binary". A ``GeneticAlgorithm`` of variant
            "binary" ("ga" is made one by encoding "binary") has words of bits itself; any other
            method searches each bit as a number in [0, 1], set from 0.5 on. Plain binary code.
        max_evals: networks to evaluate; all are, unless something below ends the search.
        bound: weights and biases are searched in [-bound, bound], in scaled units.
        bits: of a weight in the encoding "binary"; a method with words brings its own number.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: generations without a better validation error before it stops.
        scaling: "minmax" (inputs and targets to [-1, 1] by the training rows) or None.
        warm_start: put the weights of the last ``fit`` into the first generation.
        callback: called with ``Progress`` after each generation, whose ``max_epochs`` is how many
            there will be as far as is known; True ends the search.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        evaluations_: networks evaluated.
        n_iter_: generations.
        training_mse_: (E, m) errors of the best network so far, after each generation.
        layers_: (n, h, m).
        coefs_, intercepts_: weights and biases of each layer, as scikit-learn names them.

    Example:
        >>> net = SwarmMLP(hidden=(8,), optimizer="gwo", max_evals=5000).fit(X, y)
        >>> net.evaluations_
        5000
    """

    max_iter: int | None = None  # the budget is told in evaluations

    def __init__(
        self,
        hidden: Sequence[int] = (8,),
        *,
        activation: str = "logsig",
        optimizer: str | Optimizer = "pso",
        encoding: str = "vector",
        max_evals: int = 20_000,
        bound: float = 1.0,
        bits: int = 12,
        goal: float = 0.0,
        early_stopping: bool = False,
        validation_fraction: float = 0.15,
        n_iter_no_change: int = 50,
        scaling: str | None = "minmax",
        warm_start: bool = False,
        callback: Callable[[Progress], Any] | None = None,
        random_state: Any = None,
    ) -> None:
        self.hidden = hidden
        self.activation = activation
        self.optimizer = optimizer
        self.encoding = encoding
        self.max_evals = max_evals
        self.bound = bound
        self.bits = bits
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

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags

    def _check_settings(self) -> None:
        super()._check_settings()
        check_one_layer(self.hidden)
        activation(self.activation)
        check_encoding(self.encoding)
        check_number("bound", self.bound, 0.0, np.inf, open_ends=True)
        check_whole("bits", self.bits, 1)
        if self.bits > 52:
            raise InputError(f"bits must be 52 at most, got {self.bits}")
        # what the method objects to is said before anything is learned
        self._method().start([(0.0, 1.0)], max_evals=self.max_evals)

    def _method(self) -> Optimizer:
        if isinstance(self.optimizer, Optimizer):
            return self.optimizer
        if self.optimizer == "ga" and self.encoding == "binary":
            return make_optimizer("ga", variant="binary", bits=self.bits)
        return make_optimizer(self.optimizer)

    def _epochs(self) -> int:
        return self.max_evals

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return self._form(n_inputs, n_outputs).count

    def _form(self, n_inputs: int, n_outputs: int) -> Layers:
        sizes = (n_inputs, check_one_layer(self.hidden), n_outputs)
        return Layers(sizes, (self.activation, "purelin"))

    def _layers(self) -> Layers:
        return Layers(tuple(self.layers_.tolist()), tuple(self.activations_.tolist()))

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        layers = self._form(X.shape[1], Y.shape[1])
        self.layers_ = np.array(layers.sizes)
        self.activations_ = np.array(layers.activations)
        method = self._method()
        has_words = isinstance(method, GeneticAlgorithm) and method.variant == "binary"
        kind = "matrix" if self.encoding == "binary" and has_words else self.encoding
        encoding = Encoding(kind, layers, self.bound, self.bits)
        first = None if start is None or len(start) != layers.count else encoding.member(start)
        run = method.start(encoding.box, max_evals=self.max_evals, rng=rng, x0=first)
        best, lowest, errors = None, np.inf, np.empty(0)
        self.evaluations_ = 0
        while not run.done:
            members = run.ask()[0]
            mse = population_mse(encoding.matrices(members), self.activation, X, Y)
            values = mse.sum(axis=1)
            run.tell(values[None])
            self.evaluations_ = int(run.evaluations[0])
            values[~np.isfinite(values)] = np.inf
            k = int(values.argmin())
            if best is None or values[k] < lowest:
                best, lowest, errors = encoding.weights(members[k : k + 1])[0], values[k], mse[k]
            left = self.max_evals - self.evaluations_
            monitor.max_epochs = monitor.epochs + 1 + ceil(left / len(members))
            if run.done:
                monitor.stop("the evaluations are spent")
            if monitor.epoch(best, errors):
                return

    def _forward(self, weights: Array, X: Array) -> Array:
        return self._layers().forward(weights, X)


def population_mse(networks: Stacked, name: str, X: Array, Y: Array) -> Array:
    """Mean squared errors (K, m) of K networks with one hidden layer and linear outputs.

    Args:
        networks: (W (K, n, h), b (K, h)) and (W (K, h, m), b (K, m)).
        name: the activation of the hidden layer.
        X: (N, n) rows.
        Y: (N, m) targets.

    Example:
        >>> population_mse(Encoding("matrix", layers, 1.0).matrices(members), "logsig", X, Y).shape
        (100, 5)
    """
    (W, b), (V, c) = networks
    members, _, h = W.shape
    first = np.concatenate([W, b[:, None]], axis=1).transpose(0, 2, 1)  # (K, h, n + 1)
    second = np.ascontiguousarray(V.transpose(0, 2, 1))
    squares = np.zeros_like(c)
    for at in range(0, len(X), ROWS):
        rows = np.vstack([X[at : at + ROWS].T, np.ones(len(X[at : at + ROWS]))])
        wanted = Y[at : at + ROWS].T
        step = max(1, ENTRIES // (h * rows.shape[1]))
        for k in range(0, members, step):
            block = first[k : k + step].reshape(-1, len(rows))
            hidden = activation(name).of(block @ rows).reshape(-1, h, rows.shape[1])
            error = second[k : k + step] @ hidden
            error += c[k : k + step, :, None]
            error -= wanted
            squares[k : k + step] += np.einsum("kmr,kmr->km", error, error)
    return squares / len(X)

"""Elman's recurrent network: what came before is fed back through context units."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_array

from kinverse.errors import InputError
from kinverse.networks._base import IterativeNetwork, check_one_layer, check_whole
from kinverse.networks.activations import activation
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.recurrent import Recurrent
from kinverse.networks.scaling import Scaling
from kinverse.networks.trainers.limited_memory_bfgs import descend

__all__ = ["Elman", "windows"]

Array = NDArray[np.float64]


class Elman(IterativeNetwork):
    """A hidden layer that sees its own last state (Elman, Cognitive Science 14 (1990) 179).

    A row holds a short sequence, oldest first: (x_1, ..., x_T) with T = ``n_steps``, n numbers
    each; ``windows`` makes such rows of a time series. The context begins at zero, the row is read
    step by step, the output is read after the last: h_t = f(x_t W + h_{t-1} U + b), y = h_T V + c.
    Rows do not know each other. Trained by back-propagation through time and L-BFGS.

    Args:
        hidden: units of the hidden layer, (h,) or h; as many context units.
        n_steps: T; the columns of X must be a multiple of it. With 1 there is no memory.
        activation: of the hidden layer: "logsig", "tansig" or "purelin". The output is linear.
        max_iter: epochs at most.
        goal: stop at a mean squared error not above this [squared units of y].
        early_stopping: hold rows back and stop when their error no longer falls.
        validation_fraction: share of the rows held back.
        n_iter_no_change: epochs without a better validation error before it stops.
        scaling: "minmax" (inputs, alike in all steps, and targets to [-1, 1] by the training rows)
            or None.
        warm_start: go on from the weights of the last ``fit``.
        callback: called with ``Progress`` after each epoch; True ends the training.
        random_state: None, an int, a RandomState or a Generator.

    Attributes:
        form_: (T, n, h, m).

    Example:
        >>> net = Elman(hidden=(10,), n_steps=3, random_state=0).fit(windows(X, 3), y)
        >>> net.predict(windows(X, 3)).shape == y.shape
        True
    """

    def __init__(
        self,
        hidden: Sequence[int] = (10,),
        *,
        n_steps: int = 1,
        activation: str = "tansig",
        max_iter: int = 500,
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
        self.n_steps = n_steps
        self.activation = activation
        self.max_iter = max_iter
        self.goal = goal
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.scaling = scaling
        self.warm_start = warm_start
        self.callback = callback
        self.random_state = random_state

    def _check_settings(self) -> None:
        super()._check_settings()
        check_whole("n_steps", self.n_steps, 1)
        check_one_layer(self.hidden)
        activation(self.activation)

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        return self._form(n_inputs, n_outputs).count

    def _form(self, columns: int, n_outputs: int) -> Recurrent:
        if columns % self.n_steps:
            raise InputError(
                f"the {columns} columns of X must be a multiple of n_steps={self.n_steps}:"
                " a row holds n_steps samples, one after the other"
            )
        sizes = (columns // self.n_steps, check_one_layer(self.hidden), n_outputs)
        return Recurrent(self.n_steps, sizes, self.activation)

    def _scale(self, X: Array, Y: Array) -> None:
        super()._scale(X, Y)
        # one scaling for all steps: the same weights read them
        n = X.shape[1] // self.n_steps
        each = Scaling.fitted(X.reshape(-1, n), self.scaling)
        self.input_middle_, self.input_unit_ = (np.tile(part, self.n_steps) for part in each)

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        form = self._form(X.shape[1], Y.shape[1])
        self.form_ = np.array([form.n_steps, *form.sizes])
        self.activation_ = self.activation
        if start is None or len(start) != form.count:
            start = form.first_weights(rng)
        descend(form, X, Y, start, monitor)

    def _forward(self, weights: Array, X: Array) -> Array:
        n_steps, n, h, m = self.form_.tolist()
        return Recurrent(n_steps, (n, h, m), self.activation_).forward(weights, X)


def windows(X: ArrayLike, n_steps: int) -> Array:
    """Rows for ``Elman`` from a time series: each sample behind those before it, oldest first.

    The first rows, which have too few before them, repeat the first sample.

    Args:
        X: (N, n) samples in their order in time.
        n_steps: samples in a row.

    Returns:
        (N, n_steps n).

    Raises:
        InputError: n_steps is no whole number of at least 1.
        ValueError: NaN or infinite values, no rows, not two dimensions.

    Example:
        >>> windows([[1.0], [2.0], [3.0]], 2)
        array([[1., 1.],
               [1., 2.],
               [2., 3.]])
    """
    check_whole("n_steps", n_steps, 1)
    series = check_array(X, dtype=np.float64)
    at = np.arange(len(series))[:, None] + np.arange(1 - n_steps, 1)
    rows: Array = series[np.maximum(at, 0)].reshape(len(series), -1)
    return rows

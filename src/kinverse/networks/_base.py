"""The base of every network: a scikit-learn regressor of several outputs, scaled inside.

A new network writes ``__init__`` (settings stored untouched), ``_check_settings``, ``_train`` and
``_output``; the last two see scaled rows only. One that is trained in epochs derives from
``IterativeNetwork`` and writes ``_optimize`` and ``_forward`` instead. What is learned ends in
``_`` and is made of arrays, numbers, text and lists of arrays, so that a model file can hold it.
"""

import os
import warnings
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data
from threadpoolctl import threadpool_limits

from kinverse import kernels
from kinverse.errors import InputError
from kinverse.networks.monitor import Monitor, Progress
from kinverse.networks.scaling import Scaling, check_scaling

__all__ = [
    "IterativeNetwork",
    "NetworkRegressor",
    "check_number",
    "check_one_layer",
    "check_whole",
]

Array = NDArray[np.float64]

BLOCK = 4096
"""Rows predicted at a time: the hidden layer of a block stays in the cache."""


class NetworkRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Scaled rows in, scaled rows out; ``fit``, ``predict`` and ``score`` as in scikit-learn.

    Attributes:
        n_features_in_: columns of X.
        n_outputs_: columns of y.
    """

    scaling: str | None
    random_state: Any

    # What a network writes --------------------------------------------------------------------

    def _check_settings(self) -> None:
        """Refuse settings that cannot be used (InputError)."""

    def _count_parameters(self, n_inputs: int, n_outputs: int) -> int:
        """Numbers to be learned, as far as the settings tell; 0 where they do not."""
        return 0

    def _train(self, X: Array, Y: Array, rng: np.random.Generator) -> None:
        """Learn from scaled rows X (N, n), Y (N, m) into attributes that end in ``_``."""
        raise NotImplementedError(f"{type(self).__name__} has no _train")

    def _output(self, X: Array) -> Array:
        """Scaled outputs (N, m) of scaled rows X (N, n)."""
        raise NotImplementedError(f"{type(self).__name__} has no _output")

    # What a user calls ------------------------------------------------------------------------

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn from rows, with as many BLAS threads as ``kinverse.set_threads`` allows: one.

        Args:
            X: (N, n) inputs.
            y: (N,) or (N, m) targets.

        Returns:
            The network itself.

        Raises:
            InputError: a setting that is not valid.
            ValueError: NaN, infinite or complex values, no rows, rows of different number.

        Example:
            >>> MLP(hidden=(20,)).fit(X, y).predict(X).shape == y.shape
            True
        """
        self._check_settings()
        check_scaling(self.scaling)
        kept = self._kept_from_before()
        rows, targets = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, ensure_min_samples=2
        )
        self.flat_output_ = targets.ndim == 1
        Y = np.asarray(targets, dtype=np.float64).reshape(len(targets), -1)
        self.n_outputs_ = Y.shape[1]
        self._warn_if_few(len(Y))
        # steps are small: more BLAS threads than kinverse's own wait for each other, and the
        # order of their sums changes the bits
        with threadpool_limits(kernels.threads(), user_api="blas"):
            self._learn(rows, Y, _generator(self.random_state), kept)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """Outputs for rows.

        Args:
            X: (N, n) inputs.

        Returns:
            (N, m), or (N,) if the targets were.

        Raises:
            ValueError: NaN or infinite values, or not n columns.
            sklearn.exceptions.NotFittedError: ``fit`` comes first.

        Example:
            >>> net.predict(X).shape
            (100, 6)
        """
        rows: Any = X
        if not self._is_plain(rows):
            check_is_fitted(self)
            rows = validate_data(self, X, reset=False, dtype=np.float64)
        if len(rows) <= BLOCK:
            out = self._predicted(rows)
        else:
            parts = range(0, len(rows), BLOCK)
            out = np.concatenate([self._predicted(rows[k : k + BLOCK]) for k in parts])
        return out[:, 0] if self.flat_output_ else out

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Write the fitted network to a .npz file that holds no code; ``networks.load`` reads it.

        Raises:
            InputError: not fitted, or a setting or attribute that such a file cannot hold.
            OSError: the file cannot be written.

        Example:
            >>> net.save("arm.npz")
        """
        from kinverse.networks.storage import save

        save(self, path)

    # How it works -----------------------------------------------------------------------------

    @property
    def _inputs(self) -> Scaling:
        return Scaling(self.input_middle_, self.input_unit_)

    @property
    def _outputs(self) -> Scaling:
        return Scaling(self.output_middle_, self.output_unit_)

    def _learn(self, X: Array, Y: Array, rng: np.random.Generator, kept: Any) -> None:
        self._scale(X, Y)
        self._train(self._inputs.forward(X), self._outputs.forward(Y), rng)

    def _scale(self, X: Array, Y: Array) -> None:
        self.input_middle_, self.input_unit_ = Scaling.fitted(X, self.scaling)
        self.output_middle_, self.output_unit_ = Scaling.fitted(Y, self.scaling)

    def _kept_from_before(self) -> Any:
        """What an earlier fit leaves to this one: nothing."""
        return None

    def _predicted(self, rows: Array) -> Array:
        return self._outputs.inverse(self._output(self._inputs.forward(rows)))

    def _is_plain(self, X: Any) -> bool:
        """Whether X needs no checks but this one; scikit-learn's take longer than the network."""
        return (
            type(X) is np.ndarray
            and X.ndim == 2
            and X.dtype == np.float64
            and "output_unit_" in self.__dict__
            and "feature_names_in_" not in self.__dict__
            and X.shape[1] == self.n_features_in_
            and len(X) > 0
            and bool(np.isfinite(X).all())
        )

    def _warn_if_few(self, rows: int) -> None:
        parameters = self._count_parameters(self.n_features_in_, self.n_outputs_)
        if rows * self.n_outputs_ < parameters:
            warnings.warn(
                f"{type(self).__name__}: {rows} patterns of {self.n_outputs_} targets for"
                f" {parameters} parameters: it can learn them by heart",
                UserWarning,
                stacklevel=3,
            )


class IterativeNetwork(NetworkRegressor):
    """A network that is trained in epochs; its weights are one vector, ``weights_`` (P,).

    Interrupted by Ctrl-C it keeps the best weights so far and warns; ``warm_start=True`` goes on
    from the weights (and the scaling) of the last ``fit``.

    Attributes:
        weights_: (P,) everything learned.
        n_iter_: epochs.
        training_mse_: (E, m) mean squared error of each output after each epoch, in squared
            units of the targets.
        validation_mse_: (E, m) the same on the rows held back; E = 0 without early stopping.
        stop_reason_: why the training ended.
    """

    max_iter: int | None
    goal: float
    early_stopping: bool
    validation_fraction: float
    n_iter_no_change: int
    warm_start: bool
    callback: Callable[[Progress], Any] | None

    # What a network writes --------------------------------------------------------------------

    def _optimize(
        self, X: Array, Y: Array, start: Array | None, rng: np.random.Generator, monitor: Monitor
    ) -> None:
        """Train, telling ``monitor.epoch(weights, mse)`` each epoch and ending when it says so."""
        raise NotImplementedError(f"{type(self).__name__} has no _optimize")

    def _forward(self, weights: Array, X: Array) -> Array:
        """Scaled outputs (N, m) of scaled rows with the given weights."""
        raise NotImplementedError(f"{type(self).__name__} has no _forward")

    def _epochs(self) -> int:
        """Epochs at most; a network whose ``max_iter`` may be None says what that means."""
        if self.max_iter is None:
            raise InputError(f"{type(self).__name__}: max_iter must be a whole number, got None")
        return self.max_iter

    # How it works -----------------------------------------------------------------------------

    @property
    def loss_curve_(self) -> Array:
        """(E,) mean squared error over all outputs after each epoch."""
        curve: Array = self.training_mse_.mean(axis=1)
        return curve

    def _check_settings(self) -> None:
        if self.max_iter is not None:
            check_whole("max_iter", self.max_iter, 1)
        check_number("goal", self.goal, 0.0)
        check_whole("n_iter_no_change", self.n_iter_no_change, 1)
        check_number("validation_fraction", self.validation_fraction, 0.0, 1.0, open_ends=True)
        for name in ("early_stopping", "warm_start"):
            if not isinstance(getattr(self, name), (bool, np.bool_)):
                raise InputError(f"{name} must be True or False, got {getattr(self, name)!r}")
        if self.callback is not None and not callable(self.callback):
            raise InputError(f"callback must be a function, got {self.callback!r}")

    def _kept_from_before(self) -> Any:
        if not self.warm_start or "weights_" not in vars(self):
            return None
        shape = (self.n_features_in_, self.n_outputs_)
        return shape, self.weights_, self._inputs, self._outputs, self.held_seed_

    def _learn(self, X: Array, Y: Array, rng: np.random.Generator, kept: Any) -> None:
        going_on = kept is not None and kept[0] == (self.n_features_in_, self.n_outputs_)
        # who goes on must not have seen the rows held back: the same ones, if they are as many
        self.held_seed_ = kept[-1] if going_on else int(rng.integers(2**31))
        held = np.zeros(len(X), np.bool_)
        if self.early_stopping:
            count = min(max(1, round(self.validation_fraction * len(X))), len(X) - 1)
            order = np.random.default_rng(self.held_seed_).permutation(len(X))
            held[order[:count]] = True
        start = None
        if going_on:
            _, start, inputs, outputs, _ = kept
            self.input_middle_, self.input_unit_ = inputs
            self.output_middle_, self.output_unit_ = outputs
        else:
            self._scale(X[~held], Y[~held])
        rows, wanted = self._inputs.forward(X), self._outputs.forward(Y)
        monitor = Monitor(
            max_epochs=self._epochs(),
            unit=self.output_unit_,
            goal=self.goal,
            patience=self.n_iter_no_change,
            callback=self.callback,
            validation=(rows[held], wanted[held]) if held.any() else None,
            output=self._forward,
            predict=self._as_now,
        )
        try:
            self._optimize(rows[~held], wanted[~held], start, rng, monitor)
        except KeyboardInterrupt:
            if monitor.best is None:
                raise
            monitor.stop("interrupted")
            warnings.warn(
                f"{type(self).__name__}: training was interrupted after {monitor.epochs} epochs;"
                " the best weights so far are kept",
                UserWarning,
                stacklevel=4,
            )
        self.weights_ = monitor.best
        self.__dict__.update(monitor.learned)
        self.n_iter_ = monitor.epochs
        self.training_mse_ = monitor.training_mse
        self.validation_mse_ = monitor.validation_mse
        self.stop_reason_ = monitor.reason

    def _as_now(self, weights: Array, X: ArrayLike) -> Array:
        """What a callback is told that the network in training predicts for X (N, n)."""
        rows = self._inputs.forward(np.asarray(X, dtype=np.float64))
        return self._outputs.inverse(self._forward(weights, rows))

    def _output(self, X: Array) -> Array:
        return self._forward(self.weights_, X)


def check_whole(name: str, value: Any, least: int) -> None:
    """Refuse a setting that is no whole number or below ``least`` (InputError)."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{name} must be a whole number >= {least}, got {value!r}")


def check_one_layer(hidden: Any) -> int:
    """The units of the one hidden layer that ``hidden``, (h,) or h, must name (InputError)."""
    whole = isinstance(hidden, (int, np.integer))
    several = np.iterable(hidden) and not isinstance(hidden, str)
    units = [hidden] if whole else list(hidden) if several else []
    if len(units) != 1:
        raise InputError(f"hidden must name one layer, (h,) or h, got {hidden!r}")
    check_whole("hidden units", units[0], 1)
    return int(units[0])


def check_number(
    name: str, value: Any, low: float = -np.inf, high: float = np.inf, *, open_ends: bool = False
) -> None:
    """Refuse a setting that is no finite number between low and high (InputError)."""
    good = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if good:
        good = np.isfinite(value) and (low < value < high if open_ends else low <= value <= high)
    if not good:
        where = f"in {'(' if open_ends else '['}{low:g}, {high:g}{')' if open_ends else ']'}"
        raise InputError(f"{name} must be a finite number {where}, got {value!r}")


def _generator(random_state: Any) -> np.random.Generator:
    """scikit-learn's random_state (None, int, RandomState) or a Generator as a new Generator."""
    if isinstance(random_state, np.random.Generator):
        return np.random.default_rng(random_state.integers(2**63))
    return np.random.default_rng(check_random_state(random_state).randint(2**31))

"""Watches a training: errors epoch by epoch, the best weights so far, and when to stop."""

import copy
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Monitor", "Progress"]

Array = NDArray[np.float64]


class Progress(NamedTuple):
    """What a callback is told after each epoch."""

    epoch: int  # 1 is the first
    max_epochs: int
    training_mse: Array  # (m,) mean squared error of each output, squared target units
    validation_mse: Array | None  # (m,) the same on the rows held back, if some are
    predict: Callable[[Array], Array] | None = None  # the network as it is now, X -> y


class Monitor:
    """Keeps the record of one training; ``epoch`` tells the trainer whether to stop.

    The best weights are those of the lowest error on the validation rows where there are some,
    else on the training rows: of the scaled error, which is what trainers minimise and in which
    targets of unlike units weigh alike.

    Args:
        max_epochs: stop after so many.
        goal: stop at a mean squared error, over all outputs, not above this.
        patience: epochs without a better validation error before it stops.
        callback: called with ``Progress``; True stops.
        unit: (m,) target units in one scaled unit, so that errors are told in target units.
        validation: scaled rows (Xv, Yv) held back, or None.
        output: (weights, X) -> Y on scaled rows; what validation is computed with.
        predict: (weights, X) -> y in the caller's units, for callbacks.

    Attributes:
        best: the best weights, None before the first epoch.
        learned: what else the network should remember, as it was with them.
        training_mse, validation_mse: (E, m).
        reason: why it stopped.
    """

    def __init__(
        self,
        *,
        max_epochs: int,
        unit: Array,
        goal: float = 0.0,
        patience: int = 10,
        callback: Callable[[Progress], Any] | None = None,
        validation: tuple[Array, Array] | None = None,
        output: Callable[[Any, Array], Array] | None = None,
        predict: Callable[[Any, Array], Array] | None = None,
    ) -> None:
        self.max_epochs, self._goal, self._patience = max_epochs, goal, patience
        self._callback, self._unit = callback, unit
        self._validation, self._output, self._predict = validation, output, predict
        self._training: list[Array] = []
        self._held: list[Array] = []
        self.best: Any = None
        self.learned: Mapping[str, Any] = {}
        self._lowest = np.inf
        self._since = 0
        self.reason = "all epochs were used"

    @property
    def epochs(self) -> int:
        """Epochs so far."""
        return len(self._training)

    @property
    def training_mse(self) -> Array:
        """(E, m) mean squared errors on the training rows, squared target units."""
        return np.array(self._training).reshape(-1, len(self._unit))

    @property
    def validation_mse(self) -> Array:
        """(E, m) the same on the rows held back; E = 0 where none were."""
        return np.array(self._held).reshape(-1, len(self._unit))

    def epoch(
        self,
        weights: Any,
        mse: Array,
        *,
        latest: bool = False,
        learned: Mapping[str, Any] | None = None,
    ) -> bool:
        """Record an epoch; True asks the trainer to end.

        Args:
            weights: what the network is now; copied when it is the best so far.
            mse: (m,) mean squared error of each output on the scaled training rows.
            latest: the training error is not what the trainer minimises: without rows held back
                the latest weights are the best.
            learned: attributes of the network beside its weights, by name.
        """
        told = mse * self._unit**2
        self._training.append(told)
        judged, held = float(np.mean(mse)), None
        if self._validation is not None and self._output is not None:
            rows, wanted = self._validation
            error = self._output(weights, rows) - wanted
            mse = np.mean(error * error, axis=0)
            judged, held = float(np.mean(mse)), mse * self._unit**2
            self._held.append(held)
        self._since += 1
        if self.best is None or judged < self._lowest or (latest and held is None):
            self.best, self._lowest, self._since = copy.deepcopy(weights), judged, 0
            self.learned = dict(learned or {})
        return self._ends(weights, mse, told, held)

    def stop(self, reason: str) -> None:
        """Say why a trainer ended by its own rule."""
        self.reason = reason

    def end(
        self,
        weights: Any,
        mse: Array,
        reason: str,
        *,
        learned: Mapping[str, Any] | None = None,
    ) -> None:
        """The same where there may have been no epoch: these weights are the first then."""
        if self.best is None:
            self.epoch(weights, mse, learned=learned)
        self.stop(reason)

    def _ends(self, weights: Any, mse: Array, told: Array, held: Array | None) -> bool:
        now = None if self._predict is None else partial(self._predict, weights)
        if self._callback is not None and self._callback(
            Progress(self.epochs, self.max_epochs, told, held, now)
        ):
            self.reason = "the callback ended the training"
        elif not np.isfinite(mse).all():
            self.reason = "the error is no longer a finite number: try a smaller rate"
        elif float(np.mean(told)) <= self._goal and (self._goal > 0.0 or not mse.any()):
            self.reason = "the goal was reached"
        elif held is not None and self._since >= self._patience:
            self.reason = f"no better validation error for {self._patience} epochs"
        else:
            return self.epochs >= self.max_epochs
        return True

"""Limited-memory BFGS by SciPy (Liu & Nocedal 1989)."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task

__all__ = ["Differentiable", "descend", "limited_memory_bfgs"]

Array = NDArray[np.float64]


class Differentiable(Protocol):
    """A form of network on one weight vector, as ``Layers``."""

    def forward(self, weights: Array, X: Array) -> Array:
        """Outputs (N, m) of rows X."""
        ...

    def outputs(self, weights: Array, X: Array) -> list[Array]:
        """What ``gradient`` wants to be given, the outputs (N, m) last."""
        ...

    def gradient(self, weights: Array, outputs: list[Array], error: Array) -> Array:
        """Derivatives (P,) of sum(error * Y)."""
        ...


class _Ended(Exception):
    """The monitor asked to end."""


def limited_memory_bfgs(task: Task, monitor: Monitor) -> None:
    """Minimise the mean squared error; an epoch is one iteration."""
    start = task.layers.nguyen_widrow(task.rng) if task.start is None else task.start
    descend(task.layers, task.X, task.Y, start, monitor)


def descend(form: Differentiable, X: Array, Y: Array, start: Array, monitor: Monitor) -> None:
    """The same for any form of network, from the weights ``start`` (P,)."""
    from scipy.optimize import minimize

    def value(weights: Array) -> tuple[float, Array]:
        outputs = form.outputs(weights, X)
        error = outputs[-1] - Y
        gradient = form.gradient(weights, outputs, error) * (2.0 / error.size)
        return float(np.mean(error * error)), gradient

    def told(weights: Array) -> None:
        error = form.forward(weights, X) - Y
        if monitor.epoch(weights, np.mean(error * error, axis=0)):
            raise _Ended

    options = {"maxiter": monitor.max_epochs, "maxfun": 10**9, "ftol": 0.0, "gtol": 1e-10}
    try:
        found = minimize(value, start, jac=True, method="L-BFGS-B", callback=told, options=options)
    except _Ended:
        return
    error = form.forward(found.x, X) - Y
    monitor.end(found.x, np.mean(error * error, axis=0), "no step lowers the error any more")

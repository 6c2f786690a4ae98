"""Limited-memory BFGS by SciPy (Liu & Nocedal 1989)."""

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task

__all__ = ["limited_memory_bfgs"]

Array = NDArray[np.float64]


def limited_memory_bfgs(task: Task, monitor: Monitor) -> None:
    """Minimise the mean squared error; an epoch is one iteration."""
    from scipy.optimize import minimize

    layers, X, Y = task.layers, task.X, task.Y
    rows = len(X)

    def value(weights: Array) -> tuple[float, Array]:
        outputs = layers.outputs(weights, X)
        error = outputs[-1] - Y
        gradient = layers.gradient(weights, outputs, error) * (2.0 / (rows * Y.shape[1]))
        return float(np.mean(error * error)), gradient

    def told(weights: Array) -> None:
        error = layers.forward(weights, X) - Y
        if monitor.epoch(weights, np.mean(error * error, axis=0)):
            raise StopIteration

    start = layers.nguyen_widrow(task.rng) if task.start is None else task.start
    found = minimize(
        value,
        start,
        jac=True,
        method="L-BFGS-B",
        callback=told,
        options={"maxiter": monitor.max_epochs, "maxfun": 10**9, "ftol": 0.0, "gtol": 1e-10},
    )
    if monitor.best is None:
        told(found.x)

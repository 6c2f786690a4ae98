"""Limited-memory BFGS by SciPy (Liu & Nocedal 1989)."""

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task

__all__ = ["limited_memory_bfgs"]

Array = NDArray[np.float64]


class _Ended(Exception):
    """The monitor asked to end."""


def limited_memory_bfgs(task: Task, monitor: Monitor) -> None:
    """Minimise the mean squared error; an epoch is one iteration."""
    from scipy.optimize import minimize

    def value(weights: Array) -> tuple[float, Array]:
        mse, gradient = task.mean_squares(weights)
        return float(mse.mean()), gradient

    def told(weights: Array) -> None:
        error = task.layers.forward(weights, task.X) - task.Y
        if monitor.epoch(weights, np.mean(error * error, axis=0)):
            raise _Ended

    options = {"maxiter": monitor.max_epochs, "maxfun": 10**9, "ftol": 0.0, "gtol": 1e-10}
    try:
        found = minimize(
            value, task.first_weights(), jac=True, method="L-BFGS-B", callback=told, options=options
        )
    except _Ended:
        return
    monitor.end(found.x, task.mean_squares(found.x)[0], "no step lowers the error any more")

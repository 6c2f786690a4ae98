"""Gradient descent on the mean squared error of all rows, with momentum."""

import numpy as np

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task

__all__ = ["adaptive", "momentum"]

LEAST_GRADIENT = 1e-5
FASTER, SLOWER = 1.05, 0.7
"""Factors of an adaptive rate after a better and after a discarded step."""
MOST_RISE = 1.04
"""A step that raises the error by more is discarded."""


def momentum(task: Task, monitor: Monitor) -> None:
    """A fixed rate; an epoch is one step: change = momentum change - rate (1 - momentum) g.

    Rumelhart, Hinton & Williams (1986).
    """
    weights = task.first_weights()
    mse, gradient = task.mean_squares(weights)
    change = np.zeros_like(weights)
    while np.linalg.norm(gradient) >= LEAST_GRADIENT:
        change = task.momentum * change - task.learning_rate * (1.0 - task.momentum) * gradient
        weights = weights + change
        mse, gradient = task.mean_squares(weights)
        if monitor.epoch(weights, mse):
            return
    monitor.end(weights, mse, "the gradient has vanished")


def adaptive(task: Task, monitor: Monitor) -> None:
    """A rate that follows the success; an epoch is one step, taken or discarded.

    A discarded step ends the momentum as well (Vogl et al. 1988).
    """
    weights = task.first_weights()
    mse, gradient = task.mean_squares(weights)
    change, rate = np.zeros_like(weights), task.learning_rate
    while np.linalg.norm(gradient) >= LEAST_GRADIENT:
        change = task.momentum * change - rate * (1.0 - task.momentum) * gradient
        new_mse, new_gradient = task.mean_squares(weights + change)
        if not new_mse.mean() <= MOST_RISE * mse.mean():
            change, rate = np.zeros_like(weights), rate * SLOWER
        else:
            rate *= FASTER if new_mse.mean() < mse.mean() else 1.0
            weights, mse, gradient = weights + change, new_mse, new_gradient
        if monitor.epoch(weights, mse):
            return
    monitor.end(weights, mse, "the gradient has vanished")

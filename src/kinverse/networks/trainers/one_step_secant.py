"""One-step secant (Battiti 1992): quasi-Newton steps that remember the last step only."""

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task

__all__ = ["one_step_secant", "secant_direction"]

Array = NDArray[np.float64]

LEAST_GRADIENT = 1e-10
ENOUGH = 1e-3
"""Share of the fall that the slope promises, with which a step is taken (Armijo 1966)."""
SHORTEST, LONGEST = 0.1, 0.5
"""Bounds of what a refused step is shortened by."""
MOST_TRIALS = 40


def one_step_secant(task: Task, monitor: Monitor) -> None:
    """Minimise the mean squared error; an epoch is one line search."""
    weights = task.first_weights()
    mse, gradient = task.mean_squares(weights)
    direction = -gradient
    while True:
        if not np.linalg.norm(gradient) >= LEAST_GRADIENT:
            reason = "the gradient has vanished"
            break
        found = _line_search(task, weights, mse, gradient, direction)
        if found is None:
            found = _line_search(task, weights, mse, gradient, -gradient)
        if found is None:
            reason = "no step lowers the error any more"
            break
        step, mse, new_gradient = found
        weights = weights + step
        direction = secant_direction(new_gradient, step, new_gradient - gradient)
        gradient = new_gradient
        if monitor.epoch(weights, mse):
            return
    monitor.end(weights, mse, reason)


def secant_direction(gradient: Array, step: Array, change: Array) -> Array:
    """-H g (P,), H the BFGS update of the identity by the last step s and change y of g.

    Steepest descent where the error does not curve upwards along the step.
    """
    sy = float(step @ change)
    if not sy > 0.0:
        return -gradient
    sg, yg = float(step @ gradient), float(change @ gradient)
    along_step = yg / sy - (1.0 + float(change @ change) / sy) * sg / sy
    direction: Array = -gradient + along_step * step + (sg / sy) * change
    return direction if direction @ gradient < 0.0 else -gradient


def _line_search(
    task: Task, weights: Array, mse: Array, gradient: Array, direction: Array
) -> tuple[Array, Array, Array] | None:
    """A step that lowers the error enough, with error and gradient behind it; None: there is none.

    A refused length goes to the lowest point of the parabola through what is known, within bounds.
    """
    before, slope, length = float(mse.mean()), float(direction @ gradient), 1.0
    for _ in range(MOST_TRIALS):
        new_mse, new_gradient = task.mean_squares(weights + length * direction)
        rise = float(new_mse.mean()) - before
        if rise <= ENOUGH * length * slope:
            return length * direction, new_mse, new_gradient
        curve = rise - length * slope
        best = -0.5 * slope * length / curve if np.isfinite(curve) else 0.0
        length *= min(max(best, SHORTEST), LONGEST)
    return None

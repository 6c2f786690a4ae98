"""Levenberg-Marquardt (Hagan & Menhaj 1994), and what Bayesian regularisation shares with it."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task
from kinverse.networks.trainers.damping import MOST_DAMPING, Damping, make_damping
from kinverse.networks.trainers.normal_matrix import normal_matrix

__all__ = ["Objective", "Point", "at", "descend", "levenberg_marquardt"]

Array = NDArray[np.float64]

FIRST_DAMPING = 1e-3
LEAST_GRADIENT = 1e-7


class Point(NamedTuple):
    """The network at some weights."""

    weights: Array  # (P,)
    outputs: list[Array]  # of every layer
    error: Array  # (N, m) outputs - targets

    @property
    def squares(self) -> float:
        """Sum of the squared errors."""
        return float(np.vdot(self.error, self.error))

    @property
    def mse(self) -> Array:
        """(m,) mean squared error of each output."""
        return np.asarray(np.mean(self.error * self.error, axis=0))


class Objective(NamedTuple):
    """beta sum(e^2) + alpha sum(w^2)."""

    alpha: float = 0.0
    beta: float = 1.0
    learned: Mapping[str, float] = {}  # what the network should remember of it

    def value(self, point: Point) -> float:
        """The number that every step makes smaller."""
        return self.beta * point.squares + self.alpha * float(point.weights @ point.weights)

    def half_gradient(self, task: Task, point: Point) -> Array:
        """Half of its gradient (P,): beta J^T e + alpha w."""
        fit = task.layers.gradient(point.weights, point.outputs, point.error)
        return np.asarray(self.beta * fit + self.alpha * point.weights)


Renew = Callable[[Objective, Point, Array], Objective]


def levenberg_marquardt(task: Task, monitor: Monitor) -> None:
    """Minimise the sum of squared errors; an epoch is one accepted step."""
    damping = make_damping(task.damping, FIRST_DAMPING)
    descend(task, monitor, at(task, task.first_weights()), Objective(), damping)


def at(task: Task, weights: Array) -> Point:
    """The network at these weights."""
    outputs = task.layers.outputs(weights, task.X)
    return Point(weights, outputs, outputs[-1] - task.Y)


def descend(
    task: Task,
    monitor: Monitor,
    point: Point,
    objective: Objective,
    damping: Damping,
    renew: Renew | None = None,
) -> None:
    """Steps -(beta J^T J + (mu + alpha) I)^-1 (beta J^T e + alpha w) until the monitor says stop.

    Args:
        task: rows and layers.
        monitor: told of every accepted step.
        point: where to begin.
        objective: what must fall in every step.
        damping: how mu follows the steps.
        renew: (objective, point, J^T J there) -> the objective of the next step; None keeps it.
    """
    normal = normal_matrix(task.layers, point.weights, point.outputs)
    while True:
        gradient = objective.half_gradient(task, point)
        if 2.0 * float(np.linalg.norm(gradient)) < LEAST_GRADIENT:
            reason = "the gradient has vanished"
            break
        new = _accepted(task, point, objective, normal, gradient, damping)
        if new is None:
            reason = f"no step lowers the error: the damping passed {MOST_DAMPING:g}"
            break
        point = new
        normal = normal_matrix(task.layers, point.weights, point.outputs)
        if renew is not None:
            objective = renew(objective, point, normal)
        if monitor.epoch(
            point.weights, point.mse, latest=renew is not None, learned=objective.learned
        ):
            return
    monitor.end(point.weights, point.mse, reason, learned=objective.learned)


def _accepted(
    task: Task, point: Point, objective: Objective, normal: Array, gradient: Array, damping: Damping
) -> Point | None:
    """The first point that lowers the objective, None if there is none."""
    value = objective.value(point)
    matrix = objective.beta * normal
    while damping.mu <= MOST_DAMPING:
        step = _solved(matrix, damping.mu + objective.alpha, gradient)
        if step is not None:
            new = at(task, point.weights - step)
            gain = value - objective.value(new)
            if gain > 0.0:
                promised = float(step @ gradient) + damping.mu * float(step @ step)
                damping.accept(gain / promised)
                return new
        damping.refuse()
    return None


def _solved(matrix: Array, shift: float, right: Array) -> Array | None:
    """(A + shift I)^-1 b by A's lower triangle; None where rounding makes it indefinite."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    shifted = matrix.copy(order="F")
    shifted[np.diag_indices(len(shifted))] += shift
    try:
        factor = cho_factor(shifted, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError:
        return None
    step = np.asarray(cho_solve(factor, right, check_finite=False))
    return step if np.isfinite(step).all() else None

"""Bayesian regularisation: how much the weights may grow follows from the data.

MacKay (1992) takes errors and weights as normal with precisions 2 beta and 2 alpha; their most
probable values follow from gamma, the number of parameters that the data determine. Foresee &
Hagan (1997) renew both after every Levenberg-Marquardt step:

    gamma = sum_i l_i / (l_i + alpha), l_i the eigenvalues of beta J^T J
    alpha = gamma / (2 sum(w^2)),   beta = (N m - gamma) / (2 sum(e^2))
"""

import numpy as np
from numpy.typing import NDArray

from kinverse.networks.monitor import Monitor
from kinverse.networks.trainers import Task
from kinverse.networks.trainers.damping import make_damping
from kinverse.networks.trainers.levenberg_marquardt import Objective, Point, at, descend

__all__ = ["bayesian"]

Array = NDArray[np.float64]

FIRST_DAMPING = 5e-3


def bayesian(task: Task, monitor: Monitor) -> None:
    """Minimise beta sum(e^2) + alpha sum(w^2); an epoch is one accepted step.

    The network remembers gamma as ``effective_parameters_``.
    """
    point = at(task, task.first_weights())
    first = _objective(point, float(task.layers.count))
    descend(task, monitor, point, first, make_damping(task.damping, FIRST_DAMPING), _renewed)


def _renewed(objective: Objective, point: Point, normal: Array) -> Objective:
    from scipy.linalg import eigvalsh

    values = objective.beta * eigvalsh(normal, lower=True, check_finite=False)
    values = np.maximum(values, 0.0)  # rounding
    return _objective(point, float(np.sum(values / (values + objective.alpha))))


def _objective(point: Point, gamma: float) -> Objective:
    size = float(point.weights @ point.weights)
    # fewer errors than parameters, or none at all, say nothing of their spread
    free = point.error.size - gamma
    beta = free / (2.0 * point.squares) if free > 0.0 and point.squares > 0.0 else 1.0
    alpha = gamma / (2.0 * size) if size > 0.0 else 1.0
    return Objective(alpha, beta, {"effective_parameters_": gamma})

"""The ways to train the layers of an MLP, by name."""

import typing
from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks.layers import Layers
from kinverse.networks.monitor import Monitor

__all__ = ["TRAINERS", "Task", "Trainer", "find_trainer"]

Array = NDArray[np.float64]


class Task(NamedTuple):
    """What a trainer is given; rows are scaled."""

    layers: Layers
    X: Array  # (N, n)
    Y: Array  # (N, m)
    start: Array | None  # (P,) weights to go on from
    rng: np.random.Generator
    learning_rate: float
    momentum: float
    damping: str = "tenfold"

    def first_weights(self) -> Array:
        """The weights (P,) to begin with."""
        return self.layers.nguyen_widrow(self.rng) if self.start is None else self.start

    def mean_squares(self, weights: Array) -> tuple[Array, Array]:
        """Mean squared error (m,) of each output, and the gradient (P,) of their mean."""
        # weights that diverge are the monitor's to tell
        with np.errstate(over="ignore", invalid="ignore"):
            outputs = self.layers.outputs(weights, self.X)
            error = outputs[-1] - self.Y
            gradient = self.layers.gradient(weights, outputs, error * (2.0 / error.size))
            return np.mean(error * error, axis=0), gradient


class Trainer(NamedTuple):
    """One way to train: where it is, how long it may take by default, what it needs."""

    file: str
    function: str
    epochs: int
    linear_output: bool = False

    def train(self, task: Task, monitor: Monitor) -> None:
        """Train, telling the monitor of every epoch."""
        module = import_module(f"kinverse.networks.trainers.{self.file}")
        function: Callable[[Task, Monitor], None] = getattr(module, self.function)
        function(task, monitor)


TRAINERS: typing.Final = {
    "varpro": Trainer("variable_projection", "variable_projection", 200, linear_output=True),
    "bayes": Trainer("bayesian", "bayesian", 1000),
    "lm": Trainer("levenberg_marquardt", "levenberg_marquardt", 1000),
    "gdm": Trainer("gradient_descent", "momentum", 1000),
    "gdx": Trainer("gradient_descent", "adaptive", 1000),
    "oss": Trainer("one_step_secant", "one_step_secant", 1000),
    "lbfgs": Trainer("limited_memory_bfgs", "limited_memory_bfgs", 1000),
}
"""By the name that ``MLP(trainer=...)`` takes; epochs as in the documents' program."""


def find_trainer(name: str) -> Trainer:
    """A trainer by its name.

    Raises:
        InputError: an unknown name; the message lists the names.

    Example:
        >>> find_trainer("lm").epochs
        1000
    """
    if not isinstance(name, str) or name not in TRAINERS:
        raise InputError(f"trainer must be one of {', '.join(TRAINERS)}, got {name!r}")
    return TRAINERS[name]

"""The ways to train the layers of an MLP, by name."""

import typing
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

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


class Trainer(NamedTuple):
    """One way to train: where it is, how long it may take by default, what it needs."""

    file: str
    function: str
    epochs: int
    linear_output: bool = False

    def train(self, task: Task, monitor: Monitor) -> dict[str, Any]:
        """Train; returns what the network should remember besides its weights."""
        module = import_module(f"kinverse.networks.trainers.{self.file}")
        function: Callable[[Task, Monitor], dict[str, Any] | None] = getattr(module, self.function)
        return function(task, monitor) or {}


TRAINERS: typing.Final = {
    "varpro": Trainer("variable_projection", "variable_projection", 200, linear_output=True),
    "bayes": Trainer("levenberg_marquardt", "bayesian", 1000),
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

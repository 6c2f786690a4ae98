"""Activation functions under the names that the source documents use, with derivatives.

The derivative is told by the output a = f(x): logsig a (1 - a), tansig 1 - a^2, purelin 1.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["ACTIVATIONS", "Activation", "activation"]

Array = NDArray[np.float64]


class Activation(NamedTuple):
    """A function of any array and its derivative as a function of the output."""

    of: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    linear: bool = False


def _logsig(x: Array) -> Array:
    # by tanh: exp would overflow far out
    out: Array = np.tanh(0.5 * x)
    out += 1.0
    out *= 0.5
    return out


def _slope_of_logsig(a: Array) -> Array:
    out: Array = a * (1.0 - a)
    return out


def _slope_of_tansig(a: Array) -> Array:
    out: Array = a * a
    np.subtract(1.0, out, out=out)
    return out


ACTIVATIONS = {
    "logsig": Activation(_logsig, _slope_of_logsig),
    "tansig": Activation(np.tanh, _slope_of_tansig),
    "purelin": Activation(lambda x: x, np.ones_like, linear=True),
}
"""By name: logistic 1 / (1 + exp(-x)), tanh, the identity."""


def activation(name: str) -> Activation:
    """An activation by its name.

    Raises:
        InputError: an unknown name; the message lists the names.

    Example:
        >>> activation("tansig").of(np.zeros(1))
        array([0.])
    """
    if not isinstance(name, str) or name not in ACTIVATIONS:
        names = ", ".join(ACTIVATIONS)
        raise InputError(f"activation must be one of {names}, got {name!r}")
    return ACTIVATIONS[name]

"""A network as a regressor of several outputs: checked, copied, trained and asked."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError, MissingExtra

__all__ = ["check_regressor", "cloned", "predicted", "train"]

Array = NDArray[np.float64]

METHODS = ("fit", "predict", "get_params", "set_params")


def check_regressor(network: Any) -> None:
    """Refuse what cannot be trained (InputError)."""
    if isinstance(network, type):
        raise InputError(f"network must be an object, not a class: write {network.__name__}()")
    if not all(hasattr(network, name) for name in METHODS):
        raise InputError(
            f"network must be a regressor with {', '.join(METHODS)}, such as those of"
            f" kinverse.networks, got {network!r}"
        )


def cloned(network: Any) -> Any:
    """A network with the same settings that has learned nothing.

    Raises:
        MissingExtra: scikit-learn is not installed.
    """
    try:
        from sklearn.base import clone
    except ModuleNotFoundError as error:
        raise MissingExtra("a network", "learn") from error
    return clone(network)


def train(network: Any, X: Array, Y: Array) -> None:
    """Fit a network; its callback belongs to the session that trains and is dropped.

    Raises:
        InputError: it is no regressor of several outputs.
    """
    try:
        network.fit(X, Y)
        columns = predicted(network, X[:1]).shape[1]
    except InputError:
        raise
    except (ValueError, TypeError) as error:
        raise InputError(
            f"network {type(network).__name__} cannot learn {Y.shape[1]} outputs: {error}"
        ) from error
    if columns != Y.shape[1]:
        raise InputError(
            f"network must be a regressor of several outputs: {type(network).__name__} learned"
            f" {Y.shape[1]} and gives {columns}"
        )
    if network.get_params().get("callback") is not None:
        network.set_params(callback=None)


def predicted(network: Any, X: Array) -> Array:
    """Outputs (N, m); some regressors drop an axis where m is 1."""
    return np.asarray(network.predict(X), dtype=np.float64).reshape(len(X), -1)

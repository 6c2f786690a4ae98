"""Models one after the other, each on what the ones before it leave."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from kinverse.calibration._base import ErrorModel
from kinverse.errors import InputError

__all__ = ["Stack"]

Array = NDArray[np.float64]


class Stack(ErrorModel):
    """The sum of models: the second learns the remainder of the first, and so on.

    Geometry first and a Fourier polynomial for what is left is the usual pair.

    Args:
        models: at least one, in this order.

    Attributes:
        models_: fitted clones.

    Example:
        >>> Stack([GeometricErrorModel(robot), FourierErrorModel(2)]).fit(q, error)
    """

    def __init__(self, models: Sequence[Any]) -> None:
        self.models = models

    def _check_settings(self) -> None:
        if not isinstance(self.models, (list, tuple)) or not self.models:
            raise InputError(f"Stack needs a list of models, got {self.models!r}")
        for model in self.models:
            if isinstance(model, type) or not (hasattr(model, "fit") and hasattr(model, "predict")):
                raise InputError(f"Stack needs models with fit and predict, got {model!r}")

    def _learn(self, X: Array, Y: Array) -> None:
        self.models_ = []
        rest = Y
        for model in self.models:
            fitted = clone(model).fit(X, rest)
            self.models_.append(fitted)
            rest = rest - _columns(fitted.predict(X))
        shares = [model.share_ for model in self.models_ if hasattr(model, "share_")]
        if shares:
            self.share_ = min(shares)

    def _error(self, X: Array) -> Array:
        out: Array = np.sum([_columns(model.predict(X)) for model in self.models_], axis=0)
        return out


def _columns(error: Array) -> Array:
    # some regressors drop the axis of a single output
    return np.asarray(error, dtype=np.float64).reshape(len(error), -1)

"""The model of an arm that does what its forward kinematics say."""

import numpy as np
from numpy.typing import NDArray

from kinverse.calibration._base import ErrorModel

__all__ = ["ZeroErrorModel"]

Array = NDArray[np.float64]


class ZeroErrorModel(ErrorModel):
    """No error anywhere: what every other model is compared with.

    Example:
        >>> ZeroErrorModel().fit(q, error).predict(q).any()
        False
    """

    def _learn(self, X: Array, Y: Array) -> None:
        pass

    def _error(self, X: Array) -> Array:
        return np.zeros((len(X), self.n_outputs_))

    def __sklearn_tags__(self):  # type: ignore[no-untyped-def]
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags

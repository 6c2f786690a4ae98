"""Position errors as a Fourier polynomial of the joint angles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.calibration._base import LinearErrorModel
from kinverse.errors import InputError
from kinverse.networks._base import check_number, check_whole

__all__ = ["FourierErrorModel"]

Array = NDArray[np.float64]

MOST_HARMONICS = 1000


class FourierErrorModel(LinearErrorModel):
    """error = K + sum over joints i and q = 1..r of A_qi cos(q theta_i) + B_qi sin(q theta_i).

    Document 002, equations (24) and (25): each joint adds its own, products of joints are not
    there. At a jump the series of a function converges to the mean of both sides.

    Args:
        harmonics: r.
        ridge: weight of the squared coefficients, see the base class; 0: plain least squares.
        period: what theta repeats after, one for all joints or (n,) [rad or m]. A turn suits what
            is periodic in the joint; a slide needs a length of its own.

    Attributes:
        coef_: (2 n r, m) [m]: A of harmonic 1 of each joint, B of it, then those of harmonic 2 ...
        intercept_: (m,) [m] K.

    Example:
        >>> FourierErrorModel(harmonics=2).fit(q, error).coef_.shape
        (24, 3)
    """

    def __init__(
        self, harmonics: int = 2, *, ridge: float = 0.0, period: Any = 2.0 * np.pi
    ) -> None:
        self.harmonics = harmonics
        self.ridge = ridge
        self.period = period

    def _check_settings(self) -> None:
        check_whole("harmonics", self.harmonics, 1)
        if self.harmonics > MOST_HARMONICS:
            raise InputError(f"harmonics must lie in 1..{MOST_HARMONICS}, got {self.harmonics}")
        check_number("ridge", self.ridge, 0.0)
        for value in np.atleast_1d(np.asarray(self.period, dtype=object)).ravel():
            check_number("period", value, 0.0, open_ends=True)

    def _prepare(self, X: Array) -> None:
        period = np.asarray(self.period, dtype=np.float64)
        if period.shape not in ((), (X.shape[1],)):
            raise InputError(
                f"period must be one number or {X.shape[1]}, one a joint, got shape {period.shape}"
            )
        self.harmonics_ = int(self.harmonics)
        self.frequency_ = np.broadcast_to(2.0 * np.pi / period, X.shape[1]).copy()

    def _regressors(self, X: Array) -> Array:
        angle = X * self.frequency_
        waves = [
            wave(q * angle) for q in range(1, self.harmonics_ + 1) for wave in (np.cos, np.sin)
        ]
        return np.hstack(waves)

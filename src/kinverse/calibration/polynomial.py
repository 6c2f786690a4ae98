"""Position errors as an ordinary or orthogonal polynomial of the joint angles."""

from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.polynomial.hermite import hermvander
from numpy.polynomial.laguerre import lagvander
from numpy.polynomial.legendre import legvander
from numpy.polynomial.polynomial import polyvander
from numpy.typing import NDArray

from kinverse.calibration._base import LinearErrorModel
from kinverse.errors import InputError
from kinverse.networks._base import check_number, check_whole
from kinverse.networks.scaling import Scaling

__all__ = ["BASES", "PolynomialErrorModel"]

Array = NDArray[np.float64]

BASES: dict[str, Any] = {
    "power": polyvander,
    "legendre": legvander,
    "chebyshev": chebvander,
    "hermite": hermvander,
    "laguerre": lagvander,
}
"""What ``basis`` may be, and the values of degree 0 to k: (N, n) -> (N, n, k + 1)."""

MOST_DEGREE = 50


class PolynomialErrorModel(LinearErrorModel):
    """error = Q + sum over joints i and j = 1..k of A_ji P_j(x_i), x_i the scaled joint value.

    Document 002, equations (26) and (27), which name powers, and the families its text names.
    Joint values are scaled by their range over the training rows: to [-1, 1], where Legendre's and
    Chebyshev's polynomials are orthogonal; to [0, 2] for Laguerre's, which live on the positive
    axis. All bases span the same functions, so that without a ridge they predict the same, but for
    rounding; with one they differ. Beyond the training rows polynomials run away.

    Args:
        degree: k.
        basis: "power", "legendre", "chebyshev", "hermite" (the physicists') or "laguerre".
        ridge: weight of the squared coefficients, see the base class; 0: plain least squares.

    Attributes:
        coef_: (n k, m) [m]: degrees 1 to k of the first joint, then of the second ...
        intercept_: (m,) [m].
        middle_, unit_: (n,) middle and half of the range of each joint [rad or m].

    Example:
        >>> PolynomialErrorModel(3, basis="chebyshev").fit(q, error).coef_.shape
        (18, 3)
    """

    def __init__(self, degree: int = 3, basis: str = "power", *, ridge: float = 0.0) -> None:
        self.degree = degree
        self.basis = basis
        self.ridge = ridge

    def _check_settings(self) -> None:
        check_whole("degree", self.degree, 1)
        if self.degree > MOST_DEGREE:
            raise InputError(f"degree must lie in 1..{MOST_DEGREE}, got {self.degree}")
        if not isinstance(self.basis, str) or self.basis not in BASES:
            raise InputError(f"basis must be one of {', '.join(BASES)}, got {self.basis!r}")
        check_number("ridge", self.ridge, 0.0)

    def _prepare(self, X: Array) -> None:
        self.degree_, self.basis_ = int(self.degree), str(self.basis)
        self.middle_, self.unit_ = Scaling.fitted(X, "minmax")

    def _regressors(self, X: Array) -> Array:
        x = Scaling(self.middle_, self.unit_).forward(X)
        if self.basis_ == "laguerre":
            x = x + 1.0
        values: Array = BASES[self.basis_](x, self.degree_)[:, :, 1:]
        return np.ascontiguousarray(values.reshape(len(X), -1))

"""The base of every error model: a scikit-learn regressor from joint values to the tool's error.

A new model writes ``__init__`` (settings stored untouched), ``_check_settings``, ``_learn`` and
``_error``. What is learned ends in ``_`` and is made of arrays, numbers and text, so that a file
can hold it.
"""

import warnings
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

__all__ = ["ErrorModel", "LinearErrorModel"]

Array = NDArray[np.float64]


class ErrorModel(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Joint values in, errors out; ``fit``, ``predict`` and ``score`` as in scikit-learn.

    Attributes:
        n_features_in_: joints.
        n_outputs_: columns of the error: 3 for positions, 6 with rotations.
        share_: what was measured for each parameter; not there where nothing is learned.
    """

    # What a model writes ----------------------------------------------------------------------

    def _check_settings(self) -> None:
        """Refuse settings that cannot be used (InputError)."""

    def _learn(self, X: Array, Y: Array) -> None:
        """Learn from joint values X (N, n) and errors Y (N, m) into attributes that end in _."""
        raise NotImplementedError(f"{type(self).__name__} has no _learn")

    def _error(self, X: Array) -> Array:
        """Errors (N, m) at joint values X (N, n)."""
        raise NotImplementedError(f"{type(self).__name__} has no _error")

    # What a user calls ------------------------------------------------------------------------

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn from measurements.

        Args:
            X: (N, n) joint values [rad or m].
            y: (N, 3) errors of the position [m], or (N, 6) with rotation vectors [rad] behind
                them, both in the base frame; see :func:`kinverse.calibration.tool_error`.

        Returns:
            The model itself.

        Raises:
            InputError: a setting that is not valid.
            ValueError: NaN or infinite values, no rows, rows of different number.

        Warns:
            UserWarning: fewer measurements than parameters: what is learned need not be true.

        Example:
            >>> FourierErrorModel(2).fit(q, error).predict(q).shape
            (300, 3)
        """
        self._check_settings()
        rows, targets = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, ensure_min_samples=2
        )
        self.flat_output_ = targets.ndim == 1
        Y = np.asarray(targets, dtype=np.float64).reshape(len(targets), -1)
        self.n_outputs_ = Y.shape[1]
        self._learn(rows, Y)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """Errors at joint values.

        Args:
            X: (N, n) joint values [rad or m].

        Returns:
            (N, m) errors as they were learned: [m], rotations [rad].

        Raises:
            ValueError: NaN or infinite values, or not n columns.
            sklearn.exceptions.NotFittedError: ``fit`` comes first.

        Example:
            >>> tool = robot.fk(q)[:, :3, 3] + model.predict(q)
        """
        check_is_fitted(self)
        out = self._error(validate_data(self, X, reset=False, dtype=np.float64))
        return out[:, 0] if self.flat_output_ else out

    def _warn_if_few(self, equations: int, parameters: int, what: str) -> None:
        self.share_ = equations / parameters
        if equations < parameters:
            warnings.warn(
                f"{type(self).__name__}: {equations} {what} for {parameters} parameters: it can"
                " learn them by heart",
                UserWarning,
                stacklevel=4,
            )


class LinearErrorModel(ErrorModel):
    """Least squares on regressors of the joint values, a constant beside them.

    The mean square of the residual plus ``ridge`` times the sum of squared coefficients is least,
    with each regressor scaled to unit variance over the training rows and the constant left free.
    Without a ridge it is plain least squares, of the smallest norm where these leave a choice.

    Attributes:
        coef_: (P, m) weights of the regressors as they are, not scaled.
        intercept_: (m,) the constant.
    """

    ridge: float

    def _prepare(self, X: Array) -> None:
        """Learn what the regressors need from the training rows."""

    def _regressors(self, X: Array) -> Array:
        """(N, P) of joint values (N, n); the constant is not among them."""
        raise NotImplementedError(f"{type(self).__name__} has no _regressors")

    def _learn(self, X: Array, Y: Array) -> None:
        self._prepare(X)
        phi = self._regressors(X)
        self._warn_if_few(len(phi), phi.shape[1] + 1, "measurements")
        middle, mean = phi.mean(axis=0), Y.mean(axis=0)
        spread = phi.std(axis=0)
        # a spread of a few roundings is that of a joint that did not move
        still = spread <= 1e-12 * np.abs(phi).max(axis=0)
        unit = np.divide(1.0, spread, out=np.zeros_like(spread), where=~still)
        scaled, wanted = (phi - middle) * unit, Y - mean
        if self.ridge > 0.0:
            penalty = np.sqrt(self.ridge * len(phi)) * np.eye(phi.shape[1])
            scaled = np.vstack([scaled, penalty])
            wanted = np.vstack([wanted, np.zeros((phi.shape[1], Y.shape[1]))])
        solution: Any = np.linalg.lstsq(scaled, wanted, rcond=None)[0]
        self.coef_ = solution * unit[:, None]
        self.intercept_ = mean - middle @ self.coef_

    def _error(self, X: Array) -> Array:
        out: Array = self._regressors(X) @ self.coef_ + self.intercept_
        return out

"""Which model predicts measurements it has not seen best: cross-validation."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.model_selection import KFold, cross_val_score
from sklearn.utils.validation import check_array

from kinverse.calibration.zero import ZeroErrorModel
from kinverse.errors import InputError
from kinverse.networks._base import check_whole

__all__ = ["NONE", "Choice", "HeldOut", "choose"]

Array = NDArray[np.float64]

NONE = "none"
"""The name of no model at all, which takes part in every choice."""


class HeldOut(NamedTuple):
    """How one model did on measurements held back."""

    name: str
    rms: float
    """Root mean square length of what is left of the position error [m]."""
    low: float
    """The same of the best fold [m]."""
    high: float
    """The same of the worst fold [m]."""


class Choice(NamedTuple):
    """The model with the least held-out error and how all of them did, the best first."""

    name: str
    model: Any
    """Fitted to all measurements."""
    table: tuple[HeldOut, ...]

    @property
    def before(self) -> HeldOut:
        """The error as it is, without a model."""
        return next(row for row in self.table if row.name == NONE)


def choose(
    models: Mapping[str, Any],
    q: ArrayLike,
    error: ArrayLike,
    folds: int = 5,
    random_state: int | None = 0,
) -> Choice:
    """Compare models by cross-validation and fit the best to all measurements.

    Each model is fitted to all folds but one and judged on that one. No model at all is always
    among those compared, under the name "none".

    Args:
        models: name -> model, not fitted or to be fitted anew.
        q: (N, n) joint values [rad or m].
        error: (N, 3) errors [m], or (N, 6) with rotations, which the judgement leaves out.
        folds: parts the measurements are split into, at random.
        random_state: seed of the split.

    Raises:
        InputError: fewer than two folds or more than measurements, a model called "none".
        ValueError: NaN or infinite values, rows of different number.

    Example:
        >>> chosen = choose({"fourier": FourierErrorModel(2)}, q, error)
        >>> chosen.name, chosen.model.predict(q)
    """
    if NONE in models:
        raise InputError(f"{NONE!r} is the name of no model at all: call yours something else")
    X = check_array(q, dtype=np.float64)
    Y = check_array(error, dtype=np.float64)
    check_whole("folds", folds, 2)
    if folds > len(X):
        raise InputError(f"{len(X)} measurements make no {folds} folds")
    split = KFold(folds, shuffle=True, random_state=random_state)
    sizes = np.array([len(held) for _, held in split.split(X)])
    rows = []
    contest = {NONE: ZeroErrorModel(), **models}
    for name, model in contest.items():
        scores = cross_val_score(
            clone(model), X, Y, cv=split, scoring=_negative_mean_square, error_score="raise"
        )
        squares = -np.asarray(scores)
        whole = np.sqrt((squares * sizes).sum() / sizes.sum())
        low, high = np.sqrt(squares.min()), np.sqrt(squares.max())
        rows.append(HeldOut(name, float(whole), float(low), float(high)))
    rows.sort(key=lambda row: row.rms)
    best = rows[0].name
    return Choice(best, clone(contest[best]).fit(X, Y), tuple(rows))


def _negative_mean_square(model: Any, X: Array, Y: Array) -> float:
    """Scikit-learn takes the greatest score for the best."""
    left = (np.asarray(model.predict(X)) - Y)[:, :3]
    return -float(np.mean(np.sum(left * left, axis=1)))

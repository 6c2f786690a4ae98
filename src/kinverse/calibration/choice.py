"""Which model predicts measurements it has not seen best: cross-validation."""

import math
import warnings
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
Ints = NDArray[np.int64]

NONE = "none"
"""The name of no model at all, which takes part in every choice."""

ONE_POSTURE = 1e-3
"""Joint values [rad or m] that differ by less were measured in one posture."""


FEW = 2.0
"""Measured numbers for each parameter of the chosen model from which they are not few."""


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
    postures: int
    """Different ones among the measurements."""

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

    Each model is fitted to all folds but one and judged on that one. Repeated measurements of one
    posture are in one fold, so that no model is judged on postures that it was fitted to. No model
    at all is always among those compared, under the name "none".

    Args:
        models: name -> model, not fitted or to be fitted anew.
        q: (N, n) joint values [rad or m].
        error: (N, 3) errors [m], or (N, 6) with rotations, which the judgement leaves out.
        folds: parts the postures are split into, at random.
        random_state: seed of the split.

    Warns:
        UserWarning: the best model has parameters for more than half of what was measured.

    Raises:
        InputError: fewer than two folds or more than postures, a model called "none".
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
    posture = _postures(X)
    count = int(posture.max()) + 1
    if folds > count:
        repeats = "" if count == len(X) else f" of {count} different postures"
        raise InputError(f"{len(X)} measurements{repeats} make no {folds} folds")
    parts = KFold(folds, shuffle=True, random_state=random_state).split(np.arange(count))
    split = [tuple(np.flatnonzero(np.isin(posture, part)) for part in pair) for pair in parts]
    sizes = np.array([len(held) for _, held in split])
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
    model = clone(contest[best]).fit(X, Y)
    share = getattr(model, "share_", FEW)
    if share < FEW:
        warnings.warn(
            f"{count} postures are few for {best}: {share:.2g} measured numbers for each of its"
            f" parameters; what it learned need not hold elsewhere: measure"
            f" {math.ceil(count * FEW / share)} or more",
            UserWarning,
            stacklevel=2,
        )
    return Choice(best, model, tuple(rows), count)


def _postures(X: Array) -> Ints:
    """Numbers (N,) of the postures, from 0 by first appearance; near ones are one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(X).query_pairs(ONE_POSTURE, p=np.inf, output_type="ndarray")
    near = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(X), len(X)))
    label = connected_components(near, directed=False)[1]
    _, first, posture = np.unique(label, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[posture], dtype=np.int64)


def _negative_mean_square(model: Any, X: Array, Y: Array) -> float:
    """Scikit-learn takes the greatest score for the best."""
    left = (np.asarray(model.predict(X)) - Y)[:, :3]
    return -float(np.mean(np.sum(left * left, axis=1)))

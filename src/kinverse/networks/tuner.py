"""A small tuner: which hidden nodes, rate or momentum give the lowest error on rows held back."""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, clone, is_regressor
from sklearn.model_selection import (
    KFold,
    ParameterGrid,
    ParameterSampler,
    ShuffleSplit,
    cross_validate,
)
from sklearn.utils import check_random_state, check_X_y

from kinverse.errors import InputError
from kinverse.networks._base import NetworkRegressor, check_number, check_whole

__all__ = ["Trial", "Tuning", "TuningProgress", "tune"]

Array = NDArray[np.float64]
Splits = list[tuple[NDArray[np.int64], NDArray[np.int64]]]


@dataclass(frozen=True)
class Trial:
    """What one choice of settings came to.

    Attributes:
        settings: names and values.
        rms: (F, m) root mean squared error of each fold and output, in target units.
        errors: (F,) of each fold: the root of the mean over the outputs of (rms / standard
            deviation of the target)^2, so that radians and metres weigh alike; 1 is no better
            than the mean of the targets.
        fit_seconds: what a fit takes by the clock, mean over the folds.
    """

    settings: Mapping[str, Any]
    rms: Array
    errors: Array
    fit_seconds: float

    @property
    def error(self) -> float:
        """Mean of ``errors``, by which trials are ranked."""
        return float(self.errors.mean())

    @property
    def spread(self) -> float:
        """Standard deviation of ``errors`` between the folds."""
        return float(self.errors.std())


@dataclass(frozen=True)
class Tuning:
    """The trials, best first; print it to see the table.

    Attributes:
        trials: those that were finished.
        network: the network with the best settings, fitted to all rows; None if interrupted.
        interrupted: whether Ctrl-C ended it before all were tried.
    """

    trials: tuple[Trial, ...]
    network: Any
    interrupted: bool = False

    @property
    def best(self) -> Trial:
        """The trial of the lowest error."""
        return self.trials[0]

    def __str__(self) -> str:
        names = list(self.trials[0].settings)
        table = [[*names, "error", "spread", "seconds"]]
        for trial in self.trials:
            figures = (trial.error, trial.spread, trial.fit_seconds)
            table.append([*map(str, trial.settings.values()), *(f"{x:.3g}" for x in figures)])
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        return "\n".join(
            "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
            for row in table
        )


class TuningProgress(NamedTuple):
    """What a callback is told after each trial."""

    done: int
    total: int
    trial: Trial


def tune(
    network: Any,
    X: ArrayLike,
    y: ArrayLike,
    grid: Mapping[str, Sequence[Any]],
    *,
    folds: int | Iterable[tuple[Any, Any]] = 5,
    validation_fraction: float | None = None,
    max_trials: int | None = None,
    random_state: Any = None,
    callback: Callable[[TuningProgress], Any] | None = None,
) -> Tuning:
    """Try settings of a network by cross-validation and refit it with the best ones.

    All are tried on the same folds by scikit-learn's ``cross_validate``. Keep the rows for the
    final test out of X: what is chosen by an error is too good by that error. Ctrl-C ends it and
    keeps the trials that were finished.

    Args:
        network: a regressor in the manner of scikit-learn; it is not touched.
        X: (N, n) inputs.
        y: (N,) or (N, m) targets.
        grid: values to try by the name of the setting, "hidden", "learning_rate", "momentum" or
            any other; every combination is tried.
        folds: how many parts, of shuffled rows; or pairs (train, validate) of row numbers, such as
            ``GroupKFold(5).split(X, y, groups)`` of scikit-learn gives.
        validation_fraction: instead of folds one split, with this share of the rows held back.
        max_trials: try that many of the combinations, drawn at random.
        random_state: None, an int or a RandomState: of the folds, of what is drawn, and of the
            network if it has none of its own.
        callback: called with ``TuningProgress`` after each trial; True ends it early.

    Raises:
        InputError: a setting that the network does not have or refuses, nothing to try, folds
            that cannot be made.
        ValueError: NaN or infinite values, rows of different number.
        KeyboardInterrupt: Ctrl-C before the first trial was finished.

    Example:
        >>> found = tune(MLP(), X, y, {"hidden": [(10,), (20,), (40,)]}, random_state=0)
        >>> found.best.settings, found.network.predict(X)
    """
    if not isinstance(network, BaseEstimator) or not is_regressor(network):
        raise InputError(f"network must be a regressor, got {type(network).__name__}")
    rows, targets = check_X_y(X, y, dtype=np.float64, multi_output=True, y_numeric=True)
    random = check_random_state(random_state)
    splits = _splits(rows, folds, validation_fraction, random)
    network = clone(network)
    if network.get_params().get("random_state", 0) is None:
        network.set_params(random_state=int(random.randint(2**31)))
    choices = _choices(network, grid, max_trials, random)
    spread = targets.reshape(len(targets), -1).std(axis=0)
    unit = np.where(spread > 0.0, spread, 1.0)
    trials: list[Trial] = []
    try:
        for settings in choices:
            trials.append(_trial(network, settings, rows, targets, splits, unit))
            progress = TuningProgress(len(trials), len(choices), trials[-1])
            if callback is not None and callback(progress):
                break
        best = clone(network).set_params(**_ranked(trials)[0].settings)
        return Tuning(_ranked(trials), best.fit(rows, targets))
    except KeyboardInterrupt:
        if not trials:
            raise
        warnings.warn(
            f"tune: interrupted after {len(trials)} of {len(choices)} trials; they are kept,"
            " no network was fitted",
            UserWarning,
            stacklevel=2,
        )
        return Tuning(_ranked(trials), None, interrupted=True)


def _ranked(trials: list[Trial]) -> tuple[Trial, ...]:
    return tuple(sorted(trials, key=lambda trial: trial.error))


def _splits(rows: Array, folds: Any, fraction: float | None, random: Any) -> Splits:
    if fraction is not None:
        check_number("validation_fraction", fraction, 0.0, 1.0, open_ends=True)
        splitter: Any = ShuffleSplit(1, test_size=fraction, random_state=random)
    elif np.iterable(folds) and not isinstance(folds, str):
        pairs = list(folds)
        if not pairs:
            raise InputError("folds must be a number or pairs of row numbers, got none")
        return pairs
    else:
        check_whole("folds", folds, 2)
        splitter = KFold(folds, shuffle=True, random_state=random)
    try:
        return list(splitter.split(rows))
    except ValueError as error:
        raise InputError(f"{len(rows)} rows cannot be divided: {error}") from error


def _choices(network: Any, grid: Any, most: int | None, random: Any) -> list[dict[str, Any]]:
    """The combinations to try; each is offered to the network before the first is trained."""
    if not isinstance(grid, Mapping) or not grid:
        raise InputError(f"grid must give values by the name of a setting, got {grid!r}")
    valid = network.get_params()
    for name, values in grid.items():
        if name not in valid:
            raise InputError(
                f"{type(network).__name__} has no setting {name!r}: it has {', '.join(valid)}"
            )
        if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)):
            raise InputError(f"grid: {name} must be a list of values, got {values!r}")
        if len(values) == 0:
            raise InputError(f"grid: {name} has no values to try")
    combinations: Any = ParameterGrid(dict(grid))
    if most is not None:
        check_whole("max_trials", most, 1)
        drawn = min(most, len(combinations))
        combinations = ParameterSampler(dict(grid), drawn, random_state=random)
    choices = [{name: each[name] for name in grid} for each in combinations]
    for settings in choices:
        tried = clone(network).set_params(**settings)
        if isinstance(tried, NetworkRegressor):
            tried._check_settings()
    return choices


def _trial(
    network: Any, settings: dict[str, Any], X: Array, y: Array, splits: Splits, unit: Array
) -> Trial:
    outputs = [str(k) for k in range(len(unit))]

    def errors(fitted: Any, rows: Array, wanted: Array) -> dict[str, float]:
        # a network that was interrupted says so and goes on with what it has: not so here
        if getattr(fitted, "stop_reason_", None) == "interrupted":
            raise KeyboardInterrupt
        error = (fitted.predict(rows) - wanted).reshape(len(rows), -1)
        rms = np.sqrt(np.mean(error * error, axis=0))
        return dict(zip(outputs, np.where(np.isfinite(rms), rms, np.inf), strict=True))

    tried = clone(network).set_params(**settings)
    told = cross_validate(tried, X, y, cv=splits, scoring=errors, error_score="raise")
    rms = np.stack([told[f"test_{k}"] for k in outputs], axis=1)
    relative = np.sqrt(np.mean((rms / unit) ** 2, axis=1))
    return Trial(settings, rms, relative, float(told["fit_time"].mean()))

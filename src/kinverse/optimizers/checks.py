"""What arguments must be: arrays of real numbers, numbers inside a range, whole numbers."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["not_nan", "real_array", "real_number", "whole_number"]


def real_array(name: str, value: Any) -> NDArray[np.float64]:
    """An array of float64, not copied if it is one.

    Raises:
        TypeError: complex numbers, text, objects.
        InputError: rows of unequal length.
    """
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{name} must be an array, got rows of unequal length") from None
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name} must hold real numbers, got {array.dtype}")
    return array.astype(np.float64, copy=False)


def real_number(name: str, value: Any, least: float = -np.inf, most: float = np.inf) -> None:
    """Raise InputError unless value is a finite number in least..most."""
    number = isinstance(value, (int, float, np.integer, np.floating))
    if isinstance(value, bool) or not number or not np.isfinite(value):
        raise InputError(f"{name} must be a finite number, got {value!r}")
    if not least <= value <= most:
        raise InputError(f"{name} must lie in {least:g}..{most:g}, got {value!r}")


def not_nan(name: str, value: Any) -> float:
    """A number, infinite ones too.

    Raises:
        InputError: NaN, or no number.
    """
    number = isinstance(value, (int, float, np.integer, np.floating))
    if isinstance(value, bool) or not number or value != value:
        raise InputError(f"{name} must be a number, got {value!r}")
    return float(value)


def whole_number(name: str, value: Any, least: int) -> None:
    """Raise InputError unless value is a whole number of at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")

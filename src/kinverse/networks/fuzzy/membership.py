"""Membership functions of fuzzy sets: values, derivatives, the first ones on a grid.

Every function takes all M sets at once: x (N, M) holds for each set the input it looks at, the
parameters are (M, p). Neighbours of a first grid cross at 0.5.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["MEMBERSHIPS", "Membership", "find_membership"]

Array = NDArray[np.float64]

MOST_LOG = 300.0
"""exp of more could overflow when it is multiplied by anything."""
LEAST_EXPONENT = 0.5
"""A bell below it is a cusp without a derivative at its centre."""


class Membership(NamedTuple):
    """One kind of membership function.

    Attributes:
        parameters: their names, in the order of the columns.
        centre: the column of the centre.
        start: centres (M,), spacing (M,) -> parameters (M, p).
        of: x (N, M), parameters (M, p) -> values (N, M) in [0, 1].
        slopes: the same -> derivatives (p, N, M) of the values by the parameters.
        kept: parameters (M, p), least width (M,) -> the nearest valid parameters (M, p).
    """

    parameters: tuple[str, ...]
    centre: int
    start: Callable[[Array, Array], Array]
    of: Callable[[Array, Array], Array]
    slopes: Callable[[Array, Array], Array]
    kept: Callable[[Array, Array], Array]


def _bell_start(centres: Array, spacing: Array) -> Array:
    return np.stack([0.5 * spacing, np.full_like(centres, 2.0), centres], axis=1)


def _bell(x: Array, parameters: Array) -> Array:
    a, b, c = parameters.T
    values: Array = 1.0 / (1.0 + np.exp(np.minimum(b * _log_square((x - c) / a), MOST_LOG)))
    return values


def _bell_slopes(x: Array, parameters: Array) -> Array:
    a, b, c = parameters.T
    away = x - c
    value = _bell(x, parameters)
    # the value is 1 / (1 + z): its derivative is -value (1 - value) times that of log z
    common = value * (1.0 - value)
    by_centre = np.divide(2.0 * b * common, away, out=np.zeros_like(x), where=away != 0.0)
    return np.stack([2.0 * b / a * common, -_log_square(away / a) * common, by_centre])


def _log_square(ratio: Array) -> Array:
    logs: Array = 2.0 * np.log(np.maximum(np.abs(ratio), np.finfo(np.float64).tiny))
    return logs


def _bell_kept(parameters: Array, least: Array) -> Array:
    a, b, c = parameters.T
    return np.stack([np.maximum(a, least), np.maximum(b, LEAST_EXPONENT), c], axis=1)


def _gauss_start(centres: Array, spacing: Array) -> Array:
    return np.stack([spacing / np.sqrt(8.0 * np.log(2.0)), centres], axis=1)


def _gauss(x: Array, parameters: Array) -> Array:
    sigma, c = parameters.T
    # far out it is 0 anyway, and a square could overflow
    values: Array = np.exp(-0.5 * np.minimum(np.abs((x - c) / sigma), MOST_LOG) ** 2)
    return values


def _gauss_slopes(x: Array, parameters: Array) -> Array:
    sigma, c = parameters.T
    ratio = (x - c) / sigma
    by_centre = _gauss(x, parameters) * ratio / sigma
    return np.stack([by_centre * ratio, by_centre])


def _gauss_kept(parameters: Array, least: Array) -> Array:
    sigma, c = parameters.T
    return np.stack([np.maximum(sigma, least), c], axis=1)


def _triangle_start(centres: Array, spacing: Array) -> Array:
    return np.stack([centres - spacing, centres, centres + spacing], axis=1)


def _triangle(x: Array, parameters: Array) -> Array:
    left, c, right = parameters.T
    values: Array = np.clip(np.minimum((x - left) / (c - left), (right - x) / (right - c)), 0, 1)
    return values


def _triangle_slopes(x: Array, parameters: Array) -> Array:
    left, c, right = parameters.T
    value = _triangle(x, parameters)
    rising = (left < x) & (x <= c)
    falling = (c < x) & (x < right)
    up, down = rising / (c - left), falling / (right - c)
    return np.stack([(value - 1.0) * up, value * (down - up), (1.0 - value) * down])


def _triangle_kept(parameters: Array, least: Array) -> Array:
    left, c, right = parameters.T
    return np.stack([np.minimum(left, c - least), c, np.maximum(right, c + least)], axis=1)


MEMBERSHIPS = {
    "gbell": Membership(("a", "b", "c"), 2, _bell_start, _bell, _bell_slopes, _bell_kept),
    "gauss": Membership(("sigma", "c"), 1, _gauss_start, _gauss, _gauss_slopes, _gauss_kept),
    "tri": Membership(
        ("left", "c", "right"),
        1,
        _triangle_start,
        _triangle,
        _triangle_slopes,
        _triangle_kept,
    ),
}
"""By name: 1 / (1 + |(x - c) / a|^(2 b)), exp(-(x - c)^2 / (2 sigma^2)), the triangle."""


def find_membership(name: str) -> Membership:
    """A kind of membership function by its name.

    Raises:
        InputError: an unknown name; the message lists the names.

    Example:
        >>> find_membership("gauss").parameters
        ('sigma', 'c')
    """
    if not isinstance(name, str) or name not in MEMBERSHIPS:
        raise InputError(f"mf must be one of {', '.join(MEMBERSHIPS)}, got {name!r}")
    return MEMBERSHIPS[name]

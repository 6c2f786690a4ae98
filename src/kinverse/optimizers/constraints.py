"""Equality and inequality constraints, read into rows c(x) = 0 and d(x) <= 0."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError
from kinverse.optimizers.checks import real_array

__all__ = ["AtMost", "Equal", "Rows"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equal:
    """g(x) = value.

    Args:
        g: takes what the objective takes: x (D,), gives a number or (m,); with ``vectorized=True``
            x (K, D), gives (K,) or (K, m).
        value: a number or (m,).

    Example:
        >>> Equal(lambda x: x @ x, 1.0)  # on the unit sphere
    """

    g: Callable[..., Any]
    value: Any = 0.0


@dataclass(frozen=True)
class AtMost:
    """h(x) <= bound; what ``Equal`` takes.

    Example:
        >>> AtMost(lambda x: x[0] + x[1], 1.0)
    """

    h: Callable[..., Any]
    bound: Any = 0.0


class Rows:
    """Constraints as rows c(x) = 0 and d(x) <= 0, equalities first in each constraint.

    Args:
        constraints: one or a sequence of Equal, AtMost, SciPy's NonlinearConstraint or
            LinearConstraint, and dictionaries ``{"type": "eq" | "ineq", "fun": ..., "args": ...}``
            ("ineq" means fun >= 0, as in SciPy).
        vectorized: whether functions take (K, D).

    Attributes:
        equal: (m,) which rows are equalities; known once values were asked for.
        sizes: rows of each constraint.
    """

    def __init__(self, constraints: Any, vectorized: bool) -> None:
        if not isinstance(constraints, (list, tuple)):
            constraints = [constraints]
        self._parts = [_part(k, item) for k, item in enumerate(constraints)]
        self._vectorized = vectorized
        self.equal = np.zeros(0, bool)
        self.sizes: list[int] = []

    def __call__(self, x: Array) -> Array:
        """(K, m) rows at the points x (K, D); NaN stays NaN."""
        columns, equal = [], []
        self.sizes = []
        for k, (function, low, high) in enumerate(self._parts):
            values = self._values(k, function, x)
            try:
                low_, high_ = (np.broadcast_to(b, values.shape[1]) for b in (low, high))
            except ValueError:
                raise InputError(
                    f"constraint {k} gives {values.shape[1]} values, its bounds hold"
                    f" {max(np.size(low), np.size(high))}"
                ) from None
            same = low_ == high_
            above, below = ~same & np.isfinite(high_), ~same & np.isfinite(low_)
            parts = [
                values[:, same] - low_[same],
                values[:, above] - high_[above],
                low_[below] - values[:, below],
            ]
            columns += parts
            equal += [np.full(part.shape[1], which == 0) for which, part in enumerate(parts)]
            self.sizes.append(sum(part.shape[1] for part in parts))
        self.equal = np.concatenate(equal)
        return np.concatenate(columns, axis=1)

    def violation(self, rows: Array) -> Array:
        """(K, m) by how much each row is not met."""
        return np.where(self.equal, np.abs(rows), np.maximum(rows, 0.0))

    def split(self, rows: Array) -> list[Array]:
        """(m,) numbers as one array for each constraint; none while the rows are not known."""
        if rows.size != sum(self.sizes):
            return []
        return np.split(rows, np.cumsum(self.sizes)[:-1])

    def _values(self, k: int, function: Callable[..., Any], x: Array) -> Array:
        name = f"the values of constraint {k}"
        if self._vectorized or isinstance(function, _Linear):
            values = real_array(name, function(x.copy()))
            if values.ndim == 1:
                values = values[:, None]
            if values.ndim != 2 or len(values) != len(x):
                raise InputError(
                    f"constraint {k} must give ({len(x)},) or ({len(x)}, m) values,"
                    f" got shape {values.shape}"
                )
            return values
        rows = [np.array(real_array(name, function(point))) for point in x.copy()]
        if any(row.ndim > 1 or row.shape != rows[0].shape for row in rows):
            raise InputError(
                f"constraint {k} must give a number or (m,) values,"
                f" got shapes {sorted({row.shape for row in rows})}"
            )
        return np.array(rows).reshape(len(x), -1)


class _Linear:
    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix

    def __call__(self, x: Array) -> Array:
        if self.matrix.shape[1] != x.shape[1]:
            raise InputError(
                f"a linear constraint has {self.matrix.shape[1]} columns for {x.shape[1]} variables"
            )
        values: Array = np.einsum("kd,md->km", x, self.matrix)
        return values


def _part(k: int, item: Any) -> tuple[Callable[..., Any], Array, Array]:
    """One constraint as a function and its lower and upper bounds."""
    infinite = np.array(np.inf)
    if isinstance(item, Equal):
        value = _bound(k, "value", item.value)
        part = item.g, value, value
    elif isinstance(item, AtMost):
        part = item.h, -infinite, _bound(k, "bound", item.bound)
    elif isinstance(item, Mapping):
        part = _of_mapping(k, item)
    elif hasattr(item, "lb") and hasattr(item, "ub") and hasattr(item, "fun"):
        part = item.fun, _bound(k, "lb", item.lb), _bound(k, "ub", item.ub)
    elif hasattr(item, "lb") and hasattr(item, "ub") and hasattr(item, "A"):
        linear = _Linear(np.atleast_2d(_dense(k, item.A)))
        part = linear, _bound(k, "lb", item.lb), _bound(k, "ub", item.ub)
    else:
        raise InputError(
            f"constraint {k} must be Equal, AtMost, a NonlinearConstraint, a LinearConstraint or a"
            f" dictionary, got {type(item).__name__}"
        )
    if not callable(part[0]):
        raise InputError(f"constraint {k} needs a function, got {part[0]!r}")
    try:
        np.broadcast_arrays(part[1], part[2])
    except ValueError:
        raise InputError(
            f"constraint {k}: bounds of {part[1].size} and {part[2].size} numbers"
        ) from None
    if np.isnan(part[1]).any() or np.isnan(part[2]).any() or (part[1] > part[2]).any():
        raise InputError(f"constraint {k}: bounds must rise, got {part[1]} and {part[2]}")
    if (part[1] == np.inf).any() or (part[2] == -np.inf).any():
        raise InputError(f"constraint {k}: no number meets the bounds {part[1]} and {part[2]}")
    return part


def _of_mapping(k: int, item: Mapping[str, Any]) -> tuple[Callable[..., Any], Array, Array]:
    kind, function, args = item.get("type"), item.get("fun"), item.get("args", ())
    if kind not in ("eq", "ineq") or function is None or not callable(function):
        raise InputError(f'constraint {k} must have "type": "eq" or "ineq" and "fun", got {item!r}')
    zero, most = np.array(0.0), np.array(0.0 if kind == "eq" else np.inf)
    return (lambda x: function(x, *args)), zero, most


def _bound(k: int, name: str, value: ArrayLike) -> Array:
    bound = real_array(f"{name} of constraint {k}", value)
    if bound.ndim > 1:
        raise InputError(f"{name} of constraint {k} must be a number or (m,), got {bound.shape}")
    return bound


def _dense(k: int, matrix: Any) -> Array:
    if hasattr(matrix, "toarray"):
        matrix = matrix.toarray()
    return real_array(f"the matrix of constraint {k}", matrix)

"""Objects that are made of settings, in the manner of scikit-learn: solvers and optimizers."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np

__all__ = ["HasSettings"]


class HasSettings:
    """The arguments of ``__init__`` are the settings, each stored untouched under its own name.

    Example:
        >>> kv.Numerical(task="position").get_params()["task"]
        'position'
    """

    def get_params(self) -> dict[str, Any]:
        """The settings by name, as given."""
        return {name: getattr(self, name) for name in _parameters(type(self))}

    def set_params(self, **settings: Any) -> Self:
        """Change settings; a solver heeds them from its next ``fit``, an optimizer at once.

        Raises:
            TypeError: a name that is no setting; the message lists the names.
        """
        valid = tuple(_parameters(type(self)))
        for name, value in settings.items():
            if name not in valid:
                raise TypeError(
                    f"{type(self).__name__} has no setting {name!r}: it has {', '.join(valid)}"
                )
            setattr(self, name, value)
        return self

    def clone(self) -> Self:
        """A new object with the same settings and no learned state; settings in it are cloned too.

        Example:
            >>> kv.Numerical().fit(robot).clone().is_fitted
            False
        """
        settings = {name: _copied(value) for name, value in self.get_params().items()}
        fresh = type(self)(**settings)
        for name, value in settings.items():
            if getattr(fresh, name) is not value:
                raise TypeError(f"{type(self).__name__}.__init__ altered its setting {name!r}")
        return fresh

    def __sklearn_clone__(self) -> Self:
        # scikit-learn's clone asks for this: an estimator may have such an object as a setting
        return self.clone()

    def __repr__(self) -> str:
        parameters = _parameters(type(self))
        shown = ", ".join(
            f"{name}={value!r}"
            for name, value in self.get_params().items()
            if not _same(value, parameters[name].default)
        )
        return f"{type(self).__name__}({shown})"

    def __eq__(self, other: object) -> bool:
        # same class, same settings; what was learned is not compared
        if type(other) is not type(self):
            return NotImplemented
        theirs = other.get_params()  # type of self, just checked
        return all(_same(value, theirs[name]) for name, value in self.get_params().items())


def _parameters(cls: type[HasSettings]) -> Mapping[str, Any]:
    from inspect import signature  # a tenth of NumPy's own import

    return signature(cls).parameters


def _copied(value: Any) -> Any:
    """A setting for a clone: nothing mutable is shared, what has settings loses its state."""
    if isinstance(value, HasSettings):
        return value.clone()
    if isinstance(value, (list, tuple)) and any(isinstance(item, HasSettings) for item in value):
        return type(value)(_copied(item) for item in value)
    if value is None or isinstance(value, (str, int, float)):
        return value
    from copy import deepcopy

    return deepcopy(value)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if hasattr(one, "get_params") and not isinstance(one, (type, HasSettings)):
        # scikit-learn's estimators compare by identity
        theirs = other.get_params()
        return all(_same(value, theirs[name]) for name, value in one.get_params().items())
    if isinstance(one, (list, tuple)):
        # an array inside says neither yes nor no
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)

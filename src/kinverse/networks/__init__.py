"""Networks as scikit-learn regressors of several outputs. They know no robots.

>>> from kinverse.networks import MLP
>>> net = MLP(hidden=(40,), random_state=0).fit(X, y)
>>> net.predict(X), net.training_mse_

``save`` writes one to a file without code, ``kinverse.networks.load`` reads it. Needs the extra
"learn".
"""

import typing

from kinverse.errors import MissingExtra

__all__ = ["NAMES", "load", "make_network"]

_LAZY: dict[str, str] = {
    "Elman": "elman",
    "MLP": "mlp",
    "RBFNetwork": "rbf",
    "SwarmRBF": "swarm_rbf",
    "SwarmMLP": "swarm_mlp",
    "ANFIS": "anfis",
    "PiSigma": "pi_sigma",
    "PolynomialPerceptron": "polynomial_perceptron",
}
NAMES = tuple(_LAZY)
"""The networks by class name."""
_ELSEWHERE = {"Progress": "monitor", "load": "storage", "tune": "tuner", "windows": "elman"}


def make_network(name: str, **settings: typing.Any) -> typing.Any:
    """A network by its class name in any case: ``make_network("mlp", hidden=(30,))``.

    Raises:
        InputError: an unknown name; the message lists the names.
        MissingExtra: scikit-learn is not installed.
    """
    from kinverse.errors import InputError

    for title in NAMES:
        if isinstance(name, str) and title.lower() == name.lower():
            return __getattr__(title)(**settings)
    raise InputError(f"unknown network {name!r}: the networks are {', '.join(NAMES).lower()}")


def __getattr__(name: str) -> typing.Any:
    file = _LAZY.get(name) or _ELSEWHERE.get(name)
    if file is None:
        raise AttributeError(f"module 'kinverse.networks' has no attribute {name!r}")
    from importlib import import_module

    try:
        module = import_module(f"kinverse.networks.{file}")
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] == "sklearn":
            raise MissingExtra(f"kinverse.networks.{name}", "learn") from error
        raise
    value = globals()[name] = getattr(module, name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *NAMES, *_ELSEWHERE})

"""Correct the real arm: models of its tool's error by measurements, and joint angles for it.

>>> from kinverse import calibration
>>> measured = calibration.read_measurements("measurements.csv", robot)
>>> model = calibration.GeometricErrorModel(robot).fit(measured.q, measured.error)
>>> solver = calibration.Compensated(kv.Analytic(), model).fit(robot)

An error is what the real tool misses the robot's forward kinematics by: measured minus computed.
Models are scikit-learn regressors from joint values to errors. Needs the extra "learn".
"""

import typing

from kinverse.errors import MissingExtra

__all__ = ["MODELS"]

_LAZY: dict[str, str] = {
    "FourierErrorModel": "fourier",
    "PolynomialErrorModel": "polynomial",
    "GeometricErrorModel": "geometric",
    "ZeroErrorModel": "zero",
    "Stack": "stack",
}
MODELS = tuple(_LAZY)
"""The models by class name."""
_ELSEWHERE = {
    "Choice": "choice",
    "Compensated": "compensated",
    "Measurements": "measurements",
    "choose": "choice",
    "load": "storage",
    "make_model": "named",
    "measured_robot": "storage",
    "read_measurements": "measurements",
    "save": "storage",
    "tool_error": "tool_errors",
}


def __getattr__(name: str) -> typing.Any:
    file = _LAZY.get(name) or _ELSEWHERE.get(name)
    if file is None:
        raise AttributeError(f"module 'kinverse.calibration' has no attribute {name!r}")
    from importlib import import_module

    try:
        module = import_module(f"kinverse.calibration.{file}")
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] == "sklearn":
            raise MissingExtra(f"kinverse.calibration.{name}", "learn") from error
        raise
    value = globals()[name] = getattr(module, name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *MODELS, *_ELSEWHERE})

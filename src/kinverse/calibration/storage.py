"""Error models in files: .npz without pickled objects, a JSON header with a version inside."""

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks.storage import read, write
from kinverse.robot import Robot

__all__ = ["load", "measured_robot", "save"]

Arrays = dict[str, NDArray[Any]]

KIND = "error model"
TEXTS = ("kinds", "name", "source_note")
LISTS = ("joint_names", "unverified")
ROBOT = ("frames", "limits", "source", "multiplier", "offset")


def save(model: Any, path: "str | os.PathLike[str]", robot: Robot | None = None) -> None:
    """Write a fitted error model to a .npz file that holds no code; ``load`` reads it.

    Args:
        model: of ``kinverse.calibration``.
        path: the file.
        robot: against which the errors were measured, its tool included; None: the file does not
            tell.

    Raises:
        InputError: not fitted, or no model of this package.
        OSError: the file cannot be written.

    Example:
        >>> save(model, "kr16_errors.npz", robot)
    """
    arrays: Arrays = {}
    header = {"model": _packed(model, "", arrays), "robot": _packed(robot, "robot", arrays)}
    write(path, KIND, header, arrays)


def load(path: "str | os.PathLike[str]") -> Any:
    """The model that ``save`` wrote.

    Raises:
        InputError: no model file, truncated, altered, of another version or kind, or with pickled
            objects (which could hold code).
        FileNotFoundError: no such file.

    Example:
        >>> load("kr16_errors.npz").predict(q)
    """
    return _part(path, "model")


def measured_robot(path: "str | os.PathLike[str]") -> Robot | None:
    """The robot that ``save`` was told; None if it was told none.

    Raises:
        InputError, FileNotFoundError: as :func:`load`.

    Example:
        >>> measured_robot("kr16_errors.npz").name
        'kr16'
    """
    robot: Robot | None = _part(path, "robot")
    return robot


def _part(path: "str | os.PathLike[str]", name: str) -> Any:
    header, arrays = read(path, KIND)
    try:
        return _unpacked(header[name] if name == "model" else header.get(name), arrays)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise InputError(f"{path}: the header of this model is not as it was written") from error


def _packed(value: Any, at: str, arrays: Arrays) -> Any:
    """Anything a model is made of as JSON, arrays aside under their place in the tree."""
    from kinverse.calibration import MODELS

    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray) and value.dtype != object:
        arrays[at] = value
        return {"array": at}
    if isinstance(value, Robot):
        for name in ROBOT:
            arrays[f"{at}.{name}"] = getattr(value, name)
        return {"robot": at, **{name: _plain(getattr(value, name)) for name in TEXTS + LISTS}}
    if isinstance(value, (list, tuple)):
        items = [_packed(item, f"{at}.{k}", arrays) for k, item in enumerate(value)]
        return {type(value).__name__: items}
    name = type(value).__name__
    if name not in MODELS or not hasattr(value, "get_params"):
        raise InputError(
            f"{value!r} cannot be saved without code: the models of kinverse.calibration can"
            f" ({', '.join(MODELS)})"
        )
    learned = {key: item for key, item in vars(value).items() if _is_learned(key)}
    if not at and not learned:
        raise InputError(f"this {name} is not fitted: there is nothing to save")
    state = {"settings": value.get_params(deep=False), "learned": learned}
    return {
        "model": name,
        **{
            group: {key: _packed(item, f"{at}.{key}", arrays) for key, item in items.items()}
            for group, items in state.items()
        },
    }


def _unpacked(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    if "robot" in value:
        at = value["robot"]
        stored: dict[str, Any] = {name: arrays[f"{at}.{name}"] for name in ROBOT}
        return Robot(**stored, **{name: value[name] for name in TEXTS + LISTS})
    for kind in (list, tuple):
        if kind.__name__ in value:
            return kind(_unpacked(item, arrays) for item in value[kind.__name__])
    import kinverse.calibration as calibration

    if value["model"] not in calibration.MODELS:
        raise KeyError(value["model"])
    settings = {key: _unpacked(item, arrays) for key, item in value["settings"].items()}
    model = getattr(calibration, value["model"])(**settings)
    for key, item in value["learned"].items():
        if not _is_learned(key):
            raise KeyError(key)
        setattr(model, key, _unpacked(item, arrays))
    return model


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _is_learned(name: str) -> bool:
    # names of columns are arrays of objects; a model that is loaded does without them
    return name.endswith("_") and not name.startswith("_") and name != "feature_names_in_"

"""Networks in files: .npz without pickled objects, a JSON header with a version inside."""

import hashlib
import io
import json
import os
import uuid
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["VERSION", "load", "pack", "read", "save", "unpack", "write"]

VERSION = 1
"""Of the file's form; another one is refused by name."""
MOST_BYTES = 2**30
"""A file that would unpack to more is refused."""
HEADER = "header"

Arrays = dict[str, NDArray[Any]]


def save(network: Any, path: "str | os.PathLike[str]") -> None:
    """Write a fitted network of ``kinverse.networks``; see ``NetworkRegressor.save``."""
    header, arrays = pack(network)
    write(path, "network", header, arrays)


def load(path: "str | os.PathLike[str]") -> Any:
    """The network that ``save`` wrote.

    Raises:
        InputError: no model file, truncated, altered, of another version or kind, or with pickled
            objects (which could hold code).
        FileNotFoundError: no such file.

    Example:
        >>> networks.load("arm.npz").predict(X)
    """
    header, arrays = read(path, "network")
    return unpack(header, arrays, str(path))


def pack(network: Any) -> tuple[dict[str, Any], Arrays]:
    """A network as a header of plain values and its arrays."""
    from kinverse.networks import NAMES

    name = type(network).__name__
    if name not in NAMES:
        raise InputError(
            f"{name} cannot be saved without code: the networks of kinverse.networks can"
            f" ({', '.join(NAMES)})"
        )
    learned = {key: value for key, value in vars(network).items() if _is_learned(key)}
    if not learned:
        raise InputError(f"this {name} is not fitted: there is nothing to save")
    arrays: Arrays = {}
    # a callback belongs to the session that trained
    settings = {k: v for k, v in network.get_params(deep=False).items() if k != "callback"}
    header = {
        "network": name,
        "settings": {key: _plain(name, key, value) for key, value in settings.items()},
        "learned": {key: _stored(name, key, value, arrays) for key, value in learned.items()},
    }
    return header, arrays


def unpack(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], where: str) -> Any:
    """The network that ``pack`` took apart."""
    import kinverse.networks as networks

    name = header.get("network")
    if name not in networks.NAMES:
        raise InputError(f"{where}: unknown network {name!r}: {', '.join(networks.NAMES)}")
    try:
        settings = {key: _restored(value) for key, value in header["settings"].items()}
        network = getattr(networks, name)(**settings)
        for key, value in header["learned"].items():
            if not _is_learned(key):
                raise KeyError(key)
            setattr(network, key, _fetched(value, arrays))
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{where}: the header of this {name} is not as it was written") from error
    _try_out(network, where)
    return network


def _try_out(network: Any, where: str) -> None:
    """Refuse parts that do not belong together, before anybody trusts them."""
    try:
        n, m = network.n_features_in_, network.n_outputs_
        sizes = {name: len(getattr(network, name)) for name in ("input_unit_", "input_middle_")}
        good = all(size == n for size in sizes.values())
        good &= len(network.output_unit_) == len(network.output_middle_) == m
        counted = network._count_parameters(n, m)
        if hasattr(network, "weights_") and hasattr(network, "layers_") and counted:
            good &= len(network.weights_) == counted
        rows = network._predicted(np.zeros((1, n)))
        good &= rows.shape == (1, m) and bool(np.isfinite(rows).all())
    except Exception as error:  # whatever a file can get wrong
        raise InputError(f"{where}: the parts of this network do not belong together") from error
    if not good:
        raise InputError(f"{where}: the parts of this network do not belong together")


def write(
    path: "str | os.PathLike[str]", kind: str, header: Mapping[str, Any], arrays: Arrays
) -> None:
    """Write a header and arrays at once: a file of this name is whole or is not there."""
    target = Path(path)
    full = {"kinverse": VERSION, "kind": kind, **header}
    text = json.dumps({**full, "digest": _digest(full, arrays)}, allow_nan=False).encode()
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **{HEADER: np.frombuffer(text, np.uint8), **arrays})  # type: ignore[arg-type]
    partial = target.with_name(f".{target.name}.{uuid.uuid4().hex}.part")
    try:
        partial.write_bytes(buffer.getvalue())
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def read(path: "str | os.PathLike[str]", kind: str) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a file of this kind; everything is checked before anything is used."""
    where = str(path)
    with open(path, "rb") as file:
        data = file.read(MOST_BYTES + 1)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(item.file_size for item in archive.infolist()) > MOST_BYTES:
                raise InputError(f"{where}: would unpack to more than {MOST_BYTES} bytes")
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays: Arrays = {name: archive[name] for name in archive.files}
        header = json.loads(arrays.pop(HEADER).tobytes())
    except InputError:
        raise
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise InputError(f"{where}: refused, it holds pickled objects") from error
        raise InputError(f"{where}: no model file, or a damaged one ({error})") from error
    except (zipfile.BadZipFile, KeyError, EOFError, OSError, NotImplementedError) as error:
        raise InputError(f"{where}: no model file, or a truncated one ({error})") from error
    except Exception as error:  # zlib and struct have errors of their own
        raise InputError(f"{where}: a damaged model file ({error})") from error
    if not isinstance(header, dict) or "kinverse" not in header:
        raise InputError(f"{where}: no model file of kinverse")
    if header["kinverse"] != VERSION:
        raise InputError(
            f"{where}: model file version {header['kinverse']!r}, this kinverse reads {VERSION}"
        )
    if header.get("kind") != kind:
        raise InputError(f"{where}: holds a {header.get('kind')}, not a {kind}")
    if header.pop("digest", None) != _digest(header, arrays):
        raise InputError(f"{where}: altered, this is not what was written")
    return header, arrays


def _digest(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    """What tells an altered file from a whole one; who alters it on purpose can make another."""
    digest = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape};".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _is_learned(name: str) -> bool:
    return name.endswith("_") and not name.startswith("_")


def _plain(network: str, key: str, value: Any) -> Any:
    """A setting as JSON; tuples and objects made of settings are marked."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (np.random.Generator, np.random.RandomState)):
        return None  # the stream that trained belongs to the session, as callbacks do
    if isinstance(value, (tuple, list)):
        return {"tuple": [_plain(network, key, item) for item in value]}
    from kinverse.optimizers import Optimizer
    from kinverse.optimizers.registry import METHODS

    if isinstance(value, Optimizer):
        short = {title: name for name, (title, _) in METHODS.items()}.get(type(value).__name__)
        if short is not None:
            settings = {k: _plain(network, k, v) for k, v in value.get_params().items()}
            return {"optimizer": short, "settings": settings}
    raise InputError(f"{network}: the setting {key}={value!r} cannot be saved without code")


def _restored(value: Any) -> Any:
    if isinstance(value, dict) and "tuple" in value:
        return tuple(_restored(item) for item in value["tuple"])
    if isinstance(value, dict) and "optimizer" in value:
        from kinverse.optimizers import make_optimizer

        settings = {key: _restored(item) for key, item in value["settings"].items()}
        return make_optimizer(value["optimizer"], **settings)
    return value


def _stored(network: str, key: str, value: Any, arrays: Arrays) -> Any:
    """A learned attribute: plain, or the name of its array."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray) and all(isinstance(item, str) for item in value.flat):
        value = value.astype(str)  # names of columns
    if isinstance(value, np.ndarray) and value.dtype != object:
        arrays[key] = value
        return {"array": key}
    if isinstance(value, list) and all(isinstance(item, np.ndarray) for item in value):
        for k, item in enumerate(value):
            arrays[f"{key}{k}"] = item
        return {"arrays": [f"{key}{k}" for k in range(len(value))]}
    raise InputError(f"{network}: what was learned as {key} cannot be saved without code")


def _fetched(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    if isinstance(value, dict) and "array" in value:
        return arrays[value["array"]]
    if isinstance(value, dict) and "arrays" in value:
        return [arrays[name] for name in value["arrays"]]
    return value

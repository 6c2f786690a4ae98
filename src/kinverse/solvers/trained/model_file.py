"""Trained solvers in files: networks, examples, settings and whose robot they are for."""

import hashlib
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.networks import storage
from kinverse.robot import Robot

__all__ = ["KIND", "load", "save", "solver_name"]

Arrays = dict[str, NDArray[Any]]

KIND = "trained solver"
OF_THE_SESSION = {"network", "keep", "progress", "features", "virtual"}
"""Settings that are not written as they are: functions stay behind, objects have their own form."""


def save(solver: Any, path: "str | os.PathLike[str]") -> None:
    """Write a fitted ``Learned`` or ``Fusion``; see ``Learned.save``."""
    if not solver.is_fitted:
        name = type(solver).__name__
        raise InputError(f"this {name} is not fitted: call {name}(...).fit(robot) first")
    robot = solver.robot_
    used = solver.trained_with_
    settings = {key: value for key, value in used.items() if key not in OF_THE_SESSION}
    network = used["network"]
    given = {
        "network": network is not None,
        "seeded": network is not None and network.get_params().get("random_state") is not None,
    }
    parts: list[Any] = []
    arrays: Arrays = {}
    for k, expert in enumerate(solver.experts_):
        head, own = expert.packed()
        parts.append(head)
        arrays |= {f"{k}.{name}": array for name, array in own.items()}
    header = {
        "solver": type(solver).__name__,
        "robot": robot.name,
        "fingerprint": fingerprint(robot),
        "settings": {key: _plain(key, value) for key, value in settings.items()},
        "branch_labels": list(solver.branch_labels_),
        "branches": solver.branches_.tolist(),
        "given": given,
        "experts": parts,
    }
    storage.write(path, KIND, header, arrays)


def load(cls: Any, path: "str | os.PathLike[str]", robot: Robot) -> Any:
    """The solver that ``save`` wrote, bound to its robot; nothing is half loaded."""
    if not isinstance(robot, Robot):
        raise InputError(
            f"robot must be a kinverse.Robot (see kinverse.load), got {type(robot).__name__}"
        )
    header, arrays = storage.read(path, KIND)
    where = str(path)
    _check_names(cls.__name__, header, robot, where)
    try:
        solver = cls(**header["settings"])
        solver._restore(
            robot,
            header["branch_labels"],
            header["branches"],
            [(head, _of_part(arrays, k)) for k, head in enumerate(header["experts"])],
            header["given"],
            where,
        )
        _try_out(solver, where)
    except InputError as error:
        said = str(error)
        raise InputError(said if said.startswith(where) else f"{where}: {said}") from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"{where}: its parts do not belong together ({error!r})") from error
    return solver


def _try_out(solver: Any, where: str) -> None:
    """Refuse examples and networks of another size than the robot's."""
    n = solver.robot_.dof
    for expert in solver.experts_:
        q, T = expert.neighbours.q, expert.neighbours.T
        if not len(q) or q.shape != (len(T), n) or T.shape != (len(T), 4, 4):
            raise InputError(f"{where}: examples of shape {q.shape}, {T.shape} for {n} joints")
    solver.predict(solver.experts_[0].neighbours.T[:1])


def solver_name(path: "str | os.PathLike[str]") -> str:
    """The class of the solver in a file, "Learned" or "Fusion"; raises as ``load`` does."""
    name = storage.read(path, KIND)[0].get("solver")
    return str(name)


def fingerprint(robot: Robot) -> str:
    """A number made of everything that joint values depend on; the names do not count."""
    digest = hashlib.sha256(robot.kinds.encode())
    for array in (robot.frames, robot.limits, robot.source, robot.multiplier, robot.offset):
        # another machine's sine may differ in the last bit
        digest.update((np.round(np.asarray(array, dtype=np.float64), 9) + 0.0).tobytes())
    return digest.hexdigest()


def _check_names(name: str, header: Mapping[str, Any], robot: Robot, where: str) -> None:
    if header.get("solver") != name:
        raise InputError(f"{where}: holds a {header.get('solver')}, not a {name}")
    if header.get("fingerprint") != fingerprint(robot):
        theirs = header.get("robot")
        raise InputError(
            f"{where}: trained for the robot {theirs!r}, not for {robot.name!r}"
            if theirs != robot.name
            else f"{where}: trained for another {robot.name!r}: its geometry, limits or tool differ"
        )


def _of_part(arrays: Mapping[str, NDArray[Any]], k: int) -> Arrays:
    start = f"{k}."
    return {key[len(start) :]: value for key, value in arrays.items() if key.startswith(start)}


def _plain(key: str, value: Any) -> Any:
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (tuple, list)):
        return [_plain(key, item) for item in value]
    raise InputError(f"the setting {key}={value!r} cannot be saved without code")

"""ANFIS on the two arms of document 004 that it tells configurations for, errors on test rows."""

import time
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.report import Line
from kinverse.bench.run import Spread

__all__ = ["anfis"]

Array = NDArray[np.float64]

TRAINING, TEST = 700, 300
"""Rows, as in the document."""
SEED = 7_500
DRAWS = 5
NEIGHBOURS = 10
READINGS = {"bells, order 0": ("gbell", 0), "Gaussians, order 1": ("gauss", 1)}
"""Of the document's configuration: what its tables count, and what its text says."""
RIDGES = (1e-6, 1e-4, 1e-2, 1.0, 100.0)
PLAIN = 1e-8
"""The ridge that stands for plain least squares."""
PRINTED = {"rules": 343, "linear": 343, "nonlinear": 63, "nodes": 734}
"""Document 004, tables 7.5 and 7.9; seven sets for each of three inputs."""


class Case(NamedTuple):
    """Rows to learn from."""

    robot: kv.Robot
    label: str
    note: str


def anfis(quick: bool) -> list[Line]:
    """Test errors of both readings of the printed configuration, joint by joint.

    The inputs are positions only, as in the document. A position does not determine the joints:
    no network gets below their scatter at a position. The mean of the nearest training rows, which
    cannot be wild, stands beside as a rough measure of it; the mean of all rows knows no position.
    """
    sets, epochs, draws = (3, 2, 2) if quick else (7, 10, DRAWS)
    lines = _counts()
    for case in _cases():
        data = [_rows(case.robot, SEED + k) for k in range(draws)]
        for label, estimator in _predictors(sets, epochs).items():
            lines += _errors(case, label, estimator, data)
    return lines


def _cases() -> list[Case]:
    scara, revolute = kv.load("adept_one"), kv.load("pioneer2")
    limits = np.array(scara.limits)
    limits[1, 0] = 0.0
    free = "a position has two elbows, and leaves joint 4 free"
    return [
        Case(scara, "SCARA", free),
        Case(scara.with_limits(limits), "SCARA, joint 2 >= 0", "only joint 4 is left free"),
        Case(revolute, "5R", "a position leaves two of five joints free, in several branches"),
    ]


def _rows(robot: kv.Robot, seed: int) -> tuple[Array, Array]:
    """Positions (N, 3) and joints (N, n) of random joints inside the limits, test rows last."""
    q = robot.random(TRAINING + TEST, np.random.default_rng(seed))
    return robot.fk(q)[:, :3, 3], q


def _predictors(sets: int, epochs: int) -> dict[str, Any]:
    """What is compared, not fitted yet."""
    from sklearn.dummy import DummyRegressor
    from sklearn.model_selection import GridSearchCV, ShuffleSplit
    from sklearn.multioutput import MultiOutputRegressor
    from sklearn.neighbors import KNeighborsRegressor

    from kinverse.networks import ANFIS

    fifth = ShuffleSplit(n_splits=1, test_size=0.2, random_state=1)
    out: dict[str, Any] = {}
    for label, (mf, order) in READINGS.items():
        network = ANFIS(sets, mf=mf, order=order, ridge=PLAIN, max_iter=epochs)
        out[f"{label}, ridge {PLAIN:g}"] = network
        # for each joint its own, as each has a model of its own
        out[f"{label}, ridge by a held-out fifth"] = MultiOutputRegressor(
            GridSearchCV(network, {"ridge": RIDGES}, cv=fifth)
        )
    out[f"mean of {NEIGHBOURS} nearest training rows"] = KNeighborsRegressor(NEIGHBOURS)
    out["mean of all training rows"] = DummyRegressor()
    return out


def _errors(case: Case, label: str, estimator: Any, data: list[tuple[Array, Array]]) -> list[Line]:
    """Root mean square errors on the test rows, a line for each joint."""
    from sklearn.base import clone

    test, training = [], []
    start = time.process_time()
    for X, q in data:
        with warnings.catch_warnings():
            # the document's own configuration has more parameters than patterns
            warnings.filterwarnings("ignore", message=".*by heart")
            fitted = clone(estimator).fit(X[:TRAINING], q[:TRAINING])
        off = fitted.predict(X) - q
        training.append(_rms(off[:TRAINING]))
        test.append(_rms(off[TRAINING:]))
    seconds = (time.process_time() - start) / len(data)
    section = (
        f"ANFIS on positions, {TRAINING} training and {TEST} test rows: test RMS, median and range"
        f" of {len(data)} draws"
    )
    lines = []
    for joint, (errors, known) in enumerate(
        zip(np.transpose(test), np.transpose(training), strict=True)
    ):
        unit = "m" if case.robot.kinds[joint] == "P" else "rad"
        note = f"training {np.median(known):.3g}"
        if joint == 0:
            note += f"; {seconds:.2g} s of CPU; {case.note}"
        what = f"{label}: joint {joint + 1} [{unit}]"
        lines.append(Line(section, case.label, what, Spread.of(errors.tolist()), note=note))
    return lines


def _rms(off: Array) -> Array:
    out: Array = np.sqrt(np.mean(off * off, axis=0))
    return out


def _counts() -> list[Line]:
    """What the printed configuration counts, against what the two readings have."""
    from kinverse.networks.fuzzy.rules import Rules

    lines = []
    for label, (mf, order) in READINGS.items():
        rules = Rules((7, 7, 7), mf, order)
        found = {
            "rules": rules.n_rules,
            "linear": rules.n_linear,
            "nonlinear": rules.n_nonlinear,
            "nodes": rules.n_nodes,
        }
        agree = sum(found[name] == count for name, count in PRINTED.items())
        told = ", ".join(f"{name} {count}" for name, count in found.items())
        bound = len(PRINTED) if order == 0 else None
        lines.append(
            Line(
                "ANFIS, configuration of document 004",
                label,
                f"counts that are the printed {', '.join(map(str, PRINTED.values()))}",
                Spread.exact(agree),
                bound,
                note=told,
            )
        )
    return lines

"""Cells: networks from positions to joints, trained and tested on rows that never mix."""

import time
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.studies.cell import Row
from kinverse.studies.jha2015.networks.sets import draw, output_names

__all__ = ["SWARM_METHODS", "train_network"]

Array = NDArray[np.float64]

SWARM_METHODS = ("pso", "ga", "gwo", "tlbo", "cibo")
POPULATION = 100
NETWORK_SEED = 59


def train_network(
    geometry_name: str,
    network: str,
    hidden: str,
    train: int,
    test: int,
    seeds: int,
    budget: int,
    rate: float = 0.1,
    momentum: float = 0.9,
    keep: bool = False,
    swept: bool = False,
) -> list[Row]:
    """A network trained on fresh rows with each seed.

    Args:
        geometry_name: see ``geometry``.
        network: "gdm" (back-propagation with momentum), "lm" (Levenberg-Marquardt), "lbfgs",
            "ppn", "pi-sigma", "anfis-gbell-0:1e-2" (sets, order, ridge), or the swarm that finds
            the weights.
        hidden: units of the hidden layers, "10-10"; the degree of "ppn", the order of "pi-sigma".
        train: rows to train on.
        test: further rows to test on.
        seeds: how many.
        budget: epochs, of a swarm networks tried.
        rate: of "gdm".
        momentum: of "gdm".
        keep: also rows of the first seed with ``kind`` "pair" (wanted and predicted joints on the
            test rows) and "epoch" (training errors).
        swept: see ``draw``.

    Returns:
        Rows of each seed and joint with ``kind`` "error": ``training`` and ``test`` mean squared
        errors [rad^2 or m^2], ``r_training`` and ``r_test`` correlations, CPU ``seconds`` of the
        training. Errors are None where the training diverged.
    """
    rows: list[Row] = []
    names = output_names(geometry_name)
    for seed in range(seeds):
        X, q = draw(geometry_name, train + test, seed, swept)
        net = _network(network, hidden, budget, rate, momentum, NETWORK_SEED + seed)
        start = time.process_time()
        with warnings.catch_warnings():
            # the thesis' own numbers: few rows for many weights, rates that diverge
            warnings.simplefilter("ignore")
            net.fit(X[:train], q[:train])
            guess = net.predict(X)
        seconds = time.process_time() - start
        for k, name in enumerate(names):
            told = _errors(q[:, k], guess[:, k], train)
            rows.append({"kind": "error", "seed": seed, "output": name, **told, "seconds": seconds})
        if keep and seed == 0:
            rows += _pairs(names, q[train:], guess[train:]) + _epochs(names, net)
    return rows


def _errors(wanted: Array, guess: Array, train: int) -> Row:
    out: Row = {}
    for part, rows in (("training", slice(None, train)), ("test", slice(train, None))):
        a, b = wanted[rows], guess[rows]
        fine = bool(np.isfinite(b).all())
        out[part] = float(np.mean((a - b) ** 2)) if fine else None
        moved = fine and np.ptp(b) > 0.0
        out[f"r_{part}"] = float(np.corrcoef(a, b)[0, 1]) if moved else None
    return out


def _pairs(names: list[str], wanted: Array, guess: Array) -> list[Row]:
    return [
        {"kind": "pair", "output": name, "wanted": a, "predicted": b}
        for name, left, right in zip(names, wanted.T.tolist(), guess.T.tolist(), strict=True)
        for a, b in zip(left, right, strict=True)
    ]


def _epochs(names: list[str], net: Any) -> list[Row]:
    return [
        {"kind": "epoch", "epoch": k, "output": name, "training": value}
        for k, errors in enumerate(net.training_mse_.tolist(), start=1)
        for name, value in zip(names, errors, strict=True)
    ]


def _network(
    network: str, hidden: str, budget: int, rate: float, momentum: float, seed: int
) -> Any:
    from kinverse.networks import ANFIS, MLP, PiSigma, PolynomialPerceptron, SwarmMLP
    from kinverse.optimizers import make_optimizer

    units = tuple(int(part) for part in hidden.split("-"))
    if network == "gdm":
        return MLP(
            units,
            trainer="gdm",
            learning_rate=rate,
            momentum=momentum,
            max_iter=budget,
            random_state=seed,
        )
    if network in ("lm", "lbfgs"):
        return MLP(units, trainer=network, max_iter=budget, random_state=seed)
    if network == "ppn":
        return PolynomialPerceptron(units[0])
    if network == "pi-sigma":
        return PiSigma(units[0], max_iter=budget, random_state=seed)
    if network.startswith("anfis"):
        reading, ridge = network.split(":")
        _, mf, order = reading.split("-")
        return ANFIS(units[0], mf=mf, order=int(order), ridge=float(ridge), max_iter=budget)
    return SwarmMLP(
        units,
        optimizer=make_optimizer(network, population=POPULATION),
        encoding="matrix",
        max_evals=budget,
        random_state=seed,
    )

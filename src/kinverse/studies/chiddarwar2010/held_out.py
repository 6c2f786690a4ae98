"""Networks of increments and of absolute angles, and a constant, on patterns they have not met."""

import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.learning import DataSet, IncrementalPairs, PoseFeatures
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.networks import CONSTANT, FAMILY, NETWORKS, make_network
from kinverse.studies.chiddarwar2010.path import answer_rows, timed, way_of
from kinverse.studies.chiddarwar2010.poses import arm, draw
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["ABSOLUTE", "POSES", "SPLITS", "START", "held_out_errors"]

Array = NDArray[np.float64]
Patterns = tuple[Array, Array]

POSES, SPLIT, SAMPLES, START = 41_000, 42_000, 43_000, 44_000
"""First seeds of the 70 poses, of splits, of the absolute networks' samples, of first weights."""
SPLITS = ("pose", "pair")
ABSOLUTE = "sample"
"""The split of absolute networks: every pattern has a pose of its own."""


def held_out_errors(robot: str, half: float, seed: int, epochs: int) -> list[Row]:
    """Train every network on 70 % of the patterns of a region, test it on the others.

    Args:
        robot: its name.
        half: of the region [deg].
        seed: numbers region, poses, splits and first weights.
        epochs: of the MLPs.

    Returns:
        A row of part "rms" for each network, split and joint [deg] with the times [s]; of the
        absolute networks also "path" and "pose", what they say of the path of this region.
    """
    given = arm(robot)
    data = draw(given, int(parameter("poses")), half, seed, POSES + seed)
    rows: list[Row] = []
    for split in SPLITS:
        pairs = IncrementalPairs(
            PoseFeatures("xyz+rpy"),
            split=split,
            test_fraction=_test_share(),
            random_state=SPLIT + seed,
        ).make(data.q, data.T)
        for name in (*NETWORKS, CONSTANT):
            rows += _fitted("fusion", name, split, pairs.train, pairs.test, epochs, seed)[1]
    features, train, test = _absolute_patterns(robot, half, seed)
    way = way_of(given, half, seed)
    inputs = features.transform(way.T)
    patterns = train.inverse(features), test.inverse(features)
    for name in (*NETWORKS, CONSTANT):
        network, more = _fitted("absolute", name, ABSOLUTE, *patterns, epochs, seed)
        said, spent = timed(partial(network.predict, inputs))
        rows += more + answer_rows(way, f"{FAMILY[name]} absolute", name, "directly", said, spent)
    return [{"robot": robot, "half_deg": half, "seed": seed, **row} for row in rows]


def _absolute_patterns(robot: str, half: float, seed: int) -> tuple[PoseFeatures, DataSet, DataSet]:
    """Fitted features, and as many samples as the document has patterns: to train, to test."""
    samples = draw(arm(robot), int(parameter("patterns")), half, seed, SAMPLES + seed)
    train, test = samples.split(_test_share(), random_state=SPLIT + seed)
    return PoseFeatures("xyz+rpy").fit(train.T), train, test


def _test_share() -> float:
    return 1.0 - parameter("training share") / 100.0


def _fitted(
    form: str, name: str, split: str, train: Patterns, test: Patterns, epochs: int, seed: int
) -> tuple[Any, list[Row]]:
    """The network, trained, and its errors joint by joint."""
    network = make_network(name, epochs, START + seed)
    start = time.process_time()
    network.fit(*train)
    trained = time.process_time()
    error = network.predict(test[0]) - test[1]
    tested = time.process_time()
    rows: list[Row] = []
    for joint, value in enumerate(np.sqrt(np.mean(error**2, axis=0)).tolist(), start=1):
        row: Row = {"part": "rms", "method": f"{FAMILY[name]} {form}", "network": name}
        row |= {"split": split, "joint": joint, "rms_deg": float(np.degrees(value))}
        row |= {"patterns": len(train[0]), "tested": len(test[0])}
        row |= {"training_s": trained - start, "testing_s": tested - trained}
        rows.append(row)
    return network, rows

"""Networks of increments and of absolute angles, held against patterns they have not met."""

import time

import numpy as np
from numpy.typing import NDArray

from kinverse.learning import DataSet, IncrementalPairs, PoseFeatures
from kinverse.studies.cell import Row
from kinverse.studies.chiddarwar2010.networks import FAMILY, NETWORKS, make_network
from kinverse.studies.chiddarwar2010.poses import arm, draw
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["ABSOLUTE", "POSES", "SPLITS", "START", "absolute_patterns", "held_out_errors"]

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
        A row for each network, split and joint with its rms error [deg] and the times [s].
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
        rows += _tried("fusion", split, pairs.train, pairs.test, epochs, seed)
    features, train, test = absolute_patterns(robot, half, seed)
    rows += _tried(
        "absolute", ABSOLUTE, train.inverse(features), test.inverse(features), epochs, seed
    )
    return [{"robot": robot, "half_deg": half, "seed": seed, **row} for row in rows]


def absolute_patterns(robot: str, half: float, seed: int) -> tuple[PoseFeatures, DataSet, DataSet]:
    """Fitted features, and as many samples as the document has patterns: to train, to test."""
    samples = draw(arm(robot), int(parameter("patterns")), half, seed, SAMPLES + seed)
    train, test = samples.split(_test_share(), random_state=SPLIT + seed)
    return PoseFeatures("xyz+rpy").fit(train.T), train, test


def _test_share() -> float:
    return 1.0 - parameter("training share") / 100.0


def _tried(
    form: str, split: str, train: Patterns, test: Patterns, epochs: int, seed: int
) -> list[Row]:
    rows: list[Row] = []
    for name in NETWORKS:
        network = make_network(name, epochs, START + seed)
        start = time.process_time()
        network.fit(*train)
        trained = time.process_time()
        error = network.predict(test[0]) - test[1]
        tested = time.process_time()
        rms = np.degrees(np.sqrt(np.mean(error**2, axis=0)))
        for joint, value in enumerate(rms.tolist(), start=1):
            row: Row = {"method": f"{FAMILY[name]} {form}", "network": name, "split": split}
            row |= {"joint": joint, "rms_deg": value, "patterns": len(train[0])}
            row |= {"tested": len(test[0])}
            row |= {"training_s": trained - start, "testing_s": tested - trained}
            rows.append(row)
    return rows

"""A network of document 003, trained and tried: what it is told, how far off it is, what it tracks.

Training and test rows are drawn together, then split once; trajectories are in neither.
"""

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.learning import DataSet, PoseFeatures, VirtualVector, regression_table, sample
from kinverse.networks import MLP
from kinverse.studies.cell import Row
from kinverse.studies.habibkhah2021.arm import (
    CLASSES,
    IN_RANGES,
    TRAJECTORIES,
    Trajectory,
    arm,
    parameter,
    trajectory,
)

__all__ = ["BANDS", "POSITION_ONLY", "train_network"]

Array = NDArray[np.float64]

POSITION_ONLY = "none"
"""Stands for no virtual vector: the network is told x and y."""
FIRST_DATA, FIRST_NETWORK = 31_000, 32_000
"""First seeds of what is drawn and of what networks start from."""
BANDS = (0.0, 60.0, 90.0, 120.0, 180.0)
"""Of the elbow's turn abs(theta2) [deg]: 0 is the arm stretched, 180 folded."""
SHOWN = 240
"""Samples of a trajectory that are kept for pictures."""


def train_network(virtual: str, trainer: str, epochs: int, seed: int, details: bool) -> list[Row]:
    """Train on the document's 7000 samples, test on 1500 others, follow the four trajectories.

    Args:
        virtual: a kind of ``VirtualVector``, or "none".
        trainer: of ``MLP``.
        epochs: at most.
        seed: numbers the samples, the split and the first weights.
        details: also rows for pictures.

    Returns:
        Rows of several parts, told apart by their column "part": one "run"; "joint"; "class" for
        each trajectory and kind of pose; "band"; with details "epoch", "test" and "sample".
    """
    robot = arm()
    count = int(parameter("training samples") + parameter("test samples"))
    data = sample(robot, count, random_state=FIRST_DATA + seed)
    share = parameter("test samples") / count
    train, test = data.split(share, random_state=FIRST_DATA + seed)
    inputs = _Inputs(
        PoseFeatures("xy").fit(train.T),
        None if virtual == POSITION_ONLY else VirtualVector(virtual),
    )
    net = MLP(
        (int(parameter("hidden neurons")),),
        trainer=trainer,
        max_iter=epochs,
        damping="nielsen",
        random_state=FIRST_NETWORK + seed,
    )
    X, y = train.inverse(*inputs)
    start = time.process_time()
    net.fit(X, y)
    spent = time.process_time() - start
    rows = _test_rows(robot, net, test, inputs, details)
    rows[0].update(
        trainer=trainer, epochs=int(net.n_iter_), seconds=spent, training_rms_deg=_rms(net, X, y)
    )
    for number in TRAJECTORIES:
        rows += _track(robot, net, inputs, number, details)
    if details:
        mse = np.degrees(np.degrees(net.training_mse_.mean(axis=1)))
        rows += [
            {"part": "epoch", "epoch": k, "mse_deg2": float(value)}
            for k, value in enumerate(mse, start=1)
        ]
    return rows


class _Inputs(NamedTuple):
    """What a network is told: features of the pose, and a virtual vector or None."""

    features: PoseFeatures
    virtual: VirtualVector | None

    def of_poses(self, robot: kv.Robot, T: Array) -> Array:
        """X (N, k) of poses T (N, 4, 4)."""
        X = self.features.transform(T)
        if self.virtual is None:
            return X
        known = self.virtual.of_pose(robot, T)
        assert known is not None  # the planar kinds are told by the pose
        return np.hstack([X, known])


def _rms(net: MLP, X: Array, y: Array) -> float:
    return float(np.degrees(np.sqrt(np.mean((net.predict(X) - y) ** 2))))


def _off(robot: kv.Robot, q: Array, T: Array) -> Array:
    """Distances (N,) of the tool at joint values q (N, 3) from poses T (N, 4, 4)."""
    return np.asarray(np.linalg.norm(robot.fk(q)[:, :2, 3] - T[:, :2, 3], axis=1))


def _test_rows(
    robot: kv.Robot, net: MLP, test: DataSet, inputs: _Inputs, details: bool
) -> list[Row]:
    X, y = test.inverse(*inputs)
    said = net.predict(X)
    table = regression_table(y, said, robot.joint_names)
    off = _off(robot, said, test.T)
    rows: list[Row] = [
        {
            "part": "run",
            "test_rms_deg": _rms(net, X, y),
            "tool_median": float(np.median(off)),
            "tool_95": float(np.quantile(off, 0.95)),
        }
    ]
    for name, r, mse in zip(table.names, table.r, table.mse, strict=True):
        rows.append(
            {"part": "joint", "joint": name, "r": r, "rms_deg": float(np.degrees(mse**0.5))}
        )
    if details:
        for true, predicted in zip(np.degrees(y), np.degrees(said), strict=True):
            row: Row = {"part": "test"}
            for k, name in enumerate(robot.joint_names):
                row[f"{name}_true_deg"] = round(float(true[k]), 3)
                row[f"{name}_predicted_deg"] = round(float(predicted[k]), 3)
            rows.append(row)
    return rows


def _track(robot: kv.Robot, net: MLP, inputs: _Inputs, number: int, details: bool) -> list[Row]:
    path = trajectory(number)
    said = net.predict(inputs.of_poses(robot, path.T))
    off = _off(robot, said, path.T)
    rows: list[Row] = []
    for kind in CLASSES:
        here = path.kind == kind
        if here.any():
            row: Row = {"part": "class", "trajectory": number, "kind": kind, **_spread(off[here])}
            row["finished"] = _finished(robot, said[here], path.T[here])
            rows.append(row)
    rows += _bands(path, off, number)
    if details:
        for i in np.unique(np.linspace(0, len(off) - 1, SHOWN).round().astype(int)):
            row = {"part": "sample", "trajectory": number, "kind": str(path.kind[i])}
            row |= {"x": float(path.T[i, 0, 3]), "y": float(path.T[i, 1, 3])}
            row |= {f"q{k + 1}": float(said[i, k]) for k in range(3)}
            rows.append(row)
    return rows


def _spread(off: Array) -> Row:
    return {
        "points": len(off),
        "median": float(np.median(off)),
        "95 %": float(np.quantile(off, 0.95)),
        "largest": float(off.max()),
    }


def _finished(robot: kv.Robot, q: Array, T: Array) -> int:
    """How many predictions full Newton steps bring to the pose, limits left out."""
    newton = kv.Numerical(task="planar", method="newton_raphson", limits="ignore").fit(robot)
    return int(newton.solve(T, q_seed=q).ok.sum())


def _bands(path: Trajectory, off: Array, number: int) -> list[Row]:
    """Where the closed form has an answer inside (4), by how far its elbow is from stretched."""
    inside = path.kind == IN_RANGES
    elbow = np.degrees(np.abs(path.q[inside, 1]))
    rows: list[Row] = []
    for low, high in zip(BANDS[:-1], BANDS[1:], strict=True):
        here = (elbow >= low) & (elbow < high)
        if here.any():
            row: Row = {"part": "band", "trajectory": number, "from_deg": low, "to_deg": high}
            row["least_deg"] = float(elbow.min())
            rows.append(row | _spread(off[inside][here]))
    return rows

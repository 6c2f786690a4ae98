"""The thesis' seven arms through quaternion-vector pairs and matrices: agreement and operations."""

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench import cases, oracle
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.studies.forms import Matrix, Pair
from kinverse.studies.operation_counts import Count, count_forms, count_forward, count_inverse
from kinverse.studies.pair_kinematics import THESIS_ROBOTS, inverse
from kinverse.studies.zero_arm import zero_arm

__all__ = ["quaternion_pairs"]

Array = NDArray[np.float64]

MOST_SLOPE = 10.0
"""Joint motion for a unit of tool motion, lengths in arm lengths, up to which 1e-12 is asked:
rounding grows with it."""


def quaternion_pairs(quick: bool) -> list[Line]:
    """Branches by pairs against those by matrices, and what each takes, counted."""
    lines = [_operations("any transform", count) for count in count_forms()]
    for name in THESIS_ROBOTS:
        robot = kv.load(name)
        q, T = cases.reachable(robot, 20 if quick else 500, seed=10)
        lines += _agreement(name, robot, q, T)
        lines += [_operations(name, count) for count in count_forward(robot, q[0])]
        # the pose with the most branches: elsewhere some are not computed
        counts = [count_inverse(robot, pose) for pose in T[:40]]
        full = max(counts, key=lambda pair: (pair[0].solutions, _sum(pair[0])))
        lines += [_operations(name, count) for count in full]
    return lines


def _agreement(name: str, robot: kv.Robot, q: Array, T: Array) -> list[Line]:
    arm = zero_arm(robot)
    J = oracle.jacobian(robot, q)
    J[:, :3] /= np.linalg.norm(robot.frames[:, :3, 3], axis=1).sum()
    sizes = np.linalg.svd(J, compute_uv=False)
    slope = 1.0 / np.maximum(sizes[:, min(robot.dof, 6) - 1], 1e-300)
    worst, poses, branches, uneven = 0.0, 0, 0, 0
    for pose in T[slope <= MOST_SLOPE]:
        by_matrix: Array = np.array(inverse(arm, Matrix.of(pose))).reshape(-1, robot.dof)
        by_pair: Array = np.array(inverse(arm, Pair.of(pose))).reshape(-1, robot.dof)
        uneven += len(by_matrix) != len(by_pair)
        if not len(by_matrix) or not len(by_pair):
            continue
        poses += 1
        branches += len(by_pair)
        worst = max(
            worst,
            *(float(oracle.wrapped(robot, by_matrix - row).min()) for row in by_pair),
            *(float(oracle.wrapped(robot, by_pair - row).min()) for row in by_matrix),
        )
    head = ("quaternion pairs", name)
    note = f"{branches} branches of {poses} poses with slopes up to {MOST_SLOPE:g}"
    return [
        Line(*head, "poses with other branches", Spread.exact(uneven), 0.0, False),
        Line(*head, "pairs off matrices, rad or m", Spread.exact(worst), 1e-12, False, note),
    ]


def _operations(subject: str, count: Count) -> Line:
    parts = [
        f"{number} {kind.replace('_', ' ')}" for kind, number in asdict(count.operations).items()
    ]
    if count.solutions:
        parts.append(f"{count.solutions} branches")
    note = ", ".join([*(part for part in parts if part[:2] != "0 "), f"{count.scalars} scalars"])
    what = f"{count.what} by {count.form}: operations"
    return Line("quaternion pairs", subject, what, Spread.exact(_sum(count)), note=note)


def _sum(count: Count) -> int:
    return sum(asdict(count.operations).values())

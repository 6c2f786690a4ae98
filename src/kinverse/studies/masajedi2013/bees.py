"""The bees algorithm at 21 accuracy points: position only as printed, full pose, every branch."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import judge
from kinverse.optimizers import BeesAlgorithm
from kinverse.paths import named_samples
from kinverse.studies.cell import Row
from kinverse.studies.data import printed
from kinverse.studies.masajedi2013.branches import ROBOT, branches_along

__all__ = ["bees_along", "bees_near", "colony", "every_branch"]

Array = NDArray[np.float64]
NEAR = np.radians(10.0)
"""Half the box of a search that starts from the last answer; branches step by 5.4 deg at most."""


def colony(radius_unit: str = "range") -> BeesAlgorithm:
    """The bees algorithm with the settings that section 6 prints.

    Args:
        radius_unit: "range" (radius is a share of each joint's range) or "own" (radians): the
            document prints none.
    """
    rows = printed("masajedi2013", "parameters")
    value = {row["parameter"]: row["value"] for row in rows.rows}
    recruits = int(value["recruited around best"])
    return BeesAlgorithm(
        population=int(value["scout bees"]),
        sites=int(value["best selected patches m"]),
        elites=int(value["elite patches e"]),
        elite_recruits=recruits,
        recruits=recruits,
        radius=float(value["patch radius"]),
        radius_unit=radius_unit,
        abandon_after=int(value["ni (abandon after)"]),
    )


def bees_along(
    path: str, task: str, radius_unit: str, evaluations: int, polish: bool, seed: int
) -> list[Row]:
    """A row for each accuracy point, each searched by itself.

    Args:
        path: of ``kinverse.paths.named_samples``.
        task: "position" (equation 31, the squared distance) or "pose".
        radius_unit: see ``colony``.
        evaluations: of a search.
        polish: whether a descent ends it.
        seed: of the bees.
    """
    robot = kv.load(ROBOT)
    T = named_samples(path).T
    norm: dict[str, Any] = {"norm": "squared"} if task == "position" else {}
    solver = kv.Swarm(
        optimizer=colony(radius_unit), task=task, max_evals=evaluations, polish=polish, **norm
    ).fit(robot)
    answers = solver.solve(T, rng=seed)
    q = answers.nearest(np.zeros(6))  # polished: one answer a pose
    q = np.where(np.isnan(q), answers.stats.best_q, q)
    far, turned = judge.errors(T, judge.pose(robot, q))
    known, labels = branches_along(T)
    gaps = judge.apart(q[None], known)
    rows: list[Row] = []
    for i in range(len(T)):
        nearest = int(gaps[:, i].argmin())
        rows.append(
            {
                "point": i + 1,
                "position error, mm": 1e3 * float(far[i]),
                "rotation error, deg": float(np.degrees(turned[i])),
                "nearest branch": labels[nearest],
                "from the nearest branch, deg": float(np.degrees(gaps[nearest, i])),
                **_joints(q[i]),
            }
        )
    return rows


def bees_near(path: str, branch: str, evaluations: int, seed: int) -> Array:
    """Joint values (21, 6) [rad] that stay on a branch: each searched about the one before.

    The box of a search is ``NEAR`` about the last point's answer, the first point's about the
    closed form; full pose, no descent.
    """
    robot = kv.load(ROBOT)
    T = named_samples(path).T
    known, labels = branches_along(T)
    low, high = robot.limits.T
    q = np.empty((len(T), robot.dof))
    last = known[labels.index(branch), 0]
    for i, pose in enumerate(T):
        box = np.stack([np.maximum(last - NEAR, low), np.minimum(last + NEAR, high)], axis=1)
        bees = kv.Swarm(optimizer=colony(), max_evals=evaluations, polish=False)
        answers = bees.fit(robot.with_limits(box)).solve(pose, rng=seed)
        q[i] = last = answers.stats.best_q[0]
    return q


def every_branch(path: str, seed: int) -> list[Row]:
    """All solutions that bees find at each point: searches that shun what is known, polished."""
    robot = kv.load(ROBOT)
    T = named_samples(path).T
    known, labels = branches_along(T)
    answers = kv.Swarm(optimizer=colony(), all_branches=True).fit(robot).solve(T, rng=seed)
    rows: list[Row] = []
    for i in range(len(T)):
        found = answers[i].q
        gaps = judge.apart(found[:, None], known[None, :, i])
        for branch, label in enumerate(labels):
            k = int(gaps[:, branch].argmin())
            gap = float(np.degrees(gaps[k, branch]))
            rows.append({"point": i + 1, "branch": label, "gap, deg": gap, **_joints(found[k])})
    return rows


def _joints(q: Array) -> Row:
    return {f"theta{k + 1}, deg": float(np.degrees(value)) for k, value in enumerate(q)}

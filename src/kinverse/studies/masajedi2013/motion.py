"""The arm in the multibody simulator along a path: section 7, figures 7 to 9."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse import judge
from kinverse.paths import JointCurve, deviation, named_path, named_samples, simulate
from kinverse.paths.links import default_links
from kinverse.studies.cell import Row
from kinverse.studies.masajedi2013.bees import bees_along, bees_near
from kinverse.studies.masajedi2013.branches import ROBOT, branches_along

__all__ = [
    "APART",
    "BY_ITSELF",
    "DEGREES",
    "LARGEST",
    "ON",
    "RMS",
    "SECONDS",
    "blend",
    "interpolated",
    "joint_forces",
    "moved",
    "times",
]

Array = NDArray[np.float64]

SECONDS = 2.0
"""Of a motion from rest to rest; the document prints no time."""
SHOWN = 81
"""Instants of a motion that are kept for pictures."""
GRAVITY = np.array([0.0, 0.0, -9.81])
DRIVES = ("joints", "tool")
EVALUATIONS = 20_000
DEGREES = (3, 5, 6)
"""Of splines; the document's "6th order interpolation" is 5 or 6."""
ON = "bees on "
BY_ITSELF = ("bees, full pose", "bees, position only")
RMS, LARGEST = "error, rms, mm", "error, largest, mm"
TURNED = "rotation error, largest, deg"
APART = "joints against inverse kinematics, deg"
UNKNOWN: Row = dict.fromkeys((RMS, LARGEST, TURNED, APART))
"""Of a motion that there is not."""


def times(count: int) -> Array:
    """Instants (count,) [s] at which points evenly along the path are passed, rest to rest."""
    t = np.linspace(0.0, 1.0, 20_001)
    return np.asarray(SECONDS * np.interp(np.linspace(0.0, 1.0, count), blend(t), t))


def blend(t: Array) -> Array:
    """Share of the path after the share t of the time: no speed or acceleration at its ends."""
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t * t))


def interpolated(path: str, source: str, seed: int) -> list[Row]:
    """How far the tool strays between accuracy points if the joints are splines through them.

    A row for each degree of ``DEGREES``; arguments as of ``moved``.
    """
    robot, (T, s), line = kv.load(ROBOT), named_samples(path), named_path(path)
    q = _joint_values(path, source, seed)
    at_points, _ = judge.errors(T, judge.pose(robot, q))
    return [
        {
            "path": path,
            "joint values": source,
            "degree": degree,
            "at the points, largest, mm": 1e3 * float(at_points.max()),
            "between them, largest, mm": 1e3
            * float(deviation(robot, JointCurve(s, q, degree=degree), line).position),
        }
        for degree in DEGREES
    ]


def moved(path: str, source: str, seed: int) -> list[Row]:
    """A simulation for each drive: a row "motion", rows "joint", rows "instant" for pictures.

    What jumps from branch to branch holds no tool to a path: joints are driven only.

    Args:
        path: of ``kinverse.paths.named_samples``.
        source: a branch of the closed form; "bees on BRANCH", each point searched about the last;
            "bees, full pose" or "bees, position only", each point searched by itself.
        seed: of the bees.

    Raises:
        MissingExtra: MuJoCo is not installed.
    """
    q = _joint_values(path, source, seed)
    drives = DRIVES[:1] if source in BY_ITSELF else DRIVES
    return [row for drive in drives for row in _moved(path, source, q, drive)]


def _moved(path: str, source: str, q: Array, drive: str) -> list[Row]:
    robot, line = kv.load(ROBOT), named_path(path)
    head: Row = {"path": path, "joint values": source, "drive": drive}
    try:
        run = simulate(robot, times(len(q)), q, drive=drive)
    except kv.InputError as error:
        # the spline between joint values that jump leaves the limits: there is no such motion
        return [head | {"kind": "motion", "ran to the end": False, "reason": str(error)} | UNKNOWN]
    wanted = line(line.length * blend(run.t / SECONDS))
    away, turned = judge.errors(wanted, run.T)
    force = joint_forces(robot, run.t, run.q, run.constraint_force[:, :3])
    motion: Row = {
        **head,
        "kind": "motion",
        "ran to the end": run.ok,
        "reason": run.reason,
        RMS: _finite(1e3 * np.sqrt(np.mean(away**2))),
        LARGEST: _finite(1e3 * away.max()),
        TURNED: _finite(np.degrees(turned.max())),
        APART: _finite(np.degrees(np.abs(run.q - run.q_wanted).max())),
    }
    joints: list[Row] = [
        {
            **head,
            "kind": "joint",
            "joint": k + 1,
            **_effort("force", "N", force[:, k]),
            **_effort("torque", "Nm", run.torque[:, k]),
        }
        for k in range(robot.dof)
    ]
    instants: list[Row] = [
        {
            "drive": drive,
            "kind": "instant",
            "t": float(run.t[i]),
            "away": _finite(1e3 * away[i]),
            **{f"force {k + 1}": _finite(force[i, k]) for k in range(robot.dof)},
        }
        for i in np.linspace(0, len(run.t) - 1, SHOWN).round().astype(int)
    ]
    return [motion, *joints, *instants]


def joint_forces(robot: kv.Robot, t: Array, q: Array, at_tool: Array) -> Array:
    """Force that each joint passes on (N, n) [N]: what moves and carries all links behind it.

    Newton's second law for the links of ``default_links``, accelerations by differences.

    Args:
        robot: the arm.
        t: (N,) instants [s].
        q: (N, n) joint values [rad].
        at_tool: (N, 3) force on the tool from outside [N].
    """
    stops = judge.frames(robot, q)[:-1]
    step = float(t[1] - t[0])
    passed = np.empty((robot.dof, len(t), 3))
    behind = -at_tool
    for k in range(robot.dof - 1, -1, -1):
        link, frame = default_links(robot)[k], stops[k]
        centre = frame[:, :3, 3] + frame[:, :3, :3] @ link.centre
        acceleration = np.zeros_like(centre)
        acceleration[1:-1] = np.diff(centre, 2, axis=0) / step**2
        behind = behind + link.mass * (acceleration - GRAVITY)
        passed[k] = behind
    return np.asarray(np.linalg.norm(passed, axis=2).T)


def _joint_values(path: str, source: str, seed: int) -> Array:
    """At the accuracy points (21, 6) [rad]."""
    known, labels = branches_along(named_samples(path).T)
    if source in labels:
        return np.asarray(known[labels.index(source)])
    if source.startswith(ON):
        return bees_near(path, source.removeprefix(ON), EVALUATIONS, seed)
    task = "pose" if source == "bees, full pose" else "position"
    rows = bees_along(path, task, "range", EVALUATIONS, False, seed)
    values = [[float(row[f"theta{k}, deg"] or 0.0) for k in range(1, 7)] for row in rows]
    return np.radians(values)


def _effort(name: str, unit: str, values: Array) -> Row:
    """Peak, rms and their ratio: 1 where the load never changes."""
    peak = float(np.abs(values).max())
    rms = float(np.sqrt(np.mean(values**2)))
    return {
        f"{name}, peak, {unit}": _finite(peak),
        f"{name}, rms, {unit}": _finite(rms),
        f"{name}, uniformity": _finite(rms / peak) if peak > 0.0 else None,
    }


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None

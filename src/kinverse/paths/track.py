"""Follow a path: every solution of every sample, and the cheapest way through them."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.joint_path import JointPath
from kinverse.paths.tracking.branches import branches_of
from kinverse.paths.tracking.closed import check_closed, held_at_ends, not_closed
from kinverse.paths.tracking.gaps import gaps
from kinverse.paths.tracking.layers import Keep, Layers, kept
from kinverse.paths.tracking.middle import nearest_middle
from kinverse.paths.tracking.problem import Problem, Steps
from kinverse.paths.tracking.refine import refined
from kinverse.paths.tracking.samples import COUNT, as_samples
from kinverse.paths.tracking.search import Found, follow
from kinverse.ranking import turning
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.solvers import Solver

__all__ = ["track"]

Array = NDArray[np.float64]

MAX_STEP = 0.5
"""Largest joint step [rad or m] where none is given."""
MOST_STEP = 3.14
"""A turning joint must step by less than half a turn: else which way it went would be open."""
MOST_WINDINGS = 4096
"""Windings a solution may have."""
METRICS = ("max", "l2", "time")


def track(
    robot: Robot,
    path: Any,
    solver: str | Solver = "auto",
    metric: str = "max",
    q_start: ArrayLike | None = None,
    keep: Keep | None = None,
    *,
    max_step: ArrayLike | None = None,
    max_velocity: ArrayLike | None = None,
    task: str = "pose",
    tolerance: float | None = None,
    samples: int = COUNT,
    closed: bool = False,
) -> JointPath:
    """Joint values that follow a path without a jump: the cheapest of all ways.

    Every solution of every sample, with all windings inside the limits, is a node; steps join
    nodes of neighbouring samples whose joints are at most ``max_step`` apart and which lie on the
    same side of the singularities (on the same branch, in closed forms). Only where every way
    breaks may a step change sides, and only if the path itself leads over: followed closer and
    closer, to a part in 8,000 of the step, no joint has to move aside; of poses, if half-way the
    tool is no further from their chord than an arc through them; or within ``tolerance``. Dynamic
    programming in the native core (Bellman 1957; for redundant arms over a grid of the free
    parameter, made finer about the best way: Shin & McKay 1986) finds the way with fewest breaks,
    of these the one with the least sum of ``metric``. Without ``q_start`` it begins
    nearest the middle of the limits, of all ways that differ by whole turns.

    Samples without a solution, and breaks, are gaps with reasons; all else is tracked. A break is
    explained by what would remove it: samples in between, a predicate or limits not heeded; if
    none of these does, it is a singularity.

    Args:
        robot: the robot.
        path: (N, 4, 4) poses [m] in order; a ``Path``, or what its ``sample`` returns.
        solver: "auto" (closed forms, else searches), or a name or solver as in ``kinverse.solve``.
            Searches (of any solver but ``Analytic``) find some of the branches only. With a
            ``calibration.Compensated`` all is about the real tool: poses, steps that pass a
            singularity, and what the tolerance is held against.
        metric: what a step costs: "max", its largest joint movement; "l2", the root of the sum of
            squares; "time", the largest movement over ``max_velocity``.
        q_start: (n,) joint values [rad or m] before the path. Where solutions of the first sample
            are within ``max_step`` of it, the path begins with one of these, else there is a break
            before sample 0; the way to the first sample counts in ``cost``.
        keep: predicate, joint values (M, n) to a mask (M,) of those to keep, such as a
            ``collision.Capsules``. It is asked at the samples, not between them.
        max_step: largest step of each joint, a number or (n,) [rad or m], for turning joints below
            3.14; None: 0.5.
        max_velocity: (n,) or a number [rad/s or m/s], for the metric "time".
        task: which part of the poses must hold; a solver object brings its own.
        tolerance: largest distance [m] of the tool from the path between samples, joints moving in
            a straight line and the parameter evenly; samples are added until it is kept, a path's
            ``breaks`` first. It needs a ``Path``: poses say nothing of what is between them.
        samples: of a ``Path``, at first.
        closed: the joints are to end where they begin, which those of an arm with joints to spare
            need not do. The path must end with its first pose. Ways from 16 solutions of it (if
            need be from 32 more of a grid) are looked at; if none comes back, the last gap is
            NOT_CLOSED.

    Returns:
        A ``JointPath``.

    Raises:
        InputError: an argument that cannot be used; fewer than two poses; a pose that is not
            rigid or not finite (its row is named).
        NoClosedForm: "analytic" knows no family for this robot.
        TypeError: complex, object or text arrays.

    Example:
        >>> joint_path = track(kv.load("kr16"), T, max_step=0.2)
        >>> joint_path.q, joint_path.gaps
    """
    if not isinstance(robot, Robot):
        raise InputError(f"robot must be a kinverse.Robot, got {type(robot).__name__}")
    if keep is not None and not callable(keep):
        raise InputError(f"keep must be a function of joint values (M, n), got {keep!r}")
    if tolerance is not None and not 0.0 < _number("tolerance", tolerance) < np.inf:
        raise InputError(f"tolerance must be positive and finite [m], got {tolerance}")
    if isinstance(solver, Solver) and task not in ("pose", solver._check_settings().task):
        raise InputError("task belongs to the solver object: set it there, not in track")
    _check_windings(robot)
    steps = _steps(robot, metric, max_step, max_velocity, q_start)
    poses = as_samples(path, tolerance, samples)
    problem = Problem(branches_of(robot, solver, task), poses, steps, keep, tolerance or 0.0)
    if closed:
        check_closed(poses)
    every = problem.layers()
    layers, found = _followed(problem, every)
    held = None
    if closed and not found.breaks and (found.row >= 0).all():
        middle = nearest_middle(problem, layers, found)
        held = held_at_ends(problem, every, layers, middle)
    search = partial(_followed, is_held=held is not None)
    if held is not None:
        layers, found = search(problem, held)
    deviation = float("nan")
    if tolerance is not None:
        problem, layers, found, deviation = refined(problem, layers, found, tolerance, search)
    found = nearest_middle(problem, layers, found)
    joint_path = _joint_path(problem, layers, found, deviation, tolerance)
    if closed:
        more = not_closed(robot, found.q, bool(joint_path.gaps))
        joint_path = replace(joint_path, gaps=joint_path.gaps + more)
    return joint_path


def _followed(problem: Problem, layers: Layers, is_held: bool = False) -> tuple[Layers, Found]:
    """The best way; for a redundant arm by values of its free parameter ever closer about it.

    Of layers that are held the first and the last get no more rows.
    """
    best = _finer(problem, *follow(problem, layers), is_held)
    step = getattr(problem.branches, "step", 0.0)
    limit = problem.steps.max_step
    if best[1].breaks and (limit < 4.0 * step).any():
        # the grid is too coarse for the largest step: reach over it at first
        wide = replace(problem.steps, max_step=np.minimum(np.maximum(limit, 4.0 * step), MOST_STEP))
        other = _finer(problem, *follow(replace(problem, steps=wide), layers), is_held)
        if other[1].breaks < best[1].breaks:
            best = other
    return best


def _finer(problem: Problem, layers: Layers, found: Found, is_held: bool) -> tuple[Layers, Found]:
    level = 0
    ends = [0, -1] if is_held else []
    while True:
        about = found.q.copy()
        about[ends] = np.nan  # nothing is added where joint values are not known
        more = problem.branches.finer(problem.samples.T, about, level)
        if more is None:
            return layers, found
        more = kept(problem.robot, more, problem.keep)
        at = np.flatnonzero(found.row >= 0)
        rows = found.row[at]
        more = more.with_rows(
            at, found.q[at], layers.branch[rows], layers.side[rows], layers.fixed[rows]
        )
        layers = replace(more, status=layers.status, removed=layers.removed)
        layers, found = follow(problem, layers)
        level += 1


def _joint_path(
    problem: Problem, layers: Layers, found: Found, deviation: float, tolerance: float | None
) -> JointPath:
    ok = found.row >= 0
    ends = np.flatnonzero(~found.linked | ~ok)
    runs = zip(ends, np.append(ends[1:], len(ok)), strict=True)
    return JointPath(
        robot=problem.robot,
        T=problem.samples.T,
        q=found.q,
        branch=np.where(ok, layers.branch[found.row] if len(layers.q) else -1, -1),
        ok=ok,
        cost=found.cost,
        intervals=tuple((int(a), int(b)) for a, b in runs if ok[a]),
        gaps=gaps(problem, layers, found),
        s=problem.samples.s,
        branch_labels=problem.branches.branch_labels,
        deviation=deviation,
        tolerance=float("nan") if tolerance is None else tolerance,
    )


def _steps(
    robot: Robot,
    metric: str,
    max_step: ArrayLike | None,
    max_velocity: ArrayLike | None,
    q_start: ArrayLike | None,
) -> Steps:
    if metric not in METRICS:
        raise InputError(f"unknown metric {metric!r}: the metrics are {', '.join(METRICS)}")
    limit = _per_joint(robot, "max_step", MAX_STEP if max_step is None else max_step)
    wide = np.flatnonzero(turning(robot) & (limit >= MOST_STEP))
    if len(wide):
        raise InputError(
            f"max_step of joint {robot.joint_names[wide[0]]!r} must be below {MOST_STEP} rad, got"
            f" {limit[wide[0]]:g}: with half a turn, which way it went would be open"
        )
    if (metric == "time") != (max_velocity is not None):
        raise InputError('max_velocity goes with metric="time", and the other way round')
    weight = np.ones(robot.dof)
    if max_velocity is not None:
        weight = 1.0 / _per_joint(robot, "max_velocity", max_velocity)
    start = None
    if q_start is not None:
        start = se3.as_joints(q_start, robot.dof, "q_start", bound=se3.MOST_SEED)
        if start.ndim != 1:
            raise InputError(f"q_start must have shape ({robot.dof},), got {start.shape}")
        low, high = robot.limits.T
        out = np.flatnonzero((start < low - LIMIT_SLACK) | (start > high + LIMIT_SLACK))
        if len(out):
            name = robot.joint_names[out[0]]
            raise InputError(f"q_start: joint {name!r} at {start[out[0]]:g} is outside its limits")
    return Steps(limit, weight, metric == "l2", start)


def _per_joint(robot: Robot, name: str, value: ArrayLike) -> Array:
    given = se3.as_real(value, name)
    if given.shape not in ((), (robot.dof,)):
        raise InputError(f"{name} must be a number or ({robot.dof},), got {given.shape}")
    values = np.ascontiguousarray(np.broadcast_to(given, (robot.dof,)))
    bad = np.flatnonzero(~(np.isfinite(values) & (values > 0.0)))
    if len(bad):
        raise InputError(
            f"{name} must be positive and finite, got {values[bad[0]]:g} for joint"
            f" {robot.joint_names[bad[0]]!r}"
        )
    return values


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise InputError(f"{name} must be a number, got {value!r}")
    return float(value)


def _check_windings(robot: Robot) -> None:
    low, high = robot.limits.T
    count = np.where(turning(robot), np.floor((high - low) / (2.0 * np.pi)) + 1.0, 1.0)
    if count.prod() > MOST_WINDINGS:
        wide = [name for name, n in zip(robot.joint_names, count, strict=True) if n > 2]
        raise InputError(
            f"a solution would have {count.prod():g} windings, more than {MOST_WINDINGS}: narrow"
            f" the limits of {', '.join(wide) or 'the joints'}"
        )

"""The contract of a solver as checks that any solver can be run through.

The idea is scikit-learn's ``check_estimator``: who writes a solver need not know every rule, the
checks do. Each is a function of (solver, case) whose name says what it holds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels, se3
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solutions import Solutions, Status
from kinverse.solvers._base import Solver
from kinverse.table import PER_INTERVAL, PER_POSE, PER_SOLUTION

__all__ = ["CHECKS", "Case", "check_solver", "make_case", "widened"]

Array = NDArray[np.float64]

MANY = 1100
"""Poses that enter native threads and packs: the cores split batches from 1024 poses on."""

VARIED = 53
"""How many of them differ, beside those of the small case."""

PATIENCE = 0.2
"""Seconds that so many poses may take; of a slower solver the small case is all that is asked."""


@dataclass(frozen=True, slots=True)
class Case:
    """A robot, poses it can reach, and the joint values they were made of."""

    robot: Robot
    q: Array
    T: Array


def check_solver(solver: Solver, robot: Robot) -> None:
    """Run a solver through every check of the contract.

    Args:
        solver: a solver object, fitted or not; it is cloned, never changed.
        robot: a robot the solver can be fitted to.

    Raises:
        AssertionError: the name of the check and what was found.

    Example:
        >>> check_solver(kv.Numerical(task="position"), kv.load("puma560"))
    """
    for check in CHECKS:
        try:
            check(solver.clone(), make_case(robot))
        except AssertionError as failure:
            raise AssertionError(f"{check.__name__}, {solver!r}: {failure}") from failure


def make_case(robot: Robot, poses: int = 6) -> Case:
    """Poses inside the limits, the last of them at the limits' middle (often singular)."""
    q = robot.random(poses, rng=5)
    q[-1] = robot.limits.mean(axis=1)
    return Case(robot, q, robot.fk(q))


def widened(solver: Solver, case: Case) -> Case:
    """The case with more poses, repeated to at least ``MANY``, if the fitted solver is that quick.

    The poses of a 6R arm are joined by those with each joint, and all joints, at 0 (as near as the
    limits allow), many of which are singular. The number of different poses is odd, so that each
    comes to stand in every lane of a pack.
    """
    robot = case.robot
    q = np.vstack([robot.random(VARIED, rng=7), case.q])
    if robot.kinds == "RRRRRR" and robot.dof == 6:
        low, high = robot.limits.T
        zeroed = np.where(np.eye(6, dtype=bool), 0.0, q[:6])
        q = np.vstack([q, np.clip(zeroed, low, high), np.clip(np.zeros((1, 6)), low, high)])
    q = q[1 - len(q) % 2 :]
    T = robot.fk(q)
    # a few first: a slow solver must not be kept busy by the question whether it is slow
    for probe in (T[:5], T):
        if _seconds(solver, probe) * MANY / len(probe) > PATIENCE:
            return case
    times = -(-MANY // len(q))
    return Case(robot, np.tile(q, (times, 1)), np.tile(T, (times, 1, 1)))


def settings_are_stored_untouched(solver: Solver, case: Case) -> None:
    """The constructor and fit leave every setting the very object that was given."""
    before = solver.get_params()
    fresh = type(solver)(**before)
    for moment in ("__init__", "fit"):
        for name, value in before.items():
            _hold(getattr(fresh, name) is value, f"{moment} altered the setting {name}")
        if moment == "__init__":
            extra = set(vars(fresh)) - set(before)
            _hold(not extra, f"__init__ set more than settings: {sorted(extra)}")
            fresh.fit(case.robot)


def unknown_names_are_refused(solver: Solver, case: Case) -> None:
    """An unknown keyword is a TypeError, in the constructor and in set_params."""
    settings = {**solver.get_params(), "no_such_setting": 1}
    _raises(TypeError, "an unknown keyword", type(solver), **settings)
    _raises(TypeError, "set_params of no setting", solver.set_params, no_such_setting=1)


def bad_common_settings_are_refused(solver: Solver, case: Case) -> None:
    """A wrong common setting is stored by the constructor and an InputError in fit."""
    bad = {"task": "no such task", "tol_position": -1.0, "windings": "most", "limits": "maybe"}
    for name in sorted(bad.keys() & solver.get_params().keys()):
        wrong = solver.clone().set_params(**{name: bad[name]})
        _raises(InputError, f"{name}={bad[name]!r}", wrong.fit, case.robot)
        _hold(not wrong.is_fitted, "a failed fit leaves a fitted solver")


def clone_drops_what_was_learned(solver: Solver, case: Case) -> None:
    """A clone has equal settings and is not fitted."""
    fitted = solver.fit(case.robot)
    fresh = fitted.clone()
    _hold(fresh == fitted, "the clone's settings differ")
    _hold(not fresh.is_fitted, "the clone is fitted")
    learned = [name for name in vars(fresh) if name.endswith("_")]
    _hold(not learned, f"the clone kept {learned}")
    _raises(InputError, "solve before fit", fresh.solve, case.T)


def fit_returns_the_solver_and_repeats(solver: Solver, case: Case) -> None:
    """``fit`` returns self; fitting again changes nothing."""
    _hold(solver.fit(case.robot) is solver, "fit must return the solver")
    _hold(solver.is_fitted and solver.robot_ is case.robot, "fit must bind the robot")
    first = solver.solve(case.T)
    _same_bits(first, solver.fit(case.robot).solve(case.T), "after a second fit")


def pickles_and_copies_answer_alike(solver: Solver, case: Case) -> None:
    """A fitted solver pickles and deepcopies; so do its solutions."""
    import copy
    import pickle

    solver.fit(case.robot)
    first = solver.solve(case.T)
    for name, twin in (
        ("unpickled", pickle.loads(pickle.dumps(solver))),
        ("deepcopied", copy.deepcopy(solver)),
    ):
        _hold(twin == solver, f"the {name} solver has other settings")
        _same_bits(first, twin.solve(case.T), f"from the {name} solver")
    _same_bits(first, pickle.loads(pickle.dumps(first)), "after pickling the solutions")


def shapes_follow_the_poses(solver: Solver, case: Case) -> None:
    """(4, 4) gives length 1, (N, 4, 4) gives N, (0, 4, 4) gives 0; dtypes are fixed."""
    solver.fit(case.robot)
    n = case.robot.dof
    for T, poses in ((case.T[0], 1), (case.T, len(case.T)), (case.T[:0], 0)):
        s = solver.solve(T)
        rows = len(s.q)
        _hold(len(s) == poses, f"T {T.shape} gives length {len(s)}")
        for name, shape, kind in (
            ("q", (rows, n), "f"),
            ("pose_index", (rows,), "i"),
            ("position_error", (rows,), "f"),
            ("rotation_error", (rows,), "f"),
            ("branch", (rows,), "i"),
            ("status", (poses,), "u"),
            ("count", (poses,), "i"),
            ("ok", (poses,), "b"),
        ):
            array = getattr(s, name)
            _hold(array.shape == shape, f"{name} has shape {array.shape}, not {shape}")
            _hold(array.dtype.kind == kind, f"{name} has dtype {array.dtype}")
        _hold(s.stats.best_q.shape == (poses, n), f"best_q has shape {s.stats.best_q.shape}")


def a_batch_is_its_single_poses(solver: Solver, case: Case) -> None:
    """The same bits whatever the split and the place in the batch, with and without a seed."""
    solver.fit(case.robot)
    many = widened(solver, case)
    T, poses = many.T, len(many.T)
    period = _period(T)
    for seeds in (None, case.robot.random(period, rng=6)):
        near = None if seeds is None else np.resize(seeds, (poses, case.robot.dof))
        whole = solver.solve(T, near, rng=3)
        turned = solver.solve(T[::-1], None if near is None else near[::-1], rng=3)
        for i in range(period):
            one = solver.solve(T[i], None if near is None else near[i], rng=3)
            for k in range(i, poses, period):
                _same_bits(whole[k], one, f"of pose {k}, alone and in a batch")
                _same_bits(turned[poses - 1 - k], one, f"of pose {k}, in reverse order")
        half = poses // 2
        for part in (slice(0, half), slice(half, None)):
            there = None if near is None else near[part]
            _same_bits(whole[part], solver.solve(T[part], there, rng=3), "of half a batch")


def the_same_seed_gives_the_same_bits(solver: Solver, case: Case) -> None:
    """None, an int and equal Generators repeat; other kinds of rng are refused."""
    solver.fit(case.robot)
    for make in (lambda: None, lambda: 11, lambda: np.random.default_rng(11)):
        one, two = (solver.solve(case.T, rng=make()) for _ in range(2))
        _same_bits(one, two, f"with rng={make()!r}")
    _raises(TypeError, "a text rng", solver.solve, case.T, rng="eleven")
    _raises(InputError, "a negative rng", solver.solve, case.T, rng=-1)


def arrays_of_the_caller_stay_as_they_are(solver: Solver, case: Case) -> None:
    """Poses and seeds are not written to, and need not be writable."""
    solver.fit(case.robot)
    T, q_seed = case.T.copy(), case.q.copy()
    first = solver.solve(T, q_seed)
    _hold(np.array_equal(T, case.T), "solve wrote to T")
    _hold(np.array_equal(q_seed, case.q), "solve wrote to q_seed")
    T.flags.writeable = q_seed.flags.writeable = False
    _same_bits(first, solver.solve(T, q_seed), "from read-only arrays")


def any_layout_of_memory_will_do(solver: Solver, case: Case) -> None:
    """Strided and Fortran arrays, lists, and one seed for all give the same bits."""
    solver.fit(case.robot)
    T, q_seed = case.T, case.q
    first = solver.solve(T, q_seed)
    wide = np.zeros((len(T), 8, 4))
    wide[:, ::2] = T
    _same_bits(first, solver.solve(wide[:, ::2], np.asfortranarray(q_seed)), "from strided T")
    _same_bits(first, solver.solve(np.asfortranarray(T), q_seed), "from Fortran T")
    _same_bits(first, solver.solve(T.tolist(), q_seed.tolist()), "from lists")
    one = solver.solve(T, q_seed[0])
    _same_bits(one, solver.solve(T, np.tile(q_seed[0], (len(T), 1))), "from one q_seed")


def every_solution_is_true(solver: Solver, case: Case) -> None:
    """The robot's own forward kinematics confirms each solution and its reported errors."""
    s = solver.fit(case.robot).solve(case.T)
    settings, task = solver.settings_, solver.settings_.task
    far, turned = _errors(task, case.T[s.pose_index], case.robot.fk(s.q))
    _hold(
        bool((far <= settings.tol_position * 1.001).all()),
        f"position is off by {far.max(initial=0)}",
    )
    _hold(
        bool((turned <= settings.tol_rotation * 1.001).all()),
        f"rotation is off by {turned.max(initial=0)}",
    )
    _hold(np.allclose(s.position_error, far, atol=1e-9), "position_error is not the measured one")
    _hold(
        np.allclose(s.rotation_error, turned, atol=1e-7), "rotation_error is not the measured one"
    )


def solutions_keep_the_limits(solver: Solver, case: Case) -> None:
    """Unless the limits are ignored by setting, no joint value leaves them at all."""
    s = solver.fit(case.robot).solve(case.T)
    if solver.settings_.limits == "hold":
        low, high = case.robot.limits.T
        _hold(bool(((low <= s.q) & (s.q <= high)).all()), "a solution is outside the limits")


def statuses_agree_with_counts(solver: Solver, case: Case) -> None:
    """SOLVED poses have solutions and others none; a pose that can be reached is not denied."""
    far_away = case.T.copy()
    far_away[:, :3, 3] += 1e4
    solver.fit(case.robot)
    for T, reachable in ((case.T, True), (far_away, False)):
        s = solver.solve(T)
        _hold(np.array_equal(s.ok, s.count > 0), "SOLVED must mean at least one solution")
        count = np.bincount(s.pose_index, minlength=len(s))
        _hold(np.array_equal(s.count, count), "count is not the number of solutions")
        _hold(bool((np.diff(s.pose_index) >= 0).all()), "pose_index must ascend")
        denied = s.status == Status.UNREACHABLE
        _hold(not (reachable and denied.any()), "UNREACHABLE for a pose made by robot.fk")
        _hold(reachable or not s.ok.any(), "a solution for a pose 10 km away")


def bad_input_is_refused(solver: Solver, case: Case) -> None:
    """NaN, shapes, rigidity and kinds of numbers; one bad row fails the call and is named."""
    solver.fit(case.robot)
    T, n = case.T, case.robot.dof

    def spoiled(row: int, i: int, j: int, value: float) -> Array:
        bad = T.copy()
        bad[row, i, j] = value
        return bad

    for what, bad, seed in (
        ("NaN in T", spoiled(1, 0, 3, np.nan), None),
        ("inf in T", spoiled(1, 0, 3, np.inf), None),
        ("T that is not rigid", spoiled(1, 0, 0, 3.0), None),
        ("a bad last row", spoiled(1, 3, 0, 0.5), None),
        ("a reflection", T * np.array([-1.0, 1.0, 1.0, 1.0]), None),
        ("T of the wrong shape", T[:, :3], None),
        ("T of rank 4", T[None], None),
        ("T of rank 1", T[0, 0], None),
        ("q_seed of the wrong length", T, np.zeros(n + 1)),
        ("q_seed of too few rows", T, np.zeros((len(T) - 1, n))),
        ("NaN in q_seed", T, np.full(n, np.nan)),
    ):
        _raises(InputError, what, solver.solve, bad, seed)
    for what, kind in (("complex", complex), ("object", object), ("text", str)):
        _raises(TypeError, f"{what} T", solver.solve, T.astype(kind))
        _raises(TypeError, f"{what} q_seed", solver.solve, T, case.q.astype(kind))
    try:
        solver.solve(spoiled(1, 0, 3, np.nan))
    except InputError as error:
        _hold("1" in str(error), f"the message must name the bad row: {error}")


def threads_answer_alike(solver: Solver, case: Case) -> None:
    """Calls from several threads at once, and batches split over threads, give the same bits."""
    from concurrent.futures import ThreadPoolExecutor

    solver.fit(case.robot)
    T = widened(solver, case).T
    first = solver.solve(T)
    with ThreadPoolExecutor(4) as pool:
        for other in pool.map(lambda _: solver.solve(T), range(4)):
            _same_bits(first, other, "from another thread")
    before = kernels.threads()
    try:
        kernels.set_threads(2)
        _same_bits(first, solver.solve(T), "on two native threads")
    finally:
        kernels.set_threads(before)


def solutions_are_ordered(solver: Solver, case: Case) -> None:
    """Within a pose by largest joint distance to q_seed if given, else by branch; no two alike."""
    solver.fit(case.robot)
    for i, one in enumerate(solver.solve(case.T, case.q)):
        away = np.abs(one.q - case.q[i]).max(axis=1, initial=0.0)
        _hold(bool((np.diff(away) >= -1e-12).all()), f"pose {i} is not ordered by q_seed")
    for i, one in enumerate(solver.solve(case.T)):
        _hold(bool((np.diff(one.branch) >= 0).all()), f"pose {i} is not ordered by branch")
        apart = np.abs(one.q[:, None] - one.q[None]).max(axis=2, initial=0.0)
        np.fill_diagonal(apart, 1.0)
        _hold(bool((apart > 0.9e-6).all()), f"pose {i} has one solution twice")


def results_cannot_be_changed(solver: Solver, case: Case) -> None:
    """Solutions are frozen and their arrays read-only."""
    s = solver.fit(case.robot).solve(case.T)
    for name in ("q", "pose_index", "position_error", "rotation_error", "branch", "status"):
        _hold(not getattr(s, name).flags.writeable, f"{name} can be written to")
        _raises(AttributeError, f"setting {name}", setattr, s, name, None)


CHECKS: tuple[Callable[[Solver, Case], None], ...] = (
    settings_are_stored_untouched,
    unknown_names_are_refused,
    bad_common_settings_are_refused,
    clone_drops_what_was_learned,
    fit_returns_the_solver_and_repeats,
    pickles_and_copies_answer_alike,
    shapes_follow_the_poses,
    a_batch_is_its_single_poses,
    the_same_seed_gives_the_same_bits,
    arrays_of_the_caller_stay_as_they_are,
    any_layout_of_memory_will_do,
    every_solution_is_true,
    solutions_keep_the_limits,
    statuses_agree_with_counts,
    bad_input_is_refused,
    threads_answer_alike,
    solutions_are_ordered,
    results_cannot_be_changed,
)


def _hold(condition: bool, message: str) -> None:
    # not the assert statement: python -O would turn the suite off
    if not condition:
        raise AssertionError(message)


def _raises(
    kind: type[Exception], what: str, call: Callable[..., Any], *args: Any, **keywords: Any
) -> None:
    try:
        call(*args, **keywords)
    except kind:
        return
    except Exception as error:
        message = f"{what} must raise {kind.__name__}, got {type(error).__name__}: {error}"
        raise AssertionError(message) from error
    raise AssertionError(f"{what} must raise {kind.__name__}, nothing was raised")


def _same_bits(one: Solutions, other: Solutions, where: str) -> None:
    for name in PER_SOLUTION + PER_POSE + PER_INTERVAL:
        a, b = getattr(one._table, name), getattr(other._table, name)
        same = a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
        _hold(same, f"{name} differs {where}")


def _seconds(solver: Solver, T: Array) -> float:
    spent = []
    for _ in range(2):
        start = perf_counter()
        solver.solve(T)
        spent.append(perf_counter() - start)
    return min(spent)


def _period(T: Array) -> int:
    """After how many poses a batch begins anew."""
    again = np.flatnonzero((T[1:] == T[0]).all(axis=(1, 2)))
    return int(again[0]) + 1 if len(again) else len(T)


def _errors(task: str, T: Array, found: Array) -> tuple[Array, Array]:
    """Position and rotation errors (M,) of found poses, constrained components only."""
    target = se3.nearest_rotation(T[:, :3, :3])
    offset = found[:, :3, 3] - T[:, :3, 3]
    if task == "planar":
        offset = offset[:, :2]
    log = se3.rotation_log(target @ found[:, :3, :3].transpose(0, 2, 1))
    turned = {
        "pose": np.linalg.norm(log, axis=1),
        "position": np.zeros(len(T)),
        "position_axis": 2
        * np.arcsin(np.minimum(1.0, np.linalg.norm(target[:, :, 2] - found[:, :3, 2], axis=1) / 2)),
        "planar": np.abs(log[:, 2]),
        "schoenflies": np.abs(log[:, 2]),
    }
    return np.linalg.norm(offset, axis=1), turned[task]

"""Joint values for which the real tool reaches the target."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.exceptions import NotFittedError
from sklearn.utils.validation import check_is_fitted

from kinverse import se3
from kinverse.errors import InputError
from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal, Settings, Solver
from kinverse.solvers.descent import Descent, moved
from kinverse.status import Status
from kinverse.table import PER_INTERVAL, TableLike, kept, replaced
from kinverse.verify import verify_table

__all__ = ["Compensated"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

GRID = 2.0**36
"""Errors count to 1.5e-11 m or rad: a matrix product has other last bits for another number of
rows, and an answer shall not depend on which poses are solved together."""
ROUNDS = 40
"""Fixed-point steps: an error of a thousandth of the arm shrinks some hundred times in each."""
WINDINGS = 3
"""How often a solution may be moved to another winding, where the error is another one."""
SETTLED = 1e-3
"""Change of the error, in tolerances, at which the steps end."""
SAME = 1e-6
"""Joint values [rad or m] that differ by less are one solution."""
NO_ROTATIONS = ("planar", "schoenflies")


class Compensated(Solver):
    """A solver for the real arm, whose tool is at forward kinematics plus the model's error.

    The inner solver answers for the nominal arm; each of its solutions is the start of a fixed
    point: the pose to be commanded is the target less the error at the joint values found so far,
    and a descent leads from these to it. What comes back is measured: ``position_error`` and
    ``rotation_error`` are those of forward kinematics plus model, so that the conformance check
    "every solution is true", which knows forward kinematics only, holds for a model without error.
    Branch numbers are those of the nominal solutions. A pose that the nominal arm does not reach
    is tried again less the error of its best candidate. That no solution was found shows nothing
    about the real arm: such a pose is NOT_FOUND where the inner solver says UNREACHABLE.

    Tolerances, windings, limits and the task are the inner solver's. A model of positions leaves
    rotations as they are computed.

    Args:
        solver: the inner solver, such as ``kv.Analytic()``.
        model: a fitted error model of ``kinverse.calibration``, or any fitted regressor of 3
            columns [m] or 6 (rotation vectors [rad] behind them).

    Attributes:
        solver_: the inner solver, a fitted clone.

    Raises:
        InputError: (fit) a model that is not fitted, of other joints, of another robot, or of
            rotations for the tasks "planar" and "schoenflies"; a solver that counts a setting from
            ``q_seed``.

    Example:
        >>> solver = Compensated(kv.Analytic(), model).fit(robot)
        >>> q = solver.solve(T, q_seed=q_now).q
    """

    solver_: Solver

    def __init__(self, solver: Solver, model: Any) -> None:
        self.solver = solver
        self.model = model

    def real_fk(self, q: Any) -> Array:
        """Poses (N, 4, 4) of the real tool at joint values (N, n), as far as the model tells.

        Raises:
            InputError: not fitted, another shape, NaN or inf.

        Example:
            >>> solver.real_fk(solver.solve(T).q)[0]
        """
        if not self.is_fitted:
            raise InputError("this Compensated is not fitted: call Compensated(...).fit(robot)")
        joints = np.atleast_2d(se3.as_joints(q, self.robot_.dof))
        T, error = self.robot_.fk(joints), self._errors(joints)
        T[:, :3, 3] += error[:, :3]
        if error.shape[1] == 6:
            T[:, :3, :3] = se3.rotation_exp(error[:, 3:]) @ T[:, :3, :3]
        return T

    def _check_settings(self) -> Settings:
        if not isinstance(self.solver, Solver):
            raise InputError(f"Compensated needs a solver object, got {self.solver!r}")
        return self.solver._check_settings()

    def _fit(self, robot: Robot) -> None:
        self.solver_ = self.solver.clone().fit(robot)
        setting = self.solver_._counted_from_seed()
        if setting:
            raise InputError(
                f"Compensated: {setting} of {type(self.solver).__name__} is counted from q_seed,"
                " and corrections lead away from it: leave it out"
            )
        self.branch_labels_ = self.solver_.branch_labels_
        _check_model(self.model, robot, self.settings_.task)

    def _bind(self) -> None:
        # damped: at a wrist that is nearly straight full steps go round several times
        free = replace(self.settings_, windings="nearest", limits="ignore")
        self._descent = Descent(self.robot_, free)

    def _answer(self, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        nominal = self.solver_._answer(T, q_seed, seed)
        q, pose, branch = self._starts(T, nominal, q_seed, seed)
        spent = np.zeros(len(q), np.int64)
        rows = np.arange(len(q))
        for _ in range(WINDINGS):
            q[rows], more = self._settled(T[pose[rows]], q[rows], seed)
            spent[rows] += more
            found = self._measured(T[pose], q)
            # of those outside the limits some have a winding inside: the error there is another
            apart = np.abs(found.q - q[found.pose_index]).max(axis=1, initial=0.0) > SAME
            rows = found.pose_index[apart]
            if not len(rows):
                break
            q[rows] = found.q[apart]
            # what finds no rest between its windings is no solution
            found = kept(found, ~apart)
        return self._grouped(nominal, found, pose, branch, spent, q_seed)

    # Steps ------------------------------------------------------------------------------------

    def _starts(
        self, T: Array, nominal: TableLike, q_seed: Array | None, seed: int
    ) -> tuple[Array, Ints, NDArray[np.int32]]:
        """Joint values (K, n) to start from, their poses (K,) and branches (K,).

        The nominal solutions; of a pose without one, those of the pose less the error; of one that
        has none of these either, the best candidate.
        """
        parts = [(nominal.q, nominal.pose_index, nominal.branch)]
        open_ = np.flatnonzero((nominal.count == 0) & np.isfinite(nominal.best_q).all(axis=1))
        if len(open_):
            best = nominal.best_q[open_]
            near = None if q_seed is None else np.ascontiguousarray(q_seed[open_])
            again = self.solver_._answer(_less(T[open_], self._errors(best)), near, seed)
            parts.append((again.q, open_[again.pose_index], again.branch))
            lost = again.count == 0
            parts.append((best[lost], open_[lost], np.full(lost.sum(), -1, np.int32)))
        q, pose, branch = (np.concatenate(group) for group in zip(*parts, strict=True))
        return q, pose, branch

    def _settled(self, T: Array, q: Array, seed: int) -> tuple[Array, Ints]:
        """The fixed points (K, n) that starts lead to, each on its own, and evaluations (K,)."""
        q, spent = q.copy(), np.zeros(len(q), np.int64)
        error = self._errors(q)
        tolerance = SETTLED * min(self.settings_.tol_position, self.settings_.tol_rotation)
        rows = np.arange(len(q))
        for _ in range(ROUNDS):
            if not len(rows):
                break
            target = _less(T[rows], error[rows])
            made = self._descent.each(target, q[rows])
            spent[rows] += made.evaluations
            lost = np.flatnonzero(~made.found)
            if len(lost):
                # near a singular posture a descent may stop where the solver itself does not
                again = self.solver_._answer(target[lost], made.q[lost], seed)
                nearest = np.flatnonzero(np.diff(again.pose_index, prepend=-1))
                made.q[lost[again.pose_index[nearest]]] = again.q[nearest]
                spent[rows[lost]] += again.evaluations
            now = self._errors(made.q)
            change = np.abs(now - error[rows]).max(axis=1)
            q[rows], error[rows] = made.q, now
            rows = rows[change > tolerance]
        return q, spent

    def _measured(self, T: Array, q: Array) -> TableLike:
        """What holds of candidates (K, n), each alone before its own target (K, 4, 4)."""
        # forward kinematics miss the target less the error by what the real tool misses it by
        target = _less(T, self._errors(q))
        settings = replace(self.settings_, windings="nearest")
        alone = Proposal(q, np.arange(len(q)))
        return verify_table(self.robot_, self._origin.task, target, alone, q, settings)

    def _grouped(
        self,
        nominal: TableLike,
        found: TableLike,
        pose: Ints,
        branch: NDArray[np.int32],
        spent: Ints,
        q_seed: Array | None,
    ) -> TableLike:
        """Measured candidates as the solutions of their poses."""
        count = len(nominal.status)
        q, rows = found.q, found.pose_index
        at = pose[rows]
        away = np.zeros(len(q)) if q_seed is None else np.abs(q - q_seed[at]).max(axis=1, initial=0)
        order = np.lexsort((branch[rows], away, at))
        order = order[~self._repeated(q[order], at[order])]
        solutions = np.bincount(at[order], minlength=count)
        outside = np.zeros(count, np.bool_)
        outside[pose[found.status == Status.OUT_OF_LIMITS]] = True
        status = np.where(
            outside & (nominal.status == Status.OUT_OF_LIMITS),
            np.uint8(Status.OUT_OF_LIMITS),
            np.uint8(Status.NOT_FOUND),
        )
        status[solutions > 0] = Status.SOLVED
        evidence = nominal.evidence.copy()
        evidence["weak"] = True
        changes: dict[str, NDArray[Any]] = {
            "q": q[order],
            "pose_index": at[order],
            "position_error": found.position_error[order],
            "rotation_error": found.rotation_error[order],
            "branch": branch[rows][order],
            "status": status,
            "count": solutions.astype(np.int64),
            "evaluations": nominal.evaluations + np.bincount(pose, spent, count).astype(np.int64),
            "evidence": evidence,
        }
        worst = found.best_position_error / self.settings_.tol_position
        worst = np.maximum(worst, found.best_rotation_error / self.settings_.tol_rotation)
        first = np.lexsort((worst, pose))
        has, best = np.unique(pose[first], return_index=True)
        for name in ("best_q", "best_position_error", "best_rotation_error"):
            changes[name] = np.full_like(getattr(nominal, name), np.nan)
            changes[name][has] = getattr(found, name)[first][best]
        for name in PER_INTERVAL:
            changes[name] = getattr(nominal, name)[:0]
        return replaced(nominal, **changes)

    # Parts ------------------------------------------------------------------------------------

    def _errors(self, q: Array) -> Array:
        """Errors (K, 3) or (K, 6) at joint values (K, n)."""
        if not len(q):
            return np.zeros((0, 3))
        error = np.asarray(self.model.predict(q), dtype=np.float64).reshape(len(q), -1)
        return np.asarray(np.rint(error * GRID) / GRID)

    def _repeated(self, q: Array, pose: Ints) -> NDArray[np.bool_]:
        """Which rows (K,) are an earlier one of their pose; poses ascend."""
        out = np.zeros(len(q), np.bool_)
        turns = turning(self.robot_) & (self.settings_.windings == "nearest")
        for k in range(1, int(np.bincount(pose).max(initial=0))):
            same = (pose[k:] == pose[:-k]) & (moved(q[k:], q[:-k], turns) <= SAME)
            out[k:] |= same
        return out


def _less(T: Array, error: Array) -> Array:
    """Poses (K, 4, 4) from which errors (K, 3) or (K, 6) lead to T (K, 4, 4)."""
    out = T.copy()
    out[:, :3, 3] -= error[:, :3]
    if error.shape[1] == 6:
        out[:, :3, :3] = se3.rotation_exp(-error[:, 3:]) @ T[:, :3, :3]
    return out


def _check_model(model: Any, robot: Robot, task: str) -> None:
    """What a robot and a task ask of a model."""
    if isinstance(model, type) or not hasattr(model, "predict"):
        raise InputError(f"model must be a fitted error model, got {model!r}")
    try:
        check_is_fitted(model)
    except (NotFittedError, TypeError) as error:
        raise InputError(f"{model!r} is not fitted: call its fit(q, error) first") from error
    joints = getattr(model, "n_features_in_", robot.dof)
    if joints != robot.dof:
        raise InputError(f"the model has {joints} joints, robot {robot.name!r} has {robot.dof}")
    for part in (model, *getattr(model, "models_", ())):
        nominal = getattr(part, "nominal_", robot)
        if not np.array_equal(nominal.frames, robot.frames):
            raise InputError(
                f"the model's errors are counted against a robot {nominal.name!r} whose frames"
                f" are not those of {robot.name!r}"
            )
    made = np.shape(model.predict(robot.limits.mean(axis=1)[None]))
    if made not in ((1, 3), (1, 6)):
        raise InputError(f"the model must predict 3 or 6 columns, got shape {made} for one row")
    if made[1] == 6 and task in NO_ROTATIONS:
        raise InputError(
            f"a model of rotations cannot serve the task {task!r}, which holds one rotation only:"
            " fit it to the three columns of the position"
        )

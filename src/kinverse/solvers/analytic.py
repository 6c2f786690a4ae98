"""Closed forms: every branch of every pose, in one native call."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import kernels, se3
from kinverse.errors import InputError, NoClosedForm
from kinverse.geometry import axis_lines
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.solvers._base import Proposal, Solver, _seeds
from kinverse.solvers.closed_form.bare import BareArm, bare_arm
from kinverse.solvers.closed_form.decoupled import DecoupledForm
from kinverse.solvers.closed_form.extension import Extension, check_mobility, extended
from kinverse.solvers.closed_form.families import (
    ClosedFormSpec,
    Family,
    check_own_joints,
    closed_form_spec,
)
from kinverse.solvers.closed_form.held import HeldJoint, end_removed
from kinverse.solvers.closed_form.parallel_arm import PARALLEL_TASKS, ParallelArm, parallel_arm
from kinverse.solvers.closed_form.redundant import (
    ARM_ANGLE,
    RedundantForm,
    arm_angle,
    redundant_form,
)
from kinverse.solvers.numerical import Numerical
from kinverse.status import Status
from kinverse.table import (
    PER_INTERVAL,
    TableLike,
    has_not_found,
    merged,
    replaced,
    without,
)

if TYPE_CHECKING:
    from kinverse.solutions import Solutions

__all__ = ["Analytic"]

Array = NDArray[np.float64]

EXACT = 1e-9
"""Error [rad, and m for arms up to a metre] that rounding explains: a branch with more only just
misses the pose, and counts only if the pose has no exact branch."""


DIGITS = 0.01
"""Rounding of far bases and tools, in tolerances, up to which what misses a tolerance misses it."""


SEARCHES = 60
"""Starts of the search for a pose where a sweep found nothing: about as long as the sweep."""

FINE = 1e-9
"""Its tolerances [m, rad]: ranges of the free parameter may be narrow."""

CLOSE = 0.02
"""How far about its end the sweep looks again [rad]."""


class Analytic(Solver):
    """Every branch in closed form, with labels, and the proof where there is none.

    Solves arms with a spherical wrist at either end (any shoulder and elbow in which axes 1 and 2,
    or 2 and 3, meet or are parallel), three consecutive parallel axes with axes 5 and 6 meeting
    (Universal Robots), the 5R arms that lack one axis of these, planar 3R arms and SCARA arms; no
    two axes need be perpendicular. Arms of three slides and three turning joints, in any order: the
    rotation first, then a linear system for the slides. Every other chain of six joints by
    elimination: with at most one slide after Raghavan & Roth (1993), with two along the spherical
    four-bar that the turning joints make. Chains of one to five joints with virtual ones that must
    stand still, polished on the chain itself; where their joints repeat each other they are given
    members of the continuum, and no proof. The tasks "planar" and "schoenflies" take arms whose
    turning axes are all parallel, with slides anywhere among them. Sources: Pieper (1968); thesis
    of Jha (2015), chapter 4, with the corrections of the project's errata.

    A pose that meets a continuum of solutions (a singular pose) gets, per branch, the member that
    lies inside the limits and nearest to ``q_seed`` (else to their middle), to about 1e-3 rad;
    ``stats.singular`` tells. UNREACHABLE is shown by interval arithmetic over all poses within
    the tolerances; for arms solved by elimination it rests on the roots found, and is said, as is
    OUT_OF_LIMITS, only where these are clear. Where six joints move the tool in fewer than six
    ways (two on one axis, parallel slides) every pose is such a continuum: a search gives members
    of it.

    Arms with seven joints have a free parameter: a joint (a slide if there is one), or the arm
    angle where shoulder and wrist are spherical (the angle of the elbow about the line from
    shoulder to wrist, 0 in the plane of axis 1 and that line, on the side axis 1 points to).
    ``solve_at`` gives every branch at a value of it; ``solve`` sweeps it and returns every range in
    which a branch exists inside the limits (``intervals``), with the solution in its middle, or the
    nearest to ``q_seed``. The sweep is a search: ranges narrower than its step are found where the
    limit violation, or a numerical search, descends to them. A pose without any is UNREACHABLE
    where interval arithmetic shows it, OUT_OF_LIMITS where the sweep finds solutions and all miss
    the limits by more than 0.02 rad, else NOT_FOUND. Holding an inner joint leaves another arm for
    each value, made when the value is met: a thousand times slower; its sweep, and that of an end
    joint before a general arm, looks at 64 values and bisects to 1e-6 rad.

    Args:
        task: "pose"; "position" with three joints, "position_axis" with five; "planar" with three
            and "schoenflies" with four, where the turning axes are all parallel.
        redundancy: for arms with seven joints: the joint (index or name) or "arm_angle" that
            parametrises the solutions; None chooses the arm angle, else the last or the first
            joint, else an inner one, and keeps it in ``redundancy_``.
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" or "all".
        limits: "hold" or "ignore".

    Attributes:
        redundancy_: index of the joint, or "arm_angle"; None below seven joints.

    Raises:
        NoClosedForm: at ``fit``, if no family fits the robot or the task.
        InputError: at ``fit``, a redundancy that the robot does not have.

    Example:
        >>> solver = kv.Analytic().fit(kv.load("kr16"))
        >>> solver.solve(robot.fk(q)).branch_labels
    """

    spec_: ClosedFormSpec
    bare_: BareArm | None
    inner_: "Analytic | None"
    rounding_: float
    deviation_: float
    redundancy_: int | str | None
    redundant_form_: RedundantForm | None
    extension_: Extension | None
    parallel_arm_: ParallelArm | None

    _held: HeldJoint | None
    _numerical: Numerical | None

    def __init__(
        self,
        *,
        task: str = "pose",
        redundancy: int | str | None = None,
        tol_position: float = 1e-6,
        tol_rotation: float = 1e-6,
        windings: str = "nearest",
        limits: str = "hold",
    ) -> None:
        self.task = task
        self.redundancy = redundancy
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits

    def _fit(self, robot: Robot) -> None:
        task = self.settings_.task
        self.bare_ = self.inner_ = None
        self.rounding_ = 0.0
        self.redundancy_ = self.redundant_form_ = self.extension_ = self.parallel_arm_ = None
        self.deviation_ = 0.0
        check_own_joints(robot)
        bare = bare_arm(robot, task)
        if bare is not None:
            self._fit_bare(bare)
            return
        if robot.dof == 7 and task == "pose":
            form = self.redundant_form_ = redundant_form(robot, self.redundancy)
            self.redundancy_ = form.redundancy
            self.branch_labels_ = form.branch_labels
            self.deviation_ = _deviation(robot, form)
            return
        if self.redundancy is not None:
            raise InputError(
                f"redundancy={self.redundancy!r}: only arms with seven joints have a free"
                f" parameter, {robot.name} has {robot.dof} joints"
            )
        if PARALLEL_TASKS.get(task) == robot.dof:
            self.parallel_arm_ = parallel_arm(robot, task)
            check_mobility(robot, task)
            self.branch_labels_ = self.parallel_arm_.branch_labels
            self.deviation_ = self.parallel_arm_.deviation
            return
        try:
            if task != "pose":
                raise NoClosedForm(task)
            self.spec_ = closed_form_spec(robot)
        except NoClosedForm:
            if task == "pose" and robot.dof >= 6:
                raise
            self.extension_ = extended(robot, task)
            self.spec_ = closed_form_spec(self.extension_.robot)
            if self.spec_.family is not Family.GENERAL_6R:  # nothing is missed
                self.extension_ = replace(self.extension_, turns=self.extension_.turns[:1])
        self.branch_labels_ = self.spec_.branch_labels
        if self.spec_.family is not Family.GENERAL_6R:
            solved = robot if self.extension_ is None else self.extension_.robot
            self.deviation_ = self.spec_.deviation(solved)

    def _fit_bare(self, bare: BareArm) -> None:
        """Learn the arm without its far base and tool, and what the digits of these leave."""
        settings = self.settings_
        tolerances = float(settings.tol_position), float(settings.tol_rotation)
        if bare.shows(*tolerances):
            tolerances = bare.tolerances(*tolerances)
        inner = Analytic(
            task=settings.task,
            redundancy=self.redundancy,
            tol_position=tolerances[0],
            tol_rotation=tolerances[1],
            windings=settings.windings,
            limits=settings.limits,
        ).fit(bare.robot)
        inner.rounding_ = bare.rounding
        inner._rebind()
        self.bare_, self.inner_, self.rounding_ = bare, inner, bare.rounding
        self.branch_labels_, self.redundancy_ = inner.branch_labels_, inner.redundancy_
        self.redundant_form_, self.extension_ = inner.redundant_form_, inner.extension_
        self.parallel_arm_, self.deviation_ = inner.parallel_arm_, inner.deviation_
        if hasattr(inner, "spec_"):
            self.spec_ = inner.spec_

    def _bind(self) -> None:
        self._held = self._numerical = None
        if self.inner_ is not None:
            return
        if self.redundant_form_ is not None:
            self._bind_redundant(self.redundant_form_)
            return
        if self.parallel_arm_ is not None:
            return
        spec, settings, extension = self.spec_, self.settings_, self.extension_
        robot = self.robot_ if extension is None else extension.robot
        self._form: Any = self._form_of(robot, spec)
        self._other: tuple[Any, int] | None = None
        self._roots = 0
        if extension is not None and extension.arm is not None:
            self._roots = extension.most_roots(self._form)
        is_native = spec.family is not Family.DECOUPLED
        if settings.windings == "nearest" and extension is None and is_native:
            self._fused = self._form.solve

    def _form_of(self, robot: Robot, spec: ClosedFormSpec) -> Any:
        """What solves an arm, the robot itself or its extension, whose limits are not its own."""
        settings = self.settings_
        tolerances = float(settings.tol_position), float(settings.tol_rotation)
        ignore = settings.limits == "ignore" or self.extension_ is not None
        if spec.family is Family.DECOUPLED:
            return DecoupledForm(robot, tolerances[1])
        if spec.family is Family.GENERAL_6R:
            return kernels.GeneralForm(robot.chain, *tolerances, ignore, self._exact)
        return self._special_form(robot, (*tolerances, ignore, self._exact))

    def _other_form(self) -> tuple[Any, int]:
        """The form of the extension's other arm and its most roots, when it is first asked."""
        if self._other is None:
            assert self.extension_ is not None and self.extension_.other is not None
            other = self.extension_.other
            form = self._form_of(other.robot, closed_form_spec(other.robot))
            self._other = form, other.most_roots(form)
        return self._other

    @property
    def _exact(self) -> float:
        # a family whose equations are a little off the arm has no branch with less error than that
        form = self.parallel_arm_ or self.spec_
        return max(EXACT * max(1.0, form.size), self.deviation_) + self.rounding_

    def _special_form(self, robot: Robot, tolerances: tuple[float, float, bool, float]) -> Any:
        spec = self.spec_
        links = spec.links
        return kernels.ClosedForm(
            robot.chain,
            int(spec.family),
            int(spec.regional),
            spec.is_reversed,
            spec.perpendicular_wrist,
            _rows(spec),
            np.linalg.inv(links.base),
            np.linalg.inv(links.tool),
            spec.joint,
            links.sign,
            links.offset,
            *tolerances,
            self.deviation_,
        )

    def _bind_redundant(self, form: RedundantForm) -> None:
        robot, settings, spec = self.robot_, self.settings_, form.spec
        ignore = settings.limits == "ignore"
        low, high, is_round = _range(robot, form, ignore)
        if spec is None or form.parameter is None:
            joint = int(form.redundancy)
            make = Analytic(
                tol_position=settings.tol_position,
                tol_rotation=settings.tol_rotation,
                limits=settings.limits,
            )
            self._held = HeldJoint(robot, joint, (low, high), make, form.lasting)
            return
        self._form = self._redundant_kernel(low, high, is_round)
        if settings.windings == "nearest":
            self._fused = self._swept

    def _redundant_kernel(self, low: float, high: float, is_round: bool) -> Any:
        """The native form that sweeps the free parameter from low to high."""
        robot, settings, form = self.robot_, self.settings_, self.redundant_form_
        assert form is not None and form.spec is not None and form.parameter is not None
        spec, first = form.spec, form.redundancy == 0
        links = spec.links
        return kernels.Redundant(
            robot.chain,
            form.parameter,
            int(spec.family),
            int(spec.regional),
            spec.is_reversed,
            form.perpendicular[1] if form.redundancy == ARM_ANGLE else spec.perpendicular_wrist,
            form.perpendicular[0],
            _rows(spec),
            np.linalg.inv(links.base),
            np.linalg.inv(links.tool),
            (spec.joint + (1 if first else 0)).astype(np.int32),
            links.sign,
            links.offset,
            np.linalg.inv(form.before),
            np.linalg.inv(form.behind),
            form.elbow_side,
            low,
            high,
            is_round,
            float(settings.tol_position),
            float(settings.tol_rotation),
            settings.limits == "ignore",
            max(EXACT * max(1.0, spec.size), self.deviation_) + self.rounding_,
        )

    def _swept(self, T: Any, q_seed: Any, seed: int) -> TableLike | None:
        table: TableLike | None = self._form.solve(T, q_seed, seed)
        if table is None or not has_not_found(table):
            return table
        poses = se3.as_poses(T)
        return self._searched(table, poses, _seeds(q_seed, self.robot_.dof, len(poses)), seed)

    def _answer(self, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        table = super()._answer(T, q_seed, seed)
        if self.redundant_form_ is None or self._fused is not None or not has_not_found(table):
            return table
        return self._searched(table, T, q_seed, seed)

    def _searched(self, table: TableLike, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        """A sweep's table with what a numerical search finds for poses where it found nothing.

        A range narrower than the sweep's step is met where a search ends: there the sweep looks
        again, closely, or the range is the one value.
        """
        open_ = np.flatnonzero(table.status == Status.NOT_FOUND)
        found = self._searcher().solve(np.ascontiguousarray(T[open_]), rng=0)
        parts: list[tuple[TableLike, NDArray[np.int64]]] = []
        for k in np.flatnonzero(found.ok):
            i = open_[k]
            one, near = T[i : i + 1], None if q_seed is None else q_seed[i : i + 1]
            value = float(self.redundancy_at(found[int(k)].q[0]))
            part = self._at_value(one, near, value, seed)
            if part is not None:
                parts.append((part, np.array([i])))
        if not parts:
            return table
        rest = without(table, np.concatenate([where for _, where in parts]))
        return merged([rest, *parts], len(T))

    def _at_value(
        self, T: Array, q_seed: Array | None, value: float, seed: int
    ) -> TableLike | None:
        """The table of one pose, swept about a value of the free parameter."""
        is_native = self._held is None and self.inner_ is None
        if is_native and self._fused is not None:
            assert self.redundant_form_ is not None
            low, high, is_round = _range(
                self.robot_, self.redundant_form_, self.settings_.limits == "ignore"
            )
            a, b = value - CLOSE, value + CLOSE
            if not is_round:
                a, b = max(a, low), min(b, high)
            table: TableLike = self._redundant_kernel(a, b, False).solve(T, q_seed, seed)
            if table.status[0] == Status.SOLVED:
                turns = 2.0 * np.pi * np.floor((table.interval_low - low) / (2.0 * np.pi))
                turns = turns if is_round else 0.0 * turns
                return replaced(
                    table,
                    interval_low=table.interval_low - turns,
                    interval_high=table.interval_high - turns,
                )
        table = self.solve_at(T, value, q_seed)._table
        if table.status[0] != Status.SOLVED:
            return None
        count = len(table.q)
        return replaced(
            table,
            interval_pose=np.zeros(count, np.int64),
            interval_branch=table.branch.copy(),
            interval_low=np.full(count, value),
            interval_high=np.full(count, value),
        )

    def _searcher(self) -> Numerical:
        """The search that looks where a sweep found nothing."""
        if self._numerical is None:
            settings = self.settings_
            self._numerical = Numerical(
                tol_position=min(FINE, settings.tol_position),
                tol_rotation=min(FINE, settings.tol_rotation),
                limits=settings.limits,
                max_starts=SEARCHES,
            ).fit(self.robot_)
        return self._numerical

    def solve_at(
        self, T: ArrayLike, value: ArrayLike, q_seed: ArrayLike | None = None
    ) -> "Solutions":
        """Every branch at a value of the free parameter of an arm with seven joints.

        A pose without a solution at its value is NOT_FOUND, or UNREACHABLE where it is shown that
        no value has one.

        Args:
            T: (4, 4) or (N, 4, 4), tool in base [m].
            value: one value [rad] for all poses, or (N,); with one pose also (K,) values for it.
            q_seed: (7,) or (N, 7) joint values [rad] to be near to.

        Returns:
            ``Solutions`` of length N, or K.

        Raises:
            InputError: not fitted, no free parameter, a value outside the joint's limits, or
                beyond 1e6.

        Example:
            >>> solver = kv.Analytic().fit(kv.load("iiwa14"))
            >>> solver.solve_at(T, 0.3).count
        """
        form = self._redundant("solve_at")
        values = self._checked_values(form, value)
        # one native call where T and seed are plain arrays; else they are checked and brought there
        is_native = self._held is None and self.inner_ is None
        if is_native and getattr(T, "shape", ()) == (len(values), 4, 4):
            table = self._form.solve_at(T, values, q_seed)
            if table is not None and self.settings_.windings == "nearest":
                return self._solutions(table)
        poses = se3.as_poses(T)
        count = len(poses) if len(values) == 1 else len(values)
        if len(poses) not in (1, count):
            raise InputError(
                f"{len(poses)} poses need one value or {len(poses)}, got {len(values)}"
            )
        poses = np.ascontiguousarray(np.broadcast_to(poses, (count, 4, 4)))
        values = np.ascontiguousarray(np.broadcast_to(values, (count,)))
        near = None
        if q_seed is not None:
            near = se3.as_joints(q_seed, self.robot_.dof, "q_seed", count=count)
        if self.inner_ is not None and self.bare_ is not None:
            inner = self.inner_.solve_at(self.bare_.target(poses), values, near)
            proposal = self._inner_proposal(poses, _proposal(inner._table))
        elif self._held is not None:
            proposal = self._held.propose_at(poses, values, near)
        else:
            table = self._form.solve_at(poses, values, near)
            if self.settings_.windings == "nearest":
                return self._solutions(table)
            proposal = _proposal(table)
        return self._solutions(self._verified(poses, proposal, near))

    def _checked_values(self, form: RedundantForm, value: ArrayLike) -> Array:
        values = se3.as_real(value, "value")
        if values.ndim > 1 or not np.isfinite(values).all():
            raise InputError(
                f"value must be finite and of shape () or (N,), got {values.shape}"
                if values.ndim > 1
                else "value must be finite"
            )
        if np.abs(values).max(initial=0.0) > se3.MOST_SEED:
            raise InputError(
                f"value must lie within +-{se3.MOST_SEED:g}, got {np.abs(values).max():g}"
            )
        values = np.ascontiguousarray(values.reshape(-1))
        if form.redundancy != ARM_ANGLE and self.settings_.limits == "hold":
            low, high = self.robot_.limits[int(form.redundancy)]
            outside = np.flatnonzero((values < low - LIMIT_SLACK) | (values > high + LIMIT_SLACK))
            if len(outside):
                name = self.robot_.joint_names[int(form.redundancy)]
                raise InputError(
                    f"joint {name!r} cannot be held at {values[outside[0]]:g}:"
                    f" its limits are {low:g} to {high:g}"
                )
            values = np.clip(values, low, high)
        return values

    def redundancy_at(self, q: ArrayLike) -> Array:
        """The value of the free parameter at joint values.

        Args:
            q: (..., 7) joint values [rad].

        Returns:
            (...,) [rad]; an arm angle lies in -pi..pi.

        Raises:
            InputError: not fitted, or no free parameter.

        Example:
            >>> solver.solve_at(robot.fk(q), solver.redundancy_at(q), q_seed=q).q[0]
        """
        form = self._redundant("redundancy_at")
        q = se3.as_joints(q, self.robot_.dof)
        if form.redundancy == ARM_ANGLE:
            robot = self.robot_ if self.bare_ is None else self.bare_.robot
            return arm_angle(robot, form, q.reshape(-1, 7)).reshape(q.shape[:-1])
        return np.array(q[..., int(form.redundancy)])

    def _redundant(self, method: str) -> RedundantForm:
        if not self.is_fitted:
            raise InputError("this Analytic is not fitted: call Analytic(...).fit(robot) first")
        if self.redundant_form_ is None:
            raise InputError(
                f"{method} is for arms with seven joints: {self.robot_.name} has"
                f" {self.robot_.dof} and no free parameter"
            )
        return self.redundant_form_

    def _verified(self, T: Array, proposal: Proposal, q_seed: Array | None) -> TableLike:
        table = super()._verified(T, proposal, q_seed)
        # where solutions may be missing, one of them may lie inside the limits
        doubtful = table.evidence["weak"] & (self.extension_ is not None)
        # nor where their errors are those of the digits they are measured in
        if self.rounding_ > DIGITS * self.settings_.tol_position:
            doubtful = np.ones(len(T), np.bool_)
        doubtful = doubtful & (table.status == Status.OUT_OF_LIMITS)
        if not doubtful.any():
            return table
        return replaced(table, status=np.where(doubtful, np.uint8(Status.NOT_FOUND), table.status))

    def _inner_proposal(self, T: Array, proposal: Proposal) -> Proposal:
        """What the bare arm proposes, as a proposal of the arm with its far base and tool."""
        assert self.bare_ is not None
        settings = self.settings_
        hint = proposal.hint
        if not self.bare_.shows(float(settings.tol_position), float(settings.tol_rotation)):
            hint = None
        return replace(proposal, hint=hint, exact=proposal.exact + 2.0 * self.rounding_)

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        if self.inner_ is not None and self.bare_ is not None:
            proposal = self.inner_._propose(self.bare_.target(T), q_seed, seed)
            return self._inner_proposal(T, proposal)
        if self.redundant_form_ is not None:
            if self._held is not None:
                # what holds on a limit only just is none where others are exact
                size = axis_lines(self.robot_.frames, self.robot_.kinds).size
                return replace(self._held.propose(T, q_seed), exact=EXACT * max(1.0, size))
            return _proposal(self._form.solve(T, q_seed))
        if self.parallel_arm_ is not None:
            tolerances = self.settings_.tol_position, self.settings_.tol_rotation
            return self.parallel_arm_.propose(T, q_seed, *tolerances, self._exact)
        if self.extension_ is not None:
            settings = self.settings_
            tolerances = float(settings.tol_position), float(settings.tol_rotation)
            return self.extension_.propose(
                (self._form, self._roots), self._other_form, T, q_seed, tolerances, self._exact
            )
        q, pose_index, branch, hint, singular, evidence = self._form.propose(T, q_seed)
        return Proposal(
            q=q,
            pose_index=pose_index,
            branch=branch,
            hint=hint,
            evaluations=np.bincount(pose_index, minlength=len(T)),
            singular=singular,
            exact=self._exact,
            evidence=evidence,
        )


def _rows(spec: ClosedFormSpec) -> Array:
    links = spec.links
    alpha = np.arctan2(links.sin_alpha, links.cos_alpha)
    return np.column_stack([links.a, links.d, alpha, links.cos_alpha, links.sin_alpha])


def _deviation(robot: Robot, form: RedundantForm) -> float:
    """How far the equations of an arm with seven joints may be from the arm [m, rad]."""
    if form.spec is None or form.parameter is None:
        return 0.0
    if form.redundancy == ARM_ANGLE:
        return form.spec.deviation(robot)
    return form.spec.deviation(end_removed(robot, int(form.redundancy)))


def _range(robot: Robot, form: RedundantForm, ignore: bool) -> tuple[float, float, bool]:
    """The values of the free parameter that a sweep covers, and whether they go round."""
    if form.redundancy == ARM_ANGLE:
        return -np.pi, np.pi, True
    joint = int(form.redundancy)
    low, high = robot.limits[joint]
    if robot.kinds[joint] == "P":  # a sweep needs ends: a slide's limits are, heeded or not
        return float(low), float(high), False
    middle = 0.5 * (low + high)
    if ignore or high - low > 2 * np.pi + 1e-9:
        return float(middle - np.pi), float(middle + np.pi), True
    return float(low), float(high), False


def _proposal(table: TableLike) -> Proposal:
    """A verified table as candidates again, for what only verification can do (all windings)."""
    # where solutions are all outside the limits, the best one shows it
    outside = np.flatnonzero(table.status == Status.OUT_OF_LIMITS)
    index = np.concatenate([table.pose_index, outside])
    order = np.argsort(index, kind="stable")
    q = np.concatenate([table.q, table.best_q[outside]])
    branch = np.concatenate([table.branch, np.full(len(outside), -1, np.int32)])
    unreachable = table.status == Status.UNREACHABLE
    return Proposal(
        q=q[order],
        pose_index=index[order],
        branch=branch[order],
        hint=np.where(unreachable, Status.UNREACHABLE, Status.NOT_FOUND),
        evaluations=table.evaluations,
        singular=table.singular,
        intervals=tuple(getattr(table, name) for name in PER_INTERVAL),
        evidence=table.evidence,
    )

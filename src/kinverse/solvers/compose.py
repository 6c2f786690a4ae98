"""Solvers made of solvers: ``FirstOf`` asks in turn, ``Seeded`` refines."""

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError, NoClosedForm
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal, Settings, Solver, _seeds
from kinverse.status import Status
from kinverse.table import TableLike, has_not_found, merged, replaced, without

__all__ = ["FirstOf", "Seeded"]

Array = NDArray[np.float64]


class FirstOf(Solver):
    """Each pose is settled by the first solver that can say something about it.

    Only NOT_FOUND falls through to the next solver, and so does a whole solver whose ``fit`` raised
    NoClosedForm; UNREACHABLE and OUT_OF_LIMITS are final. Tolerances and limits are the children's
    own; their tasks must agree. Branch numbers of a later solver follow those of the earlier ones.

    Args:
        solvers: at least one solver, asked in this order.

    Attributes:
        solvers_: the fitted clones that took part; of children that were trained for this robot,
            copies.

    Raises:
        InputError: (fit) nothing to ask, something that is no solver, or different tasks.
        NoClosedForm: (fit) every solver's fit raised it.

    Example:
        >>> solver = kv.FirstOf([kv.Analytic(), kv.Numerical()]).fit(robot)
        >>> solver.solve(T).status
    """

    solvers_: list[Solver]

    def __init__(self, solvers: Sequence[Solver]) -> None:
        self.solvers = solvers

    def _check_settings(self) -> Settings:
        return _shared_settings("FirstOf", self.solvers)

    def _fit(self, robot: Robot) -> None:
        self.solvers_, reasons = [], []
        for solver in self.solvers:
            try:
                self.solvers_.append(_own(solver, robot))
            except NoClosedForm as reason:
                reasons.append(reason)
        if not self.solvers_:
            raise reasons[0]
        labels = [solver.branch_labels_ for solver in self.solvers_]
        self.branch_labels_ = tuple(label for group in labels for label in group)

    def _counted_from_seed(self) -> str:
        return next(filter(None, (child._counted_from_seed() for child in self.solvers_)), "")

    def _bind(self) -> None:
        # the first solver's own fast path is ours, as long as no pose falls through
        fused = self.solvers_[0]._fused
        if fused is None:
            return
        if len(self.solvers_) == 1:
            self._fused = fused
            return
        dof, counts = self.robot_.dof, bool(self._counted_from_seed())

        def first(T: Any, q_seed: Any, seed: int) -> TableLike | None:
            if counts:
                self._check_seed(q_seed)
            table = fused(T, q_seed, seed)
            if table is None or not has_not_found(table):
                return table
            # the native call takes any buffer of numbers; the later solvers take arrays
            poses = se3.as_poses(T)
            return self._rest(table, poses, _seeds(q_seed, dof, len(poses)), seed)

        self._fused = first

    def _answer(self, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        return self._rest(self.solvers_[0]._answer(T, q_seed, seed), T, q_seed, seed)

    def _rest(self, table: TableLike, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        """The first solver's table with its NOT_FOUND poses given to the later solvers."""
        labels = len(self.solvers_[0].branch_labels_)
        for solver in self.solvers_[1:]:
            open_ = np.flatnonzero(table.status == Status.NOT_FOUND)
            if not len(open_):
                break
            near = None if q_seed is None else q_seed[open_]
            later = solver._answer(np.ascontiguousarray(T[open_]), near, seed)
            table = self._joined(table, later, open_, labels)
            labels += len(solver.branch_labels_)
        return table

    def _joined(
        self, table: TableLike, later: TableLike, open_: NDArray[np.int64], labels: int
    ) -> TableLike:
        """The later table's rows in place of the open poses of the earlier one."""
        earlier, closed = without(table, open_)
        branch = np.where(later.branch >= 0, later.branch + labels, -1).astype(np.int32)
        changes: dict[str, NDArray[Any]] = {"branch": branch}
        changes["interval_branch"] = (later.interval_branch + labels).astype(np.int32)
        changes["evaluations"] = later.evaluations + table.evaluations[open_]
        changes["singular"] = later.singular | table.singular[open_]
        # a pose that stays open keeps the evidence that says more, and the better best candidate
        still = later.status == Status.NOT_FOUND
        changes["evidence"] = np.where(still, table.evidence[open_], later.evidence)
        settings = self.settings_
        keep = _badness(table, open_, settings) < _badness(later, slice(None), settings)
        keep &= still
        for name in ("best_q", "best_position_error", "best_rotation_error"):
            mine, theirs = getattr(table, name)[open_], getattr(later, name)
            changes[name] = np.where(keep[:, None] if mine.ndim == 2 else keep, mine, theirs)
        parts = [(earlier, closed), (replaced(later, **changes), open_)]
        return merged(parts, len(table.status))


class Seeded(Solver):
    """One solver's candidates as the starts of another, verified once at the end.

    The candidates of ``first`` are neither verified nor trusted. What ``first`` says of a pose it
    has no candidate for stands.

    Args:
        first: a solver that proposes (closed-form, learned, swarm ...).
        refine: a solver that can start from given joint values, such as ``kv.Numerical``;
            tolerances, windings and limits are its.

    Attributes:
        solvers_: (first, refine), fitted clones.

    Raises:
        InputError: (fit) ``refine`` cannot be seeded or counts a setting from ``q_seed``, or the
            tasks differ.

    Example:
        >>> solver = kv.Seeded(kv.Learned(), kv.Numerical()).fit(robot)
        >>> solver.solve(T).ok
    """

    solvers_: tuple[Solver, Solver]

    def __init__(self, first: Solver, refine: Solver) -> None:
        self.first = first
        self.refine = refine

    def _check_settings(self) -> Settings:
        _shared_settings("Seeded", [self.first, self.refine])
        if type(self.refine)._refine is Solver._refine:
            raise InputError(
                f"Seeded: {type(self.refine).__name__} cannot start from given joint values; "
                "Numerical can"
            )
        return self.refine._check_settings()

    def _fit(self, robot: Robot) -> None:
        self.solvers_ = (_own(self.first, robot), _own(self.refine, robot))
        setting = self.solvers_[1]._counted_from_seed()
        if setting:
            raise InputError(
                f"Seeded: {setting} of {type(self.refine).__name__} is counted from q_seed, and it"
                " starts from the first solver's candidates: set it on the first solver or leave"
                " it out"
            )
        self.branch_labels_ = self.solvers_[0].branch_labels_

    def _counted_from_seed(self) -> str:
        return self.solvers_[0]._counted_from_seed()

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        first, refine = self.solvers_
        rough = first._propose(T, q_seed, seed)
        starts = np.ascontiguousarray(rough.q, dtype=np.float64)
        q = refine._refine(np.ascontiguousarray(T[rough.pose_index]), starts)
        return Proposal(
            q,
            rough.pose_index,
            rough.branch,
            rough.hint,
            rough.evaluations,
            rough.singular,
            evidence=rough.evidence,
        )


def _own(solver: Solver, robot: Robot) -> Solver:
    """A fitted child that nobody else holds: refitting the one given must not change the whole."""
    ready = solver._ready(robot)
    return copy(ready) if ready is solver else ready


def _shared_settings(name: str, solvers: Sequence[Solver]) -> Settings:
    """The first child's common settings, if the children are solvers of one task."""
    if not isinstance(solvers, (list, tuple)) or not solvers:
        raise InputError(f"{name} needs a list of solvers, got {solvers!r}")
    for solver in solvers:
        if not isinstance(solver, Solver):
            hint = ", not a class: write Numerical()" if isinstance(solver, type) else ""
            raise InputError(f"{name} needs solver objects, got {solver!r}{hint}")
    settings: list[Settings] = [solver._check_settings() for solver in solvers]
    tasks = [each.task for each in settings]
    if len(set(tasks)) > 1:
        raise InputError(f"{name} needs solvers of one task, got {', '.join(tasks)}")
    return settings[0]


def _badness(table: TableLike, poses: Any, settings: Settings) -> Array:
    """Error of the best candidate in tolerances; infinite where there was none."""
    error = table.best_position_error / settings.tol_position
    error = np.maximum(error, table.best_rotation_error / settings.tol_rotation)[poses]
    return np.where(np.isnan(error), np.inf, error)

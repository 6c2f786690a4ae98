"""Verification: the only way from candidates to solutions, the same for every solver.

The native core chooses windings, runs forward kinematics on the robot as given, measures the
errors, checks the limits, drops duplicates and ranks. Candidates are not trusted in any respect.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels
from kinverse.errors import InputError
from kinverse.solutions import Origin, Solutions
from kinverse.status import METHODS, Status
from kinverse.table import PER_INTERVAL, TableLike, replaced
from kinverse.task import Task, as_task

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Proposal", "Settings", "verify", "verify_table"]

Array = NDArray[np.float64]

INCOMPLETE = [METHODS.index("search"), METHODS.index("elimination")]
"""Methods that, where their evidence is weak, may have missed solutions inside the limits."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as a solution; checked when made.

    Attributes:
        task: name of the task, see ``kinverse.task``.
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" (one winding a solution) or "all" (every one inside the limits).
        limits: "hold" (solutions inside the limits only) or "ignore".

    Raises:
        InputError: a value that is not valid; the message lists the valid ones.
    """

    task: str = "pose"
    tol_position: float = 1e-6
    tol_rotation: float = 1e-6
    windings: str = "nearest"
    limits: str = "hold"

    def __post_init__(self) -> None:
        as_task(self.task)
        for name in ("tol_position", "tol_rotation"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
                raise InputError(f"{name} must be a number, got {value!r}")
            if not 0.0 < value < float("inf"):
                raise InputError(f"{name} must be positive and finite, got {value!r}")
        for name, valid in (("windings", ("nearest", "all")), ("limits", ("hold", "ignore"))):
            if getattr(self, name) not in valid:
                shown = " or ".join(repr(v) for v in valid)
                raise InputError(f"{name} must be {shown}, got {getattr(self, name)!r}")


@dataclass(frozen=True, slots=True)
class Proposal:
    """What a solver hands to verification: K untrusted candidates for N poses.

    Attributes:
        q: (K, n) joint values, limits and windings not yet considered.
        pose_index: (K,) the pose each candidate is for, 0..N-1.
        branch: (K,) number of the branch, -1 where the method knows none; None: all -1.
        hint: (N,) what the solver claims for a pose if no candidate of it holds: UNREACHABLE only
            where it is shown that no joint values meet the tolerances; None: all NOT_FOUND.
        evaluations: (N,) forward kinematics evaluations spent; None: as counted by verification.
        singular: (N,) the pose meets a continuum of solutions, of which the candidates are
            representatives; None: no pose does.
        exact: the error [m, rad] that rounding explains, for methods that are exact: candidates
            with more count only for poses that have none with less.
        intervals: (K,) arrays pose, branch, low, high: see ``Solutions.intervals``; None: none.
        starts: (N,) descents begun; None: the method has none.
        cost: (N,) value of an objective before any descent; None: the method has none.
        evidence: (N,) rows of ``kernels.EVIDENCE``: what the proposal rests on; None: a search.
    """

    q: Array
    pose_index: NDArray[np.int64]
    branch: NDArray[np.int32] | None = None
    hint: NDArray[np.uint8] | None = None
    evaluations: NDArray[np.int64] | None = None
    singular: NDArray[np.bool_] | None = None
    exact: float = float("inf")
    intervals: tuple[NDArray[Any], ...] | None = None
    evidence: NDArray[np.void] | None = None
    starts: NDArray[np.int64] | None = None
    cost: NDArray[np.float64] | None = None


def verify(
    robot: "Robot",
    task: str,
    T: Array,
    proposal: Proposal,
    q_seed: Array | None = None,
    settings: Settings | None = None,
) -> Solutions:
    """Measure candidates against the robot's own forward kinematics and keep what holds.

    Args:
        robot: the robot as given.
        task: name of the task.
        T: (N, 4, 4) rigid poses, checked.
        proposal: candidates for them.
        q_seed: (N, n) the joint values to be near to, or None.
        settings: tolerances, windings and limits; ``task`` above wins over the one in it.

    Raises:
        InputError: the arrays of the proposal do not fit the robot or the poses.

    Example:
        >>> found = verify(robot, "pose", T, Proposal(q, np.arange(len(q))))
        >>> found.ok
    """
    origin = Origin(robot, as_task(task), ())
    table = verify_table(robot, origin.task, T, proposal, q_seed, settings or Settings())
    return Solutions(table, origin)


def verify_table(
    robot: "Robot",
    task: Task,
    T: Array,
    proposal: Proposal,
    q_seed: Array | None,
    settings: Settings,
) -> TableLike:
    """The same as ``verify``, for the solvers' base class: a bare table comes back."""
    poses, count = len(T), len(proposal.q)
    q = _array("q", proposal.q, np.float64, (count, robot.dof))
    index = _array("pose_index", proposal.pose_index, np.int64, (count,))
    if count and not (0 <= index.min() and index.max() < poses):
        raise InputError(f"Proposal.pose_index must lie in 0..{poses - 1}")
    hint = np.full(poses, Status.NOT_FOUND) if proposal.hint is None else np.asarray(proposal.hint)
    if not np.isin(hint, (Status.UNREACHABLE, Status.NOT_FOUND)).all():
        raise InputError("Proposal.hint must hold UNREACHABLE or NOT_FOUND: the rest is measured")
    branch = np.full(count, -1) if proposal.branch is None else proposal.branch
    singular = None
    if proposal.singular is not None:
        singular = _array("singular", proposal.singular, np.bool_, (poses,))
    table: TableLike = kernels.verify(
        robot.chain,
        task.code,
        T,
        q,
        index,
        _array("branch", branch, np.int32, (count,)),
        _array("hint", hint, np.uint8, (poses,)),
        q_seed,
        float(settings.tol_position),
        float(settings.tol_rotation),
        settings.windings == "all",
        settings.limits == "ignore",
        float(proposal.exact),
        singular,
    )
    changes: dict[str, NDArray[Any]] = {}
    counted: dict[str, Any] = {"evaluations": np.int64, "starts": np.int64, "cost": np.float64}
    for name, kind in counted.items():
        if getattr(proposal, name) is not None:
            changes[name] = _array(name, getattr(proposal, name), kind, (poses,))
    if proposal.evidence is not None:
        evidence = _array("evidence", proposal.evidence, kernels.EVIDENCE, (poses,)).copy()
        # an incomplete list of solutions that all lie outside the limits shows nothing
        doubtful = evidence["weak"] & np.isin(evidence["method"], INCOMPLETE)
        doubtful &= table.status == Status.OUT_OF_LIMITS
        if doubtful.any():
            changes["status"] = np.where(doubtful, np.uint8(Status.NOT_FOUND), table.status)
        evidence["weak"] |= table.status == Status.NOT_FOUND
        changes["evidence"] = evidence
    if proposal.intervals is not None:
        rows = len(proposal.intervals[0])
        kinds = (np.int64, np.int32, np.float64, np.float64)
        for name, array, kind in zip(PER_INTERVAL, proposal.intervals, kinds, strict=True):
            changes[name] = _array(name, array, kind, (rows,))
    return replaced(table, **changes) if changes else table


def _array(name: str, value: Any, dtype: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    array = np.ascontiguousarray(value, dtype=dtype)
    if array.shape != shape:
        raise InputError(f"Proposal.{name} must have shape {shape}, got {array.shape}")
    return array

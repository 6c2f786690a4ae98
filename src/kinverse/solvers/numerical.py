"""Nonlinear least squares with restarts: any serial chain, any task, limits held in every step."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import kernels, se3
from kinverse.errors import InputError
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.seeds import seed_of
from kinverse.solvers._base import Proposal, Rng, Solver
from kinverse.table import TableLike
from kinverse.task import as_task

if TYPE_CHECKING:
    from kinverse.solutions import Solutions

__all__ = ["METHODS", "Numerical"]

Array = NDArray[np.float64]

METHODS = ("lm", "newton_raphson", "gauss_newton", "damped_least_squares")
"""The iterations by name, in the native core's order."""

MOST = 100_000
"""Upper bound of max_starts and max_iterations: the work of a call stays bounded."""

MOST_STARTS = 1000
"""Default of max_starts: of 80,000 reachable PUMA poses the hardest took 400."""

MOST_WEIGHT_RATIO = 1e6
"""Largest ratio of the two weights: beyond it the lesser one drowns in the other's rounding."""

FOLLOW_STEP = 0.5
"""Largest joint step [rad or m] of ``follow`` where max_joint_distance is not set."""


class Numerical(Solver):
    """One solution a pose by least squares on the task's error, from several starts.

    Start 0 is ``q_seed`` (moved into the limits) or the middle of the limits; further starts are a
    low-discrepancy sequence inside the limits, shifted by a number made of ``rng`` and the pose. Of
    the starts that converge the lowest-numbered is the answer, however the work was shared out.

    The residual is [position; 2 sin(angle / 2) axis] of the error in the base frame, lengths
    counted in half the arm's reach (rounded to a power of two), so that arms of any size behave
    alike; the tolerances stay in metres and radians. An arm of a kilometre carries rounding errors
    near 1e-12 m, one of a millimetre needs a smaller ``tol_position`` to mean anything.

    Args:
        task: see ``kinverse.task``.
        method: "lm", projected Levenberg-Marquardt (Levenberg 1944, Marquardt 1963), joint limits
            inside the step, restarts; "newton_raphson", full pseudo-inverse steps from one initial
            guess (Jazar 2007; the iterative technique of the seed study on fusion);
            "gauss_newton", the same steps halved until the error falls;
            "damped_least_squares", constant ``damping``, every step taken (Wampler 1986). The last
            three do not know the limits: what they find is held against them at the end.
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" or "all".
        limits: "hold" or "ignore".
        max_starts: starts a pose, at most; None: 1000 for "lm", 1 for the others. A
            pose that has no solution costs them all, about 1 ms.
        max_iterations: steps a start, at most; None: 60 for "lm", 200 for the others.
        weights: (position, rotation) weights of the residual, both positive and within a factor of
            1e6.
        damping: of "damped_least_squares".
        step_tolerance: a start also ends when the norm of its step is not above this; 0: never.
        jacobian_tolerance: a start also ends when the norm of J^T e is not above this; 0: never.
        max_joint_distance: hard bound on how far each joint may be from ``q_seed`` [rad or m],
            which must then be given; None: none.

    Raises:
        InputError: (fit) a setting that is not valid.

    Example:
        >>> solver = kv.Numerical().fit(kv.load("panda"))
        >>> solver.solve(T, q_seed=q_now).q
    """

    def __init__(
        self,
        *,
        task: str = "pose",
        method: str = "lm",
        tol_position: float = 1e-6,
        tol_rotation: float = 1e-6,
        windings: str = "nearest",
        limits: str = "hold",
        max_starts: int | None = None,
        max_iterations: int | None = None,
        weights: tuple[float, float] = (1.0, 1.0),
        damping: float = 0.1,
        step_tolerance: float = 0.0,
        jacobian_tolerance: float = 0.0,
        max_joint_distance: float | None = None,
    ) -> None:
        self.task = task
        self.method = method
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits
        self.max_starts = max_starts
        self.max_iterations = max_iterations
        self.weights = weights
        self.damping = damping
        self.step_tolerance = step_tolerance
        self.jacobian_tolerance = jacobian_tolerance
        self.max_joint_distance = max_joint_distance

    def _fit(self, robot: Robot) -> None:
        if self.method not in METHODS:
            raise InputError(f"method must be one of {', '.join(METHODS)}, got {self.method!r}")
        lm = self.method == "lm"
        distance = self.max_joint_distance
        if distance is not None and self.windings == "all":
            raise InputError("max_joint_distance and windings='all' exclude each other")
        self.options_ = (
            METHODS.index(self.method),
            *_weights(self.weights),
            np.inf if distance is None else _number("max_joint_distance", distance),
            _number("damping", self.damping),
            _number("step_tolerance", self.step_tolerance),
            _number("jacobian_tolerance", self.jacobian_tolerance),
            _count("max_starts", self.max_starts, MOST_STARTS if lm else 1),
            _count("max_iterations", self.max_iterations, 60 if lm else 200),
        )

    def _bind(self) -> None:
        settings = self.settings_
        method, position, rotation, *others = self.options_
        self._native: Any = kernels.LeastSquares(
            self.robot_.chain,
            as_task(settings.task).code,
            method,
            float(settings.tol_position),
            float(settings.tol_rotation),
            position,
            rotation,
            *others,
            settings.limits == "ignore",
        )
        if self.max_joint_distance is not None:
            self._fused = self._solve_near
        elif settings.windings == "nearest":
            self._fused = self._native.solve

    def _counted_from_seed(self) -> str:
        return "max_joint_distance" if np.isfinite(self.options_[3]) else ""

    def _solve_near(self, T: Any, q_seed: Any, seed: int) -> TableLike | None:
        self._check_seed(q_seed)
        table: TableLike | None = self._native.solve(T, q_seed, seed)
        return table

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        q, _, evaluations, *_ = self._native.propose(T, q_seed, seed)
        return Proposal(q, np.arange(len(q)), evaluations=evaluations)

    def _refine(self, T: Array, q_start: Array) -> Array:
        q: Array = self._native.refine(T, q_start)[0]
        return q

    def follow(self, T: ArrayLike, q_start: ArrayLike, rng: Rng = None) -> "Solutions":
        """Solve poses in sequence, each from the solution of the one before.

        The first guess of a pose is where the last two solutions point to (the last solution, for
        an arm with joints to spare); if that fails, restarts within 0.1 rad or m of the last
        solution, then further. No joint moves further from one solution to the next than
        ``max_joint_distance`` (where that is not set, 0.5 rad or m): a pose that has no solution
        so near is NOT_FOUND and the sequence goes on from the last solution before it.

        Args:
            T: (N, 4, 4) poses in order.
            q_start: (n,) joint values before the first pose, inside the limits if these hold.
            rng: as in ``solve``; only poses that need a second start look at it.

        Returns:
            ``Solutions`` of length N; a pose without a solution has no row in ``q``, so go by
            ``pose_index``.

        Raises:
            InputError: not fitted, or a pose or start that cannot be used.

        Example:
            >>> solver = kv.Numerical().fit(robot)
            >>> solver.follow(robot.fk(q_path), q_start=q_path[0]).q
        """
        if not self.is_fitted:
            raise InputError("this Numerical is not fitted: call Numerical(...).fit(robot) first")
        poses = se3.as_poses(T)
        start = se3.as_joints(q_start, self.robot_.dof, "q_start", bound=se3.MOST_SEED)
        if start.ndim != 1:
            raise InputError(f"q_start must have shape ({self.robot_.dof},), got {start.shape}")
        if self.settings_.limits == "hold":
            _inside(self.robot_, start)
        step = self.options_[3] if np.isfinite(self.options_[3]) else FOLLOW_STEP
        seed = seed_of(rng)
        return self._solutions(self._native.follow(poses, start, seed, step))


def _weights(value: Any) -> tuple[float, float]:
    try:
        pair = se3.as_real(value, "weights")
    except (TypeError, InputError):
        pair = np.empty(0)
    if pair.shape != (2,) or not (np.isfinite(pair).all() and (pair > 0.0).all()):
        raise InputError(f"weights must be two positive finite numbers, got {value!r}")
    low, high = sorted(pair.tolist())
    if high > MOST_WEIGHT_RATIO * low:
        raise InputError(f"weights must be within a factor of {MOST_WEIGHT_RATIO:g}, got {value!r}")
    return float(pair[0]), float(pair[1])


def _inside(robot: Robot, start: Array) -> None:
    for name, value, (low, high) in zip(robot.joint_names, start, robot.limits, strict=True):
        if not low - LIMIT_SLACK <= value <= high + LIMIT_SLACK:
            raise InputError(
                f"q_start: joint {name!r} is at {value:g}, outside its limits {low:g} to {high:g}"
            )


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{name} must be a number, got {value!r}")
    if not 0.0 <= value < np.inf:
        raise InputError(f"{name} must be finite and not negative, got {value!r}")
    return float(value)


def _count(name: str, value: Any, default: int) -> int:
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InputError(f"{name} must be a whole number or None, got {value!r}")
    if not 1 <= value <= MOST:
        raise InputError(f"{name} must lie in 1..{MOST}, got {value!r}")
    return int(value)

"""Population methods on a pose: documents 002 and 004, with a descent at the end if wanted."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.optimizers import History, Optimizer, make_optimizer
from kinverse.optimizers._base import whole_number
from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.seeds import seed_of
from kinverse.solvers._base import Proposal, Rng, Solver, _seeds
from kinverse.solvers.population.objective import (
    NORMS,
    ORIENTATION_ERRORS,
    PoseObjective,
    search_box,
)
from kinverse.solvers.population.polish import Polish
from kinverse.solvers.population.search import PopulationSearch
from kinverse.task import as_task

__all__ = ["Swarm"]

Array = NDArray[np.float64]

ALONE, POLISHED = 20_000, 2_000
"""Evaluations of a search by default, without and with polish."""


class Swarm(Solver):
    """Minimises the pose error over the joints' box with a population method.

    The objective is that of document 004, chapter 6.4: position error + weight * orientation error
    (equations 6.25 to 6.34), where the orientation error is the angle between the rotations, by
    atan2 (the printed arc cosine loses half the digits near zero). Alone no population method comes
    near 1e-6 on a full pose in a reasonable budget but differential evolution (``kinverse.bench``
    prints what they reach): with ``polish`` the answer is a descent by ``Numerical`` from the
    members of the last population, in order of their objective; no fresh starts. Where none of them
    leads to a solution another population searches. For answers alone ``Numerical`` is a hundred
    times quicker: this is for studying the methods, and for objectives of one's own.
    ``stats.cost`` holds the objective before polish, ``stats.starts`` the number of polishes.

    Args:
        optimizer: a name ("pso", "ga", "gwo", "tlbo", "bees", "cibo", "abc", "firefly", "bbo",
            "de") or an object of ``kinverse.optimizers``.
        max_evals: evaluations of a search; None: 20,000, with polish 2,000. Polishing comes on
            top of it; ``stats.evaluations`` counts all.
        max_searches: with polish, searches a pose at most, each with a random stream of its own:
            another begins where no member of the population led to a solution. A pose that has no
            solution costs them all, about 0.1 s.
        weight: of the orientation error [m/rad], mu of equation 6.25: a number >= 0, or "random" as
            printed: uniform in [0, 1), drawn once a pose. 1 suits arms of about a metre; take about
            the arm's reach for others, or one of the two errors is all that is searched for.
        norm: "l2", "l1" or "squared" (with task="position": document 002's objective).
        orientation_error: "quaternion" (the angle, equation 6.34), "rotation_vector" or "euler"
            (the norm of the vector, or of the differences of roll, pitch and yaw: not smooth where
            pitch nears +-90 degrees); the last two for task="pose" only.
        secondary: None, "least_motion" (distance from q_seed) or a callable that takes q (K, n) and
            returns (K,): added to the objective. It steers the population; alone it trades accuracy
            away, and polish, which does not know it, keeps what the population has chosen only
            roughly. NaN counts as worst, with a warning in the log.
        secondary_weight: its factor.
        polish: whether to descend at the end.
        all_branches: look for every solution: searches in turn, each shunning ``taboo_radius``
            about the solutions known so far, whose members are all polished. An extension of ours;
            document 002 wants eight. Ends after five searches without a new one, which proves
            nothing. Of continua members 0.4 rad apart are kept, 128 solutions a pose at most.
        taboo_radius: largest joint distance [rad or m] that is taboo.
        task: see ``kinverse.task``.
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" or "all".
        limits: "hold": they are the box; "ignore": turning joints anywhere in a turn.

    Raises:
        InputError: (fit) a setting that is not valid.

    Example:
        >>> solver = kv.Swarm(optimizer="gwo").fit(kv.load("puma560"))
        >>> solver.solve(T).stats.cost
    """

    def __init__(
        self,
        *,
        optimizer: str | Optimizer = "pso",
        max_evals: int | None = None,
        weight: float | str = 1.0,
        norm: str = "l2",
        orientation_error: str = "quaternion",
        secondary: str | Callable[[Array], Any] | None = None,
        secondary_weight: float = 0.01,
        polish: bool = True,
        max_searches: int = 100,
        all_branches: bool = False,
        taboo_radius: float = 0.2,
        task: str = "pose",
        tol_position: float = 1e-6,
        tol_rotation: float = 1e-6,
        windings: str = "nearest",
        limits: str = "hold",
    ) -> None:
        self.optimizer = optimizer
        self.max_evals = max_evals
        self.weight = weight
        self.norm = norm
        self.orientation_error = orientation_error
        self.secondary = secondary
        self.secondary_weight = secondary_weight
        self.polish = polish
        self.max_searches = max_searches
        self.all_branches = all_branches
        self.taboo_radius = taboo_radius
        self.task = task
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits

    def _fit(self, robot: Robot) -> None:
        _check_choice("norm", self.norm, NORMS)
        _check_choice("orientation_error", self.orientation_error, ORIENTATION_ERRORS)
        if self.orientation_error != "quaternion" and self.task != "pose":
            raise InputError(
                f"orientation_error={self.orientation_error!r} is for task='pose':"
                f" task {self.task!r} has an angle of its own, set 'quaternion'"
            )
        if self.weight != "random":
            _check_number("weight", self.weight, " or 'random'")
        whole_number("max_searches", self.max_searches, 1)
        _check_number("secondary_weight", self.secondary_weight)
        _check_number("taboo_radius", self.taboo_radius)
        if not (
            self.secondary is None or callable(self.secondary) or self.secondary == "least_motion"
        ):
            raise InputError(
                "secondary must be None, 'least_motion' or a callable q (K, n) -> (K,),"
                f" got {self.secondary!r}"
            )
        if self.all_branches and not self.polish:
            raise InputError(
                "all_branches tells solutions apart by polishing: it needs polish=True"
            )
        if not isinstance(self.optimizer, (str, Optimizer)):
            raise InputError(f"optimizer must be a name or an Optimizer, got {self.optimizer!r}")
        chosen = self.optimizer
        self.optimizer_ = make_optimizer(chosen) if isinstance(chosen, str) else chosen.clone()
        self.box_ = search_box(robot, self.limits)
        by_default = POLISHED if self.polish else ALONE
        self.max_evals_ = by_default if self.max_evals is None else self.max_evals
        self.fitted_ = SimpleNamespace(**self.get_params())
        # says now what is wrong with max_evals or the method's settings
        self.optimizer_.start(self.box_, max_evals=self.max_evals_)

    def _bind(self) -> None:
        given = self.fitted_
        objective = PoseObjective(
            self.robot_,
            as_task(self.settings_.task),
            given.norm,
            given.orientation_error,
            given.secondary,
            given.secondary_weight,
            self.settings_.limits,
        )
        self._search = PopulationSearch(
            self.optimizer_,
            objective,
            self.box_,
            self.max_evals_,
            given.max_searches,
            given.weight,
            given.taboo_radius,
            turning(self.robot_),
            Polish(self.robot_, self.settings_) if given.polish else None,
        )

    def _counted_from_seed(self) -> str:
        return "secondary='least_motion'" if self.fitted_.secondary == "least_motion" else ""

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        return self._search.propose(T, q_seed, seed, self.fitted_.all_branches)

    def watch(
        self,
        T: ArrayLike,
        q_seed: ArrayLike | None = None,
        rng: Rng = None,
        every: int = 1,
        population: bool = True,
    ) -> History:
        """How the first search of each pose goes, before any polish, for pictures and studies.

        The same numbers as in ``solve`` with the same ``rng``. The populations take about a
        megabyte a pose in 20,000 evaluations.

        Args:
            T: (4, 4) or (N, 4, 4) poses, at least one.
            q_seed: (n,) or (N, n), as in ``solve``.
            rng: as in ``solve``.
            every: write down every that many steps.
            population: keep the populations too.

        Returns:
            A ``History`` of N problems.

        Raises:
            InputError: not fitted, or a pose or seed that cannot be used.

        Example:
            >>> solver.watch(T).best[-1]    # as solve(T).stats.cost where one search did
        """
        self._check_fitted()
        self._check_seed(q_seed)
        poses = se3.as_poses(T)
        if not len(poses):
            raise InputError("watch needs at least one pose")
        near = _seeds(q_seed, self.robot_.dof, len(poses))
        history = History(every=every, population=population)
        seed = seed_of(rng)
        self._search.searched(poses, near, seed, history=history)
        return history

    def cost(self, T: ArrayLike, q: ArrayLike) -> Array:
        """The objective of joint values against one pose, without ``least_motion``.

        Args:
            T: (4, 4) pose.
            q: (..., n) joint values.

        Returns:
            (...) costs; weight "random" counts as 1.

        Raises:
            InputError: not fitted, several poses, or joint values of another width.

        Example:
            >>> solver.cost(T, s.q)
        """
        self._check_fitted()
        poses, values = se3.as_poses(T), se3.as_real(q, "q")
        if len(poses) != 1:
            raise InputError(f"cost takes one pose, got {len(poses)}")
        if not values.ndim or values.shape[-1] != self.robot_.dof:
            raise InputError(f"q must have shape (..., {self.robot_.dof}), got {values.shape}")
        weight = self.fitted_.weight
        weights = np.full(1, 1.0 if weight == "random" else float(weight))
        rows = np.ascontiguousarray(values.reshape(1, -1, self.robot_.dof))
        return self._search.objective(poses, weights, None, rows).reshape(values.shape[:-1])

    def _check_fitted(self) -> None:
        if not self.is_fitted:
            raise InputError("this Swarm is not fitted: call Swarm(...).fit(robot) first")


def _check_choice(name: str, value: Any, valid: tuple[str, ...]) -> None:
    if value not in valid:
        raise InputError(f"{name} must be one of {', '.join(valid)}, got {value!r}")


def _check_number(name: str, value: Any, other: str = "") -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise InputError(f"{name} must be a number{other}, got {value!r}")
    if not 0.0 <= float(value) < np.inf:
        raise InputError(f"{name} must be finite and not negative{other}, got {value!r}")

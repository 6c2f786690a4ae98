"""The feedback loop of document 000: a network of increments, corrected by forward kinematics."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal
from kinverse.solvers.trained.examples import Examples
from kinverse.solvers.trained.held_out import task_errors
from kinverse.solvers.trained.increments import Increments
from kinverse.solvers.trained.trained import (
    Trained,
    check_fallback,
    check_whole,
    restarting,
    searched,
)
from kinverse.task import as_task

if TYPE_CHECKING:
    from kinverse.learning import PoseFeatures

__all__ = ["Fusion"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

NEURONS, SPREAD = 68, 3.0
"""Document 000's neurons; its spread of 0.75 belongs to inputs that are not scaled."""

CANDIDATES = 1000
"""Pairs that may become centres: all of them take five times as long and arrive no more often."""

MOST_POSES = 2000
"""Pairs grow with the square: four million patterns."""

PATIENCE = 3
"""The loop gives up once the error has grown so many times."""


class Fusion(Trained):
    """A network is told a start pose and a pose increment and predicts the joint increment.

    Document 000 (Chiddarwar and Ramesh Babu 2010). ``fit`` draws ``n_poses`` configurations and
    learns all ordered pairs of them. Solving starts at ``q_seed``, else at the nearest training
    pose, and repeats

        q' = q_s + net([P_s, D]),   D <- D + (P_target - FK(q'))

    with D = P_target - P_s at first: the deviation that forward kinematics finds is added to the
    increment that is asked for, the reading of the document that converges. Each pose ends within
    the tolerances, or after ``max_iterations``, or when its error has grown three times or the
    network says what is no joint value (beyond +-1e6); then ``fallback`` takes over from
    ``q_seed``, or the best joint values met. ``stats.starts`` is 0 where the loop alone arrived
    and 1 where it fell back.

    The loop arrives where the training poses lie close together (document 000's figures belong to
    a region of a few degrees about one configuration, ``kinverse.bench`` prints which).

    Args:
        network: a regressor of several outputs; None: ``RBFNetwork`` of 68 neurons, spread 3
            in scaled inputs, centres among 1000 pairs.
        features: what it is told of a pose: "xyz+quat" or another kind of ``PoseFeatures``. With
            the document's own, "xyz+rpy", the loop is lost near a pitch of a quarter turn, where
            roll and yaw are no smooth functions of the joints.
        n_poses: training poses.
        region: (q_centre (n,), half_width (n,) or a number) [rad or m] to draw them in; None: all
            of the limits.
        keep: which configurations to learn, see ``kinverse.learning.sample``.
        max_iterations: of the loop.
        fallback: "numerical" (``Numerical`` from the best joint values, restarts and all) or None:
            NOT_FOUND, with what the loop reached in ``stats.best_q``.
        random_state: seed of the poses and of the network.
        progress: called with (text, share done) while ``fit`` works; True ends it.
        task: see ``kinverse.task``.
        tol_position: largest position error [m]; the document's 0.02 mm.
        tol_rotation: largest rotation error [rad]; the document has none.
        windings: "nearest" or "all".
        limits: "hold" or "ignore".

    Attributes:
        experts_: the network with its training poses, in a list.

    Raises:
        InputError: (fit) a setting that is not valid, or configurations that cannot be drawn.
        MissingExtra: (fit) scikit-learn is not installed.

    Example:
        >>> solver = kv.Fusion(region=(q_now, 0.09)).fit(robot)
        >>> solver.solve(T, q_seed=q_now).q
    """

    experts_: list[Increments]
    _expert = Increments

    def __init__(
        self,
        network: Any = None,
        *,
        features: "str | PoseFeatures" = "xyz+quat",
        n_poses: int = 70,
        region: tuple[ArrayLike, ArrayLike] | None = None,
        keep: Any = None,
        max_iterations: int = 50,
        fallback: str | None = "numerical",
        random_state: int = 0,
        progress: Callable[[str, float], Any] | None = None,
        task: str = "pose",
        tol_position: float = 2e-5,
        tol_rotation: float = 1e-3,
        windings: str = "nearest",
        limits: str = "hold",
    ) -> None:
        self.network = network
        self.features = features
        self.n_poses = n_poses
        self.region = region
        self.keep = keep
        self.max_iterations = max_iterations
        self.fallback = fallback
        self.random_state = random_state
        self.progress = progress
        self.task = task
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits

    # Training ---------------------------------------------------------------------------------

    def _fit(self, robot: Robot) -> None:
        from kinverse.learning import PoseFeatures, sample

        self._check()
        features = self.features
        if not isinstance(features, PoseFeatures):
            features = PoseFeatures(features)
        rng = np.random.default_rng(self.random_state)
        drawn = sample(robot, self.n_poses, random_state=rng, keep=self.keep, region=self.region)
        network = self._new_network(0, "pairs", 1)
        rotations = as_task(self.settings_.task).rotation > 0
        self.branches_ = np.zeros(1, np.int64)
        self.experts_ = [Increments(network, features, drawn.q, drawn.T, rotations)]
        self._remember()
        self._tell("done", 1.0)

    def _default_network(self) -> Any:
        from kinverse.networks import RBFNetwork

        return RBFNetwork(NEURONS, spread=SPREAD, n_candidates=CANDIDATES)

    def _remember(self) -> None:
        super()._remember()
        self.fallback_, self.max_iterations_ = self.fallback, int(self.max_iterations)

    def _check(self) -> None:
        self._check_training()
        check_whole("n_poses", self.n_poses, 2, MOST_POSES)
        check_whole("max_iterations", self.max_iterations, 1, 100_000)
        check_fallback(self.fallback)

    def _fresh(self, n_samples: int, rng: np.random.Generator) -> list[Examples]:
        from kinverse.learning import sample

        used = self.trained_with_
        drawn = sample(
            self.robot_, n_samples, random_state=rng, keep=used["keep"], region=used["region"]
        )
        return [Examples(drawn.q, drawn.T)]

    # Solving ----------------------------------------------------------------------------------

    def _bind(self) -> None:
        self._numerical = restarting(self.settings_, self.robot_)

    def _predicted(self, T: Array) -> Array:
        start = self._start(T, None)
        expert = self.experts_[0]
        P, target = expert.features.transform(self.robot_.fk(start)), expert.features.transform(T)
        q: Array = start + expert.predict(P, expert.features.difference(P, target))
        return q[:, None]

    def _start(self, T: Array, q_seed: Array | None) -> Array:
        if q_seed is not None:
            return q_seed
        first: Array = self.experts_[0].neighbours.first(T)
        return first

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        q, arrived, evaluations = self._loop(T, self._start(T, q_seed))
        lost = np.flatnonzero(~arrived)
        if self.fallback_ is not None and len(lost):
            near = q if q_seed is None else q_seed
            rest = self._numerical._propose(
                np.ascontiguousarray(T[lost]), np.ascontiguousarray(near[lost]), seed
            )
            q[lost] = rest.q
            if rest.evaluations is not None:
                evaluations[lost] += rest.evaluations
        starts = (~arrived).astype(np.int64) if self.fallback_ is not None else None
        return Proposal(
            q,
            np.arange(len(T)),
            evaluations=evaluations,
            starts=starts,
            evidence=searched(len(T)),
        )

    def _loop(self, T: Array, start: Array) -> tuple[Array, NDArray[np.bool_], Ints]:
        """Best joint values (N, n), whether they are within the tolerances, evaluations."""
        expert, robot = self.experts_[0], self.robot_
        N = len(T)
        if not N:
            return start, np.zeros(0, np.bool_), np.zeros(0, np.int64)
        best, lowest = start.copy(), self._error(start, T)
        evaluations, grown = np.ones(N, np.int64), np.zeros(N, np.int64)
        P = expert.features.transform(robot.fk(start))
        target = expert.features.transform(T)
        asked = expert.features.difference(P, target)
        last = np.full(N, np.inf)
        rows = np.flatnonzero(lowest > 1.0)
        for _ in range(self.max_iterations_):
            q = start[rows] + expert.predict(P[rows], asked[rows])
            # a network far from its training poses may say anything, and no number too
            sane = (np.abs(q) <= se3.MOST_SEED).all(axis=1)
            q, rows = q[sane], rows[sane]
            if not len(rows):
                break
            reached = robot.fk(q)
            evaluations[rows] += 1
            error = self._error(q, np.ascontiguousarray(T[rows]))
            better = error < lowest[rows]
            best[rows[better]], lowest[rows[better]] = q[better], error[better]
            grown[rows] += error > last[rows]
            last[rows] = error
            asked[rows] += expert.features.difference(
                expert.features.transform(reached), target[rows]
            )
            rows = rows[(error > 1.0) & (grown[rows] < PATIENCE)]
            if not len(rows):
                break
        inside = self._inside(best)
        return best, (lowest <= 1.0) & inside, evaluations

    def _error(self, q: Array, T: Array) -> Array:
        """The larger of position and rotation error of q (K, n), in their tolerances."""
        position, rotation = task_errors(self.robot_, self.settings_.task, q, T)
        return np.asarray(
            np.maximum(
                position / self.settings_.tol_position, rotation / self.settings_.tol_rotation
            )
        )

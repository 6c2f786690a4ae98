"""Networks predict, a descent finishes, the robot's own forward kinematics judges."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal
from kinverse.solvers.descent import Descent
from kinverse.solvers.trained.branch_labels import BranchLabels, branch_labels
from kinverse.solvers.trained.examples import Examples, by_branch, nearest_middle, unchanged
from kinverse.solvers.trained.expert import Expert
from kinverse.solvers.trained.rounds import Rounds, Starts
from kinverse.solvers.trained.trained import (
    Trained,
    check_fallback,
    check_whole,
    restarting,
    searched,
)
from kinverse.task import as_task

__all__ = ["REFINES", "Learned"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

REFINES = {"newton": "newton_raphson", "lm": "lm"}
"""The descents by name: of ``Learned``, of ``Numerical``."""

HIDDEN, EPOCHS = (60,), 40
"""The network where none is given: large enough for a start, trained in a second a branch."""

MOST_SAMPLES, MOST_NEIGHBORS = 10_000_000, 1000


class Learned(Trained):
    """A network's prediction, refined and verified; one network for each branch.

    ``fit`` draws joint values inside the limits and learns the way back from the poses they reach.
    Where the robot has a closed form with named branches, it labels the examples, and each branch
    has a network of its own: all of them are asked. Elsewhere there is one network, whose examples
    are the solutions nearest the middle of the limits, so that a pose has one answer; or, with
    ``virtual``, the joints drawn, told apart by the virtual vector. At solving the closed form
    gives no joint values; it names the branch on which a descent has ended.

    A prediction that does not lead to a solution is followed by the examples nearest to the pose.
    Where there is one network, ``q_seed`` is tried before its prediction; where each branch has its
    own, all are solved and ``q_seed`` orders them.
    It is a search: a pose that cannot be reached, or only outside the limits, is NOT_FOUND.
    Without ``refine`` a prediction is the answer where it meets the tolerances by itself; elsewhere
    the pose is NOT_FOUND, the prediction is in ``stats.best_q`` and its true error beside it.

    Args:
        network: a regressor of several outputs in scikit-learn's manner, such as those of
            ``kinverse.networks``; None: ``MLP((60,), max_iter=40)``.
        features: what it is told of a pose: "xyz+matrix", "xyz+quat", "xyz+rpy", "xyz" or a
            ``PoseFeatures``.
        virtual: a ``VirtualVector`` or its kind, which completes a redundant arm's task space
            (document 003). What is no function of the pose is taken from the nearest example.
        n_samples: examples for each network.
        keep: which examples to learn: a predicate or several, see ``kinverse.learning.sample``.
        refine: "newton" (full steps; limits are looked at afterwards), "lm"
            (Levenberg-Marquardt inside the limits) or None.
        neighbors: how many of the nearest examples are tried after the prediction.
        fallback: "numerical" (``Numerical`` from the prediction, restarts and all, where a pose
            has no solution yet) or None.
        random_state: seed of the examples and of the network.
        progress: called with (text, share done) now and then while ``fit`` works; True ends it:
            the networks that are left have one epoch each. So does Ctrl-C.
        task: see ``kinverse.task``.
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" or "all".
        limits: "hold" or "ignore".

    Attributes:
        experts_: the trained networks with their examples.
        branch_labels_: names of the branches, empty where there is one network for all.
        branches_: (B,) number of the branch that each network stands for.

    Raises:
        InputError: (fit) a setting that is not valid, or examples that cannot be made.
        MissingExtra: (fit) scikit-learn is not installed.

    Example:
        >>> solver = kv.Learned(n_samples=5000).fit(kv.load("kr16"))
        >>> solver.solve(T).q
    """

    def __init__(
        self,
        network: Any = None,
        *,
        features: Any = "xyz+matrix",
        virtual: Any = None,
        n_samples: int = 5000,
        keep: Any = None,
        refine: str | None = "newton",
        neighbors: int = 8,
        fallback: str | None = None,
        random_state: int = 0,
        progress: Callable[[str, float], Any] | None = None,
        task: str = "pose",
        tol_position: float = 1e-6,
        tol_rotation: float = 1e-6,
        windings: str = "nearest",
        limits: str = "hold",
    ) -> None:
        self.network = network
        self.features = features
        self.virtual = virtual
        self.n_samples = n_samples
        self.keep = keep
        self.refine = refine
        self.neighbors = neighbors
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
        from kinverse.learning import PoseFeatures, VirtualVector

        self._check()
        features, virtual = self.features, self.virtual
        if not isinstance(features, PoseFeatures):
            features = PoseFeatures(features)
        if virtual is not None and not isinstance(virtual, VirtualVector):
            virtual = VirtualVector(virtual)
        rng = np.random.default_rng(self.random_state)
        self._tell("examples", 0.0)
        labels = None if virtual is not None else branch_labels(robot, self.settings_.task)
        self.branch_labels_ = () if labels is None else labels.names
        sets = self._examples(robot, labels, virtual is not None, self.n_samples, rng, self.keep)
        if not sets:
            raise InputError(f"no branch of {robot.name!r} has enough examples inside the limits")
        self.branches_ = np.array(list(sets), np.int64)
        rotations = as_task(self.settings_.task).rotation > 0
        self.experts_ = []
        for k, (branch, examples) in enumerate(sets.items()):
            label = labels.names[branch] if labels else robot.name
            network = self._new_network(k, label, len(sets))
            expert = Expert(robot, network, features, virtual, examples, rotations)
            self.experts_.append(expert)
            self._note_ctrl_c(network)
        self._remember()
        self._tell("done", 1.0)

    def _examples(
        self,
        robot: Robot,
        labels: BranchLabels | None,
        completed: bool,
        n_samples: int,
        rng: np.random.Generator,
        keep: Any,
    ) -> dict[int, Examples]:
        """By branch, 0 where there is one network: what it learns, or is tested with."""
        if labels is not None:
            return by_branch(robot, labels, n_samples, rng, keep)
        if completed:
            return {0: unchanged(robot, n_samples, rng, keep)}
        return {0: nearest_middle(robot, self.settings_, n_samples, rng, keep)}

    def _fresh(self, n_samples: int, rng: np.random.Generator) -> list[Examples]:
        robot, first, used = self.robot_, self.experts_[0], self.trained_with_
        labels = branch_labels(robot, self.settings_.task) if self.branch_labels_ else None
        sets = self._examples(
            robot, labels, first.virtual is not None, n_samples, rng, used["keep"]
        )
        none = Examples(np.empty((0, robot.dof)), np.empty((0, 4, 4)))
        return [sets.get(branch, none) for branch in self.branches_.tolist()]

    def _default_network(self) -> Any:
        from kinverse.networks import MLP

        return MLP(HIDDEN, max_iter=EPOCHS)

    def _remember(self) -> None:
        super()._remember()
        self.refine_, self.neighbors_ = self.refine, int(self.neighbors)
        self.fallback_ = self.fallback

    def _check(self) -> None:
        self._check_training()
        if self.refine is not None and self.refine not in REFINES:
            raise InputError(f"refine must be {', '.join(REFINES)} or None, got {self.refine!r}")
        check_fallback(self.fallback)
        if self.refine is None and self.fallback is not None:
            raise InputError("fallback needs refine: without it predictions stand as they are")
        check_whole("n_samples", self.n_samples, 2, MOST_SAMPLES)
        check_whole("neighbors", self.neighbors, 0, MOST_NEIGHBORS)

    # Solving ----------------------------------------------------------------------------------

    def _bind(self) -> None:
        robot, settings = self.robot_, self.settings_
        self._rounds = None
        if self.refine_ is None:
            return
        labels = branch_labels(robot, settings.task) if self.branch_labels_ else None
        self._labels = labels
        self._rounds = Rounds(
            Descent(robot, settings, REFINES[self.refine_]),
            None if labels is None else self._network_of(labels),
            self._is_final,
        )
        self._most = 1 + min(self.neighbors_, *(len(each.neighbours) for each in self.experts_))

    def _network_of(self, labels: BranchLabels) -> Callable[[Array], Ints]:
        """Configurations (K, n) to the number of their branch's network, -1 where it has none."""
        numbers = np.full(len(self.branch_labels_) + 1, -1)
        numbers[self.branches_] = np.arange(len(self.branches_))
        return lambda q: np.asarray(numbers[labels.of(q)])

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        N, B = len(T), len(self.experts_)
        if self._rounds is None:
            q = self._predicted(T).reshape(N * B, self.robot_.dof)
            poses, numbers = np.divmod(np.arange(N * B), B)
            branch = self._branch(numbers)
            evaluations = np.full(N, B)
            return Proposal(q, poses, branch, evaluations=evaluations, evidence=searched(N))
        # where branches have names all of them are wanted, and q_seed only orders them
        first = None if self.branch_labels_ else q_seed
        most = self._most + (first is not None)
        found = self._rounds.solve(T, B, self.robot_.dof, self._starts(T, first), most)
        # of a branch without a solution the attempt is shown only where no branch has one
        shown = found.solved | ~found.solved.any(axis=1, keepdims=True)
        poses, numbers = np.nonzero(shown)
        q, branch = found.q[poses, numbers], self._branch(numbers)
        evaluations, starts = found.evaluations, found.starts.sum(axis=1)
        if self.fallback_ is not None:
            solved = found.solved[poses, numbers] & self._inside(q)
            lost = np.flatnonzero(np.bincount(poses[solved], minlength=N) == 0)
            more, spent = self._fall_back(np.ascontiguousarray(T[lost]), found.q[lost, 0], seed)
            evaluations[lost] += spent
            starts[lost] += 1
            q, poses = np.concatenate([q, more]), np.concatenate([poses, lost])
            branch = np.concatenate([branch, self._branch_of(more)])
        return Proposal(
            q, poses, branch, evaluations=evaluations, starts=starts, evidence=searched(N)
        )

    def _fall_back(self, T: Array, start: Array, seed: int) -> tuple[Array, Ints]:
        """``Numerical``'s candidates (K, n) from the first network's attempts, and evaluations."""
        if not len(T):
            return np.empty((0, self.robot_.dof)), np.zeros(0, np.int64)
        rest = restarting(self.settings_, self.robot_)._propose(
            T, np.ascontiguousarray(start), seed
        )
        assert rest.evaluations is not None
        return rest.q, rest.evaluations

    def _branch_of(self, q: Array) -> NDArray[np.int32]:
        """Branches of configurations (K, n), -1 where there are none."""
        if self._labels is None or not len(q):
            return np.full(len(q), -1, np.int32)
        return self._labels.of(q).astype(np.int32)

    def _starts(self, T: Array, q_seed: Array | None) -> Starts:
        """Of each pose: q_seed if given, the prediction, the nearest examples, as asked for."""
        near: dict[int, Ints] = {}

        def start(branch: int, poses: Ints, k: int) -> Array:
            expert = self.experts_[branch]
            if q_seed is not None:
                if k == 0:
                    return q_seed[poses]
                k -= 1
            if k == 0:
                return np.asarray(expert.predict(self.robot_, T[poses]))
            if branch not in near:
                near[branch] = np.full((len(T), self.neighbors_), -1)
            unknown = poses[near[branch][poses, 0] < 0]
            if len(unknown):
                near[branch][unknown] = expert.neighbours.of(T[unknown], self.neighbors_)
            return np.asarray(expert.neighbours.q[near[branch][poses, k - 1]])

        return start

    def _branch(self, numbers: Ints) -> NDArray[np.int32]:
        if not self.branch_labels_:
            return np.full(len(numbers), -1, np.int32)
        return self.branches_[numbers].astype(np.int32)

    def _is_final(self, q: Array) -> NDArray[np.bool_]:
        """Whether solutions (K, n) end a search.

        That of a named branch is its only one. Where branches have no names there are others, and
        one ends the search inside the limits.
        """
        return np.ones(len(q), np.bool_) if self.branch_labels_ else self._inside(q)

    def _predicted(self, T: Array) -> Array:
        q: Array = np.stack([expert.predict(self.robot_, T) for expert in self.experts_], axis=1)
        return q

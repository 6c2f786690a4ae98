"""The base of solvers that are trained: common settings, progress, files."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.ranking import turning
from kinverse.robot import LIMIT_SLACK, Robot
from kinverse.solvers._base import Settings, Solver
from kinverse.solvers.numerical import Numerical
from kinverse.solvers.trained import model_file
from kinverse.solvers.trained.examples import Examples
from kinverse.solvers.trained.expert import Expert
from kinverse.solvers.trained.held_out import HeldOut, held_out
from kinverse.solvers.trained.regressor import check_regressor, cloned
from kinverse.table import plain_evidence

__all__ = ["Trained", "check_fallback", "check_whole", "restarting", "searched"]

Array = NDArray[np.float64]

MOST_SEED = 2**32 - 1
"""The largest seed that scikit-learn's networks take."""

HELD_OUT = 20_240_229
"""Makes the seed of held-out examples another one than any of training."""
MOST_HELD_OUT = 1_000_000


class Trained(Solver):
    """A solver whose ``fit`` trains networks: ``network``, ``random_state``, ``progress``.

    Attributes:
        experts_: the trained networks with their examples.
        branches_: (B,) number of the branch that each of them stands for.
    """

    network: Any
    random_state: int
    progress: Callable[[str, float], Any] | None
    features: Any
    experts_: list[Any]
    trained_with_: dict[str, Any]
    branches_: NDArray[np.int64]
    _trains: ClassVar[bool] = True
    _expert: ClassVar[Any] = Expert
    _share: float = 0.0
    _ended: bool = False

    # Training ---------------------------------------------------------------------------------

    def _check_training(self) -> None:
        check_whole("random_state", self.random_state, 0, MOST_SEED)
        if self.network is not None:
            check_regressor(self.network)
        if self.progress is not None and not callable(self.progress):
            raise InputError(f"progress must be a function, got {self.progress!r}")

    def _default_network(self) -> Any:
        """What is trained where ``network`` is None."""
        raise NotImplementedError(f"{type(self).__name__} has no _default_network")

    def _new_network(self, number: int, label: str, total: int) -> Any:
        """A fresh network with a seed of its own, whose epochs ``progress`` is told."""
        network = self._default_network() if self.network is None else cloned(self.network)
        settings = network.get_params()
        if settings.get("random_state", 0) is None:
            network.set_params(random_state=(self.random_state + number) % MOST_SEED)
        if settings.get("callback", 0) is None:
            network.set_params(
                callback=lambda p: self._tell(label, (number + p.epoch / p.max_epochs) / total)
            )
        self._tell(label, number / total)
        return network

    def _note_ctrl_c(self, network: Any) -> None:
        """After Ctrl-C, which a network takes for its last epoch, the others have one each."""
        self._ended |= getattr(network, "stop_reason_", "") == "interrupted"

    def _tell(self, text: str, done: float) -> bool:
        """Tell ``progress``, and whether it ever asked to end; it is not asked again then."""
        if self.progress is None or self._ended:
            return self._ended
        # some trainers guess how many epochs there will be: the share does not fall back
        self._share = max(self._share, min(done, 1.0))
        self._ended = bool(self.progress(text, self._share))
        return self._ended

    # Solving ----------------------------------------------------------------------------------

    def predict(self, T: ArrayLike) -> Array:
        """What the networks say, neither refined nor verified.

        Args:
            T: (4, 4) or (N, 4, 4) poses.

        Returns:
            (N, B, n) joint values, one for each pose and network.

        Raises:
            InputError: not fitted, or a pose that cannot be used.

        Example:
            >>> solver.predict(T)[:, 0]
        """
        self._check_fitted()
        return self._predicted(se3.as_poses(T))

    def _check_fitted(self) -> None:
        if not self.is_fitted:
            name = type(self).__name__
            raise InputError(f"this {name} is not fitted: call {name}(...).fit(robot) first")

    def _predicted(self, T: Array) -> Array:
        """What the networks say of poses T (N, 4, 4): (N, B, n)."""
        raise NotImplementedError(f"{type(self).__name__} has no _predicted")

    def held_out(self, n_samples: int = 500) -> HeldOut:
        """What the networks predict for examples that they have not seen.

        They are made as the training examples were (``keep`` heeded, which a file does not hold),
        from a seed that is unrelated to ``random_state``. A virtual vector that a pose does not
        tell is taken from the nearest training example, as in ``solve``.

        Args:
            n_samples: examples for each network; a rare branch may have fewer or none.

        Raises:
            InputError: not fitted, or examples that cannot be made.

        Example:
            >>> np.median(solver.held_out().position_error)
        """
        self._check_fitted()
        check_whole("n_samples", n_samples, 2, MOST_HELD_OUT)
        rng = np.random.default_rng([HELD_OUT, int(self.trained_with_["random_state"])])
        parts = [
            held_out(
                self.robot_, self.settings_.task, k, *examples, self._predicted(examples.T)[:, k]
            )
            for k, examples in enumerate(self._fresh(n_samples, rng))
        ]
        return HeldOut(*map(np.concatenate, zip(*parts, strict=True)))

    def _fresh(self, n_samples: int, rng: np.random.Generator) -> list[Examples]:
        """Examples for each network, made as the training examples were."""
        raise NotImplementedError(f"{type(self).__name__} has no _fresh")

    # Files ------------------------------------------------------------------------------------

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Write the trained solver to a .npz file that holds no code.

        ``network``, ``keep`` and ``progress`` are not written: what they made is.

        Raises:
            InputError: not fitted, or a network that is none of ``kinverse.networks``.
            OSError: the file cannot be written.

        Example:
            >>> solver.save("kr16.npz")
        """
        model_file.save(self, path)

    @classmethod
    def load(cls, path: "str | os.PathLike[str]", robot: Robot) -> Self:
        """The solver that ``save`` wrote, fitted.

        Args:
            path: the file.
            robot: the robot that it was trained for.

        Raises:
            InputError: no model file, a damaged one, one of another version, or trained for
                another robot (both are named).
            FileNotFoundError: no such file.

        Example:
            >>> kv.Learned.load("kr16.npz", kv.load("kr16")).solve(T)
        """
        solver: Self = model_file.load(cls, path, robot)
        return solver

    def _restore(
        self,
        robot: Robot,
        labels: Sequence[str],
        branches: Sequence[int],
        experts: Sequence[tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]],
        given: Mapping[str, bool],
        where: str,
    ) -> None:
        self.branch_labels_, self.branches_ = tuple(labels), np.array(branches, np.int64)
        if self.branches_.shape != (len(experts),):
            raise InputError(f"{where}: {len(experts)} networks for branches {branches}")
        self.experts_ = [self._expert.unpacked(head, arrays, where) for head, arrays in experts]
        first = self.experts_[0]
        self.features = first.features.kind
        if hasattr(self, "virtual"):
            self.virtual = None if first.virtual is None else first.virtual.kind
        self.network = cloned(first.network) if given["network"] else None
        if given["network"] and not given["seeded"]:
            self.network.set_params(random_state=None)
        self._remember()
        self._bound_to(robot)

    def _remember(self) -> None:
        """Take over the settings as they are at ``fit``: those changed later wait for the next."""
        settings = self.get_params()
        self.trained_with_ = {key: value for key, value in settings.items() if key != "progress"}

    def _inside(self, q: Array) -> NDArray[np.bool_]:
        """Whether joint values (K, n) keep the limits, by another winding if need be."""
        if self.settings_.limits == "ignore":
            return np.ones(len(q), np.bool_)
        low, high = self.robot_.limits.T
        turns = np.ceil((low - LIMIT_SLACK - q) / (2.0 * np.pi))
        wound = q + 2.0 * np.pi * np.where(turning(self.robot_), turns, 0.0)
        inside = (wound >= low - LIMIT_SLACK) & (wound <= high + LIMIT_SLACK)
        return np.asarray(inside.all(axis=1))


def searched(poses: int) -> NDArray[np.void]:
    """The evidence of a search: what it found outside the limits does not show that none is inside.

    Without it verification says OUT_OF_LIMITS of a pose whose candidates all lie outside.
    """
    return plain_evidence("search", poses)


def check_whole(name: str, value: Any, least: int, most: int) -> None:
    """Refuse a setting that is no whole number in [least, most] (InputError)."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InputError(f"{name} must be a whole number, got {value!r}")
    if not least <= value <= most:
        raise InputError(f"{name} must lie in {least}..{most}, got {value!r}")


def check_fallback(value: Any) -> None:
    """Refuse what is no fall-back (InputError)."""
    if value not in ("numerical", None):
        raise InputError(f"fallback must be 'numerical' or None, got {value!r}")


def restarting(settings: Settings, robot: Robot) -> Numerical:
    """What falls back: ``Numerical`` with the same settings and all its restarts."""
    return Numerical(
        task=settings.task,
        tol_position=settings.tol_position,
        tol_rotation=settings.tol_rotation,
        limits=settings.limits,
    ).fit(robot)

"""The base of every solver: settings in, a fitted object out, verified answers only.

A new solver writes ``__init__`` (settings stored untouched), ``_fit`` and ``_propose``::

    class Mine(Solver):
        def __init__(self, *, task="pose", tries=8, tol_position=1e-6, tol_rotation=1e-6,
                     windings="nearest", limits="hold"):
            self.task, self.tries = task, tries
            ...

        def _propose(self, T, q_seed, seed):
            return Proposal(q, pose_index)

Names tell what lives how long: settings have plain names; what ``_fit`` learns ends in ``_`` and
is pickled; native handles start with ``_``, are made by ``_bind`` and are never pickled.
"""

from collections.abc import Callable
from math import prod
from typing import Any, ClassVar, Self, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.ranking import turning
from kinverse.robot import Robot
from kinverse.seeds import seed_of
from kinverse.settings import HasSettings
from kinverse.solutions import Origin, Solutions
from kinverse.table import TableLike
from kinverse.task import as_task
from kinverse.verify import Proposal, Settings, verify_table

__all__ = ["Fused", "Proposal", "Rng", "Settings", "Solver"]

Array = NDArray[np.float64]
# text, because naming np.random loads it: a tenth of numpy's own import
Rng: TypeAlias = "int | np.random.Generator | None"
Fused = Callable[[Any, Any, int], TableLike | None]

MOST_WINDINGS = 4096
"""Windings a solution may have: that many the native core lists."""

_blank = object.__new__


class Solver(HasSettings):
    """Settings object in the manner of scikit-learn; ``fit`` binds a robot, ``solve`` answers.

    Attributes:
        robot_: the robot, once fitted.
        settings_: the checked common settings, once fitted.
        branch_labels_: names of the branch numbers, empty where a method has none.
    """

    robot_: Robot
    settings_: Settings
    branch_labels_: tuple[str, ...] = ()

    _fused: Fused | None = None
    _trains: ClassVar[bool] = False
    """Whether ``fit`` takes seconds or more."""
    _origin: Origin
    _common: ClassVar = ("task", "tol_position", "tol_rotation", "windings", "limits")

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        for name in ("solve", "fit"):
            if name in cls.__dict__:
                raise TypeError(
                    f"{cls.__name__} overrides {name}, which is final: write _fit and _propose"
                )

    # What a solver writes ---------------------------------------------------------------------

    def _fit(self, robot: Robot) -> None:
        """Learn what depends on the robot into attributes that end in ``_``."""

    def _bind(self) -> None:
        """Make native handles (and ``_fused``) from settings and learned state.

        Called after ``_fit`` and again after unpickling and copying. ``_fused(T, q_seed, seed)``
        answers in one native call, or returns None to ask for the checked way.
        """

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        """Candidates for poses T (N, 4, 4); q_seed is (N, n) or None.

        A pose's random stream may depend on (seed, the pose) only, never on its index.
        """
        raise NotImplementedError(f"{type(self).__name__} has no _propose")

    def _refine(self, T: Array, q_start: Array) -> Array:
        """Improve starts (K, n) towards poses (K, 4, 4); only for solvers that ``Seeded`` can use.

        Returns (K, n) candidates, unverified, whether or not they converged.
        """
        raise NotImplementedError(f"{type(self).__name__} has no _refine")

    def _counted_from_seed(self) -> str:
        """Name of a setting that is counted from q_seed, which must then be given; "" if none."""
        return ""

    # What a user calls ------------------------------------------------------------------------

    @final
    def fit(self, robot: Robot) -> Self:
        """Check the settings, bind the robot, learn; returns the solver.

        Settings changed later take effect at the next ``fit``.

        Args:
            robot: the robot to solve for.

        Raises:
            InputError: a setting or the robot cannot be used.
            NoClosedForm: a closed-form solver knows no family for this robot.

        Example:
            >>> solver = kv.Numerical().fit(robot)
            >>> solver.solve(T).ok
        """
        if not isinstance(robot, Robot):
            raise InputError(f"fit needs a kinverse.Robot, got {type(robot).__name__}")
        for name in [name for name in vars(self) if _is_state(name)]:
            delattr(self, name)
        self.settings_ = self._check_settings()
        _check_for_robot(self.settings_, robot)
        try:
            self._fit(robot)
            self.robot_ = robot
            self._rebind()
        except BaseException:
            for name in [name for name in vars(self) if _is_state(name)]:
                delattr(self, name)
            raise
        return self

    @final
    def solve(self, T: ArrayLike, q_seed: ArrayLike | None = None, rng: Rng = None) -> Solutions:
        """Every verified solution of every pose.

        Args:
            T: (4, 4) or (N, 4, 4), tool in base [m]; an object with ``as_matrix()`` or ``.A``.
            q_seed: (n,) or (N, n) joint values [rad or m] to be near to; they also order the
                solutions of a pose and choose windings.
            rng: None (a fixed seed), an int >= 0 or a Generator (one draw a call).

        Returns:
            ``Solutions`` of length 1 or N.

        Raises:
            InputError: not fitted, or a pose or seed that cannot be used (its row is named).
            TypeError: complex, object or text arrays.

        Example:
            >>> solver = kv.Numerical().fit(robot)
            >>> solver.solve(robot.fk(q), q_seed=q).q[0]
        """
        fused = self._fused
        seed = seed_of(rng)
        if fused is not None:
            table = fused(T, q_seed, seed)
            if table is not None:
                # Solutions(table, origin) without the call of __init__: a twentieth of a solve
                answer = _blank(Solutions)
                answer._table = table
                answer._origin = self._origin
                return answer
        if not self.is_fitted:
            name = type(self).__name__
            raise InputError(f"this {name} is not fitted: call {name}(...).fit(robot) first")
        self._check_seed(q_seed)
        poses = se3.as_poses(T)
        near = _seeds(q_seed, self.robot_.dof, len(poses))
        return Solutions(self._answer(poses, near, seed), self._origin)

    @property
    def is_fitted(self) -> bool:
        """Whether ``fit`` has been called (and succeeded)."""
        return "_origin" in self.__dict__

    # How it works -----------------------------------------------------------------------------

    def _check_settings(self) -> Settings:
        """The common settings, checked; a wrapper takes them from its children."""
        return Settings(**{name: getattr(self, name) for name in self._common})

    def _check_seed(self, q_seed: Any) -> None:
        setting = self._counted_from_seed() if q_seed is None else ""
        if setting:
            raise InputError(f"{setting} is counted from q_seed: give one")

    def _answer(self, T: Array, q_seed: Array | None, seed: int) -> TableLike:
        """A verified table for checked poses (N, 4, 4) and seeds (N, n)."""
        if self._fused is not None:
            table = self._fused(T, q_seed, seed)
            if table is not None:
                return table
        return self._verified(T, self._propose(T, q_seed, seed), q_seed)

    def _verified(self, T: Array, proposal: Proposal, q_seed: Array | None) -> TableLike:
        """What holds of a proposal, measured on the robot as given."""
        return verify_table(self.robot_, self._origin.task, T, proposal, q_seed, self.settings_)

    def _solutions(self, table: TableLike) -> Solutions:
        """A verified native table as the answer of a method beside ``solve``."""
        return Solutions(table, self._origin)

    def _ready(self, robot: Robot) -> Self:
        """A new solver with these settings, fitted; where training takes long, this one.

        One that was trained for another robot is refused: a second training must be asked for.
        """
        if not (self._trains and self.is_fitted and isinstance(robot, Robot)):
            # no clone: it would drop what solvers among the settings have learned
            return type(self)(**self.get_params()).fit(robot)
        if self.robot_ != robot:
            name, mine = type(self).__name__, self.robot_.name
            other = f"{robot.name!r}" if robot.name != mine else f"another {robot.name!r}"
            raise InputError(
                f"this {name} is trained for {mine!r}, not for {other}:"
                " solver.clone().fit(robot) trains one for it"
            )
        return self

    def _bound_to(self, robot: Robot) -> Self:
        """Bind a robot to learned state that was read from a file."""
        self.settings_ = self._check_settings()
        _check_for_robot(self.settings_, robot)
        self.robot_ = robot
        self._rebind()
        return self

    def _rebind(self) -> None:
        task = as_task(self.settings_.task)
        self._origin = Origin(self.robot_, task, self.branch_labels_, self.settings_.limits)
        self._bind()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "robot_" in state:
            self._rebind()


def _is_state(name: str) -> bool:
    return name.startswith("_") or name.endswith("_")


def _seeds(q_seed: Any, dof: int, poses: int) -> Array | None:
    """The seeds of a call, checked: (poses, dof) or None."""
    if q_seed is None:
        return None
    return se3.as_joints(q_seed, dof, "q_seed", count=poses, bound=se3.MOST_SEED)


def _check_for_robot(settings: Settings, robot: Robot) -> None:
    """What common settings ask of a robot, and of each other."""
    for name in ("tol_position", "tol_rotation"):
        if np.iscomplexobj(getattr(settings, name)):
            raise InputError(f"{name} must be a real number, got {getattr(settings, name)!r}")
    if settings.windings != "all":
        return
    if settings.limits == "ignore":
        raise InputError(
            "windings='all' lists what is inside the limits and limits='ignore' has none:"
            " set one of them to its default"
        )
    low, high = robot.limits.T
    count = np.floor((high - low) / (2.0 * np.pi)).astype(np.int64) + 1
    count[~turning(robot)] = 1
    total = prod(count.tolist())
    if total > MOST_WINDINGS:
        wide = zip(robot.joint_names, count.tolist(), strict=True)
        shown = ", ".join(f"{name} ({turns})" for name, turns in wide if turns > 1)
        raise InputError(
            f"windings='all' would give {total} windings a solution, more than {MOST_WINDINGS}:"
            f" narrow the limits of {shown}"
        )

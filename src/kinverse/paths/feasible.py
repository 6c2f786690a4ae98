"""Which parts of a path an arm can do at all, pose by pose, and why it cannot do the others."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.checks import as_length
from kinverse.paths.path import MOST_SAMPLES, Path
from kinverse.robot import Robot
from kinverse.solvers import Solver, make_solver
from kinverse.status import Status

__all__ = ["Feasibility", "Interval", "feasible"]

Array = NDArray[np.float64]
Statuses = NDArray[np.uint8]


class Interval(NamedTuple):
    """A part of a path from ``start`` to ``end`` and the status of every pose met in it."""

    start: float
    end: float
    status: Status

    @property
    def length(self) -> float:
        """From start to end, in the unit of the path."""
        return self.end - self.start


@dataclass(frozen=True)
class Feasibility:
    """What an arm can do of a path.

    Attributes:
        intervals: from the path's start to its end, without a gap; neighbours differ in status.
        unit: what parameters are in, "m" or "rad".
    """

    intervals: tuple[Interval, ...]
    unit: str

    @property
    def whole(self) -> bool:
        """Whether the arm can do all of it."""
        return not self.infeasible

    @property
    def feasible(self) -> tuple[Interval, ...]:
        """The parts whose poses have a solution inside the limits; both ends have one too."""
        return tuple(part for part in self.intervals if part.status == Status.SOLVED)

    @property
    def infeasible(self) -> tuple[Interval, ...]:
        """The parts whose poses have none, each with one reason: its ``status``."""
        return tuple(part for part in self.intervals if part.status != Status.SOLVED)

    @property
    def share(self) -> float:
        """How much of the path is feasible, from 0 to 1."""
        done = sum(part.length for part in self.feasible)
        return done / (self.intervals[-1].end - self.intervals[0].start)

    def status_at(self, s: ArrayLike) -> Statuses:
        """A ``Status`` (...) for parameters s (...); where two parts meet SOLVED comes first."""
        at = se3.as_real(s, "s")
        ends = np.array([part.end for part in self.intervals])
        last = len(ends) - 1
        states = np.array([part.status for part in self.intervals], dtype=np.uint8)
        before = states[np.minimum(np.searchsorted(ends, at, side="left"), last)]
        after = states[np.minimum(np.searchsorted(ends, at, side="right"), last)]
        return np.asarray(np.where(after == Status.SOLVED, after, before))

    def __repr__(self) -> str:
        lines = [
            f"{part.start:.9g} to {part.end:.9g} {self.unit}: {part.status.name}"
            for part in self.intervals
        ]
        return "\n  ".join([f"Feasibility: {100 * self.share:.4g} % of the path", *lines])


def feasible(
    robot: Robot,
    path: Path,
    task: str | None = None,
    solver: str | Solver = "auto",
    count: int = 1000,
    tolerance: float = 1e-9,
) -> Feasibility:
    """The parts of a path whose poses the arm reaches, each pose for itself.

    The path is looked at in ``count`` places and where its pieces meet; where the status changes
    from one to the next, the place is found by halving. A part that lies between two places is
    not seen. Where reach or limits end, a solver may be unable to show either within its
    tolerances: a sliver of NOT_FOUND, narrower with tighter ones. Whether the arm can also move
    on through a feasible part is for ``track`` to say.

    Args:
        robot: the arm.
        path: what to follow.
        task: see ``kinverse.task``; None: "pose".
        solver: a name or a solver object, as in ``kv.solve``; an object brings its own task. Its
            tolerances count here too: a pose a micrometre out of reach is reached to within one.
        count: places to look at, at least two.
        tolerance: largest error of the ends of a part, in the unit of the path.

    Raises:
        InputError: an argument that cannot be used.
        NoClosedForm: "analytic" knows no family for this robot.

    Example:
        >>> arm = kv.load("planar3r_003")
        >>> feasible(arm, named_path("habibkhah_2"), task="planar").share < 1
        True
    """
    if not isinstance(robot, Robot):
        raise InputError(f"robot must be a kinverse.Robot, got {type(robot).__name__}")
    if not isinstance(path, Path):
        raise InputError(f"path must be a kinverse.paths.Path, got {type(path).__name__}")
    close = max(as_length(tolerance, "tolerance", least=1e-300), 4e-16 * path.length)
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 2:
        raise InputError(f"count must be a whole number of at least 2, got {count!r}")
    if count > MOST_SAMPLES:
        raise InputError(f"count must be at most {MOST_SAMPLES}, got {count}")
    fitted = _fitted(robot, solver, task)

    def look(s: Array) -> Statuses:
        return fitted.solve(path(s)).status

    s = np.union1d(np.linspace(0.0, path.length, int(count)), path.breaks)
    status = look(s)
    edges = _edges(look, s, status, close)
    starts, ends = [0.0, *(at for at, _ in edges)], [*(at for at, _ in edges), path.length]
    states = [int(status[0]), *(after for _, after in edges)]
    parts = zip(starts, ends, states, strict=True)
    return Feasibility(tuple(Interval(a, b, Status(c)) for a, b, c in parts), path.unit)


def _edges(
    look: Callable[[Array], Statuses], s: Array, status: Statuses, close: float
) -> list[tuple[float, int]]:
    """Where the status changes, ascending, and what it changes to."""
    k = np.flatnonzero(status[:-1] != status[1:])
    low, high, before, after = s[k], s[k + 1], status[k], status[k + 1]
    while (wide := high - low > close).any():
        middle = (low[wide] + high[wide]) / 2.0
        seen = look(middle)
        as_before, as_after = seen == before[wide], seen == after[wide]
        third = ~as_before & ~as_after  # a third status lies between: one change becomes two
        tail, end = high[wide][third], after[wide][third]
        low[wide] = np.where(as_before, middle, low[wide])
        high[wide] = np.where(as_before, high[wide], middle)
        after[wide] = np.where(third, seen, after[wide])
        low, high = np.append(low, middle[third]), np.append(high, tail)
        before, after = np.append(before, seen[third]), np.append(after, end)
    # the feasible side, so that both ends of a feasible part can be solved
    solved = int(Status.SOLVED)
    at = np.where(after == solved, high, np.where(before == solved, low, (low + high) / 2.0))
    order = np.argsort(low, kind="stable")
    return [(float(at[i]), int(after[i])) for i in order]


def _fitted(robot: Robot, solver: str | Solver, task: str | None) -> Solver:
    if isinstance(solver, Solver):
        if task is not None:
            raise InputError("task belongs to the solver object: set it there")
        return solver.clone().fit(robot)
    return make_solver(solver, robot, "pose" if task is None else task).fit(robot)

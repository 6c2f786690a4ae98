"""Why a path is not followed somewhere: each break is looked at again under looser rules."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.paths.joint_path import Angle, Gap, Reason, SampleNumber
from kinverse.paths.joint_units import joint_units
from kinverse.paths.tracking.branches import Branches
from kinverse.paths.tracking.layers import Layers
from kinverse.paths.tracking.problem import Problem
from kinverse.paths.tracking.samples import Samples
from kinverse.paths.tracking.search import Found, follow
from kinverse.ranking import TURN, turning
from kinverse.status import Status

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["gaps"]

Array = NDArray[np.float64]
Words = Sequence[str | Angle | SampleNumber]

BETWEEN = 32
"""Pieces that the way between two samples is cut into."""
CONTINUOUS = 0.1
"""Joint steps up to this [rad or m] between the pieces are no jump, however small max_step is."""
SLACK = 1e-9
"""A step may be longer than the largest one by this part of it: rounding."""
MOST_MISSED = 16
"""Samples of a gap whose distance from what the arm reaches is looked at."""
MISSED = 1e-6
"""A miss up to this [m, rad] is not told."""
JUMP = 10.0
"""A step this many times the path's median step [m, rad] is a jump."""

_OF_STATUS = {
    Status.OUT_OF_LIMITS: Reason.OUT_OF_LIMITS,
    Status.UNREACHABLE: Reason.OUT_OF_REACH,
    Status.NOT_FOUND: Reason.NOT_FOUND,
}


def gaps(problem: Problem, layers: Layers, found: Found) -> tuple[Gap, ...]:
    """The gaps of a way through the layers, in order."""
    made = _lost(problem, layers, found) + _start(problem, found)
    breaks = _breaks(found)
    judge = _Judge(problem)
    for sample, k in breaks:
        rows, q = found.reached(k)
        f = int(found.barrier[k])
        code, words = judge.verdict(f, q, layers.side[rows])
        made.append(Gap(sample, sample, code, words, f))
    return tuple(sorted(made, key=lambda gap: (gap.start, gap.end)))


def _start(problem: Problem, found: Found) -> list[Gap]:
    """The way from ``q_start`` to the first sample, where it is no step."""
    steps = problem.steps
    if steps.q_start is None or found.row[0] < 0:
        return []
    step = np.abs(found.q[0] - steps.q_start)
    over = step / steps.max_step
    j = int(over.argmax())
    if over[j] <= 1.0 + SLACK:
        return []
    words = (
        f"from q_start to the first pose joint {problem.robot.joint_names[j]!r} moves ",
        _moved(problem.robot, j, step[j]),
        ", more than its largest step ",
        _moved(problem.robot, j, steps.max_step[j]),
    )
    return [Gap(0, 0, Reason.STEP, words)]


def _moved(robot: "Robot", joint: int, amount: float) -> str | Angle:
    return Angle(amount) if joint_units(robot)[joint] == "rad" else f"{amount:.3g} m"


def _lost(problem: Problem, layers: Layers, found: Found) -> list[Gap]:
    """Runs of samples without a row, by reason."""
    count = len(layers)
    code = np.full(count, -1)
    for status, reason in _OF_STATUS.items():
        code[layers.status == status] = reason
    code[layers.removed > 0] = Reason.COLLISION
    code[found.row >= 0] = -1
    ends = np.flatnonzero(np.diff(code)) + 1
    made = []
    for start, end in zip(np.append(0, ends), np.append(ends, count), strict=True):
        if code[start] >= 0:
            reason = Reason(int(code[start]))
            words: Words = reason.text
            if reason is Reason.COLLISION and not problem.branches.is_exhaustive:
                words = _refused(layers.removed[start:end])
            elif reason in (Reason.OUT_OF_REACH, Reason.NOT_FOUND):
                words = (reason.text, *_missed(problem, int(start), int(end)))
            made.append(Gap(int(start), int(end), reason, words))
    return made


def _missed(problem: Problem, start: int, end: int) -> Words:
    """How far the best joint values that the solver knows are from samples without a solution."""
    solver = getattr(problem.branches, "solver", None)
    if solver is None:
        return ()
    at = np.unique(np.linspace(start, end - 1, min(end - start, MOST_MISSED)).round().astype(int))
    stats = solver.solve(problem.samples.T[at]).stats
    away, turned = (
        float(np.nan_to_num(miss).max())
        for miss in (stats.best_position_error, stats.best_rotation_error)
    )
    off: list[str | Angle] = []
    if away > MISSED:
        off = [f"{away:.3g} m"]
    if turned > MISSED:
        off += [" and ", Angle(turned)] if off else [Angle(turned)]
    upto = "up to " if end - start > 1 else ""
    return (f"; the nearest joint values that are known miss it by {upto}", *off) if off else ()


def _refused(count: NDArray[np.int64]) -> str:
    """What is known where not every solution can be looked at."""
    low, high = int(count.min()), int(count.max())
    told = f"{low}" if low == high else f"{low} to {high}"
    return f"every solution that was looked at, {told} a sample, is refused by keep"


def _breaks(found: Found) -> list[tuple[int, int]]:
    """(sample, barrier): the breaks of the way, and which barrier forces each.

    Between one barrier and the next there is one break, wherever it is cheapest; a gap of lost
    samples is a break and a barrier at once.
    """
    live = found.row >= 0
    after = np.flatnonzero(live[1:] & ~found.linked[1:] & (np.cumsum(live) > 0)[:-1]) + 1
    barriers = iter(range(len(found.barrier)))
    return [(int(i), next(barriers)) for i in after if live[i - 1]]


class _Judge:
    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def verdict(self, f: int, q: Array, side: NDArray[np.int32]) -> tuple[Reason, Words]:
        """Why joint values q (K, n) at sample f lead to none at the next one."""
        problem = self.problem
        where = ("from ", SampleNumber(f), " to ", SampleNumber(f + 1))
        fine = self._fine(f)
        if self._way(problem, fine, q, side) is not None:
            return Reason.STEP, (*where, *self._step_words(f))
        if problem.keep is not None:
            if self._way(replace(problem, keep=None), fine, q, side) is not None:
                looked = "" if problem.branches.is_exhaustive else " that was looked at"
                return Reason.COLLISION, (*where, f" every way on{looked} is refused by keep")
        free = replace(problem, branches=self._free)
        for looser in (free, replace(free, keep=None)):
            found = self._way(looser, fine, q, side)
            if found is not None:
                return Reason.OUT_OF_LIMITS, (*where, f" {self._limits_text(found)}")
            if problem.keep is None:
                break
        status = free.branches.layers(fine.T).status
        if (status != Status.SOLVED).any():
            code = _OF_STATUS[Status(int(status[status != Status.SOLVED][0]))]
            return code, (*where, f", between them: {code.text}")
        return Reason.SINGULARITY, (*where, f" {Reason.SINGULARITY.text}")

    def _fine(self, f: int) -> Samples:
        fraction = np.linspace(0.0, 1.0, BETWEEN + 1)[1:-1]
        inner = self.problem.samples.at(np.full(len(fraction), f), fraction)
        ends = self.problem.samples.T[f : f + 2]
        return Samples(np.concatenate([ends[:1], inner, ends[1:]]))

    @cached_property
    def _free(self) -> Branches:
        """The same arm with a turn more to each side, and slides of three times the range."""
        robot = self.problem.robot
        low, high = robot.limits.T
        more = np.where(turning(robot), TURN, high - low)
        return self.problem.branches.on(
            robot.with_limits(np.column_stack([low - more, high + more]))
        )

    @staticmethod
    def _way(problem: Problem, samples: Samples, q: Array, side: NDArray[np.int32]) -> Found | None:
        """The way from q through all samples, if there is one without a break."""
        max_step = np.maximum(problem.steps.max_step, CONTINUOUS)
        steps = replace(problem.steps, q_start=None, max_step=max_step)
        problem = replace(problem, samples=samples, steps=steps)
        layers = problem.layers()
        rows = layers.start[1]
        first = np.zeros(len(layers.q), np.bool_)
        first[rows:] = True
        # at the first sample nothing but where the arm can be
        layers = layers.only(first).with_rows(np.zeros(len(q), np.int64), q, -1, side, True)
        if (np.diff(layers.start) == 0).any():
            return None
        _, found = follow(problem, layers)
        return found if found.breaks == 0 and (found.row >= 0).all() else None

    def _limits_text(self, found: Found) -> str:
        robot = self.problem.robot
        low, high = robot.limits.T
        outside = np.maximum(low - found.q, found.q - high).max(axis=0)
        names = [name for name, far in zip(robot.joint_names, outside, strict=True) if far > 1e-9]
        return f"every way on leaves the limits of {', '.join(names)}"

    def _step_words(self, f: int) -> Words:
        T = self.problem.samples.T
        moved = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
        turned = np.linalg.norm(
            se3.rotation_log(np.swapaxes(T[:-1, :3, :3], 1, 2) @ T[1:, :3, :3]), axis=1
        )
        said = f" the pose moves {moved[f]:.3g} m and turns ", Angle(turned[f])
        is_jump = moved[f] > JUMP * max(np.median(moved), 1e-9)
        is_jump = is_jump or turned[f] > JUMP * max(np.median(turned), 1e-6)
        if is_jump:
            return (" the path jumps:", *said)
        return (*said, ", which takes more than the largest joint step: sample it finer")

"""Searches of populations for joint values: one candidate a pose, or every branch in turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.optimizers import History, Optimizer, Run
from kinverse.optimizers.streams import Streams
from kinverse.solvers._base import Proposal
from kinverse.solvers.descent import apart
from kinverse.solvers.population.objective import PoseObjective
from kinverse.solvers.population.polish import Polish, distinct

__all__ = ["PopulationSearch"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_SOLUTIONS = 128
"""Solutions kept of a pose by ``every``: a continuum has no end of them."""

MOST_ISOLATED = 16
"""More solutions than that are members of continua: no six turning joints have more apart."""

MEMBERS_APART = 0.4
"""How far members of a continuum that are kept are apart [largest joint, rad or m]."""

IDLE_SEARCHES = 5
"""``every`` ends after so many searches in a row that found nothing new."""

SAME = 1e-5
"""Polished solutions within this [largest joint, rad or m] are one."""

BLOCK = 64
"""Poses whose populations run side by side: their arrays stay in the processor's cache."""


@dataclass
class Found:
    """What searches found of some poses."""

    q: Array  # (N, n) the best point
    cost: Array  # (N,) its objective
    evaluations: Ints  # (N,)
    starts: Ints  # (N,) descents
    candidates: list[Array]  # (K, n) of each pose

    @classmethod
    def of_none(cls, poses: int, dof: int) -> "Found":
        """Nothing yet."""
        none = np.zeros(poses, np.int64)
        rows = [np.empty((0, dof)) for _ in range(poses)]
        return cls(np.full((poses, dof), np.nan), np.full(poses, np.inf), none, none.copy(), rows)

    def keep_better(self, poses: Ints, run: Run) -> None:
        """Take over the best points of a run over some of the poses where they are better."""
        better = run.f_best < self.cost[poses]
        self.cost[poses[better]] = run.f_best[better]
        self.q[poses[better]] = run.x_best[better]
        self.evaluations[poses] += run.evaluations


@dataclass(frozen=True)
class PopulationSearch:
    """Searches with one method, objective and box, and the descents that follow them.

    A pose's random stream is keyed by the seed, the pose's own digits and the number of the search.
    """

    optimizer: Optimizer
    objective: PoseObjective
    box: Array
    max_evals: int
    max_searches: int
    weight: float | str
    taboo_radius: float
    turns: NDArray[np.bool_]
    polish: Polish | None

    def propose(self, T: Array, q_seed: Array | None, seed: int, every: bool) -> Proposal:
        """Candidates: one a pose, or as many different ones as searches in turn find."""
        search = self._every if every else self._one
        parts = [Found.of_none(0, len(self.box))]
        for first in range(0, len(T), BLOCK):
            rows = slice(first, first + BLOCK)
            near = None if q_seed is None else q_seed[rows]
            parts.append(search(np.ascontiguousarray(T[rows]), near, seed))
        candidates = [rows for part in parts for rows in part.candidates]
        return Proposal(
            np.concatenate([np.empty((0, len(self.box))), *candidates]),
            np.repeat(np.arange(len(T)), [len(rows) for rows in candidates]),
            evaluations=np.concatenate([part.evaluations for part in parts]),
            starts=np.concatenate([part.starts for part in parts]) if self.polish else None,
            cost=np.concatenate([part.cost for part in parts]),
        )

    def _one(self, T: Array, q_seed: Array | None, seed: int) -> Found:
        found = Found.of_none(len(T), len(self.box))
        open_ = np.arange(len(T))
        solution = np.full_like(found.q, np.nan)
        for search in range(self.max_searches if self.polish else 1):
            run = self.searched(T[open_], _rows(q_seed, open_), seed, search)
            found.keep_better(open_, run)
            if self.polish is None:
                break
            done = self.polish.first_of_each(T[open_], *_members(run))
            solution[open_[done.found]] = done.q[done.found]
            found.evaluations[open_] += done.evaluations
            found.starts[open_] += done.polishes
            open_ = open_[~done.found]
            if not len(open_):
                break
        q = np.where(np.isnan(solution), found.q, solution)
        found.candidates = list(q[:, None])
        return found

    def _every(self, T: Array, q_seed: Array | None, seed: int) -> Found:
        found = Found.of_none(len(T), len(self.box))
        known, idle, open_ = found.candidates, np.zeros(len(T), np.int64), np.arange(len(T))
        for search in range(self.max_searches):
            taboo = _padded([known[i] for i in open_])
            run = self.searched(T[open_], _rows(q_seed, open_), seed, search, taboo)
            found.keep_better(open_, run)
            solutions = self._polished(T[open_], _members(run)[0], found, open_)
            for i, rows in zip(open_, solutions, strict=True):
                kept = self._thinned(np.concatenate([known[i], rows]))
                idle[i] = 0 if len(kept) > len(known[i]) else idle[i] + 1
                known[i] = kept
            more = [idle[i] < IDLE_SEARCHES and len(known[i]) < MOST_SOLUTIONS for i in open_]
            open_ = open_[np.array(more)]
            if not len(open_):
                break
        found.candidates = [
            rows if len(rows) else q[None] for rows, q in zip(known, found.q, strict=True)
        ]
        return found

    def _thinned(self, q: Array) -> Array:
        """The different ones of solutions (K, n); members of continua only where well apart."""
        q = q[distinct(q, SAME, self.turns)]
        if len(q) > MOST_ISOLATED:
            q = q[distinct(q, MEMBERS_APART, self.turns)]
        return q[:MOST_SOLUTIONS]

    def _polished(self, T: Array, starts: Array, found: Found, poses: Ints) -> list[Array]:
        """The solutions of each pose that its starts (A, K, n) lead to."""
        assert self.polish is not None  # Swarm refuses all_branches without
        count, dof = starts.shape[1:]
        q, solved, spent, _ = self.polish.each(np.repeat(T, count, axis=0), starts.reshape(-1, dof))
        found.evaluations[poses] += spent.reshape(-1, count).sum(axis=1)
        found.starts[poses] += count
        rows, good = q.reshape(-1, count, dof), solved.reshape(-1, count)
        return [these[ok] for these, ok in zip(rows, good, strict=True)]

    def searched(
        self,
        T: Array,
        q_seed: Array | None,
        seed: int,
        search: int = 0,
        taboo: Array | None = None,
        history: History | None = None,
    ) -> Run:
        """A finished run."""
        words = _pose_words(T)
        run = self.optimizer.start(
            self.box,
            max_evals=self.max_evals,
            rng=seed,
            problems=len(T),
            keys=[np.append(pose, search) for pose in words],
            x0=None if q_seed is None else self._in_box(q_seed)[:, None],
        )
        weight = self._weights(words, seed)
        while not run.done:
            rows, q = run.active, run.ask()
            near = None if q_seed is None else q_seed[rows]
            cost = self.objective(T[rows], weight[rows], near, q)
            if taboo is not None:
                known = taboo[rows][:, :, None]
                far = apart(q[:, None], known, self.turns, self.taboo_radius)
                cost[~far.all(axis=1)] = np.inf
            run.tell(cost)
            if history is not None:
                history(run)
        return run

    def _in_box(self, q: Array) -> Array:
        """Joint values by whole turns to where the box is."""
        turn = 2.0 * np.pi * np.rint((q - self.box.mean(axis=1)) / (2.0 * np.pi))
        return np.where(self.turns, q - turn, q)

    def _weights(self, words: NDArray[np.uint32], seed: int) -> Array:
        if self.weight != "random":
            return np.full(len(words), float(self.weight))
        return Streams([(seed & 0xFFFFFFFF, seed >> 32, *pose) for pose in words]).uniform(1)[:, 0]


def _members(run: Run) -> tuple[Array, Array]:
    """The best point and the last population as starts (M, 1 + K, n), and what they cost."""
    x, f = run.members()
    q = np.concatenate([run.x_best[:, None], x], axis=1)
    return q, np.concatenate([run.f_best[:, None], f], axis=1)


def _pose_words(T: Array) -> NDArray[np.uint32]:
    """(N, 24) what keys the random stream of a pose: its digits, -0 and 0 alike."""
    rows = np.ascontiguousarray(T[:, :3, :], dtype="<f8") + 0.0
    return rows.reshape(len(T), -1).view(np.uint32)


def _rows(q_seed: Array | None, poses: Ints) -> Array | None:
    return None if q_seed is None else q_seed[poses]


def _padded(rows: list[Array]) -> Array | None:
    """(A, S, n) with NaN where a pose has fewer; NaN is far from everything. None if all empty."""
    most = max(len(row) for row in rows)
    if not most:
        return None
    block = np.full((len(rows), most, rows[0].shape[1]), np.nan)
    for out, row in zip(block, rows, strict=True):
        out[: len(row)] = row
    return block

"""Solve in chunks with a progress bar, and print what came out as table, JSON or CSV."""

import csv
import io
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

import kinverse as kv
from kinverse.cli._poses import Poses
from kinverse.cli._show import (
    arm_size,
    console,
    joint_header,
    joint_kinds,
    joint_values,
    note,
    notes,
    outside_limits,
    show_table,
    table,
    tiny,
)

if TYPE_CHECKING:
    from kinverse.robot import Robot
    from kinverse.solutions import Solutions
    from kinverse.solvers import Solver

__all__ = ["Answers", "run"]

CHUNK = 2000
"""Poses a call: answers do not depend on it, the progress bar and Ctrl-C do."""
SHOWN = 20
"""Poses of a batch that are printed; a file gets them all."""
FAR = 10.0
"""A miss of so many times the arm's size is taken for a mistake of units."""


def run(
    solver: "Solver",
    given: Poses,
    *,
    q_seed: NDArray[np.float64] | None,
    rng: int | None,
) -> list["Solutions"]:
    """Solve all poses; Ctrl-C ends early and keeps what is done."""
    done: list[Solutions] = []
    starts = range(0, max(len(given.T), 1), CHUNK)
    bar = Progress(console=notes(), transient=True, disable=len(starts) < 2)
    with bar:
        job = bar.add_task("solving", total=len(given.T))
        try:
            for start in starts:
                T = given.T[start : start + CHUNK]
                done.append(solver.solve(T, q_seed, rng))
                bar.advance(job, len(T))
        except KeyboardInterrupt:
            count = sum(map(len, done))
            print(f"kinverse: interrupted: {count} poses of {len(given.T)} done", file=sys.stderr)
    return done


def _label(part: "Solutions", k: int) -> str:
    branch = int(part.branch[k])
    return part.branch_labels[branch] if 0 <= branch < len(part.branch_labels) else ""


@dataclass(frozen=True)
class Answers:
    """All solutions of one command, ready to print."""

    robot: "Robot"
    solver: str
    task: str
    degrees: bool
    given: Poses
    done: list["Solutions"]

    @property
    def all_solved(self) -> bool:
        """Every pose that was given has a solution, and none was skipped or left undone."""
        solved = sum(int(part.ok.sum()) for part in self.done)
        return solved == len(self.given.T) and not self.given.problems

    def poses(self) -> Iterator[dict[str, Any]]:
        """One record for each pose that was tried, with its solutions."""
        rows = iter(self.given.rows.tolist())
        for part in self.done:
            ends = np.cumsum(part.count)
            for i, (end, count) in enumerate(zip(ends.tolist(), part.count.tolist(), strict=True)):
                record: dict[str, Any] = {
                    "row": next(rows),
                    "status": kv.Status(int(part.status[i])).name,
                    "solutions": [self._solution(part, k) for k in range(end - count, end)],
                }
                if not count:
                    record["reason"] = kv.Status(int(part.status[i])).text
                    record["best"] = self._best(part, i)
                    record["evidence"] = part.stats.evidence[i]
                yield record

    def _solution(self, part: "Solutions", k: int) -> dict[str, Any]:
        return {
            "q": joint_values(self.robot, part.q[k], self.degrees),
            "branch": int(part.branch[k]),
            "label": _label(part, k),
            "position_error": float(part.position_error[k]),
            "rotation_error": float(part.rotation_error[k]),
        }

    def _best(self, part: "Solutions", i: int) -> dict[str, Any] | None:
        q = part.stats.best_q[i]
        if np.isnan(q).any():
            return None
        return {
            "q": joint_values(self.robot, q, self.degrees),
            "outside_limits": outside_limits(self.robot, q, self.degrees),
            "position_error": float(part.stats.best_position_error[i]),
            "rotation_error": float(part.stats.best_rotation_error[i]),
        }

    @property
    def _angle(self) -> str:
        return "deg" if self.degrees else "rad"

    def json(self) -> str:
        """Everything, as one JSON object."""
        return json.dumps(
            {
                "robot": self.robot.name,
                "solver": self.solver,
                "task": self.task,
                "angle": self._angle,
                "joint_names": list(self.robot.joint_names),
                "poses": list(self.poses()),
                "skipped": list(self.given.problems),
                "not_tried": len(self.given.T) - sum(map(len, self.done)),
            }
        )

    def csv(self) -> str:
        """A line for each solution; a pose without one has a line without joint values."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        units = ["m" if k == "P" else self._angle for k in joint_kinds(self.robot)]
        names = [f"{n}_{u}" for n, u in zip(self.robot.joint_names, units, strict=True)]
        writer.writerow(
            ["row", "status", *names, "branch", "label", "position_error_m", "rotation_error_rad"]
        )
        for record in self.poses():
            head = [record["row"], record["status"]]
            for s in record["solutions"]:
                errors = [s["position_error"], s["rotation_error"]]
                writer.writerow([*head, *s["q"], s["branch"], s["label"], *errors])
            if not record["solutions"]:
                writer.writerow([*head, *[""] * (len(names) + 4)])
        return text.getvalue()

    def show(self) -> None:
        """Print the solutions, of the first poses if there are many, and a summary."""
        out = console()
        several = len(self.given.T) > 1
        heads = [">row"] if several else []
        unit = self._angle + (" and m" if "P" in self.robot.kinds else "")
        shown = table(
            *heads,
            *joint_header(self.robot),
            "branch",
            title=f"{self.robot.name}, joints in {unit}",
        )
        digits = 2 if self.degrees else 4
        for _, record in zip(range(SHOWN), self.poses(), strict=False):
            first = [str(record["row"])] if several else []
            for s in record["solutions"]:
                values = [f"{v + 0.0:.{digits}f}" for v in s["q"]]
                shown.add_row(*first, *values, s["label"] or (str(s["branch"]) if several else ""))
            if not record["solutions"] and several:
                shown.add_row(*first, *["-"] * self.robot.dof, record["status"])
        if shown.row_count:
            show_table(shown)
        if len(self.given.T) > SHOWN:
            out.print(f"the first {SHOWN} poses are shown; --out FILE.csv writes them all")
        self.summary()

    def remark(self) -> None:
        """Say on standard error if poses are so far off that their unit must be another."""
        size = arm_size(self.robot)
        for part in self.done:
            miss = np.nan_to_num(part.stats.best_position_error[~part.ok]).max(initial=0.0)
            if miss > FAR * size:
                note(f"positions are metres; a pose is {miss:.4g} m off, the arm is {size:.3g} m")
                return

    def summary(self) -> None:
        """Print how many poses ended how, with the reason."""
        out = console()
        status = np.concatenate([part.status for part in self.done] or [np.empty(0, np.uint8)])
        for kind in kv.Status:
            count = int((status == kind).sum())
            if count:
                out.print(f"{kind.name} {count} of {len(self.given.T)}: {kind.text}")
        worst = [
            max((part.position_error.max(initial=0.0) for part in self.done), default=0.0),
            max((part.rotation_error.max(initial=0.0) for part in self.done), default=0.0),
        ]
        if any(part.ok.any() for part in self.done):
            out.print(f"worst error of a solution: {tiny(worst[0])} m, {tiny(worst[1])} rad")
        if self.given.problems:
            out.print(f"skipped {len(self.given.problems)} broken rows")
        for _, record in zip(range(1), self.poses(), strict=False):
            best = record.get("best")
            if record["solutions"] or len(self.given.T) != 1:
                continue
            out.print("it rests on", record["evidence"], markup=False)
            if not best:
                continue
            if record["status"] == "OUT_OF_LIMITS":
                out.print("nearest candidate:", "; ".join(best["outside_limits"]), markup=False)
            else:
                out.print(
                    f"nearest candidate: {tiny(best['position_error'])} m, "
                    f"{tiny(best['rotation_error'])} rad off"
                )

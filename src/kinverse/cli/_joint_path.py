"""A joint path as text: a summary, CSV or JSON."""

import csv
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kinverse.cli._show import console, joint_kinds, joint_values

if TYPE_CHECKING:
    from kinverse.paths import Gap, JointPath

__all__ = ["Told"]

SHOWN = 20
"""Gaps that are printed; a file gets them all."""


@dataclass(frozen=True)
class Told:
    """A joint path, ready to print. Rows count from 1, as those of the file of poses do."""

    joint_path: "JointPath"
    degrees: bool

    @property
    def _angle(self) -> str:
        return "deg" if self.degrees else "rad"

    def csv(self) -> str:
        """A line for each pose; one that is not tracked has its reason and no joint values."""
        found, robot = self.joint_path, self.joint_path.robot
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        units = ["m" if kind == "P" else self._angle for kind in joint_kinds(robot)]
        names = [f"{n}_{u}" for n, u in zip(robot.joint_names, units, strict=True)]
        writer.writerow(["row", "run", "status", *names, "branch", "label"])
        runs = {i: run for run, ends in enumerate(found.intervals, 1) for i in range(*ends)}
        codes = {i: gap.code.name for gap in found.gaps for i in range(gap.start, gap.end)}
        for i, q in enumerate(found.q):
            if i in runs:
                branch = int(found.branch[i])
                values = joint_values(robot, q, self.degrees)
                writer.writerow([i + 1, runs[i], "TRACKED", *values, branch, self._label(branch)])
            else:
                writer.writerow([i + 1, "", codes[i], *[""] * (robot.dof + 2)])
        return text.getvalue()

    def json(self) -> str:
        """Everything, as one JSON object."""
        found, robot = self.joint_path, self.joint_path.robot
        rows: list[dict[str, Any]] = [
            {
                "row": i + 1,
                "q": joint_values(robot, q, self.degrees) if ok else None,
                "branch": int(branch),
                "label": self._label(int(branch)),
            }
            for i, (q, ok, branch) in enumerate(zip(found.q, found.ok, found.branch, strict=True))
        ]
        return json.dumps(
            {
                "robot": robot.name,
                "angle": self._angle,
                "joint_names": list(robot.joint_names),
                "cost": found.cost,
                "largest_step": found.largest_step,
                "runs": [[a + 1, b] for a, b in found.intervals],
                "gaps": [
                    {"where": where(gap), "reason": gap.code.name, "text": gap.text}
                    for gap in found.gaps
                ],
                "rows": rows,
            }
        )

    def show(self) -> None:
        """Print how much is tracked, and every gap with its reason."""
        found, out = self.joint_path, console()
        out.print(
            f"{int(found.ok.sum())} of {len(found)} poses tracked in {len(found.intervals)} runs,"
            f" largest joint step {found.largest_step:.4g}, cost {found.cost:.6g} [rad or m]",
            markup=False,
        )
        for gap in found.gaps[:SHOWN]:
            out.print(f"{where(gap)}: {gap.code.name}: {gap.text}", markup=False)
        if len(found.gaps) > SHOWN:
            out.print(f"and {len(found.gaps) - SHOWN} gaps more; --out FILE.json writes them all")

    def _label(self, branch: int) -> str:
        labels = self.joint_path.branch_labels
        return labels[branch] if 0 <= branch < len(labels) else ""


def where(gap: "Gap") -> str:
    """The rows of a gap in words."""
    if gap.is_break:
        return f"between rows {gap.start} and {gap.start + 1}"
    if gap.end == gap.start + 1:
        return f"row {gap.end}"
    return f"rows {gap.start + 1} to {gap.end}"

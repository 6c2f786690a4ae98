"""A joint path as text: a summary, CSV or JSON."""

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinverse.cli._show import console, joint_kinds, joint_values

if TYPE_CHECKING:
    from kinverse.paths import Gap, JointPath

__all__ = ["Told"]

CLOSED = 1e-6
"""Joints that end so near their start [rad or m] are back."""
SHOWN = 20
"""Gaps that are printed; a file gets them all."""


@dataclass(frozen=True)
class Told:
    """A joint path, ready to print. Rows count from 1, as those of the file of poses do.

    Attributes:
        joint_path: what was found.
        degrees: turning joints are told in degrees.
        metric: what its cost is a sum of.
        s: (N,) where the samples lie on their path, None if that is not known.
        unit: of s.
    """

    joint_path: "JointPath"
    degrees: bool
    metric: str = "max"
    s: NDArray[np.float64] | None = None
    unit: str | None = None

    @property
    def _angle(self) -> str:
        return "deg" if self.degrees else "rad"

    @property
    def _units(self) -> list[str]:
        """Of each joint."""
        return ["m" if kind == "P" else self._angle for kind in joint_kinds(self.joint_path.robot)]

    def csv(self) -> str:
        """A line for each pose; one that is not tracked has its reason and no joint values."""
        found, robot = self.joint_path, self.joint_path.robot
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        names = [f"{n}_{u}" for n, u in zip(robot.joint_names, self._units, strict=True)]
        place = [] if self.s is None else [f"s_{self.unit}"]
        writer.writerow(["row", *place, "run", "status", *names, "branch", "label"])
        runs = {i: run for run, ends in enumerate(found.intervals, 1) for i in range(*ends)}
        codes = {i: gap.code.name for gap in found.gaps for i in range(gap.start, gap.end)}
        for i, q in enumerate(found.q):
            row = [i + 1] if self.s is None else [i + 1, float(self.s[i])]
            if i in runs:
                branch = int(found.branch[i])
                values = joint_values(robot, q, self.degrees)
                writer.writerow([*row, runs[i], "TRACKED", *values, branch, self._label(branch)])
            else:
                writer.writerow([*row, "", codes[i], *[""] * (robot.dof + 2)])
        return text.getvalue()

    def json(self, motion: dict[str, Any] | None = None) -> str:
        """Everything, as one JSON object; of each joint in its unit, that of ``units``."""
        found, robot = self.joint_path, self.joint_path.robot
        rows: list[dict[str, Any]] = [
            {
                "row": i + 1,
                "s": None if self.s is None else float(self.s[i]),
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
                "units": self._units,
                "metric": self.metric,
                "cost": self._cost()[0],
                "cost_unit": self._cost()[1],
                "largest_step": joint_values(robot, self._steps(), self.degrees),
                "deviation": _number(found.deviation),
                "closure": None
                if math.isnan(found.closure)
                else joint_values(robot, np.abs(found.q[-1] - found.q[0]), self.degrees),
                "runs": [[a + 1, b] for a, b in found.intervals],
                "gaps": [
                    {
                        "where": where(gap),
                        "reason": gap.code.name,
                        "text": gap.told(self.degrees, rows=True),
                    }
                    for gap in found.gaps
                ],
                **({} if motion is None else {"motion": motion}),
                "rows": rows,
            }
        )

    def show(self, more: Sequence[str] = ()) -> None:
        """Print how much is tracked, more lines, and every gap with its reason."""
        found = self.joint_path
        say = partial(console().print, markup=False, soft_wrap=True)
        runs = len(found.intervals)
        text = f"{int(found.ok.sum())} of {len(found)} poses tracked"
        if runs:
            cost, unit = self._cost()
            text += (
                f" in {runs} run{'s' * (runs > 1)}, largest joint step"
                f" {self._joints(self._steps())}, cost {cost:.4g} {unit}"
            )
        say(text)
        if runs and not math.isnan(found.deviation):
            away = f"{1e3 * found.deviation:.3g} mm"
            say(f"between them the tool is at most {away} from the path")
            if found.deviation > found.tolerance:
                say(f"warning: the tolerance of {1e3 * found.tolerance:.3g} mm is not reached")
        if found.closure <= CLOSED:
            say("the path is closed, and the joints end where they begin")
        elif found.closure > CLOSED:
            apart = self._joints(np.abs(found.q[-1] - found.q[0]))
            say(f"the path is closed, the joints end {apart} from their start")
        for line in more:
            say(line)
        for gap in found.gaps[:SHOWN]:
            say(f"{where(gap)}: {gap.code.name}: {gap.told(self.degrees, rows=True)}")
        if len(found.gaps) > SHOWN:
            say(f"and {len(found.gaps) - SHOWN} gaps more; --out FILE.json writes them all")

    def _steps(self) -> NDArray[np.float64]:
        """(n,) largest step of each joint [rad or m]."""
        steps = [np.abs(np.diff(q, axis=0)).max(axis=0, initial=0.0) for q in self._segments]
        return np.asarray(np.max(steps, axis=0))

    @property
    def _segments(self) -> tuple[NDArray[np.float64], ...]:
        return self.joint_path.segments() or (np.zeros((1, self.joint_path.robot.dof)),)

    def _joints(self, moved: NDArray[np.float64]) -> str:
        """The largest of joint movements (n,), turning joints and slides for themselves."""
        kinds = np.array(list(joint_kinds(self.joint_path.robot)))
        told = []
        if (turns := moved[kinds == "R"]).size:
            scale = 180.0 / math.pi if self.degrees else 1.0
            told.append(f"{scale * turns.max():.4g} {self._angle}")
        if (slides := moved[kinds == "P"]).size:
            told.append(f"{slides.max():.4g} m")
        return " and ".join(told)

    def _cost(self) -> tuple[float, str]:
        """The cost and its unit."""
        cost, kinds = self.joint_path.cost, set(joint_kinds(self.joint_path.robot))
        if self.metric == "time":
            return cost, "s"
        if kinds == {"R"}:
            return (math.degrees(cost) if self.degrees else cost), self._angle
        return cost, "m" if kinds == {"P"} else "(rad and m added up)"

    def _label(self, branch: int) -> str:
        labels = self.joint_path.branch_labels
        return labels[branch] if 0 <= branch < len(labels) else ""


def _number(value: float) -> float | None:
    """JSON has no NaN."""
    return None if math.isnan(value) else value


def where(gap: "Gap") -> str:
    """The rows of a gap in words."""
    if gap.code.name == "NOT_CLOSED":
        return "from the last row to the first"
    if gap.is_break and gap.start == 0:
        return "before row 1"
    if gap.is_break:
        return f"between rows {gap.start} and {gap.start + 1}"
    if gap.end == gap.start + 1:
        return f"row {gap.end}"
    return f"rows {gap.start + 1} to {gap.end}"

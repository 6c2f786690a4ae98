"""A simulated motion as text: a summary, JSON, or CSV of every instant."""

import csv
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kinverse import se3
from kinverse.cli._joint_path import where
from kinverse.cli._show import console, joint_kinds, joint_values, show_table, table

if TYPE_CHECKING:
    from kinverse.cli._joint_curve import Joined
    from kinverse.paths import JointPath, Simulation

__all__ = ["Told"]

HOLDING = (
    *(("force_x", "N"), ("force_y", "N"), ("force_z", "N")),
    *(("moment_x", "Nm"), ("moment_y", "Nm"), ("moment_z", "Nm")),
)
"""What holds a driven tool, with units."""
FASTEST = (5.0, 20.0)
"""Speeds of slides [m/s] and of turning joints [rad/s] beyond those of the drives of arms."""


@dataclass(frozen=True)
class Told:
    """A simulation of one run of a joint path, ready to print.

    Attributes:
        joint_path: what was tracked.
        part: first row and the one behind the last of what was simulated, counted from 0.
        run: what the simulator measured.
        spline: the joint spline that was played.
        path_known: there is a path, not poses alone.
        degrees: joint values are told in degrees.
    """

    joint_path: "JointPath"
    part: tuple[int, int]
    run: "Simulation"
    spline: "Joined"
    path_known: bool
    degrees: bool

    @property
    def _angle(self) -> str:
        return "deg" if self.degrees else "rad"

    @property
    def _units(self) -> list[str]:
        kinds = joint_kinds(self.joint_path.robot)
        return ["m" if kind == "P" else self._angle for kind in kinds]

    @property
    def _loads(self) -> list[tuple[str, str]]:
        """Name and unit of each load."""
        if self.run.drive == "tool":
            return list(HOLDING)
        robot = self.joint_path.robot
        kinds = joint_kinds(robot)
        named = zip(robot.joint_names, kinds, strict=True)
        return [(name, "N" if kind == "P" else "Nm") for name, kind in named]

    def _of_the_speeds(self) -> list[str]:
        """How fast each joint moves at most, and which of them no drive could move so."""
        robot, peaks = self.joint_path.robot, self.run.peak_speeds
        kinds = np.array(list(joint_kinds(robot)))
        told = joint_values(robot, peaks, self.degrees)
        named = zip(robot.joint_names, told, self._units, strict=True)
        speeds = [f"{name} {peak:.4g} {unit}/s" for name, peak, unit in named]
        fast = peaks > np.where(kinds == "P", *FASTEST)
        lines = [f"peak joint speeds: {', '.join(speeds)}"]
        if fast.any():
            names = ", ".join(np.array(robot.joint_names)[fast].tolist())
            lines.append(f"{names}: faster than the drives of arms move; allow more time")
        return lines

    def csv(self) -> str:
        """A line for each instant: joints measured and wanted, the tool, its errors, the loads."""
        run, robot = self.run, self.joint_path.robot
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        columns = list(zip(robot.joint_names, self._units, strict=True))
        writer.writerow(
            [
                *["t_s", *(f"{n}_{u}" for n, u in columns)],
                *(f"{n}_wanted_{u}" for n, u in columns),
                *["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"],
                *["position_error_m", "rotation_error_rad"],
                *(f"{n}_{u}" for n, u in self._loads),
            ]
        )
        quats = se3.quat_from_rotation(run.T[:, :3, :3])
        loads = run.constraint_force if run.drive == "tool" else run.torque
        for k, t in enumerate(run.t.tolist()):
            writer.writerow(
                [
                    *[t, *joint_values(robot, run.q[k], self.degrees)],
                    *joint_values(robot, run.q_wanted[k], self.degrees),
                    *[*run.T[k, :3, 3].tolist(), *quats[k].tolist()],
                    *[float(run.position_error[k]), float(run.rotation_error[k])],
                    *loads[k].tolist(),
                ]
            )
        return text.getvalue()

    def json(self) -> str:
        """The figures, as one JSON object in metres, radians, newtons and seconds."""
        run, found = self.run, self.joint_path
        effort = run.constraint_forces if run.drive == "tool" else run.torques
        loads: list[dict[str, Any]] = [
            {"name": name, "unit": unit, "peak": peak, "rms": rms, "uniformity": even}
            for (name, unit), peak, rms, even in zip(
                self._loads,
                effort.peak.tolist(),
                effort.rms.tolist(),
                effort.uniformity.tolist(),
                strict=True,
            )
        ]
        return json.dumps(
            {
                "robot": found.robot.name,
                "drive": run.drive,
                "control": run.control or None,
                "ok": run.ok,
                "reason": run.reason,
                "rows": [self.part[0] + 1, self.part[1]],
                "duration": float(run.t[-1]),
                "rms_position_error": run.rms_position_error,
                "peak_position_error": float(run.position_error.max()),
                "peak_rotation_error": float(run.rotation_error.max()),
                "largest_joint_difference": self._joint_difference,
                "deviation": self.spline.position,
                "rotation_deviation": self.spline.rotation,
                "samples_added": self.spline.added,
                "beyond_limits": self.spline.beyond.amount if self.spline.beyond else 0.0,
                "peak_joint_speeds": [
                    peak if np.isfinite(peak) else None for peak in run.peak_speeds.tolist()
                ],
                "loads": loads,
                "gaps": [
                    {"where": where(gap), "reason": gap.code.name, "text": gap.told(rows=True)}
                    for gap in found.gaps
                ],
            }
        )

    def show(self) -> None:
        """Print the loads, the errors, and why it ended early if it did."""
        run, robot, out = self.run, self.joint_path.robot, console()
        driven = f"joints driven by {run.control}" if run.drive == "joints" else "tool driven"
        first, last = self.part
        out.print(
            f"{robot.name}, rows {first + 1} to {last} in {run.t[-1]:.4g} s, {driven}", markup=False
        )
        held = "held by" if run.drive == "tool" else "joint"
        shown = table(held, ">peak", ">rms", ">uniformity", "unit")
        effort = run.constraint_forces if run.drive == "tool" else run.torques
        rows = zip(self._loads, effort.peak, effort.rms, effort.uniformity, strict=True)
        for (name, unit), peak, rms, even in rows:
            shown.add_row(name, f"{peak:.4g}", f"{rms:.4g}", f"{even:.3f}", unit)
        show_table(shown)
        for line in self._of_the_speeds():
            out.print(line, markup=False, soft_wrap=True)
        turned = np.degrees(run.rotation_error.max()) if self.degrees else run.rotation_error.max()
        out.print(
            f"tracking error: rms {1e3 * run.rms_position_error:.4g} mm, peak"
            f" {1e3 * run.position_error.max():.4g} mm and {turned:.3g} {self._angle}",
            markup=False,
        )
        if run.drive == "tool":
            out.print(
                "from the joint values of inverse kinematics the measured ones differ by"
                f" {self._joint_difference:.2g}",
                markup=False,
            )
        for line in self._of_the_spline():
            out.print(line, markup=False)
        if not run.ok:
            out.print(run.reason, markup=False)

    def _of_the_spline(self) -> list[str]:
        spline = self.spline
        turned = np.degrees(spline.rotation) if self.degrees else spline.rotation
        path = "the path" if self.path_known else "straight lines between the poses"
        more = f"; {spline.added} samples added" if spline.added else ""
        if spline.unsolved:
            more += f", {spline.unsolved} not found: the arm cannot follow {path} there"
        told = [
            f"the joint spline's tool strays {1e3 * spline.position:.4g} mm and {turned:.3g}"
            f" {self._angle} from {path}{more}"
        ]
        if spline.beyond is not None:
            told.append(f"between the samples {spline.beyond.text}")
        return told

    @property
    def _joint_difference(self) -> float:
        return float(np.abs(self.run.q - self.run.q_wanted).max())

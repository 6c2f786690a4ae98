"""The five positions of each arm, and what is printed of their solutions by population methods."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.studies.data import printed
from kinverse.studies.jha2015.units import METRES

__all__ = ["ALGORITHMS", "ARMS", "ArmTask", "joint_headings", "joint_units", "printed_answers"]

Array = NDArray[np.float64]

ALGORITHMS = ("ga", "pso", "gwo", "tlbo", "cibo")


@dataclass(frozen=True)
class ArmTask:
    """Five positions that an arm is to reach.

    Attributes:
        arm: as it is called in table 7.41.
        table: of the positions.
        answers: table of the printed solutions; "" where there is none.
        unit: of the positions and of the function value.
        geometries: that are searched, the printed one first.
        accepted: printed function value up to which a result is accepted [unit].
        also: geometries that only the printed joints are held against.
    """

    arm: str
    table: str
    answers: str
    unit: str
    geometries: tuple[str, ...]
    accepted: float
    also: tuple[str, ...] = ()

    @property
    def targets(self) -> Array:
        """(5, 3) positions [m]."""
        rows = printed("jha2015", "table_" + self.table.replace(".", "_"))
        if self.arm != "planar3R":
            return rows.numbers(["X", "Y", "Z"]) * METRES[self.unit]
        plane = rows.numbers(["X", "Y"])[:5] * METRES[self.unit]
        return np.column_stack([plane, np.zeros(5)])


ARMS = {
    task.arm: task
    for task in (
        ArmTask("planar3R", "7.1", "", "cm", ("planar3r",), 0.01),
        ArmTask("SCARA", "7.25", "7.26", "mm", ("scara",), 0.001),
        ArmTask("Pioneer2_5R", "7.27", "7.28", "mm", ("pioneer2", "pioneer2_7_7"), 0.01),
        ArmTask("PUMA560", "7.30", "7.31", "cm", ("puma560", "irb1400_7_17"), 0.01),
        ArmTask("IRB1400", "7.33", "7.34", "cm", ("irb1400", "irb1400_7_17"), 0.01),
        ArmTask("ASEA_IRb6", "7.35", "7.36", "mm", ("irb6", "irb6_free"), 0.01, ("irb6_4_251",)),
        ArmTask("RX160L", "7.37", "7.38", "cm", ("rx160l", "rx160l_7_23"), 0.01),
    )
}
"""In the order of the thesis; the planar arm, rows 1 to 5 of table 7.1, is our addition."""


def joint_units(robot: Robot, unit: str) -> Array:
    """(n,) what a printed joint value has to be multiplied with [rad or m]."""
    slide = METRES[unit]
    return np.array([slide if kind == "P" else np.pi / 180.0 for kind in robot.kinds])


def joint_headings(robot: Robot, unit: str) -> list[str]:
    """Columns of our tables: joints named as in the thesis, units in brackets."""
    return [
        f"d{k} [{unit}]" if kind == "P" else f"theta{k} [deg]"
        for k, kind in enumerate(robot.kinds, start=1)
    ]


def printed_answers(task: ArmTask, robot: Robot) -> dict[tuple[str, int], tuple[float, Array]]:
    """Printed function value [unit] and joints (n,) [rad, m] by algorithm and position 0 to 4."""
    rows = printed("jha2015", "table_" + task.answers.replace(".", "_"))
    columns = [name for name in rows.columns if name.endswith(("_deg", "_mm"))]
    joints = rows.numbers(columns) * joint_units(robot, task.unit)
    keys = zip(rows.text("algorithm"), rows.text("position"), strict=True)
    values = rows.numbers(["function_value"])[:, 0].tolist()
    return {
        (algorithm.lower(), int(position[1:]) - 1): (value, q)
        for (algorithm, position), value, q in zip(keys, values, joints, strict=True)
    }

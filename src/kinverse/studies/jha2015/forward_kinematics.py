"""Tables of joint values with positions: which geometry takes the ones to the others?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import Printed, printed
from kinverse.studies.jha2015.arms import arm, conventions
from kinverse.studies.jha2015.units import METRES

__all__ = ["CASES", "Case", "forward_rows", "joint_columns", "last_place", "position_columns"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A table, and the arms to try.

    Attributes:
        table: its number.
        robot: in the words of the thesis.
        arms: names for ``arms.arm``, printed ones first.
        unit: of the positions; empty if none is printed, then every unit is tried.
    """

    table: str
    robot: str
    arms: tuple[str, ...]
    unit: str = ""

    @property
    def cell(self) -> Cell:
        """Every reading of the table."""
        arguments = {"table": self.table, "arms": " ".join(self.arms), "unit": self.unit}
        return Cell(f"forward-{self.table}", forward_rows, {**arguments})


CASES = (
    Case("7.1", "planar 3R", ("planar3r",), "cm"),
    Case("7.7", "5R", ("5r", "5r_4.4", "5r_inferred"), "mm"),
    Case("7.14", "PUMA 560", ("puma560", "puma560_4.5")),
    Case("7.17", "IRB-1400", ("irb1400", "irb1400_inferred")),
    Case("7.20", "ASEA IRb-6", ("irb6",)),
    Case("7.23", "RX160L", ("rx160l", "rx160l_inferred")),
    Case("7.25", "SCARA", ("scara",), "mm"),
    Case("7.27", "5R", ("5r", "5r_4.4", "5r_inferred"), "mm"),
    Case("7.30", "PUMA 560", ("puma560", "puma560_4.5")),
    Case("7.33", "IRB-1400", ("irb1400", "irb1400_inferred")),
    Case("7.35", "ASEA IRb-6", ("irb6",)),
    Case("7.37", "RX160L", ("rx160l", "rx160l_inferred")),
)


def joint_columns(table: Printed) -> list[str]:
    """Columns of joint values."""
    return [name for name in table.columns if name.startswith(("theta", "d3"))]


def position_columns(table: Printed) -> list[str]:
    """Columns of the position: X, Y and, but for the planar arm, Z."""
    return [name for name in table.columns if name[0] in "XYZ"]


def forward_rows(table: str, arms: str, unit: str) -> list[Row]:
    """Forward kinematics at the printed joint values, under every reading.

    Args:
        table: its number, such as "7.7".
        arms: names for ``arms.arm``, with spaces between.
        unit: of the printed positions; empty: mm, cm and m.

    Returns:
        A row for each reading (arm, convention, unit) and row of the table: the printed position
        and ours [unit], their distance, and ``allowed``: what one unit in the last printed place
        of every number can do.
    """
    rows = printed("jha2015", f"table_{table.replace('.', '_')}")
    heads, places = joint_columns(rows), position_columns(rows)
    per_value = np.array([1e-3 if head.endswith("mm") else np.pi / 180.0 for head in heads])
    q, theirs = rows.numbers(heads) * per_value, rows.numbers(places)
    found: list[Row] = []
    for name in arms.split():
        for convention in conventions(name):
            robot = arm(name, convention)
            for each in [unit] if unit else METRES:
                ours = robot.fk(q)[:, : len(places), 3] / METRES[each]
                allowed = _allowed(rows, robot, q, per_value, 1.0 / METRES[each])
                reading: Row = {"arm": name, "convention": convention, "unit": each}
                for k, row in enumerate(rows.rows):
                    found.append(
                        {
                            **reading,
                            "row": row.get("row") or row["position"],
                            **{f"{a[0]} printed": theirs[k, j] for j, a in enumerate(places)},
                            **{f"{a[0]} ours": ours[k, j] for j, a in enumerate(places)},
                            "distance": float(np.linalg.norm(ours[k] - theirs[k])),
                            "allowed": float(allowed[k]),
                        }
                    )
    return found


def _allowed(rows: Printed, robot: Robot, q: Array, per_value: Array, scale: float) -> Array:
    """(rows,) how far the position moves if every number is off by one unit of its last place."""
    places = position_columns(rows)
    moved = np.linalg.norm(robot.jacobian(q)[:, : len(places)], axis=1)
    joints = (moved * per_value * last_place(rows, joint_columns(rows))).sum(axis=1)
    position = np.linalg.norm(last_place(rows, places), axis=1)
    total: Array = scale * joints + position
    return total


def last_place(rows: Printed, columns: list[str]) -> Array:
    """(rows, columns) one unit of the last printed decimal of each entry."""
    decimals = [[len(row[name].partition(".")[2]) for name in columns] for row in rows.rows]
    unit: Array = 10.0 ** -np.array(decimals, dtype=np.float64)
    return unit

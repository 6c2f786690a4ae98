"""Rows to learn from: positions and joints of an arm, in the numbers that the thesis prints."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.geometries import geometry
from kinverse.studies.rows import quartiles

__all__ = [
    "CONFIGURATIONS",
    "DATA_SEED",
    "FLOOR_SEED",
    "Configuration",
    "Floor",
    "SUMS",
    "draw",
    "floor_cell",
    "floor_of",
    "least_errors",
    "output_names",
    "known_quartiles",
    "squared_units",
]

Array = NDArray[np.float64]

FLOOR_SEED, DATA_SEED = 880_000, 4_100
SUMS = {"planar3r_60": np.pi / 3.0}
"""Geometries whose joints add up to one angle [rad]."""
MANY, QUICK_MANY = 400_000, 20_000


@dataclass(frozen=True)
class Configuration:
    """How the networks of an arm are trained.

    Attributes:
        arm: as it is called in table 7.40.
        geometry: the printed one.
        table: of the printed configuration.
        errors: table of the printed mean squared errors of the hybrid networks.
    """

    arm: str
    geometry: str
    table: str
    errors: str

    def value(self, parameter: str, otherwise: float) -> float:
        """A printed parameter, or what stands for it."""
        rows = printed("jha2015", _file(self.table)).where("parameter", parameter)
        return float(rows.numbers(["value"])[0, 0]) if len(rows) else otherwise

    @property
    def sizes(self) -> tuple[int, int]:
        """Rows to train and to test."""
        train = int(self.value("Training datasets", 0))
        test = int(self.value("Testing datasets", 0))
        # the text has the two the other way round
        return (test, train) if self.table in ("7.2", "7.8") else (train, test)

    @property
    def conflicts(self) -> str:
        """What of the printed configuration cannot be, or contradicts the text."""
        found = []
        train, test = self.sizes
        total = int(self.value("Target datasets", 0))
        outputs, joints = int(self.value("Number of output", 0)), geometry(self.geometry).dof
        if self.table in ("7.2", "7.8"):
            found.append(
                f"table {self.table} prints {test} training and {train} testing rows, the text"
                " exchanges the two: as in the text"
            )
        if train + test > total:
            found.append(f"{train} + {test} rows are more than the {total} printed: all drawn")
        if outputs != joints:
            found.append(f"{outputs} outputs printed for {joints} joints: {joints} taken")
        same = [each.table for each in CONFIGURATIONS.values() if each._same(self)]
        if same:
            found.append(f"table {self.table} prints the numbers of {', '.join(same)}")
        return "; ".join(found)

    def _same(self, other: "Configuration") -> bool:
        if self.table == other.table:
            return False
        mine, others = (printed("jha2015", _file(each.table)) for each in (self, other))
        return mine.text("value") == others.text("value")


CONFIGURATIONS = {
    each.arm: each
    for each in (
        Configuration("SCARA", "scara", "7.2", "7.11"),
        Configuration("Pioneer2_5R", "pioneer2", "7.8", "7.12"),
        Configuration("PUMA560", "puma560", "7.13", "7.15"),
        Configuration("IRB1400", "irb1400", "7.16", "7.18"),
        Configuration("ASEA_IRb6", "irb6", "7.19", "7.21"),
        Configuration("RX160L", "rx160l", "7.22", "7.24"),
    )
}


def draw(name: str, count: int, seed: int, swept: bool = False) -> tuple[Array, Array]:
    """Positions (count, 3) [m], of a planar arm (count, 2), and joints (count, n).

    The joints are uniform in the limits; where their sum is fixed (``SUMS``), the last follows from
    the others. Swept: all go through their ranges together, on even grids, in random order.
    """
    robot = geometry(name)
    rng = np.random.default_rng(DATA_SEED + seed)
    if swept:
        low, high = robot.limits.T
        q = low + rng.permutation(np.linspace(0.0, 1.0, count))[:, None] * (high - low)
    else:
        q = robot.random(count, rng)
    if name in SUMS:
        q[:, -1] = SUMS[name] - q[:, :-1].sum(axis=1)
    position = robot.fk(q)[:, :3, 3]
    return (position[:, :2] if name.startswith("planar") else position), q


def output_names(name: str) -> list[str]:
    """Joints of an arm as the thesis names them: theta1, theta2, d3, ..."""
    kinds = geometry(name).kinds
    return [f"{'d' if kind == 'P' else 'theta'}{k}" for k, kind in enumerate(kinds, start=1)]


def squared_units(name: str) -> tuple[Array, list[str]]:
    """(n,) factors from rad^2 and m^2 to what is shown, and its names."""
    slides = [kind == "P" for kind in geometry(name).kinds]
    return np.where(slides, 1e6, 1.0), ["mm^2" if slide else "rad^2" for slide in slides]


def known_quartiles(rows: list[Row], column: str) -> tuple[float, float, float] | None:
    """Lower quartile, median, upper quartile of a column; None if a row has no number there."""
    values = [row[column] for row in rows]
    if any(value is None for value in values):
        return None
    return quartiles(np.array(values, dtype=np.float64))


def least_errors(geometry_name: str, test: int, many: int) -> list[Row]:
    """For each joint the least mean squared error of any function of the position.

    Two configurations with the same position differ by twice the variance that the position leaves
    to a joint (in the mean square): half the squared difference to the nearest of ``many`` others,
    which is nearly at the same point. It holds for joints uniform in their limits. A slide has
    none: it would tell how far apart the neighbours are.

    Args:
        geometry_name: see ``geometry``.
        test: configurations whose neighbours are looked for.
        many: configurations they are looked for among.

    Returns:
        Rows of each joint: ``floor`` and ``constant`` (error of the mean of all) [rad^2 or m^2],
        ``span``: the square of its range.
    """
    from scipy.spatial import cKDTree

    X, q = draw(geometry_name, many, FLOOR_SEED)
    X_test, wanted = draw(geometry_name, test, FLOOR_SEED + 1)
    off = wanted - q[cKDTree(X).query(X_test)[1]]
    constant = q.var(axis=0)
    floor = np.minimum((off**2).mean(axis=0) / 2.0, constant)
    robot = geometry(geometry_name)
    span = np.ptp(robot.limits, axis=1) ** 2
    return [
        {
            "output": name,
            "floor": low if kind == "R" else None,
            "constant": far,
            "span": wide,
        }
        for name, kind, low, far, wide in zip(
            output_names(geometry_name),
            robot.kinds,
            floor.tolist(),
            constant.tolist(),
            span.tolist(),
            strict=True,
        )
    ]


def floor_cell(name: str, quick: bool) -> Cell:
    """The cell of a geometry's least errors."""
    many, test = (QUICK_MANY, QUICK_MANY) if quick else (MANY, MANY // 4)
    return Cell(
        f"network-floor-{name}",
        least_errors,
        {"geometry_name": name, "test": test, "many": many},
    )


@dataclass(frozen=True)
class Floor:
    """What bounds the error of a joint.

    Attributes:
        least: mean squared error [rad^2] of the best function of the position; None for a slide.
        constant: of the mean of all joints [rad^2 or m^2].
        span: square of the joint's range [rad^2 or m^2].
    """

    least: float | None
    constant: float
    span: float

    @property
    def scaled(self) -> float | None:
        """``least`` with ranges scaled to 0..1: the smallest way of writing it that we know."""
        return None if self.least is None else self.least / self.span


def floor_of(cells: dict[str, list[Row]], name: str) -> dict[str, Floor]:
    """The floor of each joint by its name."""
    out = {}
    for row in cells[f"network-floor-{name}"]:
        least, constant, span = row["floor"], row["constant"], row["span"]
        assert isinstance(constant, float) and isinstance(span, float)
        out[str(row["output"])] = Floor(None if least is None else float(least), constant, span)
    return out


@cache
def _file(table: str) -> str:
    return "table_" + table.replace(".", "_")

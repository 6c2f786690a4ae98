"""Table 7.39: kinematics by homogeneous matrices and by quaternion-vector pairs."""

import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Cell, Row
from kinverse.studies.counted import Tally
from kinverse.studies.data import printed
from kinverse.studies.forms import Matrix, Pair
from kinverse.studies.jha2015.geometries import geometry, geometry_source
from kinverse.studies.operation_counts import count_forms, count_forward, count_inverse
from kinverse.studies.pair_kinematics import Route, inverse
from kinverse.studies.rows import as_number, quartiles
from kinverse.studies.table import Table, TableSpec, Verdict
from kinverse.studies.zero_arm import forward, zero_arm

__all__ = ["POSES_SEED", "ROBOTS", "TABLES", "compare_forms"]

Array = NDArray[np.float64]

ROBOTS = {
    "planar3R": ("planar3r", "planar3r"),
    "SCARA": ("scara", "adept_one"),
    "Pioneer2_5R": ("pioneer2", "pioneer2"),
    "PUMA560": ("puma560", "puma560"),
    "IRB1400": ("irb1400", "irb1400"),
    "ASEA_IRb6": ("irb6", "irb6"),
    "RX160L": ("rx160l", "rx160l"),
}
"""As they are called in table 7.39; the printed geometry, and the catalogue's corrected arm."""
VERSIONS = ("corrected", "printed")
METHODS: dict[str, type[Any]] = {"HT": Matrix, "QA": Pair}
"""Names in the table, and forms."""
POSES, QUICK_POSES = 200, 20
POSES_SEED = 7_390
REPEATS = 5


def compare_forms(arm: str, poses: int, version: str = "corrected") -> list[Row]:
    """Counted operations, branches and CPU time of one arm through matrices and pairs.

    Args:
        arm: of ``ROBOTS``.
        poses: random reachable ones.
        version: "corrected" or "printed".

    Returns:
        For each method one row: stored scalars, operations of forward kinematics and of an
        inverse with all branches (of the pose with the most), CPU time a pose [us] (median and
        quartiles of repeats over all poses), and ``apart``: the largest error of the tool
        position at any branch [m], by the arm's own forward kinematics. Columns of an inverse are
        None where the chapter's closed forms are of another order of axes.
    """
    robot = _robot(arm, version)
    q = robot.random(poses, np.random.default_rng(POSES_SEED))
    T = robot.fk(q)
    ways = count_forward(robot, q[0])
    rows: list[Row] = [
        _forward_times(robot, form, q)
        | {"version": version, "method": method, "scalars": ways[k].scalars}
        | {f"forward {name}": value for name, value in asdict(ways[k].operations).items()}
        for k, (method, form) in enumerate(METHODS.items())
    ]
    try:
        counted = [count_inverse(robot, pose) for pose in T]
    except kv.InputError:
        return rows
    most = max(counted, key=lambda pair: pair[0].solutions)
    return [
        row
        | {"branches": most[k].solutions, **_inverse_times(robot, form, T)}
        | {f"inverse {name}": value for name, value in asdict(most[k].operations).items()}
        for k, (row, form) in enumerate(zip(rows, METHODS.values(), strict=True))
    ]


def _robot(arm: str, version: str) -> kv.Robot:
    as_printed, corrected = ROBOTS[arm]
    return geometry(as_printed) if version == "printed" else kv.load(corrected)


def _forward_times(robot: kv.Robot, form: type[Route], q: Array) -> Row:
    arm = zero_arm(robot)
    joints = [tuple(row) for row in q.tolist()]
    return _times("forward", lambda: [forward(arm, form, each) for each in joints], len(q))


def _inverse_times(robot: kv.Robot, form: type[Route], T: Array) -> Row:
    arm = zero_arm(robot)
    targets = [form.of(pose) for pose in T]
    apart = 0.0
    for pose, target in zip(T, targets, strict=True):
        for branch in inverse(arm, target):
            reached = robot.fk(np.array(branch, dtype=np.float64))
            apart = max(apart, float(np.abs(reached - pose).max()))
    spent = _times("inverse", lambda: [inverse(arm, each) for each in targets], len(T))
    return {"apart": apart, **spent}


def _times(what: str, work: Callable[[], object], poses: int) -> Row:
    spent = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        spent.append(1e6 * (time.process_time() - start) / poses)
    low, middle, high = quartiles(spent)
    return {f"{what} low": low, f"{what} us": middle, f"{what} high": high}


def _cells(quick: bool) -> list[Cell]:
    poses = QUICK_POSES if quick else POSES
    return [
        Cell(
            f"conventional-{arm}-{version}",
            compare_forms,
            {"arm": arm, "poses": poses, "version": version},
        )
        for arm in ROBOTS
        for version in VERSIONS
    ]


def _build(cells: dict[str, list[Row]]) -> Table:
    table = printed("jha2015", "table_7_39")
    keys = zip(table.text("robot"), table.text("method"), strict=True)
    told = dict(zip(keys, table.numbers(["time_s"])[:, 0].tolist(), strict=True))
    counted = _counted(row for cell in cells.values() for row in cell)
    rows: list[Row] = []
    quicker, solved = dict.fromkeys(VERSIONS, 0), dict.fromkeys(VERSIONS, 0)
    for arm, version in product(ROBOTS, VERSIONS):
        found = cells[f"conventional-{arm}-{version}"]
        rows += [_shown(arm, row, counted, told.get((arm, str(row["method"])))) for row in found]
        spent = [row.get("inverse us") for row in found]
        if None not in spent:
            by_matrix, by_pair = (as_number(row, "inverse us") for row in found)
            quicker[version] += by_pair < by_matrix
            solved[version] += 1
    unsolved = [
        arm for arm in ROBOTS if cells[f"conventional-{arm}-printed"][0].get("inverse us") is None
    ]
    shorter = sum(told[arm, "QA"] < told[arm, "HT"] for arm in ROBOTS)
    forms = {count.form: count for count in count_forms() if count.what == "compose"}
    printed_from = "; ".join(
        f"{arm}: {geometry_source(as_printed)}" for arm, (as_printed, _) in ROBOTS.items()
    )
    composed = ", ".join(
        f"{name} {each.operations.multiplications} x and {each.operations.additions} +"
        for name, each in forms.items()
    )
    return Table(
        "Table 7.39: matrices (HT) and quaternion-vector pairs (QA)",
        rows,
        Verdict.CANNOT_CHECK,
        f"pairs have the shorter time for {shorter} of {len(ROBOTS)} arms as printed; ours (plain"
        f" Python, inverse) for {quicker['corrected']} of {solved['corrected']} corrected and"
        f" {quicker['printed']} of {solved['printed']} printed geometries; printed operation counts"
        " are lost in our copy",
        "Operations are counted by running the formulas on numbers that tally; zeros and ones of an"
        " arm's structure are free. Both forms share the elbow's equations. Geometries: the"
        f" corrected arms of the catalogue, and as printed ({printed_from}). {_lost(unsolved)}"
        f" One composition: {composed}. The text gives eight places for a quaternion"
        f" and twelve for a matrix; a pair stores {forms['pair'].scalars}. All branches of a pose;"
        " what one printed time covers is not told.",
    )


def _counted(rows: Iterable[Row]) -> list[str]:
    """Columns of operations, without those that no arm asks for."""
    every = list(rows)
    names = [f"{what} {each.name}" for what in ("forward", "inverse") for each in fields(Tally)]
    return [name for name in names if any(row.get(name) for row in every)]


def _shown(arm: str, row: Row, counted: list[str], seconds: float | None) -> Row:
    """A row of the table; dashes where there is no inverse."""
    return {
        "arm": arm,
        "geometry": row["version"],
        "method": row["method"],
        "scalars stored": row["scalars"],
        **{name.replace("_", " "): row.get(name) for name in counted},
        "branches": row.get("branches"),
        "largest error [m or 1]": row.get("apart"),
        "forward [us]": row["forward us"],
        "forward, lower quartile [us]": row["forward low"],
        "forward, upper quartile [us]": row["forward high"],
        "inverse, all branches [us]": row.get("inverse us"),
        "inverse, lower quartile [us]": row.get("inverse low"),
        "inverse, upper quartile [us]": row.get("inverse high"),
        "printed [s]": seconds,
    }


def _lost(arms: list[str]) -> str:
    """Why some arms have no inverse."""
    if not arms:
        return ""
    return (
        f"As printed {', '.join(arms)} has axes in another order than the closed forms of chapter 4"
        " are for: forward kinematics alone."
    )


TABLES: tuple[TableSpec, ...] = (
    TableSpec("7.39", "Matrices and quaternion pairs, table 7.39", _cells, _build),
)

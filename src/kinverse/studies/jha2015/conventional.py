"""Table 7.39: kinematics by homogeneous matrices and by quaternion-vector pairs."""

import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.studies.cell import Cell, Row
from kinverse.studies.counted import Tally
from kinverse.studies.data import printed
from kinverse.studies.forms import Matrix, Pair
from kinverse.studies.operation_counts import count_forms, count_forward, count_inverse
from kinverse.studies.pair_kinematics import Route, inverse
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, TableSpec, Verdict
from kinverse.studies.zero_arm import forward, zero_arm

__all__ = ["POSES_SEED", "ROBOTS", "TABLES", "compare_forms"]

Array = NDArray[np.float64]

ROBOTS = {
    "planar3R": "planar3r",
    "SCARA": "adept_one",
    "Pioneer2_5R": "pioneer2",
    "PUMA560": "puma560",
    "IRB1400": "irb1400",
    "ASEA_IRb6": "irb6",
    "RX160L": "rx160l",
}
"""As they are called in table 7.39, and in the catalogue: the corrected arms."""
METHODS = ("HT", "QA")
POSES, QUICK_POSES = 200, 20
POSES_SEED = 7_390
REPEATS = 5


def compare_forms(arm: str, poses: int) -> list[Row]:
    """Counted operations, branches and CPU time of one arm through matrices and pairs.

    Args:
        arm: of ``ROBOTS``.
        poses: random reachable ones.

    Returns:
        For each method one row: stored scalars, operations of forward kinematics and of an
        inverse with all branches (of the pose with the most), CPU time a pose [us] (median and
        quartiles of repeats over all poses), and ``apart``: the largest error of the tool
        position at any branch [m], by the arm's own forward kinematics.
    """
    robot = kv.load(ROBOTS[arm])
    q = robot.random(poses, np.random.default_rng(POSES_SEED))
    T = robot.fk(q)
    counted = [count_inverse(robot, pose) for pose in T]
    most = max(counted, key=lambda pair: pair[0].solutions)
    ways = count_forward(robot, q[0])
    spent = {"HT": _measured(robot, Matrix, q, T), "QA": _measured(robot, Pair, q, T)}
    return [
        spent[method]
        | {"method": method, "scalars": ways[k].scalars, "branches": most[k].solutions}
        | {f"forward {name}": value for name, value in asdict(ways[k].operations).items()}
        | {f"inverse {name}": value for name, value in asdict(most[k].operations).items()}
        for k, method in enumerate(METHODS)
    ]


def _measured(robot: kv.Robot, form: type[Route], q: Array, T: Array) -> Row:
    arm = zero_arm(robot)
    joints = [tuple(row) for row in q.tolist()]
    targets = [form.of(pose) for pose in T]
    apart = 0.0
    for pose, target in zip(T, targets, strict=True):
        for branch in inverse(arm, target):
            reached = robot.fk(np.array(branch, dtype=np.float64))
            apart = max(apart, float(np.abs(reached - pose).max()))
    row: Row = {"apart": apart}
    row |= _times("forward", lambda: [forward(arm, form, each) for each in joints], len(q))
    return row | _times("inverse", lambda: [inverse(arm, each) for each in targets], len(q))


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
        Cell(f"conventional-{arm}", compare_forms, {"arm": arm, "poses": poses}) for arm in ROBOTS
    ]


def _build(cells: dict[str, list[Row]]) -> Table:
    table = printed("jha2015", "table_7_39")
    keys = zip(table.text("robot"), table.text("method"), strict=True)
    told = dict(zip(keys, table.numbers(["time_s"])[:, 0].tolist(), strict=True))
    counted = _counted(row for cell in cells.values() for row in cell)
    rows: list[Row] = []
    quicker = 0
    for arm in ROBOTS:
        pair: dict[str, float] = {}
        for row in cells[f"conventional-{arm}"]:
            method = str(row["method"])
            pair[method] = float(row["inverse us"] or 0.0)
            rows.append(
                {
                    "arm": arm,
                    "method": method,
                    "scalars stored": row["scalars"],
                    **{name.replace("_", " "): row[name] for name in counted},
                    "branches": row["branches"],
                    "largest error [m or 1]": row["apart"],
                    "forward [us]": row["forward us"],
                    "inverse, all branches [us]": row["inverse us"],
                    "lower quartile [us]": row["inverse low"],
                    "upper quartile [us]": row["inverse high"],
                    "printed [s]": told.get((arm, method)),
                }
            )
        quicker += pair["QA"] < pair["HT"]
    shorter = sum(told[arm, "QA"] < told[arm, "HT"] for arm in ROBOTS)
    forms = {count.form: count for count in count_forms() if count.what == "compose"}
    composed = ", ".join(
        f"{name} {each.operations.multiplications} x and {each.operations.additions} +"
        for name, each in forms.items()
    )
    return Table(
        "Table 7.39: matrices (HT) and quaternion-vector pairs (QA)",
        rows,
        Verdict.CANNOT_CHECK,
        f"pairs have the shorter time for {shorter} of {len(ROBOTS)} arms as printed, for"
        f" {quicker} of ours (plain Python, inverse); printed operation counts are lost in our"
        " copy",
        "Operations are counted by running the formulas on numbers that tally; zeros and ones of an"
        " arm's structure are free. Both forms share the elbow's equations. Corrected arms of the"
        f" catalogue. One composition: {composed}. The text gives eight places for a quaternion"
        f" and twelve for a matrix; a pair stores {forms['pair'].scalars}. All branches of a pose;"
        " what one printed time covers is not told.",
    )


def _counted(rows: Iterable[Row]) -> list[str]:
    """Columns of operations, without those that no arm asks for."""
    every = list(rows)
    names = [f"{what} {each.name}" for what in ("forward", "inverse") for each in fields(Tally)]
    return [name for name in names if any(row[name] for row in every)]


TABLES: tuple[TableSpec, ...] = (
    TableSpec("7.39", "Matrices and quaternion pairs, table 7.39", _cells, _build),
)

"""Tables 7.26 to 7.38: function values and joints of population methods beside the printed ones."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from kinverse.studies.cell import Row
from kinverse.studies.jha2015.geometries import geometry, geometry_source
from kinverse.studies.jha2015.positions import (
    ALGORITHMS,
    ARMS,
    ArmTask,
    joint_headings,
    joint_units,
    printed_answers,
)
from kinverse.studies.jha2015.swarm.cells import (
    LIMITS,
    MAIN,
    POPULATIONS,
    answers_of,
    cells_of,
    middle,
    numbers,
    within,
)
from kinverse.studies.jha2015.swarm.pictures import joints_picture
from kinverse.studies.jha2015.swarm.populations import population_table
from kinverse.studies.jha2015.units import METRES
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES"]

Array = NDArray[np.float64]
CellRows = dict[str, list[Row]]


# ------------------------------------------------------------------------- function values
def _values(task: ArmTask, cells: CellRows) -> Table:
    rows: list[Row] = []
    every: list[Array] = []
    reach: dict[str, int] = {}
    for name in task.geometries:
        found = answers_of(cells, task, name, ALGORITHMS[0])
        reach[name] = len({row["position"] for row in found if row["least"] == 0.0})
        for position in range(5):
            for algorithm in ALGORITHMS:
                found = answers_of(cells, task, name, algorithm)
                mine = [row for row in found if row["position"] == position]
                f = numbers(mine, "f")
                every.append(f)
                low, _, high = quartiles(f)
                rows.append(
                    {
                        "geometry": name,
                        "position": f"P{position + 1}",
                        "algorithm": algorithm,
                        f"f, median [{task.unit}]": middle(mine)["f"],
                        f"lower quartile [{task.unit}]": low,
                        f"upper quartile [{task.unit}]": high,
                        f"least f known [{task.unit}]": mine[0]["least"],
                        **{f"f <= {limit} [%]": within(f, limit) for limit in LIMITS},
                        **_printed_beside(task, name, algorithm, position),
                    }
                )
    verdict, residual = _verdict(task)
    best = 100.0 * float((np.concatenate(every) <= task.accepted).mean())
    return Table(
        f"Table {task.answers or 'planar 3R (ours)'}: function values, {task.arm}",
        rows,
        verdict,
        residual,
        f"f is the distance from the position [{task.unit}], equation 6.28. Population {MAIN},"
        f" {len(every[0])} seeds; the budget is not printed: see the convergence. Of all our"
        f" searches {best:.0f} % end at f <= {task.accepted}. Positions in reach inside the joint"
        f" limits: {', '.join(f'{count} of 5 ({name})' for name, count in reach.items())}."
        f" {_read(task)}",
    )


def _printed_beside(task: ArmTask, name: str, algorithm: str, position: int) -> Row:
    robot = geometry(name)
    if not task.answers:
        return {}
    reached = "printed joints are off by"
    value, q = printed_answers(task, geometry(task.geometries[0]))[algorithm, position]
    far = float(np.linalg.norm(robot.fk(q)[:3, 3] - task.targets[position]) / METRES[task.unit])
    return {"f, printed": value, f"{reached} [{task.unit}]": far}


def _verdict(task: ArmTask) -> tuple[Verdict, str]:
    if not task.answers:
        return Verdict.OURS, "nothing printed"
    answers = printed_answers(task, geometry(task.geometries[0]))
    values = np.array([value for value, _ in answers.values()])
    far = {
        name: np.array(
            [
                np.linalg.norm(geometry(name).fk(q)[:3, 3] - task.targets[position])
                / METRES[task.unit]
                for (_, position), (_, q) in answers.items()
            ]
        )
        for name in (*task.geometries, *task.also)
    }
    best = min(far, key=lambda name: float(np.median(far[name])))
    reproduced = bool((np.abs(far[best] - values) <= task.accepted).all())
    told = (
        f"the {len(values)} printed joint sets end {far[best].min():.3g} to"
        f" {far[best].max():.4g} {task.unit} from their positions (median"
        f" {np.median(far[best]):.4g}, geometry {best}{_others(far, best)});"
        f" {int((values < 0).sum())} printed values of this norm are negative"
    )
    return Verdict.REPRODUCED if reproduced else Verdict.NOT_REPRODUCED, told


def _others(far: dict[str, Array], best: str) -> str:
    """Distances under the other geometries, those that differ from the best one's."""
    ranges: dict[str, list[str]] = {}
    for name, each in far.items():
        if not np.array_equal(each, far[best]):
            told = f"{each.min():.3g} to {each.max():.4g}, median {np.median(each):.4g}"
            ranges.setdefault(told, []).append(name)
    return "".join(f"; {', '.join(names)}: {told}" for told, names in ranges.items())


def _read(task: ArmTask) -> str:
    parts = [f"{name}: {geometry_source(name)}" for name in (*task.geometries, *task.also)]
    return "Geometries: " + "; ".join(parts) + "."


# ------------------------------------------------------------------------- joints
def _joints(task: ArmTask, cells: CellRows) -> Table:
    rows: list[Row] = []
    offs: list[float] = []
    targets = (task.targets / METRES[task.unit]).tolist()
    for name in task.geometries:
        robot = geometry(name)
        columns, units = joint_headings(robot, task.unit), joint_units(robot, task.unit)
        for position in range(5):
            for algorithm in ALGORITHMS:
                found = answers_of(cells, task, name, algorithm)
                row = middle([row for row in found if row["position"] == position])
                if row["off"] is not None:
                    offs.append(float(row["off"]))
                joints = np.array([row[f"q{k}"] for k in range(1, robot.dof + 1)], dtype=np.float64)
                rows.append(
                    {
                        "geometry": name,
                        "position": f"P{position + 1}",
                        "algorithm": algorithm,
                        **dict(zip(columns, (joints / units).tolist(), strict=True)),
                        **{
                            f"{axis} wanted [{task.unit}]": targets[position][k]
                            for k, axis in enumerate("XYZ")
                        },
                        **{f"{axis} reached [{task.unit}]": row[axis.lower()] for axis in "XYZ"},
                        "off a solution [rad or m]": row["off"],
                    }
                )
    shown = {a: answers_of(cells, task, task.geometries[0], a) for a in ALGORITHMS}
    closed = task.arm == "SCARA"
    how = (
        "the nearer of the two closed-form solutions, joint 4 left as it is"
        if closed
        else "the solution that a descent from these joints ends at: a position leaves joints of"
        " this arm free, so its solutions are surfaces, and the nearest is no farther away"
    )
    return Table(
        f"Table {task.answers or 'planar 3R (ours)'}: joints and positions, {task.arm}",
        rows,
        Verdict.OURS,
        f"median {np.median(offs):.3g} rad or m off a solution" if offs else "no solution is known",
        "Joints of the search with the median function value. Off a solution: largest joint"
        f" difference to {how}; a dash where no solution lies inside the limits.",
        (joints_picture(task, shown),),
    )


def _specs() -> tuple[TableSpec, ...]:
    specs = []
    for task in ARMS.values():
        head = task.answers or "planar"
        title = f"{task.arm}, table {task.answers}" if task.answers else "planar 3R, ours"
        main = partial(cells_of, task, (MAIN,))
        specs += [
            TableSpec(head, f"Function values, {title}", main, partial(_values, task)),
            TableSpec(f"{head}-joints", f"Joints, {title}", main, partial(_joints, task)),
            TableSpec(
                f"{head}-populations",
                f"Populations and convergence, {title}",
                partial(cells_of, task, POPULATIONS),
                partial(population_table, task),
            ),
        ]
    return tuple(specs)


TABLES: tuple[TableSpec, ...] = _specs()

"""What the size of the population does: an addition to the tables of the thesis."""

from kinverse.studies.cell import Row
from kinverse.studies.jha2015.positions import ALGORITHMS, ArmTask
from kinverse.studies.jha2015.swarm.cells import (
    LIMITS,
    POPULATIONS,
    answers_of,
    curves_of,
    numbers,
    within,
    works_with,
)
from kinverse.studies.jha2015.swarm.pictures import convergence_picture
from kinverse.studies.rows import quartiles
from kinverse.studies.table import Table, Verdict

__all__ = ["population_table"]

CellRows = dict[str, list[Row]]


def population_table(task: ArmTask, cells: CellRows) -> Table:
    """Function values by population, and the convergence of every geometry."""
    rows: list[Row] = []
    pictures = []
    for name in task.geometries:
        curves: dict[int, dict[str, list[Row]]] = {}
        for population in POPULATIONS:
            for algorithm in ALGORITHMS:
                if not works_with(algorithm, population):
                    continue
                curve = curves_of(cells, task, name, algorithm, population)
                curves.setdefault(population, {})[algorithm] = curve
                found = answers_of(cells, task, name, algorithm, population)
                reach = [row for row in found if row["least"] == 0.0]
                f = numbers(reach or found, "f")
                low, middle, high = quartiles(f)
                rows.append(
                    {
                        "geometry": name,
                        "population": population,
                        "algorithm": algorithm,
                        "positions in reach": len({row["position"] for row in reach}),
                        f"f, median [{task.unit}]": middle,
                        f"lower quartile [{task.unit}]": low,
                        f"upper quartile [{task.unit}]": high,
                        **{f"f <= {limit} [%]": within(f, limit) for limit in LIMITS},
                    }
                )
        pictures.append(convergence_picture(task, name, curves))
    column = f"f, median [{task.unit}]"
    best = rows[int(numbers(rows, column).argmin())]
    return Table(
        f"Populations of 3, 6 and 100, {task.arm}",
        rows,
        Verdict.OURS,
        f"least median f {best[column]:.3g} {task.unit}: {best['algorithm']} with population"
        f" {best['population']}",
        "The same number of evaluations for every population. Over the positions in reach, or all"
        " if none is. CIBO has no row for three: its swarms have more than five crabs each.",
        tuple(pictures),
    )

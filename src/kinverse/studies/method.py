"""How a study was made: the last section of its page, and the rows of its cells."""

from collections.abc import Callable, Iterable
from html import escape

from kinverse.studies.cell import Cell, Row
from kinverse.studies.cell_file import Finished
from kinverse.studies.grid import grid
from kinverse.studies.machine import machine, now
from kinverse.studies.places import rows_file
from kinverse.studies.study_run import StudyRun

__all__ = ["cell_rows", "method"]


def method(run: StudyRun) -> str:
    """The section: what was run, with which seeds, where and for how long."""
    facts = {
        "run": "quick: few repetitions" if run.quick else "full",
        "seeds": _seeds(run),
        "threads": "one BLAS thread in each process",
        "page": f"written {now()} UTC by kinverse {machine()['kinverse']}",
    }
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>\n" for k, v in facts.items())
    parts = {"What was computed": _work(run), "Where it was computed": _machines(run)}
    grids = "\n".join(grid(rows, name, name) for name, rows in parts.items() if rows)
    return f"""<section id="method">
<h2>How this was made</h2>
<dl>
{items}</dl>
{grids}
{_links(run)}
</section>
"""


def cell_rows(run: StudyRun) -> dict[str, list[Row]]:
    """Rows of all cells of a function, each with its cell and arguments, by name of a CSV file.

    Tables and pictures are made from these: every seed, every point of a curve.
    """
    return {
        rows_file(function): [
            {"cell": cell.name, **{f"argument {k}": v for k, v in cell.arguments.items()}, **row}
            for cell, done in cells
            for row in done.rows
        ]
        for function, cells in _by_function(run).items()
    }


def _links(run: StudyRun) -> str:
    names = map(rows_file, _by_function(run))
    links = ", ".join(f'<a href="{escape(name)}">{escape(name)}</a>' for name in names)
    return f"<p>Rows of the cells, every seed and every point of a curve: {links}</p>" * bool(links)


def _seeds(run: StudyRun) -> str:
    """Arguments of the cells that are seeds, and what is drawn from others."""
    found: dict[str, set[int]] = {}
    for cell, _ in run.cells.values():
        for name, value in cell.arguments.items():
            if isinstance(value, int) and (name == "seed" or name.endswith("_seed")):
                found.setdefault(name.replace("_", " "), set()).add(value)
            elif isinstance(value, int) and name == "seeds":  # so many, counted from 0
                found.setdefault("seed", set()).update(range(value))
    parts = [f"{name} {_ranges(values)}" for name, values in found.items()]
    parts += [f"{what} {seeds}" for what, seeds in run.study.seeds.items()]
    if not parts:
        return "nothing is drawn with a seed of the study"
    return "; ".join(parts) + "; what has no seed here: the library's fixed one"


def _ranges(values: Iterable[int]) -> str:
    """Whole numbers in short: 0-4, 7."""
    runs: list[list[int]] = []
    for value in sorted(values):
        if runs and value == runs[-1][-1] + 1:
            runs[-1].append(value)
        else:
            runs.append([value])
    return ", ".join(f"{r[0]}-{r[-1]}" if len(r) > 1 else str(r[0]) for r in runs)


def _work(run: StudyRun) -> list[Row]:
    """Cells counted by their function."""
    return [
        {
            "function": f"{function.__module__}.{function.__qualname__}",
            "cells": len(cells),
            "processor time, s": round(sum(done.seconds for _, done in cells), 2),
        }
        for function, cells in _by_function(run).items()
    ]


def _by_function(run: StudyRun) -> dict[Callable[..., list[Row]], list[tuple[Cell, Finished]]]:
    found: dict[Callable[..., list[Row]], list[tuple[Cell, Finished]]] = {}
    for cell, done in run.cells.values():
        found.setdefault(cell.function, []).append((cell, done))
    return found


def _machines(run: StudyRun) -> list[Row]:
    """Cells counted by where they were computed, perhaps long ago and by many."""
    found: dict[tuple[tuple[str, str], ...], list[Finished]] = {}
    for _, done in run.cells.values():
        found.setdefault(tuple(done.machine.items()), []).append(done)
    return [
        {
            "processor": dict(facts).get("processor"),
            "cells": len(cells),
            "first, UTC": min(done.date for done in cells),
            "last, UTC": max(done.date for done in cells),
            **dict(facts),
        }
        for facts, cells in found.items()
    ]

"""Which searches the tables of population methods are made of, and how their rows are picked."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.optimizers import make_optimizer
from kinverse.studies.cell import Cell, Row
from kinverse.studies.jha2015.positions import ALGORITHMS, ArmTask
from kinverse.studies.jha2015.swarm.search import search

__all__ = [
    "EVALUATIONS",
    "LIMITS",
    "MAIN",
    "POPULATIONS",
    "QUICK_EVALUATIONS",
    "answers_of",
    "cells_of",
    "curves_of",
    "middle",
    "numbers",
    "within",
    "works_with",
]

Array = NDArray[np.float64]

POPULATIONS = (3, 6, 100)
"""Printed as three search agents for the PUMA 560, six for the IRB-1400; 100 for the networks."""
MAIN = 100
SEEDS, QUICK_SEEDS = 21, 3
EVALUATIONS, QUICK_EVALUATIONS = 20_000, 2_000
"""The thesis does not say how many."""
LIMITS = (0.001, 0.01)
"""Function values up to which the thesis accepts a result: 7.26, and the others."""


def works_with(algorithm: str, population: int) -> bool:
    """Whether so few search agents are enough for an algorithm."""
    return population >= make_optimizer(algorithm).least_population


def cells_of(task: ArmTask, populations: tuple[int, ...], quick: bool) -> list[Cell]:
    """Every geometry and algorithm with each population that it can work with."""
    return [
        Cell(
            _name(task, name, algorithm, population),
            search,
            {
                "arm": _searched(task, name),
                "geometry_name": name,
                "algorithm": algorithm,
                "population": population,
                "seeds": QUICK_SEEDS if quick else SEEDS,
                "evaluations": QUICK_EVALUATIONS if quick else EVALUATIONS,
            },
        )
        for name in task.geometries
        for population in populations
        for algorithm in ALGORITHMS
        if works_with(algorithm, population)
    ]


def answers_of(
    cells: dict[str, list[Row]], task: ArmTask, name: str, algorithm: str, population: int = MAIN
) -> list[Row]:
    """The answers of all positions and seeds on a geometry."""
    rows = cells[_name(task, name, algorithm, population)]
    return [row for row in rows if row["kind"] == "answer"]


def curves_of(
    cells: dict[str, list[Row]], task: ArmTask, name: str, algorithm: str, population: int
) -> list[Row]:
    """The convergence on a geometry."""
    rows = cells[_name(task, name, algorithm, population)]
    return [row for row in rows if row["kind"] == "curve"]


def middle(rows: list[Row]) -> Row:
    """The search with the median function value, of an odd number."""
    return sorted(rows, key=_value)[len(rows) // 2]


def numbers(rows: list[Row], column: str) -> Array:
    """A column that is all numbers."""
    return np.array([row[column] for row in rows], dtype=np.float64)


def within(f: Array, limit: float) -> float:
    """Share of function values that are not above a limit [%]."""
    return 100.0 * float((f <= limit).mean())


def _value(row: dict[str, Any]) -> float:
    return float(row["f"])


def _searched(task: ArmTask, name: str) -> str:
    # table 7.30 prints the five positions of 7.33, which this geometry gives: the same searches
    return "IRB1400" if name == "irb1400_7_17" else task.arm


def _name(task: ArmTask, name: str, algorithm: str, population: int) -> str:
    return f"swarm-{_searched(task, name)}-{name}-{algorithm}-{population}"

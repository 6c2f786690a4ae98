"""Which networks are trained, and what of their rows the tables take."""

from kinverse.studies.cell import Cell, Row
from kinverse.studies.habibkhah2021.network import POSITION_ONLY, train_network

__all__ = ["MAIN", "VIRTUALS", "cells", "first", "main_cells"]

VIRTUALS = (POSITION_ONLY, "cos", "angle_sum", "cos_sin")
MAIN = "cos_sin"
"""Equation 3."""


def main_cells(quick: bool) -> list[Cell]:
    """The document's network: Bayesian regularisation, in a quick run variable projection."""
    return [_cell(MAIN, "varpro", 20, 0)] if quick else _repeated(MAIN, "bayes", 200, 5)


def cells(quick: bool) -> list[Cell]:
    """The document's network, and one of a quicker trainer for each virtual vector."""
    if quick:
        return [_cell(virtual, "varpro", 20, 0) for virtual in VIRTUALS]
    others = [each for virtual in VIRTUALS for each in _repeated(virtual, "varpro", 80, 5)]
    return main_cells(quick) + others


def _repeated(virtual: str, trainer: str, epochs: int, seeds: int) -> list[Cell]:
    return [_cell(virtual, trainer, epochs, seed) for seed in range(seeds)]


def _cell(virtual: str, trainer: str, epochs: int, seed: int) -> Cell:
    return Cell(
        f"{trainer}-{virtual}-{epochs}-{seed}",
        train_network,
        {
            "virtual": virtual,
            "trainer": trainer,
            "epochs": epochs,
            "seed": seed,
            "details": virtual == MAIN and seed == 0,
        },
    )


def first(found: dict[str, list[Row]]) -> list[Row]:
    """Rows of the first seed of the document's network, which has details."""
    return next(rows for name, rows in found.items() if MAIN in name)

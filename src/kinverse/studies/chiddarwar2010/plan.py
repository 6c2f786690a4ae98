"""Which cells are run: robots, regions, seeds."""

from kinverse.studies.cell import Cell, Value
from kinverse.studies.chiddarwar2010.held_out import held_out_errors
from kinverse.studies.chiddarwar2010.loop import run_fusion
from kinverse.studies.chiddarwar2010.poses import REGIONS, WHOLE

__all__ = ["MAIN", "all_cells", "fusion_cells", "held_out_cells"]

MAIN = "ir361"
"""The candidate for the document's robot; the other stands beside it in fewer regions."""
BESIDE = "puma560"


def held_out_cells(quick: bool) -> list[Cell]:
    """Errors on patterns that were held out."""
    return [
        Cell(
            f"held-out-{robot}-{half:g}-{seed}",
            held_out_errors,
            _common(robot, half, seed, quick),
        )
        for robot, half, seed in _places(quick)
    ]


def fusion_cells(quick: bool) -> list[Cell]:
    """The process on fresh poses and on a path."""
    return [
        Cell(
            f"fusion-{robot}-{half:g}-{seed}",
            run_fusion,
            {**_common(robot, half, seed, quick), "fresh": 20 if quick else 200},
        )
        for robot, half, seed in _places(quick)
    ]


def all_cells(quick: bool) -> list[Cell]:
    """Both: absolute networks follow the paths where they are trained."""
    return held_out_cells(quick) + fusion_cells(quick)


def _common(robot: str, half: float, seed: int, quick: bool) -> dict[str, Value]:
    return {"robot": robot, "half": half, "seed": seed, "epochs": 10 if quick else 25}


def _places(quick: bool) -> list[tuple[str, float, int]]:
    if quick:
        return [(MAIN, REGIONS[0], 0)]
    main = [(MAIN, half, seed) for half in REGIONS for seed in range(5)]
    return main + [(BESIDE, half, seed) for half in (REGIONS[0], WHOLE) for seed in range(3)]

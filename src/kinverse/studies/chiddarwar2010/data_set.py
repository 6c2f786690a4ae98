"""Section 2.1.3: the 70 poses and the patterns that are made of them."""

from kinverse.learning import IncrementalPairs, PoseFeatures
from kinverse.studies.cell import Cell, Row
from kinverse.studies.chiddarwar2010.held_out import POSES, SPLIT, SPLITS
from kinverse.studies.chiddarwar2010.poses import FLOORS, WHOLE, arm, draw
from kinverse.studies.chiddarwar2010.source import parameter
from kinverse.studies.rows import as_number
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["DATA_SET", "draw_data_set"]


def draw_data_set(robot: str, seed: int) -> list[Row]:
    """Draw the poses from all of the workspace; count what is turned away and what is made.

    Args:
        robot: its name.
        seed: of the poses and splits, as the networks have them.
    """
    data = draw(arm(robot), int(parameter("poses")), WHOLE, seed, POSES + seed)
    row: Row = {"robot": robot, "seed": seed, "poses": len(data), "drawn": data.drawn}
    row |= {f"rejected, {name}": count for name, count in data.rejected.items()}
    for split in SPLITS:
        pairs = IncrementalPairs(
            PoseFeatures("xyz+rpy"),
            split=split,
            test_fraction=1.0 - parameter("training share") / 100.0,
            random_state=SPLIT + seed,
        ).make(data.q, data.T)
        row["ordered pairs"] = len(pairs)
        row |= {
            f"train, split by {split}": int(pairs.is_train.sum()),
            f"test, split by {split}": int(pairs.is_test.sum()),
            f"in neither, split by {split}": pairs.n_mixed,
        }
    return [row]


def _cells(quick: bool) -> list[Cell]:
    return [
        Cell(f"data-set-{robot}-{seed}", draw_data_set, {"robot": robot, "seed": seed})
        for robot in FLOORS
        for seed in range(1 if quick else 5)
    ]


def _build(found: dict[str, list[Row]]) -> Table:
    rows = [row for each in found.values() for row in each]
    pairs, said = as_number(rows[0], "ordered pairs"), parameter("patterns")
    return Table(
        title="Section 2.1.3: 70 poses clear of collisions and singularities, and their pairs",
        rows=rows,
        verdict=Verdict.REPRODUCED if pairs == said else Verdict.NOT_REPRODUCED,
        residual=(
            f"{parameter('poses'):.0f} poses make {pairs:.0f} ordered pairs; {said:.0f} are"
            f" printed, {said - pairs:.0f} more"
        ),
        note=(
            "The document does not say what its robot may collide with, nor how near singularities"
            " poses may be: ours keep capsules of 60 mm clear of each other and the floor, and an"
            " inverse condition number of 0.005. A split by pair, the document's, holds out pairs"
            " whose poses the network meets in other pairs; a split by pose does not."
        ),
    )


DATA_SET = TableSpec("data-set", "Poses and patterns (section 2.1.3)", _cells, _build)

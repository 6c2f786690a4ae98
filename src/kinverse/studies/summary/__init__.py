"""All methods on all arms: the same targets, the same budget, one answer for each situation."""

from kinverse.studies.cell import Cell, Row, Value
from kinverse.studies.rows import select
from kinverse.studies.study import Study
from kinverse.studies.summary.answers import ENOUGH, answer
from kinverse.studies.summary.arms import CASES, REACH_SEED, SITUATIONS
from kinverse.studies.summary.methods import BUDGET, FAMILIES, TOLERANCE
from kinverse.studies.summary.pictures import solved_figure, time_against_error
from kinverse.studies.summary.race import TARGET_STREAM, TIMED_TOGETHER, race
from kinverse.studies.summary.tables import by_arm, by_situation, cannot_spend, overall
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

__all__ = ["STUDY"]

TARGET_SEEDS = (1, 2, 3)
SOLVER_SEED = 9_000
"""Of what solvers draw and learn; one more for each seed of targets, which have a stream apart."""
TARGETS, QUICK_TARGETS = 60, 8


def _cells(quick: bool) -> list[Cell]:
    seeds = TARGET_SEEDS[:1] if quick else TARGET_SEEDS
    cells = []
    for arm, task in CASES:
        for family in FAMILIES:
            for seed in seeds:
                name = f"{arm}-{task}-{family.replace(' ', '-')}-{seed}"
                arguments: dict[str, Value] = {
                    "arm": arm,
                    "task": task,
                    "family": family,
                    "target_seed": seed,
                    "solver_seed": SOLVER_SEED + seed,
                    "targets": QUICK_TARGETS if quick else TARGETS,
                    "quick": quick,
                }
                cells.append(Cell(name, race, arguments))
    return cells


def _all(rows: dict[str, list[Row]]) -> list[Row]:
    return [row for cell in rows.values() for row in cell]


def _how(rows: list[Row]) -> str:
    """What the figures are, for the notes."""
    idle = ", ".join(cannot_spend(rows))
    return (
        f"Budget: {BUDGET:,} evaluations of forward kinematics a pose, the same for all. No pose of"
        f" any arm makes these use it up: {idle}; they stop when they have an answer or nothing"
        " left to try. Analytic lists ranges of the free joint of redundant arms and is not"
        " bounded by it. Solved: an answer within"
        f" {TOLERANCE:g} m (and {TOLERANCE:g} rad for poses) and inside the limits, by forward"
        " kinematics in plain NumPy, and no answer that is not. Targets are poses of joint values"
        " drawn evenly inside the limits, from seeds that no solver uses. The reach, by"
        " which position errors of small and large arms are compared, is the largest distance of"
        " the tool from the first joint. Time is processor time of"
        f" one thread in a batch (of {TIMED_TOGETHER:,} poses; population methods: of the"
        " targets), without training."
    )


def _arms_table(rows: dict[str, list[Row]]) -> Table:
    every = _all(rows)
    table = by_arm(every)
    picture = Picture(
        "Targets solved, by method and arm",
        "Grid of methods by arms, coloured by the share of targets solved: "
        + _solved_words(overall(every)),
        lambda: solved_figure(table),
    )
    return Table(
        "Every method on every arm",
        table,
        Verdict.OURS,
        f"{len(table)} combinations of arm, task and method",
        _how(every),
        (picture,),
    )


def _overview_table(rows: dict[str, list[Row]]) -> Table:
    every = _all(rows)
    whole = overall(every)
    picture = Picture(
        "Which method to use when: time against error, all arms",
        "Processor time a pose against the error that 95 % of the poses stay below, the greater of"
        " the position's as a share of the arm's reach and the rotation's in rad, one marker a"
        " method: " + _time_words(whole),
        lambda: time_against_error(whole, ENOUGH),
    )
    return Table(
        "Every method in every situation",
        [*whole, *by_situation(every)],
        Verdict.OURS,
        "medians and quartiles over arms and seeds",
        _how(every),
        (picture,),
    )


def _answers_table(rows: dict[str, list[Row]]) -> Table:
    every = _all(rows)
    table = by_situation(every)
    answers = [
        answer(
            name,
            select(table, situation=name),
            dict.fromkeys(str(row["arm"]) for row in select(every, situation=name)),
        )
        for name in SITUATIONS
    ]
    return Table(
        "Which method to use when",
        [{name: value for name, value in row.items() if name != "answer"} for row in answers],
        Verdict.OURS,
        f"the quickest of the methods that solve {ENOUGH:g} % on every arm",
        f"Targets an arm and seed: {table[0]['targets an arm']}, seeds: {table[0]['seeds']};"
        " times are medians over arms and seeds. kv is kinverse; kv.solve(robot, T, solver=...)"
        " takes what is under call.\n\n" + "\n\n".join(str(row["answer"]) for row in answers),
    )


def _time_words(rows: list[Row]) -> str:
    found = [row for row in rows if row["time a pose, ms"] is not None]
    told = (
        f"{row['method']} {row['time a pose, ms']:.2g} ms, {_error_words(row)}" for row in found
    )
    return "; ".join(told) + "."


def _error_words(row: Row) -> str:
    far = row["position error, 95 % below, % of reach"]
    turned = row["rotation error, 95 % below, deg"]
    if far is None or turned is None:
        return "no bound"
    return f"{far:.1g} % of the reach and {turned:.1g} deg"


def _solved_words(rows: list[Row]) -> str:
    return ", ".join(f"{row['method']} {row['solved, %']:.3g} %" for row in rows) + " (medians)."


STUDY = Study(
    name="summary",
    title="All methods on all arms: which to use when",
    seeds={
        "targets": f"the stream [{TARGET_STREAM}, target seed]",
        "solvers": f"{SOLVER_SEED} + target seed, which is the solver seed",
        "reach of an arm": f"{REACH_SEED}",
    },
    source="Arms of the four source documents and of today; targets and figures of our own",
    tables=(
        TableSpec("when", "Which method to use when", _cells, _answers_table),
        TableSpec("overview", "Every method in every situation", _cells, _overview_table),
        TableSpec("methods", "Every method on every arm", _cells, _arms_table),
    ),
)

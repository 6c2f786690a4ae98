"""What came out of a training: errors in training and on poses that were not learned."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.cli._show import console, joint_kinds, note, show_table, table
from kinverse.task import as_task

if TYPE_CHECKING:
    from kinverse.solutions import Solutions
    from kinverse.solvers.trained.held_out import HeldOut
    from kinverse.solvers.trained.trained import Trained

__all__ = ["Tested", "as_json", "draw", "show", "test"]

ROWS = 500
"""Examples held out for each network."""
SHARE = 1000
"""Of them the poses that are also solved, at most."""


class Tested(NamedTuple):
    """What the solver does with examples that it has not learned."""

    rows: "HeldOut"
    answers: "Solutions"


def test(solver: "Trained") -> Tested:
    """Predict and solve fresh examples, from a seed of their own."""
    rows = solver.held_out(ROWS)
    # rows of a network come one after another: some of each
    chosen = np.linspace(0, len(rows.T) - 1, min(SHARE, len(rows.T))).round().astype(np.int64)
    return Tested(rows, solver.solve(rows.T[chosen]))


def draw(path: Path, solver: "Trained", tested: Tested) -> None:
    """The report of the training."""
    from kinverse import training_report

    training_report.solver_report(solver, tested.rows).savefig(path, dpi=120)
    note(f"drawn: {path}")


def records(solver: "Trained", tested: Tested) -> list[dict[str, Any]]:
    """One record for each network; errors in degrees and metres."""
    robot, rows = solver.robot_, tested.rows
    made = []
    for k, (expert, branch) in enumerate(
        zip(solver.experts_, solver.branches_.tolist(), strict=True)
    ):
        labels = solver.branch_labels_
        mine, net = rows.network == k, expert.network
        error = expert.training_error(robot)
        made.append(
            {
                "branch": labels[branch] if labels else "",
                "examples": len(error),
                "epochs": int(getattr(net, "n_iter_", 0)),
                "stop_reason": str(getattr(net, "stop_reason_", "")),
                **_rms("training", error, joint_kinds(robot)),
                **_rms("held_out", (rows.predicted - rows.q)[mine], joint_kinds(robot)),
                **_start(solver, rows, mine),
            }
        )
    return made


def summary(solver: "Trained", tested: Tested) -> dict[str, Any]:
    """Over all networks."""
    rows, answers = tested.rows, tested.answers
    solved = 100.0 * float(answers.ok.mean())
    every = _start(solver, rows, np.ones(len(rows.q), np.bool_))
    return {
        "poses": len(answers),
        "solved_percent": solved,
        "by_networks_percent": 100.0 * float(_by_networks(solver, answers).mean()),
        **every,
    }


def _by_networks(solver: "Trained", answers: "Solutions") -> NDArray[np.bool_]:
    """Which poses the predictions alone led to their solutions: on every branch, where several."""
    from kinverse.solvers.fusion import Fusion

    starts = answers.stats.starts
    if isinstance(solver, Fusion):
        return np.asarray(answers.ok & (starts == 0))
    return np.asarray(answers.ok & (starts <= len(solver.experts_)))


def as_json(solver: "Trained", tested: Tested, out: Path, interrupted: bool) -> str:
    """Everything, as one JSON object."""
    return json.dumps(
        {
            "robot": solver.robot_.name,
            "solver": type(solver).__name__,
            "task": solver.settings_.task,
            "network": type(solver.experts_[0].network).__name__,
            "file": str(out),
            "interrupted": interrupted,
            "networks": records(solver, tested),
            "held_out": summary(solver, tested),
        }
    )


def show(solver: "Trained", tested: Tested, out: Path, interrupted: bool) -> None:
    """Print what was trained and how good it is."""
    made, kinds = records(solver, tested), joint_kinds(solver.robot_)
    units = [unit for letter, unit in (("R", "deg"), ("P", "mm")) if letter in kinds]
    heads = [f">{part}, {unit}" for unit in units for part in ("training", "held out")]
    branches = ["branch"] if solver.branch_labels_ else []
    network = _named(solver.experts_[0].network)
    what = f"{len(made)} networks {network}" if len(made) > 1 else f"one network {network}"
    shown = table(
        *branches, ">examples", ">epochs", *heads,
    )  # fmt: skip
    for record in made:
        keys = [f"{part}_{unit}" for unit in units for part in ("training", "held_out")]
        first = [record["branch"]] if branches else []
        counts = [str(record["examples"]), str(record["epochs"])]
        shown.add_row(*first, *counts, *(_short(record[key]) for key in keys))
    tell = console().print
    tell(f"{solver.robot_.name}, {type(solver).__name__}: {what}; rms joint errors", markup=False)
    show_table(shown)
    reasons = ["Ctrl-C"] if interrupted else [record["stop_reason"] for record in made]
    for reason in dict.fromkeys(filter(None, reasons)):
        tell(f"training ended: {reason}", markup=False)
    total = summary(solver, tested)
    off = f"{_short(total['start_mm'])} mm"
    if total["start_deg"] is not None:
        off += f" and {_short(total['start_deg'])} deg"
    tell(f"predictions for fresh poses are off by {off} in the median")
    tell(
        f"solved {total['solved_percent']:.2f} % of {total['poses']} fresh poses,"
        f" {total['by_networks_percent']:.2f} % from predictions alone"
        + (" on every branch" if len(made) > 1 else "")
    )
    if getattr(solver, "refine", "") is None:
        tell("without refine only predictions inside the tolerances are solved: see how far off")
    tell(f"written: {out}", markup=False)


def _named(network: Any) -> str:
    """Class and size: MLP 12-60-6."""
    layers = getattr(network, "layers_", None)
    name = type(network).__name__
    return name if layers is None else f"{name} {'-'.join(map(str, np.asarray(layers).tolist()))}"


def _rms(name: str, error: NDArray[np.float64], kinds: str) -> dict[str, float | None]:
    """Root mean squares over the turning joints [deg] and over the slides [mm]."""
    turns = np.array([kind == "R" for kind in kinds])
    columns = {"deg": np.degrees(error[:, turns]), "mm": 1e3 * error[:, ~turns]}
    return {
        f"{name}_{unit}": float(np.sqrt((part**2).mean())) if part.size else None
        for unit, part in columns.items()
    }


def _start(solver: "Trained", rows: "HeldOut", mine: NDArray[np.bool_]) -> dict[str, float | None]:
    """Medians of how far the predictions themselves are off; no angle where the task has none."""
    turned = rows.rotation_error[mine] if as_task(solver.settings_.task).rotation else np.empty(0)
    off = {"start_mm": 1e3 * rows.position_error[mine], "start_deg": np.degrees(turned)}
    return {key: float(np.median(each)) if len(each) else None for key, each in off.items()}


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"

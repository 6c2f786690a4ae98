"""Pictures of the searches: convergence by population, and where the answers lie."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.jha2015.geometries import geometry
from kinverse.studies.jha2015.positions import ArmTask, joint_units
from kinverse.studies.table import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["convergence_picture", "joints_picture"]

LEAST = 1e-9
"""Function values are drawn from here [printed unit]."""


def convergence_picture(
    task: ArmTask, name: str, curves: dict[int, dict[str, list[Row]]]
) -> Picture:
    """Function value against evaluations, a panel for each population.

    Args:
        task: whose positions.
        name: of the geometry.
        curves: rows of kind "curve" by population and algorithm.
    """
    ends = []
    for population, by_algorithm in curves.items():
        last = {a: float(rows[-1]["median"] or 0.0) for a, rows in by_algorithm.items()}
        best = min(last, key=lambda a: last[a])
        ends.append(f"{best} with population {population} ({last[best]:.2g} {task.unit})")
    return Picture(
        f"Convergence, {task.arm}, geometry {name}",
        "Median function value with quartiles against evaluations for populations of"
        f" {', '.join(map(str, curves))}. Lowest at the end: {', '.join(ends)}.",
        partial(_convergence, task, curves),
    )


def _convergence(task: ArmTask, curves: dict[int, dict[str, list[Row]]]) -> "Figure":
    figure = new_figure((11.0, 3.6))
    axes = figure.subplots(1, len(curves), sharey=True, squeeze=False)[0]
    colours = {a: f"C{k}" for k, a in enumerate(curves[max(curves)])}
    for ax, (population, by_algorithm) in zip(axes, curves.items(), strict=True):
        for algorithm, rows in by_algorithm.items():
            spent = [row["evaluations"] for row in rows]
            low, middle, high = (
                np.maximum(np.array([row[part] for row in rows], dtype=np.float64), LEAST)
                for part in ("low", "median", "high")
            )
            ax.plot(spent, middle, color=colours[algorithm], label=algorithm)
            ax.fill_between(spent, low, high, color=colours[algorithm], alpha=0.15, linewidth=0)
        ax.axhline(task.accepted, color="0.5", lw=0.8, ls=":")
        ax.set_yscale("log")
        ax.set_title(f"population {population}")
        ax.set_xlabel("evaluations")
    axes[0].set_ylabel(f"function value [{task.unit}]")
    axes[-1].legend(frameon=False, fontsize="small")
    return figure


def joints_picture(task: ArmTask, answers: dict[str, list[Row]]) -> Picture:
    """Joints of all searches for each position (figures 7.37 to 7.41, 7.77 to 7.96).

    Args:
        task: whose positions.
        answers: rows of kind "answer" of the printed geometry by algorithm.
    """
    count = len(next(iter(answers.values()))) // 5
    return Picture(
        f"Joints found, {task.arm}, printed geometry",
        f"One panel a position, one column a joint, {count} dots for each of"
        f" {len(answers)} algorithms. Where the dots scatter the position leaves the joint free"
        " or has several solutions.",
        partial(_scatter, task, answers),
    )


def _scatter(task: ArmTask, answers: dict[str, list[Row]]) -> "Figure":
    robot = geometry(task.geometries[0])
    unit = joint_units(robot, task.unit)
    figure = new_figure((11.0, 3.2))
    axes = figure.subplots(1, 5, sharey=True)
    for position, ax in enumerate(axes):
        for k, (algorithm, rows) in enumerate(answers.items()):
            mine = [row for row in rows if row["position"] == position]
            q = np.array([[row[f"q{j}"] for j in range(1, robot.dof + 1)] for row in mine])
            at = np.arange(robot.dof) + 0.15 * (k - 2)
            ax.plot(
                np.broadcast_to(at, q.shape).ravel(),
                (q.astype(np.float64) / unit).ravel(),
                ls="",
                marker=".",
                ms=3,
                alpha=0.6,
                color=f"C{k}",
                label=algorithm,
            )
        ax.set_title(f"P{position + 1}")
        ax.set_xticks(range(robot.dof), range(1, robot.dof + 1))
        ax.set_xlabel("joint")
    slides = f" or {task.unit}" if "P" in robot.kinds else ""
    axes[0].set_ylabel(f"joint value [deg{slides}]")
    axes[-1].legend(frameon=False, fontsize="x-small", loc="best")
    return figure

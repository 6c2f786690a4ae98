"""Pictures of swarm solvers for ``solve`` and ``compare``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinverse import plots
from kinverse.cli import _race
from kinverse.cli._show import note
from kinverse.errors import InputError
from kinverse.solvers import make_solver
from kinverse.solvers.swarm import Swarm

if TYPE_CHECKING:
    from kinverse.robot import Robot
    from kinverse.solvers import Solver

__all__ = ["convergence", "search"]

MOST = 100
"""Poses whose searches are drawn: their populations are all held in memory."""


def search(path: Path, solver: "Solver", T: Any, name: str, rng: int | None) -> None:
    """Four pictures of the searches of the poses by one swarm solver, fitted."""
    if not isinstance(solver, Swarm):
        raise InputError(f"--plot draws swarm solvers, such as swarm:pso; {name!r} is none")
    if not len(T):
        raise InputError("--plot: there is no pose to draw")
    title = f"{solver.robot_.name}, {name}"
    plots.swarm_figure(solver, T[:MOST], rng, title).savefig(path, dpi=120)
    note(f"drawn: {path}")


def convergence(path: Path, robot: "Robot", T: Any, solvers: list[str], task: str) -> None:
    """How the swarm solvers among the named ones converge on the same poses."""
    made = {name: make_solver(name, robot, task) for name in _race.chosen(solvers)}
    swarms = {name: solver for name, solver in made.items() if isinstance(solver, Swarm)}
    if not swarms:
        raise InputError("--plot draws swarm solvers: name some, such as --solvers swarm:pso")
    figure = plots.new_figure((8.0, 5.0))
    histories = {}
    for name, solver in swarms.items():
        # the whole budget of a population alone, so that the methods themselves are compared
        solver.set_params(polish=False)
        histories[name] = solver.fit(robot).watch(T[:MOST], every=2, population=False)
    plots.convergence(figure.subplots(), histories)
    figure.suptitle(robot.name)
    figure.savefig(path, dpi=120)
    note(f"drawn: {path}")

"""Solvers by name. A family is imported when its name is first asked for."""

from collections.abc import Callable
from functools import partial

from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solvers._base import Solver
from kinverse.solvers.compose import FirstOf

__all__ = ["make_solver", "solver_names"]

AUTO_CLOSED_FORM_DOF = 6
"""Up to this many joints "auto" looks for a closed form first; above, no branch list is finite."""

Factory = Callable[[Robot, str], Solver]


TRAINED = ("learned", "fusion")
"""Solvers that have no name here, because ``fit`` takes seconds or more."""


def make_solver(name: str, robot: Robot, task: str = "pose") -> Solver:
    """A new, unfitted solver.

    Args:
        name: one of ``solver_names()``.
        robot: what it will be fitted to; "auto" looks at the number of joints.
        task: see ``kinverse.task``.

    Raises:
        InputError: an unknown name; the message lists the names.

    Example:
        >>> make_solver("numerical", robot).fit(robot)
    """
    factory = _KINDS.get(name) if isinstance(name, str) else None
    if factory is None:
        factory = _swarms().get(name) if isinstance(name, str) else None
    if factory is None:
        from difflib import get_close_matches

        if name in TRAINED:
            made = str(name).capitalize()
            raise InputError(
                f"solver {name!r} is trained first: kinverse.{made}().fit(robot), or `kinverse"
                f" train ROBOT --solver {name} --out FILE.npz`; then give that object or FILE.npz"
            )
        names = solver_names()
        near = get_close_matches(str(name), names, n=1)
        hint = f" did you mean {near[0]!r}?" if near else ""
        raise InputError(f"unknown solver {name!r}:{hint} the solvers are {', '.join(names)}")
    return factory(robot, task)


def solver_names() -> tuple[str, ...]:
    """The names ``kinverse.solve`` takes, "auto" first."""
    return (*_KINDS, *_swarms())


def _auto(robot: Robot, task: str) -> Solver:
    if robot.dof > AUTO_CLOSED_FORM_DOF:
        return _numerical(robot, task)
    return FirstOf([_analytic(robot, task), _numerical(robot, task)])


def _analytic(robot: Robot, task: str) -> Solver:
    from kinverse.solvers.analytic import Analytic

    return Analytic(task=task)


def _numerical(robot: Robot, task: str) -> Solver:
    from kinverse.solvers.numerical import Numerical

    return Numerical(task=task)


def _swarm(robot: Robot, task: str, optimizer: str = "pso") -> Solver:
    from kinverse.solvers.swarm import Swarm

    return Swarm(optimizer=optimizer, task=task)


_KINDS: dict[str, Factory] = {
    "auto": _auto,
    "analytic": _analytic,
    "numerical": _numerical,
    "swarm": _swarm,
}


def _swarms() -> dict[str, Factory]:
    """One for each population method; their names are not loaded before they are asked for."""
    from kinverse.optimizers.registry import NAMES

    return {f"swarm:{name}": partial(_swarm, optimizer=name) for name in NAMES}

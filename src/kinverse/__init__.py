"""kinverse: inverse kinematics of robot arms, every way to solve, every answer verified.

>>> import kinverse as kv
>>> robot = kv.load("kr16")
>>> solutions = kv.solve(robot, kv.pose([0.9, 0.3, 1.1], rpy=[0.2, 1.7, 0.3]))
>>> solutions.q

Angles are in radians, lengths in metres, poses are (4, 4) arrays of the tool in the base frame.
"""

import typing

from kinverse.errors import (
    InputError,
    KinverseError,
    MissingExtra,
    ModelError,
    NoClosedForm,
    NoSolution,
)
from kinverse.kernels import set_threads
from kinverse.load import load
from kinverse.robot import Robot
from kinverse.se3 import pose
from kinverse.solutions import Solutions
from kinverse.solve import solve
from kinverse.solvers import FirstOf, Proposal, Seeded, Solver, solver_names
from kinverse.status import Status

if typing.TYPE_CHECKING:
    from kinverse.conformance import check_solver
    from kinverse.solvers.analytic import Analytic
    from kinverse.solvers.fusion import Fusion
    from kinverse.solvers.learned import Learned
    from kinverse.solvers.numerical import Numerical
    from kinverse.solvers.swarm import Swarm

__all__ = [
    "Analytic",
    "FirstOf",
    "Fusion",
    "InputError",
    "KinverseError",
    "Learned",
    "MissingExtra",
    "ModelError",
    "NoClosedForm",
    "NoSolution",
    "Numerical",
    "Proposal",
    "Robot",
    "Seeded",
    "Solutions",
    "Solver",
    "Status",
    "Swarm",
    "__version__",
    "check_solver",
    "load",
    "pose",
    "set_threads",
    "solve",
    "solver_names",
]

__version__: str


# loaded when first asked for, which keeps `import kinverse` near the cost of NumPy's own import
_LAZY = {
    "Analytic": "kinverse.solvers.analytic",
    "Fusion": "kinverse.solvers.fusion",
    "Learned": "kinverse.solvers.learned",
    "Numerical": "kinverse.solvers.numerical",
    "Swarm": "kinverse.solvers.swarm",
    "check_solver": "kinverse.conformance",
}


def __getattr__(name: str) -> typing.Any:
    if name in _LAZY:
        from importlib import import_module

        value = globals()[name] = getattr(import_module(_LAZY[name]), name)
        return value
    # importlib.metadata costs a third of numpy's own import
    if name == "__version__":
        from importlib.metadata import version

        return version("kinverse")
    raise AttributeError(f"module 'kinverse' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

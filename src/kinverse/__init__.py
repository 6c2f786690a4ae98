"""kinverse: inverse kinematics of robot arms, every way to solve, every answer verified.

>>> import kinverse as kv
>>> robot = kv.load("kr16")
>>> solutions = kv.solve(robot, kv.pose([0.9, 0.3, 1.1], rpy=[0.2, 1.7, 0.3]))
>>> solutions.q

Angles are in radians, lengths in metres, poses are (4, 4) arrays of the tool in the base frame.
"""

from typing import TYPE_CHECKING

from kinverse.errors import (
    InputError,
    KinverseError,
    MissingExtra,
    ModelError,
    NoClosedForm,
    NoSolution,
)

__all__ = [
    "InputError",
    "KinverseError",
    "MissingExtra",
    "ModelError",
    "NoClosedForm",
    "NoSolution",
]

if TYPE_CHECKING:
    __version__: str


def __getattr__(name: str) -> str:
    # read when asked for: importlib.metadata costs a third of numpy's own import
    if name == "__version__":
        from importlib.metadata import version

        return version("kinverse")
    raise AttributeError(f"module 'kinverse' has no attribute {name!r}")

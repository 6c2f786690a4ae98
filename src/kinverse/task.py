"""Tasks: which part of a pose must hold. Errors count the constrained components only."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError

__all__ = ["TASKS", "Task", "as_task"]

Array = NDArray[np.float64]


class Task(NamedTuple):
    """One task: its name, the native core's number for it, and what it constrains.

    ``position`` and ``rotation`` count the constrained components (3 + 3 for a full pose).
    """

    name: str
    code: int
    position: int
    rotation: int
    text: str

    @property
    def size(self) -> int:
        """Number of constrained components, 6 for a full pose."""
        return self.position + self.rotation

    def constrained(self, jacobian: Array, T_base_tool: Array) -> Array:
        """The rows of a Jacobian that the task constrains.

        Args:
            jacobian: (..., 6, n), rows [linear; angular] in the base frame.
            T_base_tool: (..., 4, 4) poses the Jacobian belongs to; read for "position_axis" only,
                whose free turn is about the tool's own z axis.

        Returns:
            (..., size, n).

        Example:
            >>> as_task("planar").constrained(robot.jacobian(q), robot.fk(q)).shape
            (3, 3)
        """
        if self.name == "position_axis":
            across = np.swapaxes(T_base_tool[..., :3, :2], -1, -2) @ jacobian[..., 3:, :]
            return np.concatenate([jacobian[..., :3, :], across], axis=-2)
        rows: Array = jacobian[..., _ROWS[self.name], :]
        return rows


TASKS: dict[str, Task] = {
    task.name: task
    for task in (
        Task("pose", 0, 3, 3, "position and orientation"),
        Task("position", 1, 3, 0, "position"),
        Task("position_axis", 2, 3, 2, "position and the direction of the tool's z axis"),
        Task("planar", 3, 2, 1, "x, y and the rotation about the base's z axis"),
        Task("schoenflies", 4, 3, 1, "position and the rotation about the base's z axis"),
    )
}

_ROWS = {
    "pose": [0, 1, 2, 3, 4, 5],
    "position": [0, 1, 2],
    "planar": [0, 1, 5],
    "schoenflies": [0, 1, 2, 5],
}


def as_task(name: str) -> Task:
    """The task of that name.

    Raises:
        InputError: no such task; the message lists the names.

    Example:
        >>> as_task("position").size
        3
    """
    task = TASKS.get(name) if isinstance(name, str) else None
    if task is None:
        raise InputError(f"unknown task {name!r}: the tasks are {', '.join(TASKS)}")
    return task

"""A motion as a table for a controller: times, joint values, speeds and accelerations."""

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from kinverse.errors import InputError
from kinverse.paths.joint_units import joint_units

if TYPE_CHECKING:
    from kinverse.paths.trajectory import Trajectory
    from kinverse.robot import Robot

__all__ = ["RATE", "motion_csv"]

RATE = 250.0
"""Rows a second where none are asked for."""
MOST_ROWS = 5_000_000
"""Rows of a table, at most."""


def motion_csv(
    trajectory: "Trajectory", robot: "Robot", rate: float = RATE, degrees: bool = False
) -> str:
    """A header and a row every 1 / rate seconds; the last row is the end of the motion.

    Columns: ``t_s``, then joint values, speeds and accelerations, each with its unit, such as
    ``joint1_rad``, ``joint1_velocity_rad_per_s`` and ``joint1_acceleration_rad_per_s2``.

    Args:
        trajectory: the motion.
        robot: whose joints it moves.
        rate: rows a second [1/s].
        degrees: turning joints in degrees (files only, as everywhere).

    Raises:
        InputError: another number of joints, a rate that is not positive, or too many rows.

    Example:
        >>> motion_csv(retime(curve, 1.0, 4.0), robot).splitlines()[0][:15]
        't_s,joint1_rad,'
    """
    width = trajectory(0.0).q.shape[-1]
    if width != robot.dof:
        raise InputError(f"the trajectory has {width} joints, robot {robot.name!r} {robot.dof}")
    if not 0.0 < rate < np.inf:
        raise InputError(f"rate must be positive and finite [1/s], got {rate}")
    count = int(np.ceil(min(trajectory.duration * rate, 2.0 * MOST_ROWS) * (1.0 - 1e-12)))
    if count > MOST_ROWS:
        raise InputError(
            f"{trajectory.duration:.6g} s at {rate:g} rows a second are more than {MOST_ROWS} rows"
        )
    t = np.append(np.arange(count) / rate, trajectory.duration)
    units = [u.replace("rad", "deg") if degrees else u for u in joint_units(robot)]
    scale = np.where(np.array(units) == "deg", 180.0 / np.pi, 1.0)
    names = list(zip(robot.joint_names, units, strict=True))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            *["t_s", *(f"{name}_{unit}" for name, unit in names)],
            *(f"{name}_velocity_{unit}_per_s" for name, unit in names),
            *(f"{name}_acceleration_{unit}_per_s2" for name, unit in names),
        ]
    )
    parts = [part * scale for part in trajectory(t)]
    writer.writerows(np.column_stack([t, *parts]).tolist())
    return text.getvalue()

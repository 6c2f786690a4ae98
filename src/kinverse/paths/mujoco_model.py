"""A MuJoCo model made from a robot: a body for each joint, a site at the tool."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.errors import InputError, MissingExtra
from kinverse.paths.links import Link
from kinverse.robot import Robot

__all__ = ["mjcf", "model_of", "mujoco_or_extra", "without_log"]

Array = NDArray[np.float64]


def mujoco_or_extra(feature: str = "simulation") -> Any:
    """The package, or MissingExtra that says what needs it."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtra(feature, "sim") from error
    return mujoco


@contextmanager
def without_log() -> Iterator[None]:
    """Within it MuJoCo's warnings are dropped; it would print them and write MUJOCO_LOG.TXT."""
    mujoco = mujoco_or_extra()
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def mjcf(
    robot: Robot,
    links: Sequence[Link],
    *,
    step: float = 1e-3,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    friction: float = 0.0,
    damping: float = 0.0,
    held_tool: bool = False,
) -> str:
    """The model as MJCF text.

    Args:
        robot: no mimic joints.
        links: one for each joint.
        step: of the integration [s].
        gravity: in the base frame [m/s^2].
        friction: dry friction of each joint [Nm or N].
        damping: viscous friction of each joint [Nm s/rad or N s/m].
        held_tool: add a body that a weld ties to the tool and that the simulation moves.

    Raises:
        InputError: a robot with mimic joints.
    """
    if len(robot.kinds) != robot.dof:
        raise InputError(f"robot {robot.name!r} has mimic joints: it cannot be simulated yet")
    lines, closing = [], []
    for i, (kind, link) in enumerate(zip(robot.kinds, links, strict=True)):
        scale = float(robot.multiplier[i])
        if scale != 1.0 or robot.offset[i] != 0.0:
            raise InputError(
                f"robot {robot.name!r}: joint {robot.joint_names[i]!r} has a gear or an offset: it"
                " cannot be simulated yet"
            )
        axis = "hinge" if kind == "R" else "slide"
        matrix = link.inertia
        full = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        lines.append(
            f'<body name="link{i}" {_placed(robot.frames[i])}>'
            f'<inertial pos="{_text(link.centre)}" mass="{link.mass!r}"'
            f' fullinertia="{_text(full)}"/>'
            f'<joint name="joint{i}" type="{axis}" axis="0 0 1" frictionloss="{friction!r}"'
            f' damping="{damping!r}"/>'
        )
        closing.append("</body>")
    tool = robot.frames[-1]
    lines.append(f'<site name="tool" {_placed(tool)}/>')
    held = weld = ""
    if held_tool:
        held = '<body name="held" mocap="true"><site name="hand"/></body>'
        # stiff, and critically damped, as fast as the step allows
        weld = (
            '<equality><weld site1="hand" site2="tool"'
            f' solref="{2.0 * step!r} 1" solimp="0.99999 0.99999 0.001 0.5 2"/></equality>'
        )
    # autoreset would put an unstable arm back to zero and let it go on
    return (
        f'<mujoco model="arm"><compiler angle="radian" autolimits="false"/>'
        f'<option timestep="{step!r}" gravity="{_text(gravity)}" integrator="implicitfast"'
        ' iterations="200" tolerance="1e-12"><flag contact="disable" autoreset="disable"/></option>'
        f"<worldbody>{held}{''.join(lines)}{''.join(closing)}</worldbody>{weld}</mujoco>"
    )


def model_of(text: str) -> Any:
    """The compiled model of MJCF text."""
    return mujoco_or_extra().MjModel.from_xml_string(text)


def _placed(T: Array) -> str:
    quat = se3.quat_from_rotation(T[:3, :3])
    return f'pos="{_text(T[:3, 3])}" quat="{_text(quat)}"'


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value)) for value in values)

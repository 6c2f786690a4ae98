"""An arm in a multibody simulator: the role ADAMS has in document 002."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.paths.links import Link, links_of
from kinverse.paths.mujoco_model import mjcf, model_of, mujoco_or_extra, without_log
from kinverse.paths.simulation_run import Plants, Run
from kinverse.paths.trajectory import Trajectory
from kinverse.paths.wanted import wanted_motion
from kinverse.robot import Robot
from kinverse.velocity import characteristic_length, homogeneous, singular_directions

__all__ = ["Effort", "Simulation", "check_drive", "simulate"]

Array = NDArray[np.float64]

DRIVES = ("joints", "tool")
CONTROLS = ("computed_torque", "servo", "prescribed")
BANDWIDTH = 300.0
"""Of the controllers: their error decays as exp(-BANDWIDTH t), critically damped [rad/s]."""


@dataclass(frozen=True)
class Effort:
    """What a drive had to give, component by component.

    Attributes:
        peak: largest absolute value.
        rms: root mean square.
        uniformity: rms / peak: 1 where the load never changes, near 0 where it comes in jerks.
    """

    peak: Array
    rms: Array
    uniformity: Array

    @classmethod
    def of(cls, values: Array) -> "Effort":
        """Of values over time (N, k)."""
        if not len(values):
            nothing = np.full(values.shape[1], np.nan)
            return cls(nothing, nothing, nothing)
        peak = np.abs(values).max(axis=0)
        rms = np.sqrt(np.mean(values**2, axis=0))
        return cls(peak, rms, np.divide(rms, peak, out=np.ones_like(rms), where=peak > 0.0))


@dataclass(frozen=True)
class Simulation:
    """What was wanted and what the simulator measured, at N instants.

    Attributes:
        t: (N,) [s].
        q: (N, n) joint values measured [rad or m].
        q_wanted: (N, n) joint values asked for (drive "joints"), or those of the inverse
            kinematics beside which the measured ones stand (drive "tool"); NaN where none.
        T: (N, 4, 4) pose of the tool measured.
        T_wanted: (N, 4, 4) pose asked for.
        position_error: (N,) [m]; rotation_error: (N,) [rad].
        torque: (N, n) of the joints' drives [Nm or N]; zero where the tool is driven.
        constraint_force: (N, 6) force [N] and moment [Nm] with which what holds the tool to its
            path acts on it, in the axes of the base, the moment about the tool's origin; at rest
            ``jacobian.T @ constraint_force`` is what the drives would have to give. Zero where the
            joints are driven.
        ok: whether it ran to the end.
        reason: why it did not, and when.
    """

    t: Array
    q: Array
    q_wanted: Array
    T: Array
    T_wanted: Array
    position_error: Array
    rotation_error: Array
    torque: Array
    constraint_force: Array
    ok: bool = True
    reason: str = ""
    drive: str = "joints"
    control: str = "computed_torque"
    joint_names: tuple[str, ...] = field(default=())

    @property
    def rms_position_error(self) -> float:
        """Root mean square of the position error [m]."""
        return float(np.sqrt(np.mean(self.position_error**2))) if len(self.t) else float("nan")

    @property
    def peak_speeds(self) -> Array:
        """(n,) largest speed of each joint as measured [rad/s or m/s]; NaN of one instant."""
        if len(self.t) < 2:
            return np.full(self.q.shape[1], np.nan)
        return np.asarray((np.abs(np.diff(self.q, axis=0)) / np.diff(self.t)[:, None]).max(axis=0))

    @property
    def torques(self) -> Effort:
        """Peak, rms and uniformity of each joint's torque."""
        return Effort.of(self.torque)

    @property
    def constraint_forces(self) -> Effort:
        """Peak, rms and uniformity of what holds the tool."""
        return Effort.of(self.constraint_force)


def simulate(
    robot: Robot,
    t: ArrayLike | Trajectory,
    q: ArrayLike | None = None,
    *,
    drive: str = "joints",
    control: str | None = None,
    links: Sequence[Link] | None = None,
    mass_error: float = 0.0,
    friction: float = 0.0,
    damping: float = 0.0,
    bandwidth: float | None = None,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    step: float = 5e-4,
) -> Simulation:
    """Play a joint trajectory in MuJoCo and measure.

    Between given instants the joints are splines of degree five from rest to rest, so that the
    accelerations are smooth; a ``Trajectory`` is played as it is.

    Args:
        robot: the arm; no mimic joints, gears or offsets.
        t: a ``Trajectory``, without q; or (N,) instants [s], increasing, at least two.
        q: (N, n) joint values at these.
        drive: "joints": the joints are driven and the tool is measured. "tool": the tool is held to
            the poses that these joint values reach and the joints, which turn freely, are measured:
            document 002's first method. It takes an arm whose joints the tool determines.
        control: of driven joints: "computed_torque" (the default: inverse dynamics of the nominal
            links, and feedback), "servo" (each joint by itself: spring and damper of the same
            bandwidth, set by the inertia at the start and integrated implicitly, so that the
            coupling of the joints cannot make them unstable: Tan, Liu & Turk 2011) or "prescribed"
            (the joints follow exactly, and inverse dynamics of the true arm tells the torques).
        links: mass, centre and inertia of each link; None: ``default_links``.
        mass_error: the true links weigh (1 + mass_error) times what the controller believes.
        friction: dry friction of each joint that the controller does not know [Nm or N].
        damping: viscous friction of each joint that it does not know.
        bandwidth: of the feedback [rad/s], where there is one; None: 300.
        gravity: [m/s^2] in the base frame.
        step: of the integration [s].

    Returns:
        A ``Simulation``; one that becomes unstable ends there and says when, with what was measured
        before.

    Raises:
        InputError: times that do not increase, other shapes, NaN, unknown words, a control or
            bandwidth for a drive that has none, a motion that leaves the joint limits (by more than
            1e-3), a robot that cannot be simulated, or whose joints move by themselves while the
            tool is held.
        MissingExtra: MuJoCo is not installed.

    Example:
        >>> simulate(robot, retime(curve, 1.0, 4.0), mass_error=0.1).rms_position_error
    """
    mujoco_or_extra()
    check_drive(drive, control, bandwidth)
    how, feedback = control or CONTROLS[0], BANDWIDTH if bandwidth is None else bandwidth
    for name, value in (("friction", friction), ("damping", damping)):
        if not 0.0 <= value < np.inf:
            raise InputError(f"{name} must be finite and not negative, got {value!r}")
    for name, value in (("step", step), ("bandwidth", feedback)):
        if not 0.0 < value < np.inf:
            raise InputError(f"{name} must be positive and finite, got {value!r}")
    pull = se3.as_real(gravity, "gravity")
    if pull.shape != (3,) or not np.isfinite(pull).all():
        raise InputError(f"gravity must be three finite numbers, got {pull.tolist()}")
    if not -1.0 < mass_error < np.inf:
        raise InputError(f"mass_error must be above -1, got {mass_error!r}")
    wanted = wanted_motion(robot, t, q, step)
    believed = links_of(robot, links)
    true = [link.scaled(1.0 + mass_error) for link in believed]
    if drive == "tool":
        _check_determined(robot, wanted.q)

    def model(links: Sequence[Link], **more: Any) -> Any:
        return model_of(mjcf(robot, links, step=step, gravity=gravity, **more))

    plants = Plants(
        real=model(true, friction=friction, damping=damping, held_tool=drive == "tool"),
        smooth=model(true, damping=damping),
        believed=model(believed),
        friction=friction,
    )
    with without_log():
        run = Run(robot, plants, wanted, feedback)
        done, reason = run.tool() if drive == "tool" else run.joints(how)
    T, T_wanted = run.T[:done], run.T_wanted[:done]
    gap = np.swapaxes(T_wanted[:, :3, :3], 1, 2) @ T[:, :3, :3]
    return Simulation(
        t=wanted.t[:done],
        q=run.q[:done],
        q_wanted=wanted.q[:done],
        T=T,
        T_wanted=T_wanted,
        position_error=np.linalg.norm(T[:, :3, 3] - T_wanted[:, :3, 3], axis=1),
        rotation_error=np.linalg.norm(se3.rotation_log(gap), axis=-1),
        torque=run.torque[:done],
        constraint_force=run.force[:done],
        ok=not reason,
        reason=reason,
        drive=drive,
        control=how if drive == "joints" else "",
        joint_names=robot.joint_names,
    )


def _check_determined(robot: Robot, q: Array) -> None:
    """Refuse an arm that moves by itself with its tool held: all along, not in passing."""
    some = q[np.linspace(0, len(q) - 1, 9).astype(np.intp)]
    J = homogeneous(robot.jacobian(some), characteristic_length(robot))
    rank = int(singular_directions(J).rank.max())
    if rank < robot.dof:
        raise InputError(
            f"with its tool held {robot.name!r} moves by itself: the tool determines {rank} of"
            f" {robot.dof} joints along this motion; drive='joints' drives all"
        )


def check_drive(drive: str, control: str | None, bandwidth: float | None) -> None:
    """Refuse unknown words, and a control or bandwidth that would count for nothing.

    Raises:
        InputError: the message names what goes with what.

    Example:
        >>> check_drive("tool", "servo", None)
        InputError: control is of driven joints: a driven tool has no controller
    """
    if drive not in DRIVES:
        raise InputError(f"drive must be {' or '.join(map(repr, DRIVES))}, got {drive!r}")
    if control is not None and control not in CONTROLS:
        raise InputError(f"control must be one of {', '.join(CONTROLS)}, got {control!r}")
    if drive == "tool":
        for name, value in (("control", control), ("bandwidth", bandwidth)):
            if value is not None:
                raise InputError(f"{name} is of driven joints: a driven tool has no controller")
    if control == "prescribed" and bandwidth is not None:
        raise InputError("bandwidth is of a feedback: joints that are prescribed have none")

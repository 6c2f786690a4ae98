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
from kinverse.paths.trajectory import Trajectory
from kinverse.paths.wanted import Wanted, wanted_motion
from kinverse.robot import Robot

__all__ = ["Effort", "Simulation", "simulate"]

Array = NDArray[np.float64]

DRIVES = ("joints", "tool")
CONTROLS = ("computed_torque", "servo", "prescribed")
BANDWIDTH = 300.0
"""Of the controllers: their error decays as exp(-BANDWIDTH t), critically damped [rad/s]."""
WELD_LAG = 4
"""Steps by which what holds the tool lags behind."""
FASTEST = 1e4
"""Joint speed [rad/s or m/s] beyond which a simulation counts as unstable."""


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
        constraint_force: (N, 6) force and moment that hold the tool to its path [N, Nm], zero
            where the joints are driven.
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
    control: str = "computed_torque",
    links: Sequence[Link] | None = None,
    mass_error: float = 0.0,
    friction: float = 0.0,
    damping: float = 0.0,
    bandwidth: float = BANDWIDTH,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    step: float = 5e-4,
) -> Simulation:
    """Play a joint trajectory in MuJoCo and measure.

    Between given instants the joints are splines of degree five (three where there are too few
    instants) from rest to rest, so that the accelerations are smooth; a ``Trajectory`` is played
    as it is.

    Args:
        robot: the arm; no mimic joints, gears or offsets.
        t: a ``Trajectory``, without q; or (N,) instants [s], increasing, at least two.
        q: (N, n) joint values at these.
        drive: "joints": the joints are driven and the tool is measured. "tool": the tool is held to
            the poses that these joint values reach and the joints, which turn freely, are measured:
            document 002's first method.
        control: of the joints: "computed_torque" (inverse dynamics of the nominal links, and
            feedback), "servo" (each joint by itself: spring and damper of the same bandwidth, set
            by the inertia at the start) or "prescribed" (the joints follow exactly, and inverse
            dynamics tells the torques).
        links: mass, centre and inertia of each link; None: ``default_links``.
        mass_error: the true links weigh (1 + mass_error) times what the controller believes.
        friction: dry friction of each joint that the controller does not know [Nm or N].
        damping: viscous friction of each joint that it does not know.
        bandwidth: of the feedback [rad/s].
        gravity: [m/s^2] in the base frame.
        step: of the integration [s].

    Returns:
        A ``Simulation``; one that becomes unstable ends there and says when, with what was measured
        before.

    Raises:
        InputError: times that do not increase, other shapes, NaN, unknown words, a robot that
            cannot be simulated.
        MissingExtra: MuJoCo is not installed.

    Example:
        >>> simulate(robot, retime(curve, 1.0, 4.0), mass_error=0.1).rms_position_error
    """
    mujoco = mujoco_or_extra()
    _check_words(drive, control)
    for name, value in (("friction", friction), ("damping", damping)):
        if not 0.0 <= value < np.inf:
            raise InputError(f"{name} must be finite and not negative, got {value!r}")
    for name, value in (("step", step), ("bandwidth", bandwidth)):
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
    common = {"step": step, "gravity": gravity}
    plant = model_of(
        mjcf(
            robot,
            true,
            friction=friction,
            damping=damping,
            held_tool=drive == "tool",
            **common,  # type: ignore[arg-type]
        )
    )
    with without_log():
        if drive == "tool":
            return _Run(robot, mujoco, plant, None, wanted, bandwidth).tool()
        nominal = model_of(mjcf(robot, believed, **common))  # type: ignore[arg-type]
        return _Run(robot, mujoco, plant, nominal, wanted, bandwidth).joints(control)


class _Run:
    """One simulation in progress."""

    def __init__(
        self, robot: Robot, mujoco: Any, plant: Any, nominal: Any, wanted: Wanted, bandwidth: float
    ) -> None:
        self._robot, self._mujoco, self._plant, self._nominal = robot, mujoco, plant, nominal
        self._wanted, self._bandwidth = wanted, bandwidth
        self._T_wanted = robot.fk(wanted.q)
        self._data = mujoco.MjData(plant)
        count, n = wanted.q.shape
        self._q, self._torque = np.empty((count, n)), np.zeros((count, n))
        self._T, self._force = np.empty((count, 4, 4)), np.zeros((count, 6))

    def joints(self, control: str) -> Simulation:
        """Drive the joints."""
        data, wanted = self._data, self._wanted
        data.qpos[:], data.qvel[:] = wanted.q[0], wanted.speed[0]
        self._mujoco.mj_forward(self._plant, data)
        torque = self._servo() if control == "servo" else self._computed_torque
        if control == "prescribed":
            torque = self._inverse
        done, reason = len(wanted.t), ""
        for k in range(len(wanted.t)):
            if control == "prescribed":
                data.qpos[:], data.qvel[:] = wanted.q[k], wanted.speed[k]
            self._torque[k] = torque(k)
            if control == "prescribed":
                self._mujoco.mj_kinematics(self._plant, data)
                self._measure(k)
                continue
            data.qfrc_applied[:] = self._torque[k]
            self._mujoco.mj_kinematics(self._plant, data)
            self._measure(k)
            self._mujoco.mj_step(self._plant, data)
            reason = self._unstable(k)
            if reason:
                done = k + 1
                break
        return self._told(done, reason, "joints", control)

    def tool(self) -> Simulation:
        """Hold the tool to its poses; the joints are free."""
        data, plant, mujoco = self._data, self._plant, self._mujoco
        data.qpos[:], data.qvel[:] = self._wanted.q[0], self._wanted.speed[0]
        done, reason = len(self._wanted.t), ""
        quats = se3.quat_from_rotation(self._T_wanted[:, :3, :3])
        for k in range(done):
            # the weld is a spring and damper of two steps: it follows four steps late
            ahead = min(k + WELD_LAG, done - 1)
            data.mocap_pos[0], data.mocap_quat[0] = self._T_wanted[ahead, :3, 3], quats[ahead]
            mujoco.mj_kinematics(plant, data)
            self._measure(k)
            mujoco.mj_step(plant, data)
            self._force[k] = data.efc_force[:6]
            reason = self._unstable(k)
            if reason:
                done = k + 1
                break
        return self._told(done, reason, "tool", "")

    def _computed_torque(self, k: int) -> Array:
        """M (q'' + 2 w e' + w^2 e) + bias of the nominal links (Luh, Walker & Paul 1980)."""
        data, w = self._data, self._bandwidth
        error = self._wanted.q[k] - data.qpos
        speed_error = self._wanted.speed[k] - data.qvel
        asked = self._wanted.acceleration[k] + 2.0 * w * speed_error + w * w * error
        return self._inverse_dynamics(data.qpos, data.qvel, asked)

    def _servo(self) -> Any:
        """Each joint a spring and a damper, as stiff as its inertia at the start needs."""
        w, q = self._bandwidth, self._wanted.q[0]
        still = np.zeros(len(q))
        bias = self._inverse_dynamics(q, still, still)
        columns = [self._inverse_dynamics(q, still, unit) - bias for unit in np.eye(len(q))]
        inertia = np.diag(np.array(columns))
        stiff, soft = inertia * w * w, 2.0 * inertia * w
        data, wanted = self._data, self._wanted

        def torque(k: int) -> Array:
            return np.asarray(
                stiff * (wanted.q[k] - data.qpos) + soft * (wanted.speed[k] - data.qvel)
            )

        return torque

    def _inverse(self, k: int) -> Array:
        wanted = self._wanted
        return self._inverse_dynamics(wanted.q[k], wanted.speed[k], wanted.acceleration[k])

    def _inverse_dynamics(self, q: Array, speed: Array, acceleration: Array) -> Array:
        if not hasattr(self, "_thought"):
            self._thought = self._mujoco.MjData(self._nominal)
        data = self._thought
        data.qpos[:], data.qvel[:], data.qacc[:] = q, speed, acceleration
        self._mujoco.mj_inverse(self._nominal, data)
        return np.asarray(data.qfrc_inverse).copy()

    def _measure(self, k: int) -> None:
        data = self._data
        self._q[k] = data.qpos
        site = self._plant.site("tool").id
        self._T[k] = np.eye(4)
        self._T[k, :3, :3] = data.site_xmat[site].reshape(3, 3)
        self._T[k, :3, 3] = data.site_xpos[site]

    def _unstable(self, k: int) -> str:
        data = self._data
        if np.isfinite(data.qpos).all() and np.abs(data.qvel).max() < FASTEST:
            return ""
        return f"unstable at t = {self._wanted.t[k]:g} s: a smaller step or bandwidth may help"

    def _told(self, done: int, reason: str, drive: str, control: str) -> Simulation:
        T, T_wanted = self._T[:done], self._T_wanted[:done]
        gap = np.swapaxes(T_wanted[:, :3, :3], 1, 2) @ T[:, :3, :3]
        return Simulation(
            t=self._wanted.t[:done],
            q=self._q[:done],
            q_wanted=self._wanted.q[:done],
            T=T,
            T_wanted=T_wanted,
            position_error=np.linalg.norm(T[:, :3, 3] - T_wanted[:, :3, 3], axis=1),
            rotation_error=np.linalg.norm(se3.rotation_log(gap), axis=-1),
            torque=self._torque[:done],
            constraint_force=self._force[:done],
            ok=not reason,
            reason=reason,
            drive=drive,
            control=control,
            joint_names=self._robot.joint_names,
        )


def _check_words(drive: str, control: str) -> None:
    if drive not in DRIVES:
        raise InputError(f"drive must be {' or '.join(map(repr, DRIVES))}, got {drive!r}")
    if control not in CONTROLS:
        raise InputError(f"control must be one of {', '.join(CONTROLS)}, got {control!r}")

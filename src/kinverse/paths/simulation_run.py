"""One simulation in progress: controllers, what is measured at each step, and when it is lost."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.paths.mujoco_model import mujoco_or_extra
from kinverse.paths.wanted import Wanted
from kinverse.robot import Robot

__all__ = ["Plants", "Run"]

Array = NDArray[np.float64]

WELD_LAG = 4
"""Steps by which what holds the tool lags behind."""
FASTEST = 1e4
"""Joint speed [rad/s or m/s] beyond which a simulation counts as unstable; so do ..."""
ASTRAY = 1.0
"""... joints so far from where they should be [rad or m], ..."""
TOOL_ASTRAY = 0.1
"""... a driven tool so far off, as a share of the arm's reach, ..."""
WILD = 100.0
"""... and drives that give so many times what the motion takes at most, and beyond that ..."""
SLIP = 0.01
"""... what the feedback gives for this error [rad or m]."""


class Plants(NamedTuple):
    """Compiled models of one arm.

    Attributes:
        real: what is simulated.
        smooth: the same without dry friction, whose inverse dynamics are exact.
        believed: what the controller takes it for.
        friction: dry friction of each joint of the real one [Nm or N].
    """

    real: Any
    smooth: Any
    believed: Any
    friction: float


class Run:
    """A simulation of one wanted motion; what it measures fills the arrays.

    Attributes:
        q: (K, n) joint values measured.
        T: (K, 4, 4) pose of the tool.
        torque: (K, n) of the drives.
        force: (K, 6) force and moment on the tool, axes of the base, moment about its origin.
        T_wanted: (K, 4, 4).
    """

    def __init__(self, robot: Robot, plants: Plants, wanted: Wanted, bandwidth: float) -> None:
        self._mujoco = mujoco_or_extra()
        self._robot, self._plants, self._wanted = robot, plants, wanted
        self._bandwidth = bandwidth
        self._step = plants.real.opt.timestep
        self._data = self._mujoco.MjData(plants.real)
        self._believed = self._mujoco.MjData(plants.believed)
        self._needed = self._torque_of_the_motion()
        self.T_wanted = robot.fk(wanted.q)
        count, n = wanted.q.shape
        self.q, self.torque = np.empty((count, n)), np.zeros((count, n))
        self.T, self.force = np.empty((count, 4, 4)), np.zeros((count, 6))

    def joints(self, control: str) -> tuple[int, str]:
        """Drive the joints; instants measured, and why it ended early ("" if it did not)."""
        data, wanted = self._data, self._wanted
        if control == "prescribed":
            self.torque[:] = self._needed
            for k, q in enumerate(wanted.q):
                data.qpos[:] = q
                self._measure(k)
            return len(wanted.t), ""
        data.qpos[:], data.qvel[:] = wanted.q[0], wanted.speed[0]
        inertia = self._inertia()
        most = self._most_torque(inertia)
        step = self._servo(inertia) if control == "servo" else self._computed_torque
        for k in range(len(wanted.t)):
            self._measure(k)
            step(k)
            reason = self._fast(k) or self._astray(k) or self._wild(k, most)
            if reason:
                return k + 1, reason
        return len(wanted.t), ""

    def tool(self) -> tuple[int, str]:
        """Hold the tool to its poses, the joints free; otherwise as ``joints``."""
        data, wanted = self._data, self._wanted
        data.qpos[:], data.qvel[:] = wanted.q[0], wanted.speed[0]
        last = len(wanted.t) - 1
        quats = se3.quat_from_rotation(self.T_wanted[:, :3, :3])
        reach = sum(float(np.linalg.norm(frame[:3, 3])) for frame in self._robot.frames[1:])
        for k in range(last + 1):
            # the weld is a spring and damper of two steps: it follows four steps late
            ahead = min(k + WELD_LAG, last)
            data.mocap_pos[0], data.mocap_quat[0] = self.T_wanted[ahead, :3, 3], quats[ahead]
            self._measure(k)
            self._mujoco.mj_forward(self._plants.real, data)
            self.force[k] = self._held(quats[ahead])
            self._mujoco.mj_step(self._plants.real, data)
            reason = self._fast(k)
            off = float(np.linalg.norm(self.T[k, :3, 3] - self.T_wanted[k, :3, 3]))
            if not reason and off > TOOL_ASTRAY * reach:
                reason = self._unstable(k, f"the tool is {off:.3g} m off")
            if reason:
                return k + 1, reason
        return last + 1, ""

    # ------------------------------------------------------------------ controllers
    def _computed_torque(self, k: int) -> None:
        """M (q'' + 2 w e' + w^2 e) + bias of the believed links (Luh, Walker & Paul 1980)."""
        data, wanted, w = self._data, self._wanted, self._bandwidth
        error, speed_error = wanted.q[k] - data.qpos, wanted.speed[k] - data.qvel
        asked = wanted.acceleration[k] + 2.0 * w * speed_error + w * w * error
        self.torque[k] = self._inverse_dynamics(
            self._plants.believed, self._believed, data.qpos, data.qvel, asked
        )
        data.qfrc_applied[:] = self.torque[k]
        self._mujoco.mj_step(self._plants.real, data)

    def _servo(self, inertia: Array) -> Any:
        """Each joint a spring and a damper, as stiff as its inertia at the start needs.

        Both act as they are at the end of a step (Tan, Liu & Turk 2011): with the errors at its
        beginning, light joints that heavy ones shake (inertia coupling) would be unstable.
        """
        w, data, plant, wanted = self._bandwidth, self._data, self._plants.real, self._wanted
        stiff, soft = inertia * w * w, 2.0 * inertia * w
        # the simulator's integrator is implicit in the damping of joints, so it is put there
        damper = soft + self._step * stiff
        plant.dof_damping[:] += damper
        last = len(wanted.t) - 1

        def step(k: int) -> None:
            at = min(k + 1, last)
            spring = stiff * (wanted.q[at] - data.qpos) + soft * wanted.speed[at]
            data.qfrc_applied[:] = spring
            self._mujoco.mj_step(plant, data)
            self.torque[k] = spring - damper * data.qvel

        return step

    def _inertia(self) -> Array:
        """(n,) of each joint by itself at the start, of the believed links."""
        q = self._wanted.q[0]
        still = np.zeros(len(q))
        model, data = self._plants.believed, self._believed
        bias = self._inverse_dynamics(model, data, q, still, still)
        columns = [self._inverse_dynamics(model, data, q, still, unit) for unit in np.eye(len(q))]
        return np.diag(np.array(columns) - bias)

    def _torque_of_the_motion(self) -> Array:
        """(K, n) torques that the real arm takes for the wanted motion, friction included."""
        data = self._mujoco.MjData(self._plants.smooth)
        wanted = self._wanted
        smooth = [
            self._inverse_dynamics(self._plants.smooth, data, *row)
            for row in zip(wanted.q, wanted.speed, wanted.acceleration, strict=True)
        ]
        return np.array(smooth) + self._plants.friction * np.sign(wanted.speed)

    def _inverse_dynamics(
        self, model: Any, data: Any, q: Array, speed: Array, acceleration: Array
    ) -> Array:
        data.qpos[:], data.qvel[:], data.qacc[:] = q, speed, acceleration
        self._mujoco.mj_inverse(model, data)
        return np.array(data.qfrc_inverse)

    # ------------------------------------------------------------------ what is measured
    def _measure(self, k: int) -> None:
        data, plant = self._data, self._plants.real
        self._mujoco.mj_kinematics(plant, data)
        self.q[k] = data.qpos
        site = plant.site("tool").id
        self.T[k] = np.eye(4)
        self.T[k, :3, :3] = data.site_xmat[site].reshape(3, 3)
        self.T[k, :3, 3] = data.site_xpos[site]

    def _held(self, hand: Array) -> Array:
        """Force and moment (6,) on the tool, of the weld's multipliers.

        The weld keeps ``p_hand - p_tool`` and the vector part of ``conj(tool) hand`` (unit
        quaternions) at zero; multipliers weigh the rates of these, so they are turned into base
        axes by the transpose of what takes an angular velocity to the latter.
        """
        data, plant = self._data, self._plants.real
        site = plant.site("tool")
        tool = _product(data.xquat[int(site.bodyid[0])], site.quat)
        gap = _product(tool * [1.0, -1.0, -1.0, -1.0], hand)
        pull, turn = data.efc_force[:3], data.efc_force[3:6]
        R = data.site_xmat[site.id].reshape(3, 3)
        return np.concatenate([-pull, -0.5 * R @ (gap[0] * turn + np.cross(gap[1:], turn))])

    # ------------------------------------------------------------------ when it is lost
    def _most_torque(self, inertia: Array) -> Array:
        """(n,) beyond which drives are wild; turning and sliding joints each by their own."""
        slides = np.array([kind == "P" for kind in self._robot.kinds])
        peak = np.abs(self._needed).max(axis=0)
        most = [peak[slides == kind].max() for kind in slides]
        return np.asarray(WILD * np.array(most) + SLIP * inertia * self._bandwidth**2)

    def _fast(self, k: int) -> str:
        data = self._data
        if np.isfinite(data.qpos).all() and np.abs(data.qvel).max() < FASTEST:
            return ""
        return self._unstable(k, "joints move without bound")

    def _astray(self, k: int) -> str:
        off = np.abs(self._data.qpos - self._wanted.q[min(k + 1, len(self._wanted.t) - 1)])
        j = int(np.argmax(off))
        if off[j] <= ASTRAY:
            return ""
        unit = "rad" if self._robot.kinds[j] == "R" else "m"
        return self._unstable(k, f"{self._robot.joint_names[j]} is {off[j]:.3g} {unit} off")

    def _wild(self, k: int, most: Array) -> str:
        given = np.abs(self.torque[k])
        j = int(np.argmax(given / most))
        if given[j] <= most[j]:
            return ""
        unit = "Nm" if self._robot.kinds[j] == "R" else "N"
        name, needed = self._robot.joint_names[j], np.abs(self._needed[:, j]).max()
        return self._unstable(
            k, f"the drive of {name} gives {given[j]:.3g} {unit}, the motion takes {needed:.3g}"
        )

    def _unstable(self, k: int, why: str) -> str:
        t = self._wanted.t[k]
        return f"unstable at t = {t:g} s: {why}; a smaller step or bandwidth may help"


def _product(a: Array, b: Array) -> Array:
    """Of two quaternions, w first."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.append(w, a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))

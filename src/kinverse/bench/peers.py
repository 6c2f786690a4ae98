"""The other libraries, each built from the same robot and checked against the oracle first.

Every adapter makes the fastest sensible call of its library from Python. A peer whose forward
kinematics differ from the oracle's by more than 1e-9 is refused: it would solve another robot.
"""

import math
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from kinverse.bench import oracle

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Eaik", "Ikdh", "OptIK", "Rtb", "SsikJaco2", "installed"]

Array = NDArray[np.float64]
PACKAGES = {
    "eaik": "eaik",
    "rtb": "roboticstoolbox-python",
    "optik": "optik-py",
    "ikdh": "ikdh",
    "ssik": "ssik",
    **{name: name for name in ("mealpy", "pymoo", "pygmo", "pyswarms", "scipy", "cma")},
}


def installed() -> dict[str, str]:
    """Versions of the peers that are there."""
    found = {}
    for name, package in PACKAGES.items():
        try:
            found[name] = version(package)
        except PackageNotFoundError:
            continue
    return found


class Eaik:
    """EAIK: closed form by subproblem decomposition, all branches.

    Ostermeier, Kuelz, Althoff, IEEE RA-L 10(10), 2025. Neither limits nor windings.
    """

    def __init__(self, robot: "Robot") -> None:
        from eaik.IK_Homogeneous import HomogeneousRobot

        zero = oracle.frames(robot, np.zeros((1, robot.dof)))
        self._robot = HomogeneousRobot(np.array([T[0] for T in zero]))
        _check(self, robot)
        # the bound C++ methods, without the Python layer over them
        self.one: Any = self._robot._robot.calculate_IK
        self.many: Any = self._robot._robot.calculate_IK_batched

    def fk(self, q: Array) -> Array:
        """(n,) to (4, 4)."""
        return np.asarray(self._robot.fwdKin(q))


class Rtb:
    """Robotics Toolbox for Python: ``ik_LM`` of its C++ extension, from a short chain.

    Corke and Haviland, ICRA 2021. Its default tolerance of 1e-6 is half a squared error, hence
    1e-13 for 1e-6 m and rad.
    """

    def __init__(self, robot: "Robot") -> None:
        from roboticstoolbox import ET, ETS

        # one constant and one joint in turn: the shortest chain, quicker than its own DH models
        chain = ETS()
        for i, frame in enumerate(robot.frames):
            if np.abs(frame - np.eye(4)).max() > 0:
                chain = chain * ET.SE3(np.array(frame))
            if i < len(robot.kinds):
                joint = ET.Rz if robot.kinds[i] == "R" else ET.tz
                chain = chain * joint(qlim=np.array(robot.limits[i]))
        self._chain = chain
        _check(self, robot)

    def fk(self, q: Array) -> Array:
        """(n,) to (4, 4)."""
        return np.asarray(self._chain.fkine(q).A)

    def solve(self, T: Array, q0: Array) -> Array:
        """One search, restarted inside the limits up to 100 times."""
        return np.asarray(self._chain.ik_LM(T, q0=q0, tol=1e-13, joint_limits=True).q)


class OptIK:
    """OptIK: nonlinear optimisation with restarts, one thread (Cesare)."""

    def __init__(self, robot: "Robot") -> None:
        import optik

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(_urdf(robot), encoding="utf-8")
            self._robot = optik.Robot.from_urdf_file(str(file), "link0", f"link{robot.dof + 1}")
        self._robot.set_parallelism(1)
        # tolerances on steps and on the change of f would end it short of 1e-6
        self._config = optik.SolverConfig(
            solution_mode="speed", max_time=1.0, tol_f=1e-12, tol_df=-1.0, tol_dx=-1.0
        )
        self._nothing = np.full(robot.dof, np.nan)
        _check(self, robot)

    def fk(self, q: Array) -> Array:
        """(n,) to (4, 4)."""
        return np.asarray(self._robot.fk(q))

    def solve(self, T: Array, q0: Array) -> Array:
        """One search; NaN if it gave up."""
        answer = self._robot.ik(self._config, T, q0)
        return self._nothing if answer is None else np.asarray(answer[0])


class Ikdh:
    """IKDH: all solutions of a general 6R arm by Husty and Pfurner's algebra (Refalo, Capco)."""

    def __init__(self, robot: "Robot") -> None:
        import ikdh

        table = robot.to_dh("standard")
        rows = [np.asarray(row).tolist() for row in (table.a, table.d, table.alpha, table.theta)]
        self._before, self._behind = np.linalg.inv(table.base), np.linalg.inv(table.tool)
        self._dh = ikdh.DHTable(*rows)
        self._forward = ikdh.forward_kin
        _check(self, robot)
        # degrees, and targets of the table's own frames: see targets
        self.one: Any = ikdh.Solver(self._dh).solve

    def fk(self, q: Array) -> Array:
        """(n,) to (4, 4)."""
        inner = np.asarray(self._forward(self._dh, np.degrees(q)))
        return np.asarray(np.linalg.inv(self._before) @ inner @ np.linalg.inv(self._behind))

    def targets(self, T: Array) -> list[Array]:
        """What ``one`` takes for poses (N, 4, 4): made before the clock runs."""
        return list(np.ascontiguousarray(self._before @ T @ self._behind))

    def joints(self, answer: Any) -> Array:
        """An answer of ``one`` as (K, n) [rad]."""
        degrees: Array = np.asarray(answer, dtype=np.float64).reshape(-1, 6)
        return np.asarray(np.radians(degrees))


class SsikJaco2:
    """ssik: the prebuilt artifact of the Kinova Jaco2, by its native backend (Srinivasa).

    Its arm is an edition of the Jaco2 with lateral offsets of its own: ``robot`` is that arm.
    """

    def __init__(self) -> None:
        import ssik._native as native
        from ssik.prebuilt.kinova import jaco2_ik

        from kinverse.robot import Robot

        if not native.native_available():
            raise ModuleNotFoundError("ssik's native backend is not in this build")
        self._forward = jaco2_ik.fk
        self._solve = jaco2_ik.solve
        frames, before = [], np.eye(4)
        for joint in jaco2_ik._KB.joints:
            turned = _turned_to(np.asarray(joint.axis))
            frames.append(before @ np.asarray(joint.T_left) @ turned)
            before = np.linalg.inv(turned) @ np.asarray(joint.T_right)
        # six digits of a model file: rounded to what a rotation is
        rigid = np.array([_orthonormal(frame) for frame in [*frames, before]])
        self.robot = Robot(rigid, "R" * 6, [(-np.pi, np.pi)] * 6, name="jaco2 of ssik")
        _check(self, self.robot)

    def fk(self, q: Array) -> Array:
        """(n,) to (4, 4)."""
        return np.asarray(self._forward(q))

    def one(self, T: Array) -> Any:
        """Every branch, limits ignored, no whole turns: the quickest of its calls."""
        return self._solve(T, respect_limits=False, enumerate_windings=False)

    def targets(self, T: Array) -> list[Array]:
        """What ``one`` takes."""
        return list(T)

    def joints(self, answer: Any) -> Array:
        """An answer of ``one`` as (K, n) [rad]."""
        return np.array([found.q for found in answer]).reshape(-1, 6)


def _turned_to(axis: Array) -> Array:
    """A rotation (4, 4) that carries z to an axis."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return T


def _orthonormal(T: Array) -> Array:
    left, _, right = np.linalg.svd(T[:3, :3])
    rigid = T.copy()
    rigid[:3, :3] = left @ right
    return rigid


def _check(peer: "Eaik | Ikdh | OptIK | Rtb | SsikJaco2", robot: "Robot") -> None:
    low, high = robot.limits.T
    q = np.random.default_rng(5).uniform(low, high, (20, robot.dof))
    for values, T in zip(q, oracle.pose(robot, q), strict=True):
        off = np.abs(peer.fk(values) - T).max()
        if not off <= 1e-9:
            name = type(peer).__name__
            raise ValueError(f"{name} built another robot than {robot.name}: off by {off:.1e}")


def _urdf(robot: "Robot") -> str:
    parts = [f"<robot name={quoteattr(robot.name)}>", '<link name="link0"/>']
    for i, T in enumerate(robot.frames):
        roll = math.atan2(T[2, 1], T[2, 2])
        pitch = math.atan2(-T[2, 0], math.hypot(T[0, 0], T[1, 0]))
        yaw = math.atan2(T[1, 0], T[0, 0])
        kind = "fixed"
        limit = ""
        if i < len(robot.kinds):
            kind = "revolute" if robot.kinds[i] == "R" else "prismatic"
            low, high = map(float, robot.limits[i])
            limit = (
                f'<axis xyz="0 0 1"/><limit lower="{low!r}" upper="{high!r}" '
                'effort="1" velocity="1"/>'
            )
        xyz = " ".join(repr(float(v)) for v in T[:3, 3])
        parts.append(
            f'<link name="link{i + 1}"/><joint name="joint{i}" type="{kind}">'
            f'<parent link="link{i}"/><child link="link{i + 1}"/>'
            f'<origin xyz="{xyz}" rpy="{roll!r} {pitch!r} {yaw!r}"/>{limit}</joint>'
        )
    return "\n".join([*parts, "</robot>"])

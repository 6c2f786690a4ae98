"""The frozen robot: a chain of one-degree joints between fixed transforms."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import dh, kernels, se3
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.dh_table import DHTable

__all__ = ["LIMIT_SLACK", "MOST_JOINTS", "MOST_LIMIT", "Robot"]

Array = NDArray[np.float64]

MOST_DEGREES = 36_000.0
"""Limits beyond this are no degrees by mistake: they stand for a joint that has none."""

LIMIT_SLACK = 1e-9
"""How far outside its limits a joint value [rad or m] still counts as inside."""

MOST_JOINTS = 32
"""Moving joints a robot may have: MAX_JOINTS of the native core."""

MOST_LIMIT = 1e9
"""Largest joint limit [rad or m], with either sign."""


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """An open chain of revolute and prismatic joints, immutable.

    Moving joint i sits behind the fixed transform ``frames[i]`` and turns about, or slides along,
    its own z axis; ``frames[-1]`` leads from the last joint to the tool point::

        T_base_tool = frames[0] J0(v[0]) frames[1] J1(v[1]) ... frames[m]
        v[i] = multiplier[i] * q[source[i]] + offset[i]

    Most robots are made by :func:`kinverse.load` or :meth:`from_dh`.

    Args:
        frames: (m + 1, 4, 4) fixed transforms [m]; rotations that are off by rounding (up to
            1e-5, as poses are) are replaced by the nearest true ones.
        kinds: m letters, "R" revolute or "P" prismatic.
        limits: (n, 2) of the free joints [rad or m]; None, or None for a row, is +-pi for a
            revolute joint and an error for a prismatic one.
        joint_names: n names of the free joints; None: joint1, joint2, ...
        source: (m,) which free joint drives each moving joint; None: each drives itself.
        multiplier: (m,) factor of a mimic joint; None: 1.
        offset: (m,) offset of a mimic joint [rad or m]; None: 0.
        name: the robot's name.
        source_note: where the numbers come from.
        unverified: what about them could not be checked.

    Raises:
        TypeError: complex, object or text data.
        InputError: no joint or more than 32, wrong lengths, transforms that are not rigid, limits
            that are upside down, not finite or beyond +-1e9, repeated names.

    Example:
        >>> arm = Robot.from_dh(a=[0.3, 0.2], d=0, alpha=0, joints="RR")
        >>> arm.fk([0.0, 0.0])[:3, 3]
        array([0.5, 0. , 0. ])
    """

    frames: Array
    kinds: str
    limits: Array
    joint_names: tuple[str, ...]
    source: NDArray[np.int32]
    multiplier: Array
    offset: Array
    name: str
    source_note: str
    unverified: tuple[str, ...]

    def __init__(
        self,
        frames: ArrayLike,
        kinds: str,
        limits: Any = None,
        joint_names: Iterable[str] | None = None,
        source: ArrayLike | None = None,
        multiplier: ArrayLike | None = None,
        offset: ArrayLike | None = None,
        name: str = "robot",
        source_note: str = "",
        unverified: Iterable[str] = (),
    ) -> None:
        m = len(kinds)
        if m == 0:
            raise InputError(f"robot {name!r} has no moving joint")
        if m > MOST_JOINTS:
            raise InputError(f"robot {name!r} has {m} moving joints, more than {MOST_JOINTS}")
        if set(kinds) - set("RP"):
            raise InputError(f"joint kinds must be R (revolute) or P (prismatic), got {kinds!r}")
        stack = se3.as_poses(frames, "frames")
        if len(stack) != m + 1:
            raise InputError(f"{m} joints need {m + 1} frames, got {len(stack)}")
        drive = _drive(source, m)
        n = int(drive.max()) + 1
        self._set("frames", _rigid(stack))
        self._set("kinds", str(kinds))
        self._set("source", drive)
        self._set("multiplier", _row(multiplier, m, 1.0, "multiplier"))
        self._set("offset", _row(offset, m, 0.0, "offset"))
        self._set("joint_names", _names(joint_names, n))
        # a free joint is of the kind of the first moving joint that it drives
        free = [kinds[int(np.flatnonzero(drive == j)[0])] for j in range(n)]
        self._set("limits", _limits(limits, free, self.joint_names))
        self._set("name", str(name))
        self._set("source_note", str(source_note))
        self._set("unverified", tuple(map(str, unverified)))

    def _set(self, field: str, value: Any) -> None:
        if isinstance(value, np.ndarray):
            value = value + value.dtype.type(0)  # own copy; and -0.0 becomes 0.0, so equal is same
            value.setflags(write=False)
        object.__setattr__(self, field, value)

    @classmethod
    def from_dh(
        cls,
        a: ArrayLike,
        d: ArrayLike,
        alpha: ArrayLike,
        theta: ArrayLike = 0.0,
        joints: str | Sequence[str] = "RRRRRR",
        convention: str = "standard",
        limits: Any = None,
        base: Any = None,
        tool: Any = None,
        name: str = "robot",
        joint_names: Iterable[str] | None = None,
        source_note: str = "",
        unverified: Iterable[str] = (),
    ) -> "Robot":
        """A robot from Denavit-Hartenberg rows.

        "standard" rows read ``Rz(theta) Tz(d) Tx(a) Rx(alpha)``; "modified" rows (Craig,
        Introduction to Robotics) read ``Rx(alpha) Tx(a) Rz(theta) Tz(d)`` with alpha and a of the
        link before the joint. The joint value is added to theta of an R row and to d of a P row.

        Args:
            a: link lengths [m], one for each row, or one number for all.
            d: link offsets [m], likewise.
            alpha: twists [rad], likewise.
            theta: constant angles [rad], likewise.
            joints: one letter a row, as a text or a list: R revolute, P prismatic, F fixed.
            convention: "standard" or "modified".
            limits: (n, 2) of the moving rows [rad or m]; see :class:`Robot`.
            base: (4, 4) pose of the first row in the base frame.
            tool: (4, 4) pose of the tool in the frame of the last row.
            name: the robot's name.
            joint_names: names of the moving rows.
            source_note: where the numbers come from.
            unverified: what about them could not be checked.

        Raises:
            InputError: as :class:`Robot`; also an unknown convention or letter, or rows of
                different length.

        Warns:
            UserWarning: twists of more than a turn, or revolute limits beyond four turns: degrees
                where radians are read?

        Example:
            >>> Robot.from_dh(a=[0.1, 0.1], d=0, alpha=0, joints="RR").dof
            2
        """
        base = None if base is None else se3.as_pose(base, "base")
        tool = None if tool is None else se3.as_pose(tool, "tool")
        frames, kinds = dh.frames(a, d, alpha, theta, joints, convention, base, tool)
        robot = cls(
            frames,
            kinds,
            limits,
            joint_names,
            name=name,
            source_note=source_note,
            unverified=unverified,
        )
        twist = float(np.abs(np.asarray(alpha, dtype=np.float64)).max(initial=0.0))
        turns = np.array([kind == "R" for kind in kinds])
        bound = float(np.abs(robot.limits[turns]).max(initial=0.0))
        bound = 0.0 if bound > MOST_DEGREES else bound
        for what, value, most in (("alpha", twist, 2.0 * np.pi), ("limits", bound, 8.0 * np.pi)):
            if value > most + LIMIT_SLACK:
                # imported here: it is rarely needed, and an import of kinverse is to be quick
                import warnings

                warnings.warn(
                    f"{what} of robot {name!r} reach {value:g}, and angles are read as radians:"
                    " np.radians(...)?",
                    stacklevel=2,
                )
        return robot

    def to_dh(self, convention: str = "standard") -> "DHTable":
        """The arm as a table of Denavit-Hartenberg rows, by the geometry of its axes.

        Frames are assigned by the five steps of the thesis of Jha (2015), section 4.2.3. Joint
        values keep their meaning: no sign and no zero is changed. Base and tool transforms take
        what rows cannot hold; axes that are parallel but for less than 1e-3 rad, or whose common
        normal lies more than 30 sizes of the arm away, get a fixed row "F" between them, as no
        single row describes them well (Hayati & Mirmirani 1985). So do angles that miss a quarter
        turn by less than 1e-12, which :meth:`from_dh` would take for it. Forward kinematics of the
        table are the arm's to 1e-12 (rotation; position: times its size).

        Args:
            convention: "standard" or "modified", as in :meth:`from_dh`.

        Raises:
            InputError: an unknown convention, or joints that follow another one (mimic joints).

        Example:
            >>> table = robot.to_dh("modified")
            >>> same = Robot.from_dh(**table.arguments())
        """
        from kinverse.dh_table import dh_table
        from kinverse.geometry import axis_lines

        own = np.arange(len(self.kinds), dtype=np.int32)
        if len(own) != self.dof or (self.source != own).any() or (self.multiplier != 1.0).any():
            raise InputError(
                f"robot {self.name!r} has joints that follow others or count in another measure"
                " (mimic joints): DH rows cannot hold them; lock them, or use its frames"
            )
        frames = self.frames.copy()
        for i, kind in enumerate(self.kinds):
            if self.offset[i] != 0.0:
                frames[i] = frames[i] @ dh.motion(kind, self.offset[i])
        lines = axis_lines(frames, self.kinds)
        return dh_table(lines, self.kinds, convention, self.limits, self.joint_names, self.name)

    # ------------------------------------------------------------------ kinematics
    @property
    def dof(self) -> int:
        """Number n of free joints."""
        return len(self.joint_names)

    @cached_property
    def chain(self) -> Any:
        """The native chain, made once."""
        prismatic = np.array([kind == "P" for kind in self.kinds], dtype=np.uint8)
        return kernels.Chain(
            self.frames, prismatic, self.source, self.multiplier, self.offset, self.limits
        )

    def fk(self, q: ArrayLike) -> Array:
        """Forward kinematics.

        Args:
            q: (..., n) joint values [rad or m].

        Returns:
            (..., 4, 4) poses of the tool in the base frame [m].

        Raises:
            TypeError: complex, object or text data.
            InputError: another last dimension, NaN or inf.

        Example:
            >>> robot.fk(np.zeros(robot.dof)).shape
            (4, 4)
        """
        q = se3.as_joints(q, self.dof)
        T = self.chain.fk(q.reshape(-1, self.dof))
        return np.asarray(T).reshape(*q.shape[:-1], 4, 4)

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian at the tool point, in the base frame.

        Args:
            q: (..., n) joint values [rad or m].

        Returns:
            (..., 6, n): rows are linear x, y, z [m] and angular x, y, z [rad], each per unit of
            the joint.

        Raises:
            TypeError: complex, object or text data.
            InputError: another last dimension, NaN or inf.

        Example:
            >>> robot.jacobian(np.zeros((5, robot.dof))).shape
            (5, 6, 6)
        """
        q = se3.as_joints(q, self.dof)
        J = self.chain.jacobian(q.reshape(-1, self.dof))
        return np.asarray(J).reshape(*q.shape[:-1], 6, self.dof)

    def random(
        self,
        size: int | tuple[int, ...] | None = None,
        rng: "int | np.random.Generator | None" = None,  # quoted: np.random loads when touched
    ) -> Array:
        """Joint values drawn uniformly inside the limits.

        Args:
            size: None for (n,), a number or a shape for (*size, n).
            rng: None (seed 0: the same values at each call), an int seed or a Generator.

        Example:
            >>> robot.random(100, rng=7).shape
            (100, 6)
        """
        shape = () if size is None else (size,) if isinstance(size, int | np.integer) else size
        generator = np.random.default_rng(0 if rng is None else rng)
        low, high = self.limits.T
        return np.asarray(low + generator.random((*shape, self.dof)) * (high - low))

    # ------------------------------------------------------------------ new robots
    def locked(self, values: Mapping[str | int, float]) -> "Robot":
        """A robot with some joints, and the joints that mimic them, held at fixed values.

        Args:
            values: {joint name or index: value [rad or m]}.

        Raises:
            InputError: an unknown or repeated joint, a value outside its limits, or no joint left.

        Example:
            >>> robot.locked({"joint4": 0.0}).dof
            5
        """
        held: dict[int, float] = {}
        for joint, value in values.items():
            index = self._index(joint)
            if index in held:
                raise InputError(f"joint {self.joint_names[index]!r} is locked twice")
            number = se3.as_real(value, f"the value of joint {joint!r}")
            low, high = self.limits[index]
            inside = (low - LIMIT_SLACK <= number) & (number <= high + LIMIT_SLACK)
            if number.shape != () or not inside:
                raise InputError(
                    f"joint {self.joint_names[index]!r} cannot be locked at {value}:"
                    f" its limits are {low:g} to {high:g}"
                )
            held[index] = float(number)
        left = [j for j in range(self.dof) if j not in held]
        if not left:
            raise InputError(f"robot {self.name!r} has no joint left if all {self.dof} are locked")
        frames, moving, before = [], [], np.eye(4)
        for i, kind in enumerate(self.kinds):
            before = before @ self.frames[i]
            j = int(self.source[i])
            if j in held:
                value = self.multiplier[i] * held[j] + self.offset[i]
                before = before @ dh.motion(kind, value)
            else:
                frames.append(before)
                moving.append(i)
                before = np.eye(4)
        return self._replace(
            frames=np.stack([*frames, before @ self.frames[-1]]),
            kinds="".join(self.kinds[i] for i in moving),
            limits=self.limits[left],
            joint_names=[self.joint_names[j] for j in left],
            source=[left.index(int(self.source[i])) for i in moving],
            multiplier=self.multiplier[moving],
            offset=self.offset[moving],
        )

    def with_limits(self, limits: Any) -> "Robot":
        """The same robot with other limits.

        Args:
            limits: (n, 2) for all joints, or {joint name or index: (low, high)} for some
                [rad or m].

        Raises:
            InputError: an unknown joint, a wrong shape, limits upside down or not finite.

        Example:
            >>> robot.with_limits({"joint1": (-1.0, 1.0)}).limits[0]
            array([-1.,  1.])
        """
        if isinstance(limits, Mapping):
            rows: list[Any] = list(self.limits)
            for joint, pair in limits.items():
                rows[self._index(joint)] = pair
            limits = rows
        return self._replace(limits=limits)

    def with_tool(self, T: Any) -> "Robot":
        """The same robot with T (4, 4) added behind its tool point: ``fk_new = fk @ T``."""
        frames = self.frames.copy()
        frames[-1] = frames[-1] @ se3.as_pose(T, "tool")
        return self._replace(frames=frames)

    def with_base(self, T: Any) -> "Robot":
        """The same robot standing at T (4, 4) in a new base frame: ``fk_new = T @ fk``."""
        frames = self.frames.copy()
        frames[0] = se3.as_pose(T, "base") @ frames[0]
        return self._replace(frames=frames)

    def _index(self, joint: str | int) -> int:
        if isinstance(joint, str):
            if joint in self.joint_names:
                return self.joint_names.index(joint)
        elif isinstance(joint, int | np.integer) and 0 <= joint < self.dof:
            return int(joint)
        names = ", ".join(self.joint_names)
        raise InputError(
            f"robot {self.name!r} has no free joint {joint!r}; it has {names}"
            f" (or 0 to {self.dof - 1})"
        )

    def _replace(self, **changes: Any) -> "Robot":
        state = {field.name: getattr(self, field.name) for field in fields(self)}
        return type(self)(**{**state, **changes})

    # ------------------------------------------------------------------ a value among values
    def __reduce__(self) -> tuple[Any, ...]:
        # the native chain is left out and made again on the other side
        return type(self), tuple(getattr(self, field.name) for field in fields(self))

    def _key(self) -> tuple[Any, ...]:
        arrays = (self.frames, self.limits, self.source, self.multiplier, self.offset)
        return self.name, self.kinds, self.joint_names, *(array.tobytes() for array in arrays)

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Robot) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        mimics = len(self.kinds) - self.dof
        extra = f" + {mimics} mimic" if mimics else ""
        return f"Robot({self.name!r}, {self.kinds}{extra}, dof={self.dof})"


# ---------------------------------------------------------------------------- checks
def _rigid(frames: Array) -> Array:
    # left alone where already exact: an SVD would turn zeros into 1e-17
    R = frames[:, :3, :3]
    off = R.transpose(0, 2, 1) @ R - np.eye(3)
    error = np.abs(off).max(axis=(1, 2))
    if (error > 1e-14).any():
        frames = frames.copy()
        loose, nearly = error > 1e-12, (error > 1e-14) & (error <= 1e-12)
        frames[loose, :3, :3] = se3.nearest_rotation(R[loose])
        # one step towards it keeps zeros; without it a long chain is rigid to 1e-11 only
        frames[nearly, :3, :3] -= R[nearly] @ off[nearly] / 2
    return frames


def _row(values: ArrayLike | None, length: int, default: float, name: str) -> Array:
    if values is None:
        return np.full(length, default)
    array = se3.as_real(values, name)
    if array.shape != (length,) or not np.isfinite(array).all():
        raise InputError(f"{name} must be {length} finite numbers, got {array.tolist()}")
    return array


def _drive(source: ArrayLike | None, m: int) -> NDArray[np.int32]:
    if source is None:
        return np.arange(m, dtype=np.int32)
    drive = _row(source, m, 0.0, "source")
    free = np.unique(drive)
    if (free != np.arange(len(free))).any():
        raise InputError(
            f"source must name the free joints 0, 1, ... without gaps, got {drive.tolist()}"
        )
    return drive.astype(np.int32)


def _names(names: Iterable[str] | None, n: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"joint{j + 1}" for j in range(n))
    found = tuple(map(str, names))
    if len(found) != n:
        raise InputError(f"{n} free joints need {n} names, got {len(found)}: {', '.join(found)}")
    if len(set(found)) != n:
        raise InputError(f"joint names must differ, got {', '.join(found)}")
    return found


def _limits(limits: Any, kinds: Sequence[str], names: Sequence[str]) -> Array:
    rows = [None] * len(kinds) if limits is None else list(limits)
    if len(rows) != len(kinds):
        raise InputError(f"limits must have shape ({len(kinds)}, 2), got {len(rows)} rows")
    out = np.empty((len(kinds), 2))
    for j, (row, kind, name) in enumerate(zip(rows, kinds, names, strict=True)):
        if row is None:
            if kind == "P":
                raise InputError(f"prismatic joint {name!r} needs limits [m]")
            row = (-np.pi, np.pi)
        pair = se3.as_real(row, f"limits of joint {name!r}")
        if pair.shape != (2,) or not np.isfinite(pair).all():
            raise InputError(f"limits of joint {name!r} must be two finite numbers, got {row}")
        if np.abs(pair).max() > MOST_LIMIT:
            raise InputError(
                f"limits of joint {name!r} must lie within +-{MOST_LIMIT:g},"
                f" got {pair[0]:g} to {pair[1]:g}"
            )
        if pair[0] > pair[1]:
            raise InputError(f"limits of joint {name!r} are upside down: {pair[0]:g} > {pair[1]:g}")
        out[j] = pair
    return out

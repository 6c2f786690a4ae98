"""Collision of meshes and other bodies, by MuJoCo. Needs the extra "sim"."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError, ModelError
from kinverse.loading.text import choices
from kinverse.paths.checks import as_length
from kinverse.paths.joint_axes import differing, joint_axes
from kinverse.paths.mesh_model import mesh_model
from kinverse.paths.mujoco_model import mujoco_or_extra, without_log

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["MeshCollision"]

Array = NDArray[np.float64]

LOOKED = 4
"""Postures in which the axes of the model are compared with those of the robot."""


class MeshCollision:
    """A predicate for ``track`` and ``Solutions.filter``: which joint values keep a model clear.

    The model holds the arm's links and what stands about it, as meshes (MuJoCo takes their convex
    hulls: give concave ones in convex parts), boxes, cylinders, capsules, planes. Links that a
    joint connects are not tested against each other, nor are pairs that the model excludes, nor
    bodies that the arm does not move. Obstacles stand where the model puts them, whatever
    ``robot.base``.

    Args:
        robot: the arm; no mimic joints.
        model: a .urdf or MJCF .xml file, or its text.
        margin: distance [m] to keep beyond touching.
        exclude: pairs of bodies (links) that may touch.
        adjacent: test links that a joint connects too.
        joints: names in the model of the robot's joints; None: the robot's own.
        others: joint values [rad or m] of the model's joints that the arm has not, by name; left
            out, they stay as the model has them.
        folder: the model reads files in it and below only, see the error; None: the model's own.

    Raises:
        ModelError: a model that cannot be used, a joint that it has not or that moves otherwise
            than the robot's, a mesh that is missing or outside the folder.
        InputError: unknown bodies or joints, a negative margin, values that are not finite.
        MissingExtra: MuJoCo is not installed.

    Example:
        >>> clear = MeshCollision(kv.load("cell.xml"), "cell.xml", margin=0.01)
        >>> track(clear.robot, T, keep=clear)
    """

    ignores_turns = True
    """Whole turns of a joint change nothing: ``track`` asks about one winding of a solution."""

    def __init__(
        self,
        robot: "Robot",
        model: str | os.PathLike[str],
        margin: float = 0.0,
        *,
        exclude: Iterable[tuple[str, str]] = (),
        adjacent: bool = False,
        joints: Sequence[str] | None = None,
        others: Mapping[str, float] | None = None,
        folder: str | os.PathLike[str] | None = None,
    ) -> None:
        if len(robot.kinds) != robot.dof:
            raise InputError(f"robot {robot.name!r} has mimic joints: it cannot be tested yet")
        self.robot = robot
        self.margin = as_length(margin, "margin")
        spec = mesh_model(model, folder)
        names = robot.joint_names if joints is None else tuple(joints)
        if len(names) != robot.dof or len(set(names)) != robot.dof:
            raise InputError(f"joints must name {robot.dof} joints, none twice, got {list(names)}")
        self._model = _compiled(spec, self.margin, exclude, adjacent, names)
        self._address = self._addresses(names)
        self._rest = self._at_rest(others or {}, names)
        self._moves = _moving(self._model, names)
        self._check_axes(names)

    def __call__(self, q: ArrayLike) -> NDArray[np.bool_]:
        """(M,) whether joint values q (M, n) keep at least the margin everywhere.

        Raises:
            InputError: another shape, NaN or inf.
        """
        values = np.atleast_2d(se3.as_joints(q, self.robot.dof))
        clear = np.empty(len(values), np.bool_)
        with without_log():
            data = mujoco_or_extra().MjData(self._model)
            for k, row in enumerate(values):
                clear[k] = not self._near(data, row).any()
        return clear

    def contacts(self, q: ArrayLike) -> tuple[tuple[str, str, float], ...]:
        """Which bodies are nearer than the margin at joint values q (n,), and their distance [m].

        Nearest first; below zero they overlap. The names are those that ``exclude`` takes.

        Raises:
            InputError: another shape, NaN or inf.

        Example:
            >>> MeshCollision(robot, "cell.xml").contacts(q)
        """
        row = se3.as_joints(q, self.robot.dof)
        if row.ndim != 1:
            raise InputError(f"q must have shape ({self.robot.dof},), got {row.shape}")
        near: dict[tuple[str, str], float] = {}
        model = self._model
        with without_log():
            data = mujoco_or_extra().MjData(model)
            for k in np.flatnonzero(self._near(data, row)):
                first, second = model.geom_bodyid[data.contact.geom[k]].tolist()
                pair = model.body(first).name, model.body(second).name
                near[pair] = min(near.get(pair, np.inf), float(data.contact.dist[k]))
        return tuple((*pair, near[pair]) for pair in sorted(near, key=lambda pair: near[pair]))

    def _near(self, data: Any, row: Array) -> NDArray[np.bool_]:
        """Of each contact that MuJoCo found, whether it counts: near enough, and of the arm."""
        self._place(data, row)
        mujoco_or_extra().mj_collision(self._model, data)
        if not data.ncon:
            return np.zeros(0, np.bool_)
        contact = data.contact
        return np.asarray((contact.dist < self.margin) & self._moves[contact.geom].any(axis=1))

    def _place(self, data: Any, row: Array) -> None:
        mujoco = mujoco_or_extra()
        data.qpos[:] = self._rest
        data.qpos[self._address] = row
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)

    def _addresses(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Where the arm's joints stand in the model's; the model's joints turn or slide alike."""
        mujoco, model = mujoco_or_extra(), self._model
        wanted = {"R": mujoco.mjtJoint.mjJNT_HINGE, "P": mujoco.mjtJoint.mjJNT_SLIDE}
        found = []
        for name, kind in zip(names, self.robot.kinds, strict=True):
            joint = model.joint(name)
            if joint.type[0] != wanted[kind]:
                does = "turns" if kind == "R" else "slides"
                raise ModelError(f"joint {name!r} of the robot {does}, that of the model does not")
            found.append(int(joint.qposadr[0]))
        return np.array(found)

    def _at_rest(self, others: Mapping[str, float], names: Sequence[str]) -> Array:
        model = self._model
        rest = np.array(model.qpos0)
        single = {model.joint(j).name: j for j in range(model.njnt) if model.jnt_type[j] >= 2}
        known = [name for name in single if name and name not in names]
        for name, value in others.items():
            if name not in known:
                raise InputError(f"others: {name!r}: {choices(name, known, 'there are')}")
            if not np.isfinite(value):
                raise InputError(f"others: {name!r} must be finite, got {value!r}")
            rest[model.jnt_qposadr[single[name]]] = value
        return rest

    def _check_axes(self, names: Sequence[str]) -> None:
        """The model's axes lie to each other as the robot's do, or it is another arm."""
        model, mujoco = self._model, mujoco_or_extra()
        data = mujoco.MjData(model)
        ids = [model.joint(name).id for name in names]
        for row in self.robot.random(LOOKED, 0):
            self._place(data, row)
            pair = differing(
                self.robot.kinds,
                joint_axes(self.robot, row),
                (data.xaxis[ids], data.xanchor[ids]),
            )
            if pair is not None:
                first, second = (names[j] for j in pair)
                raise ModelError(
                    f"joints {first!r} and {second!r} do not lie to each other in the model as"
                    f" those of robot {self.robot.name!r} do: another arm, unit, sign or zero"
                )


def _moving(model: Any, names: Sequence[str]) -> NDArray[np.bool_]:
    """(geoms,) whether the arm's joints move it."""
    bodies = {int(model.joint(name).bodyid[0]) for name in names}
    moves = np.zeros(model.nbody, np.bool_)
    for body, parent in enumerate(model.body_parentid.tolist()):
        # parents come first; the world is its own
        moves[body] = body in bodies or moves[parent]
    return np.asarray(moves[model.geom_bodyid])


def _compiled(
    spec: Any,
    margin: float,
    exclude: Iterable[tuple[str, str]],
    adjacent: bool,
    names: Sequence[str],
) -> Any:
    mujoco = mujoco_or_extra()
    for k, body in enumerate(spec.bodies):
        body.name = body.name or f"body {k}"
    bodies = {body.name: body for body in spec.bodies}
    for pair in exclude:
        if isinstance(pair, str) or len(pair) != 2:
            raise InputError(f"exclude takes pairs of bodies, got {pair!r}")
        for name in pair:
            if name not in bodies:
                raise InputError(f"exclude: no body {name!r}; {choices(name, bodies)}")
        spec.add_exclude(bodyname1=pair[0], bodyname2=pair[1])
    joints = {joint.name: joint for joint in spec.joints}
    for name in names:
        if name not in joints:
            raise ModelError(
                f"the model has no joint {name!r}; {choices(name, joints, 'it has')};"
                " joints= names them in the robot's order"
            )
    contact = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    parents = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    flags = spec.option.disableflags & ~(contact | parents)
    spec.option.disableflags = flags | parents if adjacent else flags
    if not adjacent:
        # MuJoCo tests a first link against what does not move, be it the base that carries it
        first = joints[names[0]].parent
        base = first.parent
        while base.name != "world" and not base.joints:
            spec.add_exclude(bodyname1=base.name, bodyname2=first.name)
            base = base.parent
    for part in [*spec.geoms, *spec.pairs]:
        part.margin, part.gap = margin, 0.0
    try:
        return spec.compile()
    except ValueError as error:
        raise ModelError(f"the model: {error}") from error

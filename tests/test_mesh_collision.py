"""Meshes by MuJoCo: like capsules where the model is made of them, closer where it is not."""

import pickle
import sys

import numpy as np
import pytest

import kinverse as kv
from kinverse.errors import InputError, ModelError
from kinverse.paths import Reason, track
from kinverse.paths.collision import Capsules
from kinverse.paths.mesh_collision import MeshCollision

SPHERES = [[0.5, 0.3, 0.6, 0.2], [-0.4, 0.0, 0.2, 0.1]]
FLAT = kv.Robot.from_dh(a=[0.4, 0.4, 0.2], d=0, alpha=0, joints="RRR", name="flat")


def placed(T):
    quat = kv.se3.quat_from_rotation(T[:3, :3])
    return f'pos="{" ".join(map(str, T[:3, 3]))}" quat="{" ".join(map(str, quat))}"'


def mjcf(robot, geom, extra=""):
    """The robot as nested bodies; ``geom(i, end)`` is what reaches from joint i to its next one."""
    text, closing = f'<body name="base">{geom(0, robot.frames[0][:3, 3])}', "</body>"
    for i, kind in enumerate(robot.kinds):
        what = "hinge" if kind == "R" else "slide"
        text += (
            f'<body name="link{i + 1}" {placed(robot.frames[i])}>'
            f'<joint name="{robot.joint_names[i]}" type="{what}" axis="0 0 1"/>'
            f"{geom(i + 1, robot.frames[i + 1][:3, 3])}"
        )
        closing += "</body>"
    return f"<mujoco><worldbody>{extra}{text}{closing}</worldbody></mujoco>"


def capsules(radius):
    def geom(i, end):
        if np.linalg.norm(end) < 1e-9:
            return ""
        x, y, z = end
        return f'<geom type="capsule" size="{radius}" fromto="0 0 0 {x} {y} {z}"/>'

    return geom


def balls(spheres):
    return "".join(f'<geom size="{r}" pos="{x} {y} {z}"/>' for x, y, z, r in spheres)


def box_obj(path, x, y, z):
    """A box from x[0] to x[1] and so on, as an OBJ file."""
    corners = [(a, b, c) for a in x for b in y for c in z]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = [f"v {a} {b} {c}" for a, b, c in corners] + [f"f {face}" for face in faces]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def cell(tmp_path):
    """The flat arm with boxes of 40 mm as links, meshes in a folder of their own."""
    (tmp_path / "meshes").mkdir()
    for i, length in enumerate((0.4, 0.4, 0.2), start=1):
        box_obj(tmp_path / f"meshes/l{i}.obj", (0, length), (-0.02, 0.02), (-0.02, 0.02))

    def write(extra="", folder="meshes"):
        text = mjcf(FLAT, lambda i, end: f'<geom type="mesh" mesh="l{i}"/>' if i else "", extra)
        assets = "".join(f'<mesh file="l{i}.obj"/>' for i in (1, 2, 3))
        head = f'<mujoco><compiler meshdir="{folder}"/><asset>{assets}</asset>'
        path = tmp_path / "cell.xml"
        path.write_text(text.replace("<mujoco>", head))
        return path

    return write


FLOOR = '<geom type="plane" size="1 1 1" pos="0 0 -0.2"/>'


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_a_model_of_capsules_is_judged_as_capsules_are(margin):
    robot = kv.Robot.from_dh(
        a=[0.1, 0.4, 0.3, 0.2],
        d=[0.4, 0.1, 0.1, 0.2],
        alpha=[np.pi / 2, 0, np.pi / 2, 0],
        joints="RRRR",
        limits=[(-3, 3), (-1.5, 1.5), (-3, 3), (-3, 3)],
    )
    mesh = MeshCollision(robot, mjcf(robot, capsules(0.05), balls(SPHERES) + FLOOR), margin)
    around = Capsules(robot, 0.05, SPHERES, -0.2, margin=margin)
    q = robot.random(1500, 1)
    away = around.clearance(q) - margin
    sure = np.abs(away) > 1e-6
    assert sure.sum() > 1490 and 100 < mesh(q).sum() < 1400
    assert np.array_equal(mesh(q)[sure], away[sure] >= 0.0)


def test_slides_carry_their_links():
    robot = kv.Robot.from_dh(a=[0.3, 0.2], d=0, alpha=0, joints="PR", limits=[(-1, 1), (-3, 3)])
    mesh = MeshCollision(robot, mjcf(robot, capsules(0.05), FLOOR))
    q = robot.random(100, 1)
    assert np.array_equal(mesh(q), q[:, 0] > -0.15) and 0 < mesh(q).sum() < 100


def test_a_flat_link_passes_where_a_capsule_about_it_does_not(cell):
    # beside the first link: 4 mm from the box's side
    sphere = [0.2, 0.124, 0.0, 0.1]
    model = cell(balls([sphere]))
    mesh = MeshCollision(FLAT, model)
    around = Capsules(FLAT, 0.02 * np.sqrt(2), [sphere], self_collision=False)
    away = np.array([[0.0, -1.0, 0.0]])
    assert mesh(away).all() and not around(away).any()
    assert not MeshCollision(FLAT, model, margin=0.005)(away).any()
    assert MeshCollision(FLAT, model, margin=0.003)(away).all()
    turned = np.array([[0.1, -1.0, 0.0]])
    assert not mesh(turned).any()
    (first, second, distance), *_ = mesh.contacts(turned[0])
    assert {first, second} == {"world", "link1"}
    # the nearest point of the side is not beyond its ends
    assert distance == pytest.approx(0.124 * np.cos(0.1) - 0.2 * np.sin(0.1) - 0.12, abs=1e-6)


def test_meshes_of_boxes_are_judged_as_boxes_are(cell):
    def boxes(i, end):
        size = f"{end[0] / 2} 0.02 0.02"
        return f'<geom type="box" size="{size}" pos="{end[0] / 2} 0 0"/>' if i else ""

    spheres = balls([[0.5, 0.3, 0.0, 0.1], [-0.3, -0.3, 0.03, 0.2]])
    mesh = MeshCollision(FLAT, cell(spheres))
    plain = MeshCollision(FLAT, mjcf(FLAT, boxes, spheres))
    q = FLAT.random(2000, 4)
    assert np.array_equal(mesh(q), plain(q)) and 200 < mesh(q).sum() < 1800


def test_a_folded_arm_meets_itself_and_what_may_touch_is_left_out(cell):
    model = cell()
    q = np.array([[0.0, 0.3, 0.3], [0.0, 2.8, 1.9]])  # the last link lies across the first
    assert MeshCollision(FLAT, model)(q).tolist() == [True, False]
    assert MeshCollision(FLAT, model, exclude=[("link1", "link3")])(q).all()
    # links that a joint connects always overlap here
    assert not MeshCollision(FLAT, model, adjacent=True)(q).any()
    assert MeshCollision(FLAT, model)(np.empty((0, 3))).shape == (0,)


def test_the_base_may_touch_the_first_link_only():
    def geom(i, end):
        return '<geom size="0.06"/>' if i == 0 else capsules(0.02)(i, end)

    model = mjcf(FLAT, geom)
    straight, folded = [0.0, 0.0, 0.0], [0.0, np.pi, 0.0]
    assert MeshCollision(FLAT, model)([straight, folded]).tolist() == [True, False]
    touching = MeshCollision(FLAT, model, adjacent=True).contacts(straight)
    assert ("base", "link1") in [pair[:2] for pair in touching]


def test_what_the_arm_does_not_move_is_not_tested():
    # two blocks that overlap, one of them loose, and a finger that the arm's joints do not know
    blocks = (
        '<body pos="9 0 0"><freejoint/><geom size="1"/></body>'
        '<body pos="9 0 0"><geom size="1"/></body>'
    )
    finger = (
        '<body pos="0.2 0 0"><joint name="finger"/>'
        '<geom type="capsule" size="0.01" fromto="0 0 0 0.3 0 0"/></body>'
    )
    ends = 4 * "</body>"
    model = mjcf(FLAT, capsules(0.02), blocks).replace(ends, finger + ends)
    straight = [[0.0, 0.0, 0.0]]
    assert MeshCollision(FLAT, model)(straight).all()
    # folded back over the second link
    assert not MeshCollision(FLAT, model, others={"finger": np.pi})(straight).all()
    with pytest.raises(InputError, match="others: 'thumb'.*finger"):
        MeshCollision(FLAT, model, others={"thumb": 0.0})
    with pytest.raises(InputError, match="others: 'joint1'"):
        MeshCollision(FLAT, model, others={"joint1": 0.0})
    with pytest.raises(InputError, match="finite"):
        MeshCollision(FLAT, model, others={"finger": np.nan})


def test_one_by_one_and_together_it_says_the_same(cell):
    mesh = MeshCollision(FLAT, cell(balls([[0.5, 0.3, 0.0, 0.1]])))
    q = FLAT.random(60, 3)
    mask = mesh(q)
    assert mask.dtype == np.bool_ and 0 < mask.sum() < 60
    assert (
        mask.tolist() == [bool(mesh(row)[0]) for row in q] == [not mesh.contacts(row) for row in q]
    )
    assert np.array_equal(mesh(q + 2 * np.pi * np.array([1, -1, 2])), mask)
    assert np.array_equal(pickle.loads(pickle.dumps(mesh))(q), mask)


# ---------------------------------------------------------------------------- with track
def poses(count=30):
    """Across in front of the arm, with both elbows possible all along."""
    y = np.linspace(-0.25, 0.25, count)
    return kv.pose(np.column_stack([np.full(count, 0.75), y, 0 * y]))


def test_track_goes_round_an_obstacle(cell):
    T = poses()
    solver = kv.Analytic(task="planar")
    free = track(FLAT, T, solver=solver)
    elbow = free.q[15]
    # a ball where the elbow of the cheapest way passes
    at = 0.4 * np.array([np.cos(elbow[0]), np.sin(elbow[0])])
    mesh = MeshCollision(FLAT, cell(balls([[*at, 0.0, 0.05]])))
    assert not mesh(free.q).all()
    found = track(FLAT, T, solver=solver, keep=mesh)
    assert found.is_whole and mesh(found.q).all()
    assert np.sign(found.q[15, 1]) == -np.sign(elbow[1])
    assert np.allclose(FLAT.fk(found.q), T, atol=1e-6)


def test_track_says_where_a_collision_cannot_be_avoided(cell):
    mesh = MeshCollision(FLAT, cell(balls([[0.75, 0.0, 0.0, 0.05]])))
    found = track(FLAT, poses(), solver=kv.Analytic(task="planar"), keep=mesh)
    (gap,) = found.gaps
    assert gap.code == Reason.COLLISION and found.intervals == ((0, gap.start), (gap.end, 30))
    # the tool's link is 40 mm wide: at least so long as the tool is in the ball
    blocked = np.abs(poses()[:, 1, 3]) < 0.05
    assert not found.ok[blocked].any() and found.ok[:5].all()


# ---------------------------------------------------------------------------- models
URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="l1">
    <visual><geometry><mesh filename="package://arm/picture.dae"/></geometry></visual>
    <collision><geometry><mesh filename="{mesh}" scale="0.001 0.001 0.001"/></geometry></collision>
  </link>
  <link name="l2"><collision>
    <origin xyz="0.2 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry>
  </collision></link>
  <link name="wall"><collision>
    <origin xyz="1.0 0 0"/><geometry><box size="0.1 2 2"/></geometry>
  </collision></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.6 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="fixed" type="fixed"><parent link="base"/><child link="wall"/></joint>
</robot>"""


@pytest.mark.parametrize("mesh", ["package://arm/m/l1.obj", "../m/l1.obj", "file:///{}/m/l1.obj"])
def test_a_urdf_with_meshes_in_millimetres(tmp_path, mesh):
    package = tmp_path / "arm"
    for name in ("urdf", "m"):
        (package / name).mkdir(parents=True)
    box_obj(package / "m/l1.obj", (0, 600), (-20, 20), (-20, 20))
    path = package / "urdf/arm.urdf"
    path.write_text(URDF.format(mesh=mesh.format(package)))
    robot = kv.load(path, base="base", tip="l2")
    q = [[0.0, 0.0], [0.0, 1.0], [np.pi / 2, 0.0]]
    for folder in (package, tmp_path):
        clear = MeshCollision(robot, path, folder=folder)
        assert clear(q).tolist() == [False, True, True]
    assert clear.contacts(q[0])[0][:2] in (("wall", "l2"), ("l2", "wall"))
    with pytest.raises(ModelError, match="(outside|no mesh file).*folder="):
        MeshCollision(robot, path)
    (package / "m/l1.obj").unlink()
    with pytest.raises(ModelError, match="no mesh file.*l1.obj"):
        MeshCollision(robot, path, folder=package)


def test_joints_are_matched_by_name(cell):
    model = cell()
    one = MeshCollision(FLAT, model, joints=FLAT.joint_names)
    assert one([[0.0, 0.3, 0.3]]).all()
    renamed = model.read_text().replace('name="joint2"', 'name="elbow"')
    model.write_text(renamed)
    with pytest.raises(ModelError, match=r"no joint 'joint2'.*elbow.*joints= names them"):
        MeshCollision(FLAT, model)
    named = MeshCollision(FLAT, model, joints=["joint1", "elbow", "joint3"])
    q = FLAT.random(50, 2)
    assert np.array_equal(named(q), one(q))
    with pytest.raises(InputError, match="name 3 joints"):
        MeshCollision(FLAT, model, joints=["joint1", "elbow"])
    with pytest.raises(InputError, match="twice"):
        MeshCollision(FLAT, model, joints=["joint1", "joint1", "joint3"])


@pytest.mark.parametrize(
    "other",
    [
        kv.Robot.from_dh(a=[0.4, 0.5, 0.2], d=0, alpha=0, joints="RRR"),  # longer
        kv.Robot.from_dh(a=[400, 400, 200], d=0, alpha=0, joints="RRR"),  # millimetres
        kv.Robot.from_dh(a=[0.4, 0.4, 0.2], d=0, alpha=0, theta=[0, 0.1, 0], joints="RRR"),
        kv.Robot.from_dh(a=[0.4, 0.4, 0.2], d=0, alpha=[0, np.pi, 0], joints="RRR"),  # turned over
    ],
)
def test_another_arm_is_refused(cell, other):
    with pytest.raises(ModelError, match="do not lie to each other"):
        MeshCollision(other, cell())


def test_the_same_arm_may_stand_elsewhere(cell):
    moved = FLAT.with_base(kv.pose([1, 2, 3], rpy=[1, 2, 3])).with_tool(kv.pose([0, 0, 1]))
    assert MeshCollision(moved, cell())([[0.0, 0.3, 0.3]]).all()
    kr16 = kv.load("kr16")
    assert MeshCollision(kr16, mjcf(kr16, capsules(0.02)))(np.zeros(6)).shape == (1,)


def test_models_that_cannot_be_used(cell, tmp_path):
    with pytest.raises(ModelError, match="no such robot file"):
        MeshCollision(FLAT, tmp_path / "missing.xml")
    with pytest.raises(ModelError, match="DOCTYPE"):
        MeshCollision(FLAT, "<!DOCTYPE a><mujoco/>")
    with pytest.raises(ModelError, match="neither URDF"):
        MeshCollision(FLAT, "<arm/>")
    with pytest.raises(ModelError, match="outside"):
        MeshCollision(FLAT, cell(folder="../meshes"))
    (tmp_path / "meshes/l2.obj").unlink()
    with pytest.raises(ModelError, match="l2.obj"):
        MeshCollision(FLAT, cell())
    with pytest.raises(ModelError, match="Schema|unrecognized"):
        MeshCollision(FLAT, "<mujoco><nonsense/></mujoco>")
    slide = mjcf(FLAT, capsules(0.02)).replace('hinge" axis', 'slide" axis', 1)
    with pytest.raises(ModelError, match="'joint1' of the robot turns"):
        MeshCollision(FLAT, slide)
    with pytest.raises(InputError, match="mimic"):
        MeshCollision(kv.load("ir361"), cell())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"margin": -1.0}, "margin"),
        ({"margin": np.nan}, "margin"),
        ({"exclude": [("link1", "link9")]}, "no body 'link9'.*link1"),
        ({"exclude": [("link1",)]}, "pairs"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        MeshCollision(FLAT, mjcf(FLAT, capsules(0.02)), **change)


def test_a_missing_extra_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(
        kv.MissingExtra, match=r'collision of meshes.*pip install "kinverse\[sim\]"'
    ):
        MeshCollision(FLAT, "<mujoco/>")


def test_joint_values_are_checked(cell):
    mesh = MeshCollision(FLAT, cell())
    with pytest.raises(InputError):
        mesh([[0.0] * 4])
    with pytest.raises(InputError, match="nan|finite|NaN"):
        mesh([[0.0, np.nan, 0.0]])
    with pytest.raises(InputError, match="shape"):
        mesh.contacts(np.zeros((2, 3)))

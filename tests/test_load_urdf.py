import math

import mujoco
import numpy as np
import pytest

import oracle
from kinverse.errors import ModelError
from kinverse.load import load
from models import compas_urdf

ARMS = {
    "panda": ("panda_link0", "panda_link8"),
    "ur5_robot": ("base_link", "tool0"),
    "ur10e_robot": ("base_link", "tool0"),
    "abb_irb120_3_58": ("base_link", "tool0"),
    "abb_irb4600_40_255": ("base_link", "tool0"),
}


def urdf(tmp_path, joints, links="abcdefgh", root='<robot name="r">'):
    """A file with one link for each letter."""
    body = "".join(f'<link name="{name}"/>' for name in links)
    path = tmp_path / "r.urdf"
    path.write_text(f"{root}{body}{joints}</robot>")
    return path


def joint(ends, type="revolute", inside='<limit lower="-1" upper="1"/>', name=None):
    return (
        f'<joint name="{name or "j" + ends}" type="{type}"><parent link="{ends[0]}"/>'
        f'<child link="{ends[1]}"/>{inside}</joint>'
    )


# ---------------------------------------------------------------------------- right answers
@pytest.mark.parametrize("name", ARMS)
def test_published_arms_against_mujoco(name):
    """mujoco reads the same URDF with a reader of its own."""
    base, tip = ARMS[name]
    path = compas_urdf(name)
    robot = load(path, base=base, tip=tip)
    text = path.read_text()
    assert "<mujoco>" not in text
    # without meshes to look for, and with the fixed links kept
    keep = '<mujoco><compiler fusestatic="false" discardvisual="true" strippath="true"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(without_shapes(text, keep))
    data = mujoco.MjData(model)
    for q in robot.random(10, rng=0):
        for joint_name, value in zip(robot.joint_names, q, strict=True):
            data.qpos[model.joint(joint_name).qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        T = np.linalg.inv(body_pose(model, data, base)) @ body_pose(model, data, tip)
        np.testing.assert_allclose(robot.fk(q), T, atol=1e-9)
    for joint_name, limits in zip(robot.joint_names, robot.limits, strict=True):
        np.testing.assert_allclose(model.joint(joint_name).range, limits, atol=1e-12)


def without_shapes(text, extra):
    """The same tree with a unit mass for every link and nothing to draw."""
    from xml.etree import ElementTree

    root = ElementTree.fromstring(text)
    for link in root.findall("link"):
        for part in list(link):
            link.remove(part)
        link.append(
            ElementTree.fromstring(
                '<inertial><mass value="1"/><origin xyz="0 0 0"/>'
                '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
            )
        )
    root.append(ElementTree.fromstring(extra))
    return ElementTree.tostring(root, encoding="unicode")


def body_pose(model, data, name):
    # mujoco melts the root link of a URDF into its world
    known = [model.body(i).name for i in range(model.nbody)]
    body = data.body(name if name in known else 0)
    return oracle.homogeneous(body.xmat.reshape(3, 3), body.xpos)


def test_any_axis(tmp_path):
    rng = np.random.default_rng(0)
    axes = [*np.eye(3), *-np.eye(3), *rng.normal(size=(4, 3)), [1e-9, 0, 1], [0, -7, 0]]
    for number, axis in enumerate(axes):
        xyz, rpy = rng.normal(size=(2, 3))
        text = " ".join(map(repr, map(float, axis)))
        inside = (
            f'<origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/>'
            f'<axis xyz="{text}"/><limit lower="-1" upper="1"/>'
        )
        last = joint("bc", "fixed", '<origin xyz="0.1 0.2 0.3"/>')
        for kind in ("revolute", "prismatic"):
            robot = load(urdf(tmp_path, joint("ab", kind, inside) + last, "abc"))
            q = 0.3 + 0.05 * number
            unit = np.asarray(axis) / np.linalg.norm(axis)
            moved = (
                oracle.homogeneous(oracle.about(unit, q))
                if kind == "revolute"
                else oracle.homogeneous(p=q * unit)
            )
            T = oracle.homogeneous(oracle.rpy(*rpy), xyz) @ moved
            T = T @ oracle.homogeneous(p=(0.1, 0.2, 0.3))
            np.testing.assert_allclose(robot.fk([q]), T, atol=1e-13)


def test_axes_along_coordinates_keep_exact_zeros(tmp_path):
    for axis in ("1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1"):
        inside = f'<axis xyz="{axis}"/><limit lower="-1" upper="1"/>'
        robot = load(urdf(tmp_path, joint("ab", inside=inside), "ab"))
        assert set(np.unique(robot.frames)) <= {-1.0, 0.0, 1.0}


def test_types_limits_and_what_is_ignored(tmp_path):
    text = (
        joint("ab", "continuous", "")
        + joint("bc", "prismatic", '<limit lower="0.1" upper="0.5"/>')
        + joint("cd", "revolute", '<limit upper="2"/>')
        + '<transmission name="t"><joint name="jab"/></transmission><gazebo reference="a"/>'
        + '<material name="m"/><!-- a note -->'
    )
    robot = load(urdf(tmp_path, text, "abcd"))
    assert robot.kinds == "RPR" and robot.joint_names == ("jab", "jbc", "jcd")
    assert robot.limits.tolist() == [[-math.pi, math.pi], [0.1, 0.5], [0.0, 2.0]]
    assert robot.name == "r" and "a to d" in robot.source_note


def test_base_and_tip_choose_a_chain(tmp_path):
    text = "".join(map(joint, ("ab", "bc", "bd", "de")))
    path = urdf(tmp_path, text, "abcde")
    assert load(path, tip="c").joint_names == ("jab", "jbc")
    assert load(path, base="b", tip="e").joint_names == ("jbd", "jde")
    assert load(path, base="d").joint_names == ("jde",)


# ---------------------------------------------------------------------------- mimic
def mimic(target, multiplier=1, offset=0, limits=(-10, 10)):
    return (
        f'<mimic joint="{target}" multiplier="{multiplier}" offset="{offset}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}"/>'
    )


def test_mimic_joints_follow(tmp_path):
    text = (
        joint("ab", inside=mimic("jbc", 2, 0.1))
        + joint("bc")
        + joint("cd", inside=mimic("jab", -0.5, 0.3))
    )
    robot = load(urdf(tmp_path, text, "abcd"))
    assert robot.dof == 1 and robot.joint_names == ("jbc",) and len(robot.kinds) == 3
    q = 0.4
    values = np.array([2 * q + 0.1, q, -0.5 * (2 * q + 0.1) + 0.3])
    T = np.eye(4)
    for value in values:
        T = T @ oracle.homogeneous(oracle.rot_x(value))
    np.testing.assert_allclose(robot.fk([q]), T, atol=1e-14)


def test_mimic_limits_narrow_the_driver(tmp_path):
    text = joint("ab") + joint("bc", inside=mimic("jab", -2, 0, (-1, 0.5)))
    assert load(urdf(tmp_path, text, "abc")).limits.tolist() == [[-0.25, 0.5]]
    text = joint("ab") + joint("bc", inside=mimic("jab", 1, 0, (3, 4)))
    with pytest.raises(ModelError, match="no value"):
        load(urdf(tmp_path, text, "abc"))


@pytest.mark.parametrize(
    ("outside", "value"),
    [
        (joint("bx", "fixed", ""), 0.0),
        (joint("bx", inside='<limit lower="0.7" upper="0.7"/>'), 0.7),
    ],
)
def test_mimic_of_a_constant_joint_is_fixed(tmp_path, outside, value):
    text = joint("ab") + outside + joint("bc", inside=mimic("jbx", 2, 0.1))
    robot = load(urdf(tmp_path, text, "abcx"), tip="c")
    assert robot.kinds == "R"
    T = oracle.homogeneous(oracle.rot_x(0.2 + 2 * value + 0.1))
    np.testing.assert_allclose(robot.fk([0.2]), T, atol=1e-14)


def test_mimic_of_a_joint_elsewhere_is_refused(tmp_path):
    text = joint("ab") + joint("bx") + joint("bc", inside=mimic("jbx"))
    with pytest.raises(ModelError, match="'jbx', which moves but is not in the chain"):
        load(urdf(tmp_path, text, "abcx"), tip="c")
    text = joint("ab", inside=mimic("jbc")) + joint("bc", inside=mimic("jab"))
    with pytest.raises(ModelError, match="circle"):
        load(urdf(tmp_path, text, "abc"))
    with pytest.raises(ModelError, match="no such joint"):
        load(urdf(tmp_path, joint("ab", inside=mimic("zzz")), "ab"))


# ---------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("joints", "links", "choice", "words"),
    [
        ("", "", {}, "no <link>"),
        ("", "a", {}, "no joint moves"),
        (joint("ab", "fixed", ""), "ab", {}, "no joint moves"),
        (joint("ab"), "ab", {"base": "a", "tip": "a"}, "no joint moves"),
        (joint("ab"), "aab", {}, "two links are named 'a'"),
        (joint("ab") + joint("bc", name="jab"), "abc", {}, "two joints are named 'jab'"),
        (joint("ab") + joint("cb"), "abc", {}, "child of two joints"),
        (joint("ab") + joint("ba"), "ab", {}, "circle"),
        (joint("ab") + joint("bc") + joint("cb", name="k"), "abc", {}, "two joints"),
        (joint("bc") + joint("cb"), "abc", {"tip": "c"}, "circle"),
        (joint("bc") + joint("cb"), "abc", {"base": "b"}, "circle"),
        (joint("ab") + joint("cd"), "abcd", {}, "no parent: a, c"),
        (joint("ab") + joint("ac"), "abc", {}, "no child: b, c"),
        (joint("ab"), "ab", {"tip": "z"}, "tip 'z' is no link.*links: a, b"),
        (joint("ab"), "ab", {"base": "z"}, "base 'z' is no link"),
        (joint("ab"), "ab", {"base": "b", "tip": "a"}, "other way round"),
        (joint("ab") + joint("ac"), "abc", {"base": "b", "tip": "c"}, "not below"),
        (joint("ab", "floating"), "ab", {}, "'floating'"),
        (joint("ab", "planar"), "ab", {}, "'planar'"),
        (joint("ab", "spherical"), "ab", {}, "'spherical'"),
        (joint("ab", "revolvute"), "ab", {}, "did you mean 'revolute'"),
        (joint("ab", ""), "ab", {}, "unknown type ''"),
        (joint("az"), "ab", {}, "child 'z', but no such link"),
        (joint("ab", inside=""), "ab", {}, "needs <limit"),
        (joint("ab", "prismatic", ""), "ab", {}, "needs <limit"),
        (joint("ab", inside='<limit lower="1" upper="0"/>'), "ab", {}, "upside down"),
        (joint("ab", inside='<limit lower="x" upper="0"/>'), "ab", {}, "'x' is not a finite"),
        (joint("ab", inside='<limit lower="nan" upper="0"/>'), "ab", {}, "not a finite"),
        (joint("ab", inside='<limit lower="1_0" upper="20"/>'), "ab", {}, "not a finite"),
        (joint("ab", inside='<limit lower="0 1" upper="0"/>'), "ab", {}, "needs 1 numbers"),
        (joint("ab", inside='<origin xyz="1 2"/>'), "ab", {}, "needs 3 numbers, got 2"),
        (joint("ab", inside='<axis xyz="0 0 0"/>'), "ab", {}, "axis 0 0 0"),
        ('<joint name="j" type="fixed"><child link="a"/></joint>', "ab", {}, "no <parent"),
        ('<joint name="j" type="fixed"><parent link="a"/></joint>', "ab", {}, "no <child"),
        ("<joint/>", "ab", {}, "no name"),
        ("<link/>", "ab", {}, "no name"),
    ],
)
def test_refused_by_name(tmp_path, joints, links, choice, words):
    with pytest.raises(ModelError, match=words) as error:
        load(urdf(tmp_path, joints, links), **choice)
    assert "r.urdf" in str(error.value)


def test_what_lies_outside_the_chain_does_not_matter(tmp_path):
    text = joint("ab") + joint("bx", "floating", "") + joint("by", inside='<limit lower="?"/>')
    assert load(urdf(tmp_path, text, "abxy"), tip="b").dof == 1


def test_xacro_is_recognised(tmp_path):
    root = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/>'
    with pytest.raises(ModelError, match="xacro"):
        load(urdf(tmp_path, "", "", root))


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE robot [<!ENTITY a "aaaa">]>',
        '<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/hostname">]>',
        '<!DOCTYPE robot SYSTEM "http://127.0.0.1/x.dtd">',
        "<!DOCTYPE robot>",
        '<!DOCTYPE r [<!ENTITY a "a"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>',
    ],
)
def test_doctypes_and_entities_are_refused(tmp_path, head):
    path = urdf(tmp_path, joint("ab"), "ab", f"{head}<robot name='r'>")
    with pytest.raises(ModelError, match="DOCTYPE"):
        load(path)
    path.write_text("<robot>&nosuch;</robot>")
    with pytest.raises(ModelError):
        load(path)

import math

import mujoco
import numpy as np
import pytest

import oracle
from kinverse.errors import ModelError
from kinverse.load import load


def mjcf(tmp_path, body, head="", tail="", name="m.xml"):
    path = tmp_path / name
    path.write_text(f"<mujoco>{head}<worldbody>{body}</worldbody>{tail}</mujoco>")
    return path


GEOM = '<geom size="0.1" mass="1"/>'


def check(path, tip, base=None, site=False, joints=None):
    """Our chain against mujoco's own reading of the same file."""
    robot = load(path, base=base, tip=tip)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    if joints is not None:
        assert robot.joint_names == joints
    for q in robot.random(10, rng=0):
        for name, value in zip(robot.joint_names, q, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        T = pose_of(data.site(tip) if site else data.body(tip))
        if base:
            T = np.linalg.inv(pose_of(data.body(base))) @ T
        np.testing.assert_allclose(robot.fk(q), T, atol=1e-12)
    for name, limits in zip(robot.joint_names, robot.limits, strict=True):
        if model.joint(name).limited:
            np.testing.assert_allclose(model.joint(name).range, limits, atol=1e-12)
    return robot


def pose_of(item):
    return oracle.homogeneous(item.xmat.reshape(3, 3), item.xpos)


# ---------------------------------------------------------------------------- right answers
ROTATIONS = [
    'quat="0.1 -0.4 0.5 0.2"',
    'axisangle="1 2 3 40"',
    'euler="10 20 30"',
    'xyaxes="1 0.5 0 -0.3 1 0.2"',
    'zaxis="0.3 -0.2 0.9"',
    'zaxis="0 0 -1"',
    'zaxis="0 0 2"',
]


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("angle", ["degree", "radian"])
def test_placements(tmp_path, rotation, angle):
    body = f"""
    <body name="a" pos="0.1 0.2 0.3" {rotation}><joint name="j" axis="1 2 3" pos="0.1 0 -0.2"/>
      {GEOM}<body name="b" pos="0 0.4 0" {rotation}><joint name="k" axis="0 -1 0"/>{GEOM}
        <site name="s" pos="0.1 0.1 0.1" {rotation}/></body></body>"""
    path = mjcf(tmp_path, body, f'<compiler angle="{angle}"/>')
    check(path, "b", joints=("j", "k"))
    check(path, "s", site=True)
    check(path, "b", base="a")


@pytest.mark.parametrize("seq", ["xyz", "zyx", "XYZ", "zxz", "xYz", "ZYX"])
def test_euler_sequences(tmp_path, seq):
    body = f'<body name="a" euler="0.3 -0.7 1.1"><joint name="j"/>{GEOM}</body>'
    check(mjcf(tmp_path, body, f'<compiler angle="radian" eulerseq="{seq}"/>'), "a")


def test_joints_of_one_body_slides_and_refs(tmp_path):
    body = f"""
    <body name="a" euler="10 20 30">
      <joint name="x" type="slide" axis="1 1 0" range="-0.5 0.5" ref="0.2"/>
      <joint name="y" type="hinge" axis="0 1 0" pos="0.3 0.1 0" range="-90 90" ref="30"/>
      <joint name="z" axis="-1 0.5 2" pos="0 0.2 0.1"/>{GEOM}
      <body name="b" pos="0.5 0 0"><joint name="w" ref="90"/>{GEOM}</body>
    </body>"""
    robot = check(mjcf(tmp_path, body), "b", joints=("x", "y", "z", "w"))
    assert robot.kinds == "PRRR"
    assert robot.limits[1].tolist() == pytest.approx([-math.pi / 2, math.pi / 2])
    assert robot.limits[2].tolist() == [-math.pi, math.pi]


def test_default_classes(tmp_path):
    head = """<default><joint axis="0 1 0" range="-10 10"/>
      <default class="arm"><joint axis="1 0 0" limited="false"/>
        <default class="slider"><joint type="slide" range="0 1" limited="true"/></default>
      </default><default class="marked"><site pos="0 0 0.5" euler="0 90 0"/></default></default>"""
    body = f"""<body name="a"><joint name="p"/>{GEOM}
      <body name="b" childclass="arm" pos="0 0 1"><joint name="q"/>{GEOM}
        <body name="c"><joint name="r" class="slider"/>{GEOM}
          <body name="d" childclass="main"><joint name="s"/>{GEOM}
            <site name="t" class="marked" quat="1 1 0 0"/><site name="u" class="marked"/>
      </body></body></body></body>"""
    path = mjcf(tmp_path, body, head)
    robot = check(path, "t", site=True, joints=("p", "q", "r", "s"))
    check(path, "u", site=True)
    assert robot.kinds == "RRPR"
    assert robot.limits[1].tolist() == [-math.pi, math.pi]


def test_frames_carry_placements_and_classes(tmp_path):
    head = '<default><default class="up"><joint axis="1 0 0"/></default></default>'
    body = f"""<frame pos="1 0 0" euler="0 0 90"><frame pos="0 1 0" childclass="up">
      <body name="a" pos="0 0 1"><joint name="j"/>{GEOM}
        <frame euler="90 0 0"><site name="s" pos="0 0.1 0"/></frame></body></frame></frame>"""
    check(mjcf(tmp_path, body, head), "s", site=True)


def test_includes_inside_the_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    part = '<mujoco><body name="b" pos="0 0 1"><joint name="k" axis="1 0 0"/>' + GEOM
    (tmp_path / "parts" / "b.xml").write_text(part + "</body></mujoco>")
    (tmp_path / "c.xml").write_text('<mujocoinclude><compiler angle="radian"/></mujocoinclude>')
    body = (
        f'<body name="a"><joint name="j" range="-1 1"/>{GEOM}<include file="parts/b.xml"/></body>'
    )
    path = mjcf(tmp_path, body, '<include file="c.xml"/>')
    check(path, "b", joints=("j", "k"))


def test_the_only_leaf_and_a_floating_base(tmp_path):
    body = f"""<body name="a"><freejoint/>{GEOM}<body name="b"><joint name="j"/>{GEOM}
      <site name="s"/></body></body>"""
    path = mjcf(tmp_path, body, tail='<keyframe><key qpos="0 0 0 1 0 0 0 0"/></keyframe>')
    assert load(path, base="a").joint_names == ("j",)
    with pytest.raises(ModelError, match="'free'.*base="):
        load(path)


def test_names_of_bodies_and_sites(tmp_path):
    body = f"""<body name="a"><joint/>{GEOM}<site name="a" pos="0 0 1"/>
      <body><joint/>{GEOM}</body></body>"""
    path = mjcf(tmp_path, body)
    with pytest.raises(ModelError, match="body:a or site:a"):
        load(path, tip="a")
    assert load(path, tip="site:a").fk([0.0])[2, 3] == 1.0
    assert load(path, tip="body:a").fk([0.0])[2, 3] == 0.0
    assert load(path).joint_names == ("a_joint1", "a/unnamed1_joint1")


# ---------------------------------------------------------------------------- refusals
ARM = (
    '<body name="a"><joint name="j"/><body name="b"><joint name="k"/><site name="s"/></body></body>'
)


@pytest.mark.parametrize(
    ("equality", "words"),
    [
        ('<joint joint1="j" joint2="k"/>', "<joint> ties j, k"),
        ('<joint joint1="k"/>', "ties k"),
        ('<connect body1="b" anchor="0 0 0"/>', "<connect> ties b"),
        ('<weld body1="b" body2="a"/>', "ties a, b"),
        ('<connect site1="s" site2="s"/>', "ties b"),
        ('<tendon tendon1="t"/>', "ties j"),
    ],
)
def test_equality_constraints_on_the_chain(tmp_path, equality, words):
    tendon = '<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>'
    path = mjcf(tmp_path, ARM, tail=f"{tendon}<equality>{equality}</equality>")
    with pytest.raises(ModelError, match=words):
        load(path)
    off = equality.replace("/>", ' active="false"/>')
    assert load(mjcf(tmp_path, ARM, tail=f"<equality>{off}</equality>")).dof == 2


def test_equality_constraints_elsewhere_are_no_matter(tmp_path):
    tail = '<equality><joint joint1="k"/></equality>'
    assert load(mjcf(tmp_path, ARM, tail=tail), tip="a").dof == 1


@pytest.mark.parametrize(
    ("body", "head", "choice", "words"),
    [
        ("", "", {}, "no joint moves"),
        ('<body name="a"/>', "", {}, "no joint moves"),
        (ARM + '<body name="c"/>', "", {}, "no child: b, c"),
        (ARM, "", {"tip": "nosuch"}, "tip 'nosuch' is no body or site"),
        (ARM, "", {"base": "nosuch"}, "base 'nosuch' is no body"),
        (ARM, "", {"base": "b", "tip": "a"}, "other way round"),
        ('<body name="a"><joint type="ball"/></body>', "", {}, "'ball'"),
        ('<body name="a"><joint type="hing"/></body>', "", {}, "'hing'"),
        ('<body name="a"><joint axis="0 0 0"/></body>', "", {}, "axis 0 0 0"),
        ('<body name="a"><joint axis="0 0"/></body>', "", {}, "needs 3 numbers"),
        ('<body name="a"><joint range="1 -1"/></body>', "", {}, "upside down"),
        ('<body name="a"><joint limited="true"/></body>', "", {}, "has no range"),
        ('<body name="a"><joint limited="yes"/></body>', "", {}, "true, false or auto"),
        ('<body name="a"><joint type="slide"/></body>', "", {}, "slides without limits"),
        (
            '<body name="a"><joint range="0 1"/></body>',
            '<compiler autolimits="false"/>',
            {},
            "autolimits off",
        ),
        (ARM, '<compiler angle="grad"/>', {}, "angle='grad'"),
        (ARM, '<compiler coordinate="global"/>', {}, "coordinate='global'"),
        (ARM, '<compiler eulerseq="xy"/>', {}, "eulerseq"),
        ('<body name="a"><joint class="x"/></body>', "", {}, "no such class 'x'"),
        (ARM, "<default><default/></default>", {}, "has no class="),
        (
            ARM,
            '<default><default class="x"/><default class="x"/></default>',
            {},
            "two default classes",
        ),
        (ARM + '<body name="a"/>', "", {}, "two bodies or sites are named 'a'"),
        ('<body name="a"><joint name="j"/><joint name="j"/></body>', "", {}, "two joints"),
        ('<replicate count="2"><body/></replicate>', "", {}, "<replicate>"),
        ('<body name="a"><composite type="cable"/></body>', "", {}, "<composite>"),
        ('<attach model="x"/>', "", {}, "<attach>"),
        ("<joint/>", "", {}, "must stand in a <body>"),
        ('<body name="a" quat="1 0 0 0" euler="0 0 0"><joint/></body>', "", {}, "twice"),
        ('<body name="a" quat="0 0 0 0"><joint/></body>', "", {}, "all zero"),
        ('<body name="a" zaxis="0 0 0"><joint/></body>', "", {}, "all zero"),
        ('<body name="a" axisangle="0 0 0 1"><joint/></body>', "", {}, "all zero"),
        ('<body name="a" xyaxes="1 0 0 2 0 0"><joint/></body>', "", {}, "parallel"),
        ('<body name="a" xyaxes="1 0 0 0 0 0"><joint/></body>', "", {}, "parallel"),
        ('<body name="a" pos="0 inf 0"><joint/></body>', "", {}, "not a finite"),
        ("<body>" * 300 + "</body>" * 300, "", {}, "deep"),
        ("<body>" * 5000 + "</body>" * 5000, "", {}, "deep"),
        (ARM, "<default>" * 300 + "</default>" * 300, {}, "class=|deep"),
    ],
)
def test_refused_by_name(tmp_path, body, head, choice, words):
    with pytest.raises(ModelError, match=words) as error:
        load(mjcf(tmp_path, body, head), **choice)
    assert "m.xml" in str(error.value)


@pytest.mark.parametrize("file", ["../out.xml", "/etc/hostname", "link.xml", "", "a\0b"])
def test_includes_stay_in_the_folder(tmp_path, file):
    inside = tmp_path / "model"
    inside.mkdir()
    (tmp_path / "out.xml").write_text("<mujoco/>")
    (inside / "link.xml").symlink_to(tmp_path / "out.xml")
    text = file.replace("\0", "&#0;")
    with pytest.raises(ModelError):
        load(mjcf(inside, f'<include file="{text}"/>'))


def test_includes_that_go_wrong(tmp_path):
    for file, words in (
        ("missing.xml", "no such robot file"),
        ("m.xml", "includes itself"),
        ("bad.xml", "not well-formed"),
        ("dtd.xml", "DOCTYPE"),
        (".", "folder|directory"),
    ):
        (tmp_path / "bad.xml").write_text("<mujoco>")
        (tmp_path / "dtd.xml").write_text("<!DOCTYPE mujoco><mujoco/>")
        with pytest.raises(ModelError, match=words):
            load(mjcf(tmp_path, f'<include file="{file}"/>'))

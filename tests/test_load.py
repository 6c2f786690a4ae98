"""The verb, and the catalogue: where each number of it comes from."""

import math

import numpy as np
import pytest

import oracle
from kinverse.errors import InputError, ModelError
from kinverse.load import load, names
from models import compas_urdf

DEG = math.pi / 180
CATALOGUE = (
    "adept_one gen3 iiwa14 ir361 ir361_equivalent irb1400 irb6 jaco2 kr16 panda pioneer2 planar3r"
    " planar3r_003 puma560 rx160l ur10 ur5 xarm6"
)

# theta, d, a, alpha [deg, mm] of the rows, then the limits [deg, mm]: typed by hand from the
# corrected entries of the source documents' robots.json
SEEDS = {
    "planar3r": (
        "RRR",
        [(0, 0, 100, 0), (0, 0, 70, 0), (0, 0, 50, 0)],
        [(-180, 180)] * 3,
    ),
    "planar3r_003": (
        "RRR",
        [(0, 0, 10000, 0), (0, 0, 7000, 0), (0, 0, 5000, 0)],
        [(0, 180), (-180, 0), (-90, 90)],
    ),
    "adept_one": (
        "RRPR",
        [(0, 0, 425, 0), (0, 0, 375, 180), (0, 0, 0, 0), (0, 0, 0, 0)],
        [(-150, 150), (-147, 147), (0, 195), (-277, 277)],
    ),
    "pioneer2": (
        "RRRRRF",
        [
            (0, 150, 60, -90),
            (0, 0, 145, 0),
            (-90, 0, 0, -90),
            (0, 125, 0, 90),
            (0, 0, 0, -90),
            (0, 130, 0, 0),
        ],
        [(-180, 180)] * 5,
    ),
    "puma560": (
        "RRRRRR",
        [
            (0, 0, 0, 90),
            (0, 0, 431.8, 0),
            (0, 150.05, 20.3, -90),
            (0, 431.8, 0, 90),
            (0, 0, 0, -90),
            (0, 0, 0, 0),
        ],
        [(-160, 160), (-225, 45), (-45, 225), (-110, 170), (-100, 100), (-266, 266)],
    ),
    "irb1400": (
        "RRRRRR",
        [
            (0, 475, 150, -90),
            (-90, 0, 600, 0),
            (0, 0, 120, -90),
            (0, 720, 0, 90),
            (0, 0, 0, -90),
            (180, 85, 0, 0),
        ],
        [(-170, 170), (-70, 70), (-65, 70), (-150, 150), (-115, 115), (-300, 300)],
    ),
    "irb6": (
        "RRRRR",
        [(0, 700, 0, 90), (0, 0, 450, 0), (0, 0, 670, 0), (0, 0, 0, -90), (0, 95, 0, 0)],
        [(-170, 170), (50, 130), (-130, -50), (-220, -25), (-180, 180)],
    ),
    "rx160l": (
        "RRRRRR",
        [
            (0, 550, 150, -90),
            (-90, 0, 825, 0),
            (90, 0, 0, 90),
            (0, 925, 0, -90),
            (0, 0, 0, 90),
            (0, 110, 0, 0),
        ],
        [(-160, 160), (-137.5, 137.5), (-150, 150), (-270, 270), (-105, 120), (-270, 270)],
    ),
    "kr16": (
        "RRRRRR",
        [
            (0, 675, 260, -90),
            (0, 0, 680, 0),
            (-90, 0, -35, -90),
            (0, 670, 0, 90),
            (0, 0, 0, -90),
            (0, 115, 0, 0),
        ],
        [(-185, 185), (-155, 35), (-130, 154), (-350, 350), (-130, 130), (-350, 350)],
    ),
    "ir361_equivalent": (
        "RRRRRR",
        [
            (0, 1020, 0, 90),
            (0, 0, 480, 0),
            (0, 0, 0, 90),
            (0, 645, 0, -90),
            (0, 0, 0, 90),
            (0, 120, 0, 0),
        ],
        [(-180, 180)] * 6,
    ),
}


def forward(robot):
    return lambda q: oracle.robot_fk(robot, q)


# ---------------------------------------------------------------------------- the verb
def test_names():
    assert names() == CATALOGUE.split()


@pytest.mark.parametrize("name", CATALOGUE.split())
def test_every_catalogue_robot(name):
    robot = load(name)
    assert robot.name == name
    assert robot.source_note
    for q in robot.random(3, rng=0):
        np.testing.assert_allclose(robot.fk(q), oracle.robot_fk(robot, q), atol=1e-12)
        J = oracle.jacobian(forward(robot), q)
        np.testing.assert_allclose(robot.jacobian(q), J, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "hint"),
    [("KR-16", "kr16"), ("ur_5", "ur5"), ("puma", "puma560"), ("zzz", "adept_one")],
)
def test_unknown_names_get_hints(name, hint):
    with pytest.raises(ModelError, match=hint):
        load(name)


def test_files_that_are_none(tmp_path):
    (tmp_path / "folder.urdf").mkdir()
    for content, file in (
        (b"\x00\xff\x1f\x8b junk", "junk.urdf"),
        (b"\x00\xff\x1f\x8b junk", "junk.toml"),
        (b"", "empty.xml"),
        (b"<sdf/>", "model.xml"),
        (b"solid", "part.stl"),
        (b"x", "noend"),
        (b'<?xml version="1.0" encoding="nosuch"?><robot/>', "coded.urdf"),
    ):
        (tmp_path / file).write_bytes(content)
        with pytest.raises(ModelError, match=file):
            load(tmp_path / file)
        with pytest.raises(ModelError, match=file):
            load(str(tmp_path / file))
    for file in ("missing.urdf", "folder.urdf", "missing/other.toml", "a\0b.urdf"):
        with pytest.raises(ModelError):
            load(tmp_path / file)
    with pytest.raises(ModelError, match="line 2"):
        (tmp_path / "cut.urdf").write_text("<robot>\n<link")
        load(tmp_path / "cut.urdf")


def test_base_and_tip_are_for_trees(tmp_path):
    with pytest.raises(InputError, match="one chain"):
        load("kr16", tip="tool0")


# ---------------------------------------------------------------------------- the catalogue
@pytest.mark.parametrize("name", SEEDS)
def test_corrected_values_of_the_source_documents(name):
    kinds, rows, limits = SEEDS[name]
    robot = load(name)
    moving = kinds.replace("F", "")
    assert robot.kinds == moving
    unit = [1e-3 if kind == "P" else DEG for kind in moving]
    np.testing.assert_allclose(robot.limits, np.array(limits) * np.array(unit)[:, None], rtol=1e-14)
    si = [(theta * DEG, d / 1000, a / 1000, alpha * DEG) for theta, d, a, alpha in rows]
    for q in robot.random(10, rng=1):
        np.testing.assert_allclose(
            oracle.robot_fk(robot, q), oracle.dh_fk(si, kinds, q), rtol=1e-13, atol=1e-13
        )


def kuka_361(q):
    """Forward kinematics as the Orocos code has it: an ordinary wrist at equivalent angles."""
    c5, s5, half = math.cos(q[4]), math.sin(q[4]), math.sqrt(3) / 2
    side = -1 if q[4] < 0 else 1
    alpha = math.atan2(side * s5, half * side * (1 - c5))
    wrist = (
        oracle.rot_z(q[3] + alpha)
        @ oracle.rot_x(-side * 2 * math.acos((c5 + 3) / 4))
        @ oracle.rot_z(q[5] - alpha)
    )
    up = oracle.homogeneous
    return (
        up(oracle.rot_z(q[0]), (0, 0, 1.020))
        @ up(oracle.rot_x(-q[1]))
        @ up(oracle.rot_x(-q[2]), 0.480 * np.array([0, 0, 1]))
        @ up(p=(0, 0, 0.645))
        @ up(wrist)
        @ up(p=(0, 0, 0.120))
    )


def test_ir361_has_the_wrist_of_the_real_arm():
    robot = load("ir361")
    assert robot.dof == 6 and len(robot.kinds) == 7
    for q in robot.random(50, rng=2):
        np.testing.assert_allclose(oracle.robot_fk(robot, q), kuka_361(q), atol=1e-7)
    straight = robot.fk(np.zeros(6))
    np.testing.assert_allclose(straight, oracle.homogeneous(p=(0, 0, 2.265)), atol=1e-14)


def jaco2_frames():
    """The origins of j2n6s200.xacro (kinova-ros), typed by hand."""
    h, t = math.pi / 2, math.pi / 3
    return np.stack(
        [
            oracle.homogeneous(oracle.rpy(*rpy), xyz)
            for xyz, rpy in (
                ((0, 0, 0.15675), (0, math.pi, 0)),
                ((0, 0.0016, -0.11875), (-h, 0, math.pi)),
                ((0, -0.410, 0), (0, math.pi, 0)),
                ((0, 0.2073, -0.0114), (-h, 0, math.pi)),
                ((0, -0.03703, -0.06414), (t, 0, math.pi)),
                ((0, -0.03703, -0.06414), (t, 0, math.pi)),
                ((0, 0, -0.1600), (math.pi, 0, h)),
            )
        ]
    )


def gen3_frames():
    """The origins of gen3_7dof.urdf (ros_kortex), typed by hand."""
    h = math.pi / 2
    rows = (
        ((0, 0, 0.15643), math.pi),
        ((0, 0.005375, -0.12838), h),
        ((0, -0.21038, -0.006375), -h),
        ((0, 0.006375, -0.21038), h),
        ((0, -0.20843, -0.006375), -h),
        ((0, 0.00017505, -0.10593), h),
        ((0, -0.10593, -0.00017505), -h),
        ((0, 0, -0.061525), math.pi),
    )
    return np.stack([oracle.homogeneous(oracle.rot_x(roll), xyz) for xyz, roll in rows])


def xarm6_frames():
    """The origins of xarm6_robot.urdf, typed by hand with exact right angles."""
    h = math.pi / 2
    rows = (
        ((0, 0, 0.267), 0),
        ((0, 0, 0), -h),
        ((0.0535, -0.2845, 0), 0),
        ((0.0775, 0.3425, 0), -h),
        ((0, 0, 0), h),
        ((0.076, 0.097, 0), -h),
        ((0, 0, 0), 0),
    )
    return np.stack([oracle.homogeneous(oracle.rot_x(roll), xyz) for xyz, roll in rows])


def iiwa14_frames():
    """The origins of pybullet's kuka_iiwa/model.urdf, typed by hand, with a 45 mm flange."""
    h, pi = math.pi / 2, math.pi
    rows = (
        ((0, 0, 0.1575), (0, 0, 0)),
        ((0, 0, 0.2025), (h, 0, pi)),
        ((0, 0.2045, 0), (h, 0, pi)),
        ((0, 0, 0.2155), (h, 0, 0)),
        ((0, 0.1845, 0), (-h, pi, 0)),
        ((0, 0, 0.2155), (h, 0, 0)),
        ((0, 0.081, 0), (-h, pi, 0)),
        ((0, 0, 0.045), (0, 0, 0)),
    )
    return np.stack([oracle.homogeneous(oracle.rpy(*rpy), xyz) for xyz, rpy in rows])


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("jaco2", jaco2_frames()),
        ("gen3", gen3_frames()),
        ("xarm6", xarm6_frames()),
        ("iiwa14", iiwa14_frames()),
    ],
)
def test_arms_of_today_against_published_urdf_numbers(name, frames):
    robot = load(name)
    for q in robot.random(20, rng=3):
        expected = oracle.fk(frames, "R" * robot.dof, q)
        np.testing.assert_allclose(oracle.robot_fk(robot, q), expected, atol=3e-9)


@pytest.mark.parametrize(
    ("name", "file", "base", "tip"),
    [
        ("ur5", "ur5_robot", "base_link_inertia", "tool0"),
        ("panda", "panda", "panda_link0", "panda_link8"),
    ],
)
def test_arms_of_today_against_urdf_files(name, file, base, tip):
    robot, urdf = load(name), load(compas_urdf(file), base=base, tip=tip)
    assert robot.joint_names == urdf.joint_names
    np.testing.assert_allclose(robot.limits, urdf.limits, atol=1e-12)
    q = robot.random(20, rng=4)
    np.testing.assert_allclose(robot.fk(q), urdf.fk(q), atol=2e-9)


def test_ur10_lengths():
    rows = [
        (0, 0.1273, 0, 90 * DEG),
        (0, 0, -0.612, 0),
        (0, 0, -0.5723, 0),
        (0, 0.163941, 0, 90 * DEG),
        (0, 0.1157, 0, -90 * DEG),
        (0, 0.0922, 0, 0),
    ]
    robot = load("ur10")
    for q in robot.random(10, rng=5):
        expected = oracle.dh_fk(rows, "RRRRRR", q)
        np.testing.assert_allclose(oracle.robot_fk(robot, q), expected, atol=1e-13)

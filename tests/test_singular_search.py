"""Singular postures found by search: the words hold, by lines and a second Jacobian."""

import re
import time
from itertools import combinations

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.geometry import axis_lines
from kinverse.robot_class import robot_class
from kinverse.singular_search import found_singularities, singular_postures

HALF = np.pi / 2


def size(robot):
    return axis_lines(robot.frames, robot.kinds).size


def random_arm(seed, kinds="RRRRRR"):
    rng = np.random.default_rng(seed)
    rows = {key: rng.uniform(0.2, 1.0, len(kinds)) for key in ("a", "d", "alpha")}
    return kv.Robot.from_dh(**rows, joints=kinds, limits=[(-2, 2)] * len(kinds))


ARMS = {
    **{name: lambda name=name: kv.load(name) for name in ("jaco2", "xarm6", "gen3", "panda")},
    **{name: lambda name=name: kv.load(name) for name in ("puma560", "kr16", "ur5", "rx160l")},
    "iiwa14": lambda: kv.load("iiwa14"),
    "6R": lambda: random_arm(0),
    "5R": lambda: random_arm(1, "RRRRR"),
    "7R": lambda: random_arm(2, "RRRRRRR"),
    "slide": lambda: random_arm(3, "RRPRRR"),
    # a spherical wrist behind three axes of no kind
    "wrist": lambda: kv.Robot.from_dh(
        a=[0.1, 0.4, 0.1, 0, 0, 0],
        d=[0.3, 0.1, 0.2, 0.3, 0, 0.1],
        alpha=[1.2, 0.3, 1.3, -HALF, HALF, 0],
    ),
}
every = pytest.mark.parametrize("name", ARMS)


def screws(robot, q):
    """Screws about the base's origin, from moved frames alone; lengths, q's too, in arm sizes."""
    T, columns = np.eye(4), []
    unit = np.array([1.0 if kind == "R" else size(robot) for kind in robot.kinds])
    q = np.asarray(q) * unit
    for frame, kind, value in zip(robot.frames, robot.kinds, q, strict=False):
        T = T @ frame
        z, p = T[:3, 2], T[:3, 3] / size(robot)
        columns.append(np.r_[z, np.cross(p, z)] if kind == "R" else np.r_[np.zeros(3), z])
        T = T @ oracle.joint_motion(kind, value)
    return np.array(columns).T


def smallest(robot, q):
    return np.linalg.svd(screws(robot, q), compute_uv=False)[min(6, robot.dof) - 1]


def words(robot):
    return found_singularities(robot, min(6, robot.dof), size(robot))


@every
def test_postures_lose_one_dimension(name):
    robot = ARMS[name]()
    found = singular_postures(robot, min(6, robot.dof), size(robot))
    assert len(found.q) > 20
    for q, motion, wrench in zip(found.q, found.motion, found.wrench, strict=True):
        S = screws(robot, q)
        assert smallest(robot, q) < 1e-10
        assert np.abs(wrench @ S).max() < 1e-10
        if robot.dof <= 6:
            assert np.abs(S @ motion).max() < 1e-10


@every
def test_slopes_are_the_derivatives(name):
    """Where no joint is to spare, the smallest singular value grows as the slope says."""
    robot = ARMS[name]()
    if robot.dof != 6:
        return
    found = singular_postures(robot, 6, size(robot))
    for q, slope in zip(found.q[:5], found.slope[:5], strict=True):
        for joint in range(6):
            step = 1e-5 * np.eye(6)[joint]
            grown = smallest(robot, q + step) + smallest(robot, q - step)
            assert grown / 2e-5 == pytest.approx(abs(slope[joint]), abs=2e-4)


def joints_at(condition):
    """{joint: values} where the words are of joint values alone."""
    said = {}
    for joint, values in re.findall(r"joint (\d+) at ((?:[-\w./]+(?: or )?)+)", condition):
        read = {"0": 0.0, "pi": np.pi, "pi/2": HALF, "-pi/2": -HALF}
        said[int(joint) - 1] = [read.get(v) or float(read.get(v, v)) for v in values.split(" or ")]
    return said


@every
def test_joint_values_that_are_said_to_suffice_do(name):
    robot = ARMS[name]()
    rng = np.random.default_rng(7)
    for singularity in words(robot):
        if "further condition" in singularity.condition:
            continue
        said = joints_at(singularity.condition)
        for _ in range(20 if said else 0):
            q = rng.uniform(-3, 3, robot.dof)
            for joint, values in said.items():
                q[joint] = rng.choice(values)
            assert smallest(robot, q) < 1e-4  # values are printed with four digits


def axes(robot, q):
    S = screws(robot, q)
    return S[:3].T, np.cross(S[:3].T, S[3:].T)


def apart(z, p, w, r):
    """Distance of two lines, zero if they are parallel."""
    across = np.cross(z, w)
    sine = np.linalg.norm(across)
    return 0.0 if sine < 1e-9 else abs((p - r) @ across) / sine


@every
def test_a_line_that_is_said_to_meet_every_axis_does(name):
    robot = ARMS[name]()
    said = [s.name for s in words(robot)]
    if set(robot.kinds) != {"R"} or "one line" not in said:
        return
    met = 0
    found = singular_postures(robot, 6, size(robot))
    for q, wrench in zip(found.q, found.wrench, strict=True):
        moment, force = wrench[:3], wrench[3:]
        if abs(moment @ force) < 1e-8 and np.linalg.norm(force) > 1e-3:
            point = np.cross(force, moment) / (force @ force)
            direction = force / np.linalg.norm(force)
            z, p = axes(robot, q)
            assert max(apart(direction, point, *line) for line in zip(z, p, strict=True)) < 1e-5
            met += 1
    assert met > 3


@pytest.mark.parametrize("name", ["puma560", "kr16", "rx160l", "wrist"])
def test_a_wrist_is_found_and_in_line(name):
    robot = ARMS[name]()
    (wrist,) = [s for s in words(robot) if s.name == "in line"]
    assert wrist.condition == "joint 5 at 0 or pi; axes 4 and 6 are in line"
    q = np.random.default_rng(1).uniform(-3, 3, 6)
    q[4] = 0.0
    z, p = axes(robot, q)
    assert np.linalg.norm(np.cross(z[3], z[5])) < 1e-12
    assert np.linalg.norm(np.cross(p[5] - p[3], z[3])) < 1e-12


@pytest.mark.parametrize("name", ["puma560", "kr16", "rx160l", "ur5"])
def test_the_search_meets_every_factor_that_theory_knows(name):
    """Three factors of the determinant, none of them part of another."""
    robot = ARMS[name]()
    assert len(words(robot)) == len(robot_class(robot).singularities) == 3
    assert len({s.condition for s in words(robot)}) == 3


def test_three_axes_in_one_plane():
    elbow = [s.condition for s in words(kv.load("ur5")) if s.name == "one plane"]
    assert elbow == [
        "joint 3 at 0 or pi; axes 2, 3 and 4 lie in one plane and meet or are parallel"
    ]


@pytest.mark.parametrize("name", ["jaco2", "xarm6", "6R"])
def test_general_arms_have_a_surface_that_the_first_and_last_joint_leave(name):
    robot = ARMS[name]()
    (general,) = robot_class(robot).singularities
    assert general.condition == (
        "a surface over joints 2, 3, 4 and 5 where det J = 0; no simple geometric condition"
    )
    assert "may be more" in robot_class(robot).singularities_text
    q = singular_postures(robot, 6, size(robot)).q[0] + [0.7, 0, 0, 0, 0, -1.1]
    assert smallest(robot, q) < 1e-10


def test_seven_joints():
    panda = [s.condition for s in robot_class(kv.load("panda")).singularities]
    assert any(c.startswith("joint 4 at -0.4670 or 2.6746 and joint 5 at 0 or pi;") for c in panda)
    iiwa = [s.condition for s in words(kv.load("iiwa14"))]
    for known in (
        "joint 4 at 0 or pi;",
        "joint 2 at 0 or pi and joint 3 at -pi/2 or pi/2;",
        "joint 5 at -pi/2 or pi/2 and joint 6 at 0 or pi;",
    ):  # Kreutz-Delgado, Long & Seraji 1992
        assert any(c.startswith(known) for c in iiwa), known


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_slide_that_brings_the_wrist_onto_the_first_axes(scale):
    """Stanford arm: told in metres, whatever the arm's size."""
    robot = kv.Robot.from_dh(
        a=0, d=np.array([0.4, 0.1, 0.0, 0, 0, 0.2]) * scale,
        alpha=[-HALF, HALF, 0, -HALF, HALF, 0], joints="RRPRRR", limits=[(-1, 1)] * 6,
    )  # fmt: skip
    said = [s.condition for s in words(robot)]
    assert "joint 3 at 0 m" in said and "joint 2 at 0 or pi" in said
    assert "joint 5 at 0 or pi; axes 4 and 6 are in line" in said


@pytest.mark.parametrize("kinds", ["PPP", "R", "P", "RR", "RRRRRRRRRRRR"])
def test_arms_without_words(kinds):
    twists = np.linspace(0.4, 1.3, len(kinds))
    limits = [(-1, 1)] * len(kinds)
    robot = kv.Robot.from_dh(a=twists / 3, d=0.1, alpha=twists, joints=kinds, limits=limits)
    found = robot_class(robot)
    assert bool(found.singularities_text or found.singularities)
    planar = kv.Robot.from_dh(a=0.2, d=0, alpha=0, joints="RRRRR")
    assert robot_class(planar).singularities == ()


def test_joints_that_follow_others_are_left_out():
    straight = random_arm(0)
    robot = kv.Robot(straight.frames, "RRRRRR", source=[0, 1, 2, 3, 4, 4])
    assert robot_class(robot).singularities == ()


def test_same_words_each_time_and_quickly():
    robot = kv.load("gen3")
    first, start = words(robot), time.process_time()
    assert words(robot) == first
    assert time.process_time() - start < 0.1


def test_conditions_differ():
    for name in ARMS:
        said = words(ARMS[name]())
        assert all(a.condition != b.condition for a, b in combinations(said, 2))

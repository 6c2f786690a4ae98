"""Capsules: exact distances against sampled ones, and what is tested against what."""

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.errors import InputError
from kinverse.paths.collision import Capsules, segment_distance

U = np.linspace(0.0, 1.0, 201)


def sampled(a, b, c, d):
    """Distance of points sampled on both segments: too large by at most half their spacing."""
    one = a + U[:, None] * (b - a)
    other = c + U[:, None] * (d - c)
    return np.linalg.norm(one[:, None] - other[None], axis=2).min()


def cases():
    rng = np.random.default_rng(3)
    a, b, c, d = rng.normal(size=(4, 60, 3))
    b[:5] = a[:5]  # a point
    d[3:8] = c[3:8]
    d[8:16] = c[8:16] + rng.normal(size=(8, 1)) * (b - a)[8:16]  # parallel
    c[16:20] = a[16:20] + 0.3 * (b - a)[16:20]  # on one line
    d[16:20] = a[16:20] + 1.7 * (b - a)[16:20]
    c[20:24] = b[20:24]  # an end in common
    d[24:28] = c[24:28] + (b - a)[24:28] + 1e-9  # all but parallel
    return a, b, c, d


def test_distances_of_segments_are_those_of_their_points():
    a, b, c, d = cases()
    found = segment_distance(a, b, c, d)
    for k, value in enumerate(found):
        spacing = 0.5 * (np.linalg.norm(b[k] - a[k]) + np.linalg.norm(d[k] - c[k])) / 200
        most = sampled(a[k], b[k], c[k], d[k])
        assert value <= most + 1e-12 and value >= most - spacing - 1e-7
    # whichever is named first, and in whichever direction
    assert np.allclose(segment_distance(c, d, a, b), found, atol=1e-8)
    assert np.allclose(segment_distance(b, a, c, d), found, atol=1e-8)


@pytest.mark.parametrize("name", ["kr16", "adept_one", "iiwa14"])
def test_ends_of_links_are_the_joints_origins(name):
    robot = kv.load(name)
    q = robot.random(5, 1)
    points = Capsules(robot, 0.01).points(q)
    assert points.shape == (5, len(robot.kinds) + 2, 3)
    assert np.allclose(points[:, -1], robot.fk(q)[:, :3, 3])
    for values, ends in zip(q, points, strict=True):
        T = np.eye(4)
        for i, kind in enumerate(robot.kinds):
            T = T @ robot.frames[i]
            assert np.allclose(T[:3, 3], ends[i + 1], atol=1e-12)
            T = T @ oracle.joint_motion(kind, values[i])


def brute_clearance(capsules, q):
    """Least distance of points along all links, one configuration."""
    ends = capsules.points(q)[0]
    links = range(len(capsules.radii))
    rods = [ends[i] + U[:, None] * (ends[i + 1] - ends[i]) for i in links]
    values = [np.inf]
    for i in links:
        if np.linalg.norm(capsules.robot.frames[i, :3, 3]) < 1e-9:
            continue
        for x, y, z, r in capsules.spheres:
            away = np.linalg.norm(rods[i] - [x, y, z], axis=1).min()
            values.append(away - r - capsules.radii[i])
        if capsules.floor is not None and i >= capsules.floor_from:
            values.append(rods[i][:, 2].min() - capsules.radii[i] - capsules.floor)
    for i, j in capsules.pairs:
        away = np.linalg.norm(rods[i][:, None] - rods[j][None], axis=2).min()
        values.append(away - capsules.radii[i] - capsules.radii[j])
    return min(values)


@pytest.mark.parametrize("name", ["kr16", "ur5"])
def test_clearance_is_that_of_sampled_links(name):
    robot = kv.load(name)
    capsules = Capsules(robot, 0.05, [[0.5, 0.3, 0.6, 0.2], [-0.4, 0, 0.2, 0.1]], floor=-0.2)
    assert capsules.pairs
    q = robot.random(16, 2)
    found = capsules.clearance(q)
    for values, value in zip(q, found, strict=True):
        assert value == pytest.approx(brute_clearance(capsules, values), abs=6e-3)
    assert np.array_equal(capsules(q), found >= 0.0)
    assert (found < 0).any() and (found > 0).any()
    one = Capsules(robot, 0.05, [[0.5, 0.3, 0.6, 0.2]], self_collision=False, margin=0.1)
    assert np.array_equal(one(q), one.clearance(q) >= 0.1)


def test_a_slide_carries_its_link():
    robot = kv.load("adept_one")
    capsules = Capsules(robot, 0.02, floor=0.0, self_collision=False)
    low, high = robot.limits.T
    q = np.zeros((2, 4))
    q[:, 2] = low[2], high[2]
    lower = capsules.clearance(q)
    tool = robot.fk(q)[:, 2, 3]
    assert lower[1] - lower[0] != 0.0
    assert np.all(lower <= tool - 0.02 + 1e-12)


def test_neighbours_and_what_must_touch_are_left_out():
    puma = kv.load("puma560")
    thin = Capsules(puma, 1e-3).pairs
    assert thin and all(j - i >= 2 for i, j in thin)
    thick = Capsules(puma, 0.2).pairs
    assert set(thick) < set(thin)
    # an arm that has nothing to meet is always clear
    planar = kv.load("planar3r")
    alone = Capsules(planar, 0.0, self_collision=False)
    assert np.isinf(alone.clearance(planar.random(3))).all()


def test_a_folded_arm_meets_itself():
    arm = kv.Robot.from_dh(a=[0.4, 0.4, 0.4], d=0, alpha=0, joints="RRR")
    capsules = Capsules(arm, 0.05)
    third = 2 * np.pi / 3
    assert capsules([[0.0, 0.3, 0.3]])[0]
    assert not capsules([[0.0, third, third]])[0]  # a closed triangle


@pytest.mark.parametrize(
    "change",
    [
        {"radii": [0.1, 0.2]},
        {"radii": -0.1},
        {"radii": np.nan},
        {"spheres": [[0, 0, 1]]},
        {"spheres": [[0, 0, 1, -1]]},
        {"floor": np.inf},
        {"floor_from": 99},
        {"margin": -1.0},
    ],
)
def test_what_cannot_be_is_refused(change):
    with pytest.raises(InputError):
        Capsules(**({"robot": kv.load("kr16"), "radii": 0.05} | change))


def test_joint_values_are_checked():
    capsules = Capsules(kv.load("kr16"), 0.05, floor=0.0)
    with pytest.raises(InputError):
        capsules([[0.0] * 5])
    assert capsules(np.empty((0, 6))).shape == (0,)


def test_the_foot_of_an_arm_may_stand_in_the_floor():
    robot = kv.load("kr16")
    # joint 1 begins on the floor, wherever the joints are
    q = np.radians([[0, -90, 90, 0, 0, 0], [0, 10, 40, 0, 0, 0]])
    clear = Capsules(robot, 0.06, floor=0.0, self_collision=False)
    assert clear(q).tolist() == [True, False]
    assert not Capsules(robot, 0.06, floor=0.0, floor_from=1, self_collision=False)(q).any()
    # one that is mounted higher has to keep link 1 above it too
    raised = Capsules(robot.with_base(kv.pose([0, 0, 0.5])), 0.06, floor=0.0)
    assert raised.floor_from == 1

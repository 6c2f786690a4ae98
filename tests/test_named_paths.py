"""The documents' paths are what their equations say, and the numbers of the errata hold."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.paths import condition_5, condition_6, named_path, named_samples, path_names

LENGTHS = (10, 7, 5)
# errata, section 5: points, feasible by (5) and (6), with the joint ranges (4)
COUNTS = {
    "habibkhah_1": (629, 511, 405),
    "habibkhah_2": (425, 425, 405),
    "habibkhah_3": (4200, 3182, 2201),
    "habibkhah_4": (3182, 3182, 2201),
}


def far(T):
    return np.hypot(T[:, 0, 3], T[:, 1, 3])


@pytest.mark.parametrize("name", COUNTS)
def test_the_counts_of_the_errata(name):
    T, _ = named_samples(name)
    five, six = condition_5(LENGTHS, T).holds, condition_6(LENGTHS, T).holds
    assert np.array_equal(five, six)
    states = kv.solve(kv.load("planar3r_003"), T, task="planar").status
    assert (len(T), five.sum(), (states == kv.Status.SOLVED).sum()) == COUNTS[name]
    # the arm with its limits left out reaches just what the conditions allow
    reached = (states == kv.Status.SOLVED) | (states == kv.Status.OUT_OF_LIMITS)
    assert np.array_equal(reached, five)


def test_the_range_of_the_middle_term():
    # errata, section 5: f_min and f_max
    for name, low, high in [
        ("habibkhah_1", 0.06987902853166247, 264.5229603683035),
        ("habibkhah_2", 40.49251197828096, 264.52489526398784),
        ("habibkhah_3", 0.0, 169.72243622680054),
    ]:
        value = condition_5(LENGTHS, named_samples(name).T).value
        np.testing.assert_allclose([value.min(), value.max()], [low, high], atol=1e-9)


def test_the_conditions_are_an_annulus_and_a_disc():
    T, _ = named_samples("habibkhah_3")
    r = far(T)
    inside = ((r >= 8) & (r <= 22)) | (r <= 2)
    assert np.array_equal(condition_5(LENGTHS, T).holds, inside)
    near = kv.pose(np.random.default_rng(1).uniform(-4, 4, (500, 3)))
    assert (condition_5(LENGTHS, near).holds == condition_6(LENGTHS, near).holds).all()


def test_circle_and_arc_are_the_documents():
    for name, first in (("habibkhah_1", 0.0), ("habibkhah_2", 1.4 * np.pi)):
        T, s = named_samples(name)
        t = first + 0.01 * np.arange(len(s))
        np.testing.assert_allclose(T[:, 0, 3], 12.9 + 8 * np.cos(t), atol=1e-12)
        np.testing.assert_allclose(T[:, 1, 3], 3.087 + 8 * np.sin(t), atol=1e-12)
        np.testing.assert_allclose(s, 8 * (t - first), atol=1e-12)


def test_the_fourth_is_the_feasible_part_of_the_third():
    whole, part = named_samples("habibkhah_3").T, named_samples("habibkhah_4").T
    np.testing.assert_allclose(part, whole[294:3476], atol=1e-12)
    path = named_path("habibkhah_4")
    np.testing.assert_allclose(far(path([0.0, path.length])), 8.0)


@pytest.mark.parametrize("name", COUNTS)
def test_the_tool_points_away_from_the_base(name):
    T, _ = named_samples(name)
    np.testing.assert_allclose(T[:, :2, 0] * far(T)[:, None], T[:, :2, 3], atol=1e-12)


@pytest.mark.parametrize("name", ["masajedi_straight", "masajedi_curved"])
def test_eight_sets_of_joint_angles_reach_every_pose(name):
    robot = kv.load("kr16")
    assert len(named_samples(name).s) == 21
    path = named_path(name)
    T, _ = path.sample(1001)
    s = kv.Analytic().fit(robot).solve(T)
    assert (s.count == 8).all()
    # each of the eight goes on to the end: no joint has to unwind
    follow = kv.Numerical().fit(robot).follow
    for start in s[0].q:
        way = follow(T, start)
        assert way.ok.all() and np.abs(np.diff(way.q, axis=0)).max() < 0.01
    assert not s.stats.singular.any()


def test_one_is_straight_and_one_is_curved_in_space():
    straight, curved = (named_path(n)(np.linspace(0, 0.5, 51))[:, :3, 3] for n in path_names()[4:])
    for points, dimensions in ((straight, 1), (curved, 3)):
        sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        assert (sizes > 1e-3).sum() == dimensions
    assert (np.ptp(straight, axis=0) > 0.05).all()


def test_an_unknown_path_is_told_the_names():
    for name in ("habibkhah", 3, None):
        with pytest.raises(kv.InputError, match="unknown path .*habibkhah_1.*masajedi_curved"):
            named_path(name)
        with pytest.raises(kv.InputError, match="unknown path"):
            named_samples(name)


@pytest.mark.parametrize("lengths", [[10, 7], [10, 7, 0], [10, 7, np.nan], [10, -7, 5]])
def test_lengths_that_are_none(lengths):
    for condition in (condition_5, condition_6):
        with pytest.raises(kv.InputError, match="lengths must be three positive"):
            condition(lengths, np.eye(4))

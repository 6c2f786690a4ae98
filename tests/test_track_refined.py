"""Samples added until the tool stays near the path between them."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.bench.splines import Spline
from kinverse.paths import Path, track
from tracked_paths import TOOL, Curve, largest_deviation, straight


def test_a_tolerance_that_is_not_reached_is_told():
    robot = kv.load("kr16")
    start, end = np.radians([[0, -70, 60, 20, 40, -20], [10, -60, 50, 30, 30, 20]])

    def with_a_jump(s):  # of about 1 mm
        return start + s[:, None] * (end - start) + (s[:, None] > 0.5) * [1e-3, 0, 0, 0, 0, 0]

    found = track(robot, Curve(robot, with_a_jump), samples=20, tolerance=1e-4)
    assert found.is_whole and found.deviation > found.tolerance == 1e-4
    assert "more than the tolerance 0.0001 m" in repr(found)
    kept = track(robot, Curve(robot, straight(start, end)), samples=20, tolerance=1e-4)
    assert kept.deviation <= kept.tolerance and "tolerance" not in repr(kept)


def test_samples_are_added_until_the_tool_stays_near_the_path():
    robot = kv.load("kr16")
    every = (Spline(robot, seed) for seed in range(99))
    path = next(path for path in every if track(robot, path, samples=21).is_whole)
    plain = track(robot, path, samples=21)
    found = track(robot, path, tolerance=1e-5, samples=21)
    assert found.is_whole and len(found) > len(plain)
    assert found.deviation <= 1e-5
    assert np.isin(plain.s, found.s).all() and (np.diff(found.s) > 0).all()
    # not only half-way
    for u in (0.2, 0.37, 0.7):
        between = found.q[:-1] + u * np.diff(found.q, axis=0)
        wanted = path(found.s[:-1] + u * np.diff(found.s))
        assert np.linalg.norm((robot.fk(between) - wanted)[:, :3, 3], axis=1).max() < 1.5e-5


ZIGZAG = np.column_stack(
    [np.full(6, 0.9), -0.3 + 0.11 * np.arange(6), 1.1 + 0.05 * np.array([0, 1] * 3)]
)


SPIKE = np.array(
    [[0.9, -0.3, 1.1], [0.9, 0, 1.1], [0.9, 5e-4, 1.12], [0.9, 1e-3, 1.1], [0.9, 0.3, 1.1]]
)


class Unmarked:
    """A path that does not tell where its corners are."""

    def __init__(self, path):
        self.path = path

    def __call__(self, s):
        return self.path(np.asarray(s) * self.path.length)

    def sample(self, count):
        return self(np.linspace(0.0, 1.0, count))


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5])
@pytest.mark.parametrize("points", [ZIGZAG, SPIKE], ids=["zigzag", "spike"])
def test_the_deviation_told_holds_at_corners_too(points, tolerance):
    robot = kv.load("kr16")
    path = Path.polyline(points, orientation=TOOL)
    found = track(robot, path, tolerance=tolerance, samples=50)
    assert found.is_whole and found.deviation <= tolerance
    # corners are samples
    assert np.abs(found.s[:, None] - path.breaks).min(axis=0).max() < 1e-9
    assert largest_deviation(robot, found, path) <= 1.01 * found.deviation
    unmarked = Unmarked(path)
    found = track(robot, unmarked, tolerance=tolerance, samples=50)
    assert found.is_whole and found.deviation <= tolerance
    assert largest_deviation(robot, found, unmarked) <= 1.04 * found.deviation


def test_samples_are_added_where_steps_are_too_large():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 20, 40, 0], [90, -40, 60, 20, 60, 200]])
    curve = Curve(robot, straight(*ends))
    assert not track(robot, curve, samples=4).is_whole
    found = track(robot, curve, tolerance=1e-3, samples=4)
    assert found.is_whole and found.largest_step <= 0.5


def test_redundant_arms_are_refined_too():
    robot = kv.load("iiwa14")
    q = cases.path(robot, 40)
    grid = np.linspace(0, 1, 40)
    smooth = Curve(robot, lambda s: np.column_stack([np.interp(s, grid, c) for c in q.T]))
    found = track(robot, smooth, tolerance=1e-3, samples=14)
    assert found.is_whole and found.deviation <= 1e-3

"""Paths to track, and what holds of every answer."""

import numpy as np
import pytest

import kinverse as kv
import oracle

ARMS = ["kr16", "puma560", "ur5", "iiwa14", "planar3r"]
TOOL = kv.pose([0, 0, 0], rpy=[0.2, 1.7, 0.3])[:3, :3]


class Curve:
    """A path that can be evaluated: forward kinematics of a curve in joint space."""

    def __init__(self, robot, q):
        self.robot, self.q = robot, q

    def __call__(self, s):
        return self.robot.fk(self.q(np.asarray(s)))

    def sample(self, count):
        return self(np.linspace(0.0, 1.0, count))


def straight(start, end):
    start, end = np.asarray(start, float), np.asarray(end, float)
    return lambda s: start + s[:, None] * (end - start)


class Motion:
    """The path of a tool that joint values lead, known between its samples too."""

    def __init__(self, fk, q, aside=0.0):
        self.fk, self.q, self.aside = fk, q, aside

    def __call__(self, s):
        T = self.fk(self.q(s))
        tilt = kv.pose([0, 0, 0], rpy=[0, self.aside, 0])[:3, :3]
        T[:, :3, :3] = tilt @ T[:, :3, :3]
        return T

    def sample(self, count):
        return self(np.linspace(0.0, 1.0, count))


def check(robot, found, limit=0.5, away=0.0):
    """What holds of every answer."""
    low, high = robot.limits.T
    q = found.q[found.ok]
    assert ((q >= low) & (q <= high)).all()
    assert np.allclose(robot.fk(q), found.T[found.ok], atol=1e-6)
    assert np.isnan(found.q[~found.ok]).all() and (found.branch[~found.ok] == -1).all()
    assert found.largest_step <= limit + 1e-12
    # runs and lost samples are all samples, each once
    covered = [i for a, b in found.intervals for i in range(a, b)]
    lost = [i for gap in found.gaps for i in range(gap.start, gap.end)]
    assert sorted(covered + lost) == list(range(len(found)))
    assert np.array_equal(np.sort(covered), np.flatnonzero(found.ok))
    breaks = {gap.start for gap in found.gaps if gap.is_break}
    touching = {b for _, b in found.intervals} & {a for a, _ in found.intervals}
    assert breaks == touching
    steps = [np.abs(np.diff(part, axis=0)).max(axis=1).sum() for part in found.segments()]
    assert found.cost == pytest.approx(sum(steps) + away, abs=1e-9)


def largest_deviation(robot, found, path, places=60):
    """By the oracle, joints moving in straight lines."""
    share = np.arange(1, places + 1)[:, None] / (places + 1)
    worst = 0.0
    for a, b, s, t in zip(found.q, found.q[1:], found.s, found.s[1:], strict=False):
        wanted = path(s + share[:, 0] * (t - s))
        reached = [oracle.robot_fk(robot, q)[:3, 3] for q in a + share * (b - a)]
        worst = max(worst, np.linalg.norm(reached - wanted[:, :3, 3], axis=1).max())
    return worst

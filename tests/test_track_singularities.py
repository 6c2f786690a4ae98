"""Paths that meet singularities, pass through them, or pass beside them."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.paths import Reason, track
from tracked_paths import Curve, Motion, check, straight


def test_a_path_through_a_wrist_singularity_is_followed():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 20, 30, 10], [20, -60, 70, 30, -30, 40]])
    for count in (40, 41):  # with and without a sample in the very singularity
        curve = Curve(robot, straight(*ends))
        found = track(robot, curve, q_start=ends[0], samples=count)
        assert found.is_whole, found
        assert np.abs(np.diff(found.q, axis=0)).max() < 0.1
        assert len(set(found.branch.tolist())) > 1


def test_a_path_that_begins_in_a_singularity_is_followed():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 50, 0, -80], [20, -60, 70, 60, 30, -60]])
    for q in (ends, ends[::-1]):
        found = track(robot, Curve(robot, straight(*q)), q_start=q[0], samples=30)
        assert found.is_whole and np.abs(np.diff(found.q, axis=0)).max() < 0.1


def test_a_path_that_stays_in_a_singularity_is_followed():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 50, 0, -80], [40, -40, 70, 90, 0, -60]])
    found = track(robot, robot.fk(straight(*ends)(np.linspace(0, 1, 30))), max_step=0.2)
    assert found.is_whole


def test_no_branch_is_changed_beside_a_singularity():
    robot = kv.load("puma560")
    low, high = robot.limits.T
    # the elbow all but stretched, the shoulder driven to its limit: the other elbow is 0.1 rad away
    fold = np.arctan2(0.0203, 0.4318)  # of the stretched arm
    ends = np.array([[0.0, high[1] - 0.3, np.pi / 2 + fold - 0.05, 0.3, 0.5, 0.2]] * 2)
    ends[1, 1] = high[1] + 0.2
    T = kv.Robot.fk(robot, np.linspace(*ends, 60))
    found = track(robot, T)
    check(robot, found)
    for part, (a, b) in zip(found.segments(), found.intervals, strict=True):
        assert len(set(found.branch[a:b].tolist())) == 1, part


def test_a_singularity_that_cannot_be_passed_is_told():
    robot = kv.load("kr16")
    # the wrist is stretched, then bent to another side: joint 4 would have to turn at one pose
    corner = np.radians([0, -70, 60, 0, 0, 0])
    to = straight(corner + np.radians([0, 0, 0, 0, 30, 0]), corner)
    there = straight(corner, corner + np.radians([0, 0, 0, 0, 30, 0]))
    q = np.concatenate([to(np.linspace(0, 1, 20)), there(np.linspace(0, 1, 20)[1:])])
    q[20:, 3] = np.pi / 2
    q[20:, 5] = -np.pi / 2
    found = track(robot, robot.fk(q), q_start=q[0])
    check(robot, found, away=np.abs(found.q[0] - q[0]).max())
    assert found.ok.all() and [gap.code for gap in found.gaps] == [Reason.SINGULARITY]
    assert abs(found.gaps[0].start - 20) <= 1


THROUGH = np.radians([[0, -70, 60, 20, 30, 10], [20, -60, 70, 30, -30, 40]])
"""Joint 5 passes zero, between two samples if their number is even."""


@pytest.mark.parametrize("count", [20, 40, 200])
def test_a_path_through_a_singularity_leads_to_the_other_branch(count):
    robot = kv.load("kr16")
    motion = Motion(robot.fk, straight(*THROUGH))
    found = track(robot, motion, q_start=THROUGH[0], samples=count)
    check(robot, found, away=1e-9)
    assert found.is_whole and len(set(found.branch)) == 2
    assert np.abs(found.q - motion.q(np.linspace(0, 1, count))).max() < 1e-6
    # poses alone leave open what is between them
    poses = track(robot, motion.sample(count), q_start=THROUGH[0])
    assert np.abs(poses.q - found.q).max() < 1e-6


def test_a_path_past_a_singularity_changes_no_branch():
    robot = kv.load("kr16")
    # half a degree aside: between its samples joint 4 would have to turn half round
    motion = Motion(robot.fk, straight(*THROUGH), aside=np.radians(0.5))
    found = track(robot, motion, q_start=THROUGH[0], samples=20)
    assert [gap.code for gap in found.gaps if gap.is_break] == [Reason.STEP]
    assert all(len(set(found.branch[a:b])) == 1 for a, b in found.intervals)
    # the joints' own way leads the tool past it some millimetres off, which may be allowed
    near = track(robot, motion, q_start=found.q[0], samples=20, tolerance=0.02)
    assert near.is_whole and len(set(near.branch)) == 2
    assert 0.0 < near.deviation <= 0.02

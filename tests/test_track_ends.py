"""Where a tracked path begins and ends: q_start, the middle of the limits, closed paths."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.bench.splines import Spline
from kinverse.errors import InputError
from kinverse.paths import Path, Reason, track
from tracked_paths import Curve, check, straight


def test_the_path_begins_where_the_arm_is():
    robot = kv.load("kr16")
    q = cases.path(robot, 20)
    T = robot.fk(q)
    for start in kv.solve(robot, T[0]).q:
        found = track(robot, T, q_start=start)
        assert np.abs(found.q[0] - start).max() < 1e-6
    # far from all solutions: the way there counts, and is a break
    far = np.clip(q[0] + 1.5, *robot.limits.T)
    found = track(robot, T, q_start=far)
    along = np.abs(np.diff(found.q, axis=0)).max(axis=1).sum()
    assert found.cost == pytest.approx(along + np.abs(found.q[0] - far).max())
    assert found.ok.all() and not found.is_whole
    gap = found.gaps[0]
    assert (gap.start, gap.end, gap.code) == (0, 0, Reason.STEP)
    assert "q_start" in gap.text and "'joint" in gap.text and found.intervals == ((0, 20),)
    # a larger step reaches it
    wide = np.abs(found.q[0] - far).max() + 1e-6
    assert track(robot, T, q_start=far, max_step=wide).is_whole


def test_a_closed_path_says_how_far_from_their_start_the_joints_end():
    robot = kv.load("panda")
    turned = kv.pose([0, 0, 0], rpy=[3.1, 0, 0])[:3, :3]
    ring = Path.circle([0.45, 0.0, 0.4], 0.1, orientation=turned)
    found = track(robot, ring, samples=60)
    assert found.is_whole and found.closure == np.abs(found.q[-1] - found.q[0]).max()
    assert found.closure > 1e-3 and "closed" in repr(found)
    half = track(robot, Path.circle([0.45, 0.0, 0.4], 0.1, [0, 2], orientation=turned), samples=40)
    assert np.isnan(half.closure) and "closed" not in repr(half)
    # without a joint to spare and off the singularities the arm comes back
    arm = kv.load("kr16")
    tool = kv.pose([0, 0, 0], rpy=[0.2, 1.7, 0.3])[:3, :3]
    assert track(arm, Path.circle([0.9, 0, 1.1], 0.1, orientation=tool)).closure < 1e-6


@pytest.mark.parametrize("is_kept", [False, True])
@pytest.mark.parametrize("name", ["ur5", "kr16"])
def test_without_a_start_a_path_begins_nearest_the_middle(name, is_kept):
    robot = kv.load(name)
    low, high = robot.limits.T
    turn = 2.0 * np.pi
    odd = 0
    for seed in range(8):
        T = Spline(robot, 700 + seed).sample(30)
        found = track(robot, T, keep=(lambda q: np.ones(len(q), bool)) if is_kept else None)
        check(robot, found)
        for q in found.segments():
            # other whole turns of a joint are nearer the middle only where limits are left
            for sign in (-turn, turn):
                inside = ((q + sign >= low) & (q + sign <= high)).all(axis=0)
                middle = 0.5 * (low + high)
                nearer = np.abs(q[0] + sign - middle) < np.abs(q[0] - middle) - 1e-9
                assert not (inside & nearer).any()
                odd += int(inside.any())
        # a start that is given is kept
        away = np.array([turn if low[0] < -4.0 else 0.0, 0, 0, 0, 0, 0])
        for start in (found.q[0] - away, found.q[0] + away):
            if found.ok[0] and ((start >= low) & (start <= high)).all():
                assert np.abs(track(robot, T, q_start=start).q[0] - start).max() < 1e-6
    assert odd


def test_turns_that_a_predicate_refuses_are_left():
    robot = kv.load("ur5")
    path = Path.circle([0.4, 0.1, 0.3], 0.1, orientation=kv.pose(rpy=[3.1, 0, 0])[:3, :3])
    assert track(robot, path, samples=60).q[0, 0] > 0.0
    found = track(robot, path, samples=60, keep=lambda q: q[:, 0] < 0.0)
    assert found.is_whole and (found.q[:, 0] < 0.0).all()


@pytest.mark.parametrize("tolerance", [None, 1e-4])
@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_a_closed_path_ends_where_it_begins(name, tolerance):
    robot = kv.load(name)
    ring = Path.circle([0.4, 0.2, 0.5], 0.15, orientation=kv.pose(rpy=[3.1, 0, 0])[:3, :3])
    found = track(robot, ring, samples=60, tolerance=tolerance, closed=True)
    check(robot, found)
    assert found.is_whole and found.closure < 1e-9
    if tolerance is None:
        free = track(robot, ring, samples=60)
        assert free.closure > 0.01 or name == "ur5"
        # where an arm can be: the way there begins within a step of it
        start = free.q[-1]
        there = track(robot, ring, samples=60, q_start=start, closed=True)
        assert there.is_whole and there.closure < 1e-9
        assert np.abs(there.q[0] - start).max() <= 0.5
    else:
        assert found.deviation <= tolerance


def test_a_closed_way_is_found_where_the_best_way_is_far_from_any():
    robot = kv.load("iiwa14")
    low, high = robot.limits.T
    for seed in (0, 2, 4):
        rng = np.random.default_rng(seed)
        middle, size = rng.uniform(0.5 * low, 0.5 * high), rng.uniform(-0.3, 0.3, (2, 7))
        s = np.linspace(0.0, 2.0 * np.pi, 80)[:, None]
        T = robot.fk(middle + np.sin(s) * size[0] + (np.cos(s) - 1.0) * size[1])
        found = track(robot, T, closed=True)
        check(robot, found)
        assert found.is_whole and found.closure < 1e-9
        assert seed == 0 or track(robot, T).closure > 0.5


def test_a_path_that_winds_up_says_that_it_is_not_closed():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 20, 40, -170], [0, -70, 60, 20, 40, 190]])
    path = Curve(robot, straight(*ends))
    found = track(robot, path, samples=60, closed=True)
    assert found.ok.all() and not found.is_whole and found.closure == pytest.approx(2 * np.pi)
    (gap,) = found.gaps
    assert (gap.start, gap.end, gap.code) == (60, 60, Reason.NOT_CLOSED)
    assert gap.told(degrees=True).startswith("joint 'joint6' ends 360 deg from where it begins; of")
    assert track(robot, path, samples=60).is_whole
    with pytest.raises(InputError, match=r"ends .* m and .* rad from it"):
        track(robot, Curve(robot, straight(ends[0], 0.9 * ends[1])), closed=True)
    # over a gap no way back is looked for, and none is claimed
    T = path.sample(60)
    T[30, 0, 3] += 9.0
    broken = track(robot, T, closed=True)
    assert [g.code for g in broken.gaps] == [Reason.OUT_OF_REACH, Reason.NOT_CLOSED]
    assert "looked" not in broken.gaps[-1].text

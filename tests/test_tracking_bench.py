"""What judges ``track`` in the bench: it must refuse what is wrong."""

from dataclasses import replace

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.bench.continuation import continued, corrected
from kinverse.bench.sections.tracking import SAMPLES, _Judge, _led_to_the_end, _splines
from kinverse.bench.splines import Spline
from kinverse.paths import Reason, track


def test_joint_values_are_led_through_a_singularity():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 20, 30, 10], [20, -60, 70, 30, -30, 40]])
    q = np.linspace(*ends, 200)
    T = np.array([oracle.robot_fk(robot, row) for row in q])
    led = continued(robot, T[1:, None], q[:1], 0.1)
    assert np.abs(led[:, 0] - q[1:]).max() < 1e-5
    # a jump of the path, and a limit on the way, lose them
    jumped = np.concatenate([T[1:50], T[120:]])
    lost = continued(robot, jumped[:, None], q[:1], 0.1)
    assert np.isfinite(lost[:49]).all() and np.isnan(lost[49:]).all()
    limits = robot.limits.copy()
    limits[0, 1] = q[100, 0]
    held = continued(robot.with_limits(limits), T[1:, None], q[:1], 0.1)
    assert np.isfinite(held[98]).all() and np.isnan(held[101:]).all()
    free = continued(robot.with_limits(limits), T[1:, None], q[:1], 0.1, hold_limits=False)
    assert np.isfinite(free).all()


def test_a_pose_out_of_reach_is_not_reached():
    robot = kv.load("iiwa14")
    q = robot.random(20, 3)
    T = np.array([oracle.robot_fk(robot, row) for row in q])
    near, reached = corrected(robot, T, q + 0.01)
    assert reached.all()
    worst = [
        oracle.errors("pose", a, oracle.robot_fk(robot, b)) for a, b in zip(T, near, strict=True)
    ]
    assert np.max(worst) < 1e-7
    T[:, :3, 3] += 9.0
    assert not corrected(robot, T, q)[1].any()


@pytest.mark.parametrize("name, seeds", [("kr16", (21, 37)), ("iiwa14", (708,))])
def test_the_judge_refuses_another_reason(name, seeds):
    robot = kv.load(name)
    judge = _Judge(robot)
    looked = 0
    for seed in seeds:
        found = track(robot, Spline(robot, seed), samples=SAMPLES)
        for gap in found.gaps:
            if gap.is_break:
                assert judge.agrees(gap, found, seed)
                wrong = Reason.SINGULARITY if gap.code is Reason.STEP else Reason.STEP
                assert not judge.agrees(replace(gap, code=wrong), found, seed)
                looked += 1
    assert looked >= len(seeds)


def test_paths_that_could_be_followed_are_counted():
    robot = kv.load("kr16")
    tracked = {seed: track(robot, Spline(robot, seed), samples=SAMPLES) for seed in range(12)}
    whole = [seed for seed, found in tracked.items() if found.is_whole]
    lost = [seed for seed in tracked if seed not in whole]
    # most of what track follows is found by the other means as well, were it given up
    assert _led_to_the_end(robot, whole) > len(whole) // 2 and _led_to_the_end(robot, lost) == 0


def test_nothing_to_confirm_is_no_pass():
    lines = {line.what: line for line in _splines("iiwa14", 1)}
    assert "nothing to confirm" in lines["reasons confirmed"].note
    assert lines["reasons confirmed"].verdict == ""
    assert lines["paths followed to the end"].verdict == "PASS"

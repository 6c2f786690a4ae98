"""Tracked paths: against every sequence of branches, at singularities, limits and obstacles."""

import itertools

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse import calibration
from kinverse.bench import cases
from kinverse.bench.splines import Spline
from kinverse.errors import InputError, NoClosedForm
from kinverse.paths import Path, Reason, Samples, track
from kinverse.paths.collision import Capsules

ARMS = ["kr16", "puma560", "ur5", "iiwa14", "planar3r"]


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


# ---------------------------------------------------------------------------- the best way
@pytest.mark.parametrize("name", ARMS)
def test_a_smooth_path_is_tracked_to_its_end(name):
    robot = kv.load(name)
    q = cases.path(robot, 40)
    found = track(robot, robot.fk(q), task="planar" if name == "planar3r" else "pose")
    assert found.is_whole and found.intervals == ((0, 40),)
    assert found.cost <= np.abs(np.diff(q, axis=0)).max(axis=1).sum() + 1e-9
    assert found.s is None and np.isnan(found.deviation)


def sequences(solver, T, size):
    """Fewest breaks and least cost: every sequence of nodes, written out."""
    found = solver.solve(T)
    ends = np.cumsum(found.count)
    layers = [np.arange(e - c, e) for e, c in zip(ends, found.count, strict=True)]
    live = [i for i, layer in enumerate(layers) if len(layer)]
    best = (0, 0.0) if not live else (10**6, 0.0)
    for way in itertools.product(*(layers[i] for i in live)) if live else ():
        breaks, cost = 0, 0.0
        for (i, a), (j, b) in itertools.pairwise(zip(live, way, strict=True)):
            step = size(found.q[b] - found.q[a])
            largest = np.abs(found.q[b] - found.q[a]).max()
            if j == i + 1 and largest <= 0.5 and found.branch[a] == found.branch[b]:
                cost += step
            else:
                breaks += 1
        best = min(best, (breaks, cost))
    return best


SIZES = {
    "max": lambda d: np.abs(d).max(),
    "l2": np.linalg.norm,
    "time": lambda d: (np.abs(d) / np.arange(1.0, 7.0)).max(),
}


@pytest.mark.parametrize("metric", SIZES)
@pytest.mark.parametrize("name", ["kr16", "puma560"])
def test_short_paths_are_the_best_of_all_sequences(name, metric):
    robot = kv.load(name)
    # a narrower arm has few windings, so that all sequences can be written out
    low, high = robot.limits.T
    robot = robot.with_limits(np.column_stack([np.maximum(low, -3.3), np.minimum(high, 3.3)]))
    solver = kv.Analytic(windings="all").fit(robot)
    speed = {"max_velocity": np.arange(1.0, 7.0)} if metric == "time" else {}
    done = 0
    for seed in range(60):
        T = Spline(robot, seed).sample(7)
        count = solver.solve(T).count
        if not 1 <= np.prod(np.maximum(count, 1.0)) <= 1000:
            continue
        found = track(robot, T, metric=metric, **speed)
        breaks, cost = sequences(solver, T, SIZES[metric])
        ours = max(len(found.intervals) - 1, 0)
        changes = [len(set(found.branch[a:b].tolist())) - 1 for a, b in found.intervals]
        if any(changes):  # passing a singularity has saved a break
            assert ours < breaks
            continue
        assert (ours, found.cost) == (breaks, pytest.approx(cost, abs=1e-9))
        done += 1
    assert done >= 5


@pytest.mark.parametrize("name", ["kr16", "puma560", "ur5", "iiwa14"])
def test_random_paths_hold_what_is_promised(name):
    robot = kv.load(name)
    for seed in range(3 if name == "iiwa14" else 12):
        check(robot, track(robot, Spline(robot, 500 + seed), samples=40))


def test_windings_are_chosen_along_the_whole_path():
    robot = kv.load("kr16")
    # joint 6 ends near its upper limit: it must begin a turn lower than is nearest the middle
    ends = np.radians([[0, -70, 60, 20, 40, -100], [10, -70, 60, 20, 40, 340]])
    found = track(robot, Curve(robot, straight(*ends)), samples=100)
    assert found.is_whole
    assert np.ptp(found.q[:, 5]) == pytest.approx(np.radians(440), abs=1e-6)


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


def test_a_joint_path_with_many_gaps_is_printed_in_a_few_lines():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 40))
    T[1::3, 0, 3] += 9.0
    said = repr(track(robot, T)).splitlines()
    assert len(said) == 7 and said[-1].strip() == "and 8 gaps more"
    assert said[1].strip().startswith("sample 1: OUT_OF_REACH")


def test_repeated_poses_are_no_step():
    robot = kv.load("ur5")
    T = np.repeat(robot.fk(cases.path(robot, 5)), 3, axis=0)
    found = track(robot, T)
    assert found.is_whole
    same = np.abs(np.diff(found.q, axis=0)).max(axis=1).reshape(-1)[[0, 1, 3, 4]]
    assert same.max() == 0.0
    resting = track(robot, np.repeat(T[:1], 4, axis=0))
    assert resting.is_whole and resting.cost == 0.0


def test_the_largest_step_of_each_joint_is_held():
    robot = kv.load("puma560")
    q = cases.path(robot, 60)
    T = robot.fk(q)
    steps = np.abs(np.diff(q, axis=0)).max(axis=0)
    assert track(robot, T, max_step=steps * 1.001).is_whole
    tight = steps * 1.001
    tight[2] *= 0.8
    found = track(robot, T, max_step=tight)
    assert not found.is_whole
    assert {gap.code for gap in found.gaps} == {Reason.STEP}
    for part in found.segments():
        assert (np.abs(np.diff(part, axis=0)) <= tight + 1e-9).all()


# ---------------------------------------------------------------------------- singularities
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


# ---------------------------------------------------------------------------- gaps
def test_samples_out_of_reach_are_lost_and_nothing_else():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 50))
    T[20:25, 0, 3] += 9.0
    found = track(robot, T)
    check(robot, found)
    assert found.intervals == ((0, 20), (25, 50))
    assert [(g.start, g.end, g.code) for g in found.gaps] == [(20, 25, Reason.OUT_OF_REACH)]


def test_samples_out_of_limits_are_lost():
    robot = kv.load("kr16")
    q = cases.path(robot, 50)
    narrow = robot.limits.copy()
    narrow[0, 1] = np.quantile(q[:, 0], 0.7)
    narrow[0, 0] = q[:, 0].min() - 0.1
    found = track(robot.with_limits(narrow), robot.fk(q))
    check(robot.with_limits(narrow), found)
    assert any(g.code is Reason.OUT_OF_LIMITS for g in found.gaps)


def test_limits_of_no_width_lose_the_path_and_say_why():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 5))
    limits = robot.limits.copy()
    limits[2] = 0.0
    found = track(robot.with_limits(limits), T)
    assert not found.ok.any() and [gap.code for gap in found.gaps] == [Reason.OUT_OF_LIMITS]
    # where the path is at that very value it is followed
    still = cases.path(robot, 20)
    still[:, 2] = 0.0
    held = track(robot.with_limits(limits), robot.fk(still))
    assert held.is_whole and (held.q[:, 2] == 0.0).all()


def test_a_joint_that_runs_into_its_limit_is_named():
    robot = kv.load("kr16")
    ends = np.radians([[0, -70, 60, 20, 40, 0], [0, -70, 60, 20, 40, 720]])
    found = track(robot, robot.fk(straight(*ends)(np.linspace(0, 1, 200))))
    check(robot, found)
    assert found.ok.all() and len(found.gaps) == 1
    gap = found.gaps[0]
    assert gap.code is Reason.OUT_OF_LIMITS and robot.joint_names[5] in gap.text
    # it can turn by 700 degrees
    assert 500 < 720 * gap.barrier / 199 <= 700


def test_a_jump_is_told():
    robot = kv.load("kr16")
    q = cases.path(robot, 40)
    q[20:, 0] += 0.9
    found = track(robot, robot.fk(q))
    assert found.intervals == ((0, 20), (20, 40))
    assert found.gaps[0].code is Reason.STEP and "jumps" in found.gaps[0].text


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


def test_what_a_grid_misses_is_looked_for_before_it_is_called_a_collision():
    robot = kv.load("iiwa14")
    q = np.array([0.2, 0.5, 0.123, -1.2, 0.3, 0.8, 0.1])
    T = np.repeat(robot.fk(q)[None], 30, axis=0)
    T[:, 1, 3] += np.linspace(0.0, 0.1, 30)
    form = kv.Analytic().fit(robot)
    at = form.redundancy_at(q[None])[0]
    assert form.solve_at(T, np.full(30, at)).ok.all()

    def narrow(values):
        return np.abs(form.redundancy_at(np.ascontiguousarray(values)) - at) < 0.03

    found = track(robot, T, keep=narrow)
    assert found.is_whole and narrow(found.q).all()
    check(robot, found)
    # where nothing is found it says what was looked at, not that there is nothing
    none = track(robot, T, keep=lambda values: np.zeros(len(values), bool))
    assert [gap.code for gap in none.gaps] == [Reason.COLLISION]
    assert "looked at" in none.gaps[0].text
    arm = kv.load("kr16")
    none = track(arm, arm.fk(cases.path(arm, 5)), keep=lambda values: np.zeros(len(values), bool))
    assert none.gaps[0].text == Reason.COLLISION.text


def test_what_stands_in_the_way_is_told():
    robot = kv.load("kr16")
    q = cases.path(robot, 50)
    T = robot.fk(q)
    x, y, z = T[25, :3, 3]
    clear = Capsules(robot, 0.03, [[x, y, z, 0.02]], self_collision=False)
    found = track(robot, T, keep=clear)
    check(robot, found)
    assert {gap.code for gap in found.gaps} == {Reason.COLLISION}
    assert clear(found.q[found.ok]).all() and not found.ok[25]


def test_a_predicate_chooses_the_branch():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 30))
    free = track(robot, T)
    side = free.q[:, 4] > 0
    assert side.all() or not side.any()
    other = track(robot, T, keep=lambda q: (q[:, 4] > 0) != side[0])
    assert other.is_whole and ((other.q[:, 4] > 0) != side[0]).all()
    # it sees windings, not only the one nearest the middle of the limits
    high = track(robot, T, keep=lambda q: q[:, 5] > 0)
    assert high.ok.all() and (high.q[:, 5] > 0).all()


def test_a_break_by_a_predicate_is_told():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 30))
    first, second = (kv.solve(robot, T[k]) for k in (10, 20))
    other = int(np.argmax(second.branch != first.branch[0]))
    apart = first.q[0], second.q[other]

    def keep(values):
        # nothing but one branch at sample 10, another one at sample 20
        mask = np.ones(len(values), bool)
        for k, one in zip((10, 20), apart, strict=True):
            there = np.abs(robot.fk(values) - T[k]).max(axis=(1, 2)) < 1e-6
            mask &= ~there | (np.abs(values - one).max(axis=1) < 1e-6)
        return mask

    found = track(robot, T, keep=keep)
    assert found.ok.all() and [gap.code for gap in found.gaps] == [Reason.COLLISION]
    assert found.branch[10] == first.branch[0] and found.branch[20] == second.branch[other]


def test_nothing_at_all_is_an_answer():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 5))
    T[:, 0, 3] += 9.0
    found = track(robot, T)
    assert not found.ok.any() and found.intervals == () and found.cost == 0.0
    assert found.segments() == () and found.largest_step == 0.0
    assert [(g.start, g.end, g.code) for g in found.gaps] == [(0, 5, Reason.OUT_OF_REACH)]


# ---------------------------------------------------------------------------- other solvers
def test_a_search_tracks_what_has_no_closed_form():
    robot = kv.load("kr16")
    q = cases.path(robot, 40)
    found = track(robot, robot.fk(q), solver="numerical")
    assert found.is_whole
    assert found.cost == pytest.approx(track(robot, robot.fk(q)).cost, rel=1e-3)
    general = kv.load("jaco2")
    q = cases.path(general, 30)
    assert track(general, general.fk(q)).is_whole
    # a task with joints to spare
    T = robot.fk(cases.path(robot, 20))
    found = track(robot, T, task="position")
    assert found.is_whole
    assert np.allclose(robot.fk(found.q)[:, :3, 3], T[:, :3, 3], atol=1e-6)
    with pytest.raises(NoClosedForm):
        track(robot, T, solver="analytic", task="position")


def test_a_solver_object_brings_its_task_and_tolerance():
    robot = kv.load("planar3r")
    T = robot.fk(cases.path(robot, 20))
    for solver in (kv.Analytic(task="planar", windings="all"), kv.Numerical(task="planar")):
        assert track(robot, T, solver=solver).is_whole
        assert not solver.is_fitted
    with pytest.raises(InputError, match="task"):
        track(robot, T, solver=kv.Numerical(), task="planar")


@pytest.fixture(scope="module")
def bent():
    """A nominal arm, the real one, and the error model between them."""
    nominal = kv.load("kr16").with_tool(kv.pose([0.05, 0.02, 0.1]))
    real = nominal.with_base(kv.pose([0.002, 0, 0], rpy=[0, 0.002, 0.001]))
    q = nominal.random(60, 1)
    error = calibration.tool_error(nominal, q, real.fk(q)[:, :3, 3])
    return nominal, real, calibration.GeometricErrorModel(nominal).fit(q, error)


def real_errors(real, found):
    """Position errors of the real tool, by the oracle."""
    q, T = found.q[found.ok], found.T[found.ok]
    return np.array(
        [
            oracle.errors("position", t, oracle.robot_fk(real, row))[0]
            for row, t in zip(q, T, strict=True)
        ]
    )


@pytest.mark.parametrize("inner", [kv.Analytic(windings="all"), kv.Numerical(limits="ignore")])
def test_of_a_compensated_arm_the_real_tool_is_tracked(bent, inner):
    nominal, real, model = bent
    solver = calibration.Compensated(inner, model)
    T = nominal.fk(cases.path(nominal, 45))
    found = track(nominal, T, solver=solver)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    assert not solver.is_fitted
    path = Path.polyline([[0.9, -0.2, 1.1], [0.9, 0.2, 1.2]], orientation=TOOL)
    found = track(nominal, path, solver=solver, tolerance=1e-4, samples=10)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    assert found.deviation <= 1e-4 and largest_deviation(real, found, path) < 1.02e-4


def test_a_compensated_arm_passes_singularities_and_is_kept(bent):
    nominal, real, model = bent
    ends = np.radians([[0, -70, 60, 20, 30, 10], [20, -60, 70, 30, -30, 40]])
    T = real.fk(straight(*ends)(np.linspace(0.0, 1.0, 41)))
    solver = calibration.Compensated(kv.Analytic(), model)
    found = track(nominal, T, solver=solver, q_start=ends[0], max_step=0.1)
    assert found.is_whole and real_errors(real, found).max() < 2e-6
    modelled = Motion(solver.clone().fit(nominal).real_fk, straight(*ends))
    between = track(nominal, modelled, solver=solver, q_start=ends[0], samples=40)
    assert between.is_whole and len(set(between.branch)) == 2
    turned = track(nominal, T[:10], solver=solver, keep=lambda q: q[:, 5] > np.pi)
    assert turned.is_whole and (turned.q[:, 5] > np.pi).all()
    assert real_errors(real, turned).max() < 2e-6


def test_what_a_partial_task_costs_does_not_hang_on_where_its_solutions_end(monkeypatch):
    robot = kv.load("kr16")
    path = Path.polyline([[0.9, -0.3, 1.1], [0.9, 0.3, 1.3]], orientation=TOOL)
    spent, follow = [], kv.Numerical.follow

    def counted(solver, T, q_start, rng=None):
        found = follow(solver, T, q_start, rng)
        spent.append((found.stats.evaluations.sum(), len(found.q)))
        return found

    monkeypatch.setattr(kv.Numerical, "follow", counted)
    for task in ("position", "position_axis"):
        spent.clear()
        found = track(robot, path, task=task, samples=200)
        assert found.is_whole
        evaluations, solutions = np.sum(spent, axis=0)
        assert evaluations < 20 * solutions, task
    # however long the path, so many are followed
    spent.clear()
    assert track(robot, path, task="position", samples=30_000).is_whole
    assert sum(solutions for _, solutions in spent) < 30 * 30_000


def test_seven_joints_move_less_with_what_they_have_to_spare():
    robot = kv.load("iiwa14")
    q = cases.path(robot, 60)
    found = track(robot, robot.fk(q))
    check(robot, found)
    assert found.is_whole
    assert found.cost < np.abs(np.diff(q, axis=0)).max(axis=1).sum()
    # steps finer than the grid
    small = track(robot, robot.fk(q), max_step=0.03)
    assert small.is_whole and small.largest_step <= 0.03 + 1e-9


# ---------------------------------------------------------------------------- samples added
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


def largest_deviation(robot, found, path, places=60):
    """By the oracle, joints moving in straight lines."""
    share = np.arange(1, places + 1)[:, None] / (places + 1)
    worst = 0.0
    for a, b, s, t in zip(found.q, found.q[1:], found.s, found.s[1:], strict=False):
        wanted = path(s + share[:, 0] * (t - s))
        reached = [oracle.robot_fk(robot, q)[:3, 3] for q in a + share * (b - a)]
        worst = max(worst, np.linalg.norm(reached - wanted[:, :3, 3], axis=1).max())
    return worst


TOOL = kv.pose([0, 0, 0], rpy=[0.2, 1.7, 0.3])[:3, :3]
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


# ---------------------------------------------------------------------------- bad input
@pytest.fixture(scope="module")
def kr16():
    robot = kv.load("kr16")
    return robot, robot.fk(cases.path(robot, 6))


BAD = [
    ({"metric": "mean"}, "metrics are max, l2, time"),
    ({"metric": "time"}, "max_velocity"),
    ({"max_velocity": 1.0}, "max_velocity"),
    ({"metric": "time", "max_velocity": 0.0}, "max_velocity must be positive"),
    ({"max_step": 0.0}, "max_step must be positive"),
    ({"max_step": [0.1, 0.2]}, "max_step"),
    ({"max_step": np.nan}, "max_step"),
    ({"max_step": 3.5}, "joint1"),
    ({"q_start": np.zeros(5)}, "q_start"),
    ({"q_start": np.zeros((2, 6))}, "q_start"),
    ({"q_start": [9.0, 0, 0, 0, 0, 0]}, "outside its limits"),
    ({"keep": 3}, "keep"),
    ({"keep": lambda q: q}, "keep must return"),
    ({"keep": lambda q: np.ones(3, bool)}, "keep must return"),
    ({"tolerance": 1e-3}, "sample"),
    ({"tolerance": 0.0}, "tolerance must be positive"),
    ({"tolerance": True}, "tolerance must be a number"),
    ({"solver": "magic"}, "unknown solver"),
    ({"solver": kv.Analytic}, "solver"),
    ({"task": "fly"}, "unknown task"),
]


@pytest.mark.parametrize("change, said", BAD)
def test_bad_arguments_are_named(kr16, change, said):
    with pytest.raises(InputError, match=said):
        track(*kr16, **change)


def test_bad_paths_are_named(kr16):
    robot, T = kr16
    with pytest.raises(InputError, match="two poses"):
        track(robot, T[0])
    with pytest.raises(InputError, match="two poses"):
        track(robot, T[:0])
    broken = T.copy()
    broken[3:5, 0, 3] = np.nan
    with pytest.raises(InputError, match=r"path\[3\] \(row 3\).*NaN"):
        track(robot, broken)
    with pytest.raises(InputError, match="rigid|rotation|orthonormal"):
        track(robot, 2.0 * T)
    with pytest.raises(InputError, match="Robot"):
        track("kr16", T)


def test_bad_path_objects_are_named(kr16):
    robot, T = kr16

    class Given:
        def __init__(self, sample, call):
            self.given, self.call = sample, call

        def sample(self, count):
            return self.given

        def __call__(self, s):
            return self.call(s)

    with pytest.raises(InputError, match="increase"):
        track(robot, Samples(T, np.zeros(6)))
    with pytest.raises(InputError, match="s must be"):
        track(robot, Samples(T, np.arange(5.0)))
    with pytest.raises(InputError, match="differs from its samples"):
        track(robot, Given(T, lambda s: np.tile(T[0], (len(s), 1, 1))))
    with pytest.raises(InputError, match="must return"):
        track(robot, Given(T, lambda s: T[0]))


def test_paths_of_the_package_and_their_samples_are_tracked():
    robot = kv.load("kr16")
    start, end = robot.fk(np.radians([[0, -70, 60, 20, 40, 0], [20, -60, 50, 20, 40, 0]]))
    path = Path.line(start, end)
    found = track(robot, path, samples=30)
    assert len(found) == 30 and found.is_whole and found.s[-1] == pytest.approx(path.length)
    same = track(robot, path.sample(count=30))
    assert np.array_equal(same.q, found.q) and np.array_equal(same.s, found.s)
    fine = track(robot, path, samples=5, tolerance=1e-5)
    assert fine.is_whole and fine.deviation <= 1e-5 and len(fine) > 5
    with pytest.raises(InputError, match="tolerance"):
        track(robot, path.sample(count=30), tolerance=1e-5)


def test_limits_without_end_are_refused():
    robot = kv.load("kr16").with_limits(np.tile([-100.0, 100.0], (6, 1)))
    with pytest.raises(InputError, match="windings"):
        track(robot, robot.fk(np.zeros((3, 6))))


def test_answers_are_read_only_and_tell_themselves(kr16):
    robot, T = kr16
    found = track(robot, T)
    with pytest.raises(ValueError):
        found.q[0] = 0.0
    assert "6 of 6 samples" in repr(found) and len(found) == 6
    moved = T.copy()
    moved[2, 0, 3] += 9.0
    assert "OUT_OF_REACH" in repr(track(robot, moved))
    assert T.flags.writeable

"""Where there is no way: what is lost, what is kept, and the reasons."""

import numpy as np

import kinverse as kv
from kinverse.bench import cases
from kinverse.paths import Reason, track
from kinverse.paths.collision import Capsules
from tracked_paths import check, straight


def test_a_joint_path_with_many_gaps_is_printed_in_a_few_lines():
    robot = kv.load("kr16")
    T = robot.fk(cases.path(robot, 40))
    T[1::3, 0, 3] += 9.0
    said = repr(track(robot, T)).splitlines()
    assert len(said) == 7 and said[-1].strip() == "and 8 gaps more"
    assert said[1].strip().startswith("sample 1: OUT_OF_REACH")


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

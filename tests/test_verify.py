"""Verification: against plain NumPy, and its rules one by one."""

import numpy as np
import pytest

import verify_oracle
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.status import Status
from kinverse.task import TASKS
from kinverse.verify import Proposal, Settings, verify

TURN = 2 * np.pi


@pytest.fixture(scope="module")
def wide(planar):
    """The planar arm with joints that turn more than once, and unevenly."""
    return planar.with_limits(np.array([[-7.0, 7.0], [-1.0, 9.0], [-3.0, 3.5]]))


def candidates(robot, q, rng):
    """Truths, truths some turns on, near misses, repetitions, nonsense; in no order."""
    poses, n = q.shape
    rows = [q, q + TURN * rng.integers(-2, 3, q.shape), q + 1e-7, q + rng.normal(0, 1e-3, q.shape)]
    rows += [rng.uniform(-9, 9, q.shape), np.full(q.shape, np.nan), np.full(q.shape, np.inf)]
    index = np.tile(np.arange(poses), len(rows))
    order = rng.permutation(len(index))
    q = np.concatenate(rows)[order]
    return Proposal(q, index[order], branch=rng.integers(-1, 4, len(order)))


@pytest.mark.parametrize("limits", ["hold", "ignore"])
@pytest.mark.parametrize("windings", ["nearest", "all"])
@pytest.mark.parametrize("seeded", [False, True])
@pytest.mark.parametrize(("arm", "task"), [("wide", "planar"), ("puma", "pose")])
def test_native_verification_agrees_with_plain_numpy(arm, task, seeded, windings, limits, request):
    robot = request.getfixturevalue(arm)
    rng = np.random.default_rng(8)
    q = robot.random(7, rng)
    q[5] = robot.limits[:, 1]
    q[6] = robot.limits[:, 1] + 0.1  # out of the limits for sure
    T, q_seed = robot.fk(q), robot.random(7, rng) * 1.5 if seeded else None
    proposal = candidates(robot, q, rng)
    settings = Settings(task, windings=windings, limits=limits)
    s = verify(robot, task, T, proposal, q_seed, settings)
    expected = verify_oracle.verify(
        robot,
        TASKS[task].code,
        T,
        proposal.q,
        proposal.pose_index,
        proposal.branch,
        np.full(7, Status.NOT_FOUND),
        q_seed,
        settings.tol_position,
        settings.tol_rotation,
        windings == "all",
        limits == "ignore",
    )
    assert s.status.tolist() == expected.status.tolist()
    assert s.count.tolist() == expected.count.tolist() and s.count.sum() > 5
    assert np.array_equal(s.branch, expected.branch)
    assert np.allclose(s.q, expected.q, rtol=0, atol=1e-12)
    assert np.allclose(s.position_error, expected.position_error, rtol=0, atol=1e-12)
    assert np.allclose(s.rotation_error, expected.rotation_error, rtol=0, atol=1e-11)


@pytest.mark.parametrize("task", TASKS)
def test_errors_count_the_constrained_components_only(puma, task):
    rng = np.random.default_rng(1)
    q = puma.random(40, rng)
    target = puma.fk(q + rng.normal(0, 0.3, q.shape))
    settings = Settings(task, tol_position=1e3, tol_rotation=1e3, limits="ignore")
    s = verify(puma, task, target, Proposal(q, np.arange(40)), q, settings)
    assert s.ok.all()
    found = puma.fk(s.q)
    for i in range(40):
        far, turned = verify_oracle.errors(TASKS[task].code, target[i], found[i])
        assert s.position_error[i] == pytest.approx(far, abs=1e-12)
        assert s.rotation_error[i] == pytest.approx(turned, abs=1e-9)


def one(robot, q, candidate, q_seed=None, hint=None, **settings):
    """Verify one or more candidates for the pose where the joint values q lead."""
    rows = np.atleast_2d(candidate)
    T = robot.fk(np.atleast_2d(q))
    near = None if q_seed is None else np.atleast_2d(q_seed)
    proposal = Proposal(rows, np.zeros(len(rows), int), np.arange(len(rows)), hint)
    return verify(robot, settings.get("task", "pose"), T, proposal, near, Settings(**settings))


def test_limits_have_a_slack_of_a_nanometre_and_are_never_left(planar):
    robot = planar.with_limits(np.tile([-1.0, 1.0], (3, 1)))
    top = robot.limits[:, 1]
    just = one(robot, top, top + 0.5e-9)
    assert just.ok.all() and np.array_equal(just.q[0], top)
    over = one(robot, np.full(3, 1.0 + 1e-8), np.full(3, 1.0 + 1e-8), tol_position=1e-12)
    assert over.status[0] == Status.OUT_OF_LIMITS and len(over.q) == 0
    free = one(robot, np.full(3, 2.0), np.full(3, 2.0), limits="ignore")
    assert free.ok.all() and np.allclose(free.q, 2.0)


def test_the_nearest_winding_is_inside_the_limits_if_any_is(wide):
    q = np.array([-6.0, 8.0, 0.0])
    for turns in (-2, 0, 3):
        near = one(wide, q, q + TURN * turns, q_seed=[9.0, -9.0, 0.0])
        assert np.allclose(near.q, [-6.0 + 2 * TURN, 8.0 - TURN, 0.0], atol=1e-12)
        middle = one(wide, q, q + TURN * turns)
        assert np.allclose(middle.q, [-6.0 + TURN, 8.0 - TURN, 0.0], atol=1e-12)
    every = one(wide, q, q, windings="all")
    assert len(every.q) == 3 * 2 and len(np.unique(every.q.round(6), axis=0)) == 6
    assert (np.abs(every.q - wide.limits.mean(axis=1)) <= np.ptp(wide.limits, axis=1) / 2).all()


def test_slides_do_not_wind():
    robot = Robot.from_dh(a=0, d=0, alpha=0, joints="PR", limits=[[-20, 20], [-3, 3]])
    s = one(robot, [9.0, 1.0], [[9.0, 1.0], [9.0 - TURN, 1.0], [9.0, 1.0 + TURN]], windings="all")
    assert np.allclose(s.q, [[9.0, 1.0]])


def test_only_whole_mimic_ratios_wind():
    def arm(multiplier):
        frames = np.tile(np.eye(4), (3, 1, 1))
        frames[1:, 0, 3] = 0.3
        return Robot(frames, "RR", [[-9, 9]], source=[0, 0], multiplier=[1.0, multiplier])

    q = np.array([1.0])
    assert np.allclose(one(arm(-2.0), q, q + TURN, q_seed=[0.0]).q, q)
    half = one(arm(0.5), q, q + TURN, q_seed=[0.0])
    assert not half.ok.any()
    assert np.allclose(one(arm(0.5), q + TURN, q + TURN, q_seed=[0.0]).q, q + TURN)


def test_alike_is_closer_than_a_millionth_turn_or_not(wide):
    q = np.array([0.3, 0.4, 0.5])
    rows = np.array([q, q + 3e-7, q + 2e-6, q - TURN * np.array([1, 0, 0])])
    s = one(wide, q, rows, tol_position=1e-3, tol_rotation=1e-3)
    assert s.branch.tolist() == [0, 2]


def test_order_is_by_seed_distance_else_by_branch(wide):
    q = np.array([0.3, 0.4, 0.5])
    rows = q + np.array([3e-4, -1e-4, 2e-4])[:, None]
    loose = {"tol_position": 1e-2, "tol_rotation": 1e-2}
    assert one(wide, q, rows, **loose).branch.tolist() == [0, 1, 2]
    assert one(wide, q, rows, q_seed=q, **loose).branch.tolist() == [1, 2, 0]


def test_a_hint_is_believed_only_where_nothing_was_found(planar):
    q = np.array([0.3, 0.4, 0.5])
    hint = np.array([Status.UNREACHABLE])
    assert one(planar, q, q + 1e-3, hint=hint).status[0] == Status.UNREACHABLE
    assert one(planar, q, q, hint=hint).status[0] == Status.SOLVED
    tight = planar.with_limits(np.tile([-0.1, 0.1], (3, 1)))
    assert one(tight, q, q, hint=hint).status[0] == Status.OUT_OF_LIMITS
    missed = one(planar, q, [q + 1e-2, q + 1e-4, q + 1e-3])
    assert missed.status[0] == Status.NOT_FOUND
    assert np.allclose(missed.stats.best_q[0], q + 1e-4)
    found = planar.fk(q + 1e-4)[:3, 3] - planar.fk(q)[:3, 3]
    assert missed.stats.best_position_error[0] == pytest.approx(np.linalg.norm(found), abs=1e-15)


def test_without_candidates_nothing_is_known(planar):
    T = planar.fk(planar.random(3))
    s = verify(planar, "pose", T, Proposal(np.zeros((0, 3)), np.zeros(0, int)))
    assert s.status.tolist() == [Status.NOT_FOUND] * 3
    assert np.isnan(s.stats.best_q).all() and np.isnan(s.stats.best_position_error).all()
    empty = verify(planar, "pose", T[:0], Proposal(np.zeros((0, 3)), np.zeros(0, int)))
    assert len(empty) == 0 and empty.q.shape == (0, 3)


def test_errors_are_measured_to_the_nearest_rotation(puma):
    rng = np.random.default_rng(2)
    q = puma.random(20, rng)
    T = puma.fk(q)
    printed = T.copy()
    printed[:, :3, :3] = T[:, :3, :3].round(6)
    s = verify(puma, "pose", printed, Proposal(q, np.arange(20)), q, Settings())
    # six digits move a rotation by less than 1e-6, the distance from orthogonal counts for nothing
    assert s.ok.all()
    u, _, vt = np.linalg.svd(printed[:, :3, :3])
    c = np.clip(
        (np.trace(T[:, :3, :3] @ (u @ vt).transpose(0, 2, 1), axis1=1, axis2=2) - 1) / 2, -1, 1
    )
    assert np.allclose(s.rotation_error, np.arccos(c), atol=3e-8)


@pytest.mark.parametrize("value", [1e9, 1e17, 1e300, -1e300, np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("windings", ["nearest", "all"])
def test_wild_candidates_do_no_harm(wide, value, windings):
    q = np.array([0.3, 0.4, 0.5])
    s = one(wide, q, [np.full(3, value), q], windings=windings)
    assert s.ok.all() and np.isfinite(s.q).all()
    assert set(s.branch.tolist()) == {1}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q": np.zeros((2, 4))}, r"Proposal.q must have shape \(2, 3\)"),
        ({"pose_index": [0]}, r"pose_index must have shape \(2,\)"),
        ({"pose_index": [0, 2]}, r"pose_index must lie in 0..1"),
        ({"pose_index": [-1, 0]}, r"pose_index must lie in 0..1"),
        ({"branch": [1]}, r"branch must have shape \(2,\)"),
        ({"hint": [3]}, r"hint must have shape \(2,\)"),
        ({"hint": [3, 0]}, "UNREACHABLE or NOT_FOUND"),
        ({"hint": [1, 99]}, "UNREACHABLE or NOT_FOUND"),
        ({"evaluations": [1, 2, 3]}, r"evaluations must have shape \(2,\)"),
        ({"singular": [True]}, r"singular must have shape \(2,\)"),
    ],
)
def test_proposals_that_do_not_fit_are_refused(planar, changes, message):
    T = planar.fk(np.zeros((2, 3)))
    proposal = Proposal(**{"q": np.zeros((2, 3)), "pose_index": [0, 1], **changes})
    with pytest.raises(InputError, match=message):
        verify(planar, "pose", T, proposal)


def test_the_solver_counts_its_own_evaluations(planar):
    T = planar.fk(np.zeros((2, 3)))
    given = Proposal(np.zeros((2, 3)), [0, 1], evaluations=[5, 6], singular=[True, False])
    s = verify(planar, "pose", T, given)
    assert s.stats.evaluations.tolist() == [5, 6] and s.stats.continuum.tolist() == [True, False]


def test_place_does_not_change_a_bit(puma):
    rng = np.random.default_rng(3)
    q = puma.random(50, rng)
    T, proposal = puma.fk(q), candidates(puma, q, rng)

    def bits(s):
        return s.q.tobytes(), s.position_error.tobytes(), s.rotation_error.tobytes()

    whole = verify(puma, "pose", T, proposal)
    for i in (0, 17, 49):
        mine = proposal.pose_index == i
        alone = Proposal(proposal.q[mine], np.zeros(mine.sum(), int), proposal.branch[mine])
        assert bits(verify(puma, "pose", T[i : i + 1], alone)) == bits(whole[i])

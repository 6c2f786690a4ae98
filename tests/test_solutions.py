import copy
import pickle
import time

import numpy as np
import pytest

from kinverse.errors import InputError, NoSolution
from kinverse.solutions import Origin, Solutions, Status
from kinverse.table import Table, merged, plain_evidence
from kinverse.task import TASKS, as_task

N, DOF = 5, 3
COUNT = np.array([2, 0, 3, 0, 1])


def table(count=COUNT, seed=0):
    rng = np.random.default_rng(seed)
    rows, poses = int(count.sum()), len(count)
    status = np.where(count > 0, 0, np.arange(poses) % 3 + 1).astype(np.uint8)
    return Table(
        q=rng.uniform(-3, 3, (rows, DOF)),
        pose_index=np.repeat(np.arange(poses), count),
        position_error=rng.random(rows) * 1e-9,
        rotation_error=rng.random(rows) * 1e-9,
        branch=np.concatenate([np.arange(c) for c in count] + [[]]).astype(np.int32),
        status=status,
        count=count.astype(np.int64),
        singular=np.zeros(poses, bool),
        evaluations=np.arange(poses),
        iterations=np.full(poses, -1),
        starts=np.full(poses, -1),
        stop=np.full(poses, -1),
        cost=np.full(poses, np.nan),
        best_q=rng.uniform(-3, 3, (poses, DOF)),
        best_position_error=np.where(np.arange(poses) == 3, np.nan, 0.25),
        best_rotation_error=np.where(np.arange(poses) == 3, np.nan, 0.5),
        evidence=plain_evidence("search", poses),
    )


@pytest.fixture
def s(planar):
    return Solutions(table(), Origin(planar, as_task("planar"), ("elbow up", "elbow down")))


def same(one, other):
    for name in ("q", "pose_index", "position_error", "rotation_error", "branch", "status"):
        a, b = getattr(one, name), getattr(other, name)
        assert a.dtype == b.dtype and a.tobytes() == b.tobytes(), name
    return True


def test_indexing_is_a_partition_of_the_rows(s):
    parts = list(s)
    assert len(s) == len(parts) == N
    assert same(s[:], s)
    assert np.array_equal(np.concatenate([p.q for p in parts]), s.q)
    for i, part in enumerate(parts):
        assert len(part) == 1 and part.count[0] == COUNT[i] == len(part.q)
        assert not part.pose_index.any()
        assert same(part, s[i - N]) and same(part, s[i : i + 1]) and same(part, s[np.int64(i)])
        assert np.array_equal(part.q, s.q[s.pose_index == i])
    assert same(s[1:4][1], s[2])
    assert len(s[3:1]) == len(s[9:]) == 0


@pytest.mark.parametrize("index", [N, -N - 1])
def test_indexing_outside_is_an_index_error(s, index):
    with pytest.raises(IndexError, match=f"pose {index} of {N}"):
        s[index]


def test_other_indices_are_refused(s):
    with pytest.raises(InputError, match="step 1"):
        s[::2]
    with pytest.raises((TypeError, AttributeError)):
        s["0"]


def test_nearest_is_the_least_largest_joint_distance(s):
    q = np.array([0.3, -0.2, 1.0])
    near = s.nearest(q)
    assert near.shape == (N, DOF)
    assert np.isnan(near[~s.ok]).all() and not np.isnan(near[s.ok]).any()
    for i in np.flatnonzero(s.ok):
        away = np.abs(s[i].q - q).max(axis=1)
        assert np.abs(near[i] - q).max() == away.min()
    each = np.tile(q, (N, 1))
    assert np.array_equal(s.nearest(each), near, equal_nan=True)


@pytest.mark.parametrize("rule", ["nearest", "least_motion", "mid_limits", "manipulability"])
def test_select_keeps_at_most_one_of_each_pose(s, rule):
    one = s.select(rule)
    assert np.array_equal(one.count, np.minimum(s.count, 1))
    assert np.array_equal(one.status, s.status)
    rows = {tuple(row) for row in s.q}
    assert all(tuple(row) in rows for row in one.q)
    assert same(one.select(rule), one)


def test_select_rules_are_optimal(s, planar):
    low, high = planar.limits.T
    share = np.abs(2 * s.q - low - high) / (high - low)
    J = planar.jacobian(s.q)[:, [0, 1, 5]]
    measures = {"mid_limits": share.max(axis=1), "manipulability": -np.abs(np.linalg.det(J))}
    for rule, score in measures.items():
        chosen = s.select(rule).q
        best = [s.q[s.pose_index == i][score[s.pose_index == i].argmin()] for i in (0, 2, 4)]
        assert np.array_equal(chosen, best), rule


def test_least_motion_equals_brute_force(planar):
    from itertools import product

    s = Solutions(table(np.array([3, 2, 0, 3, 1, 2]), 4), Origin(planar, as_task("planar"), ()))
    start = np.array([1.0, -2.0, 0.5])
    groups = [one.q for one in s if len(one.q)]
    for q in (None, start):
        lead = [] if q is None else [q]

        def length(path, lead=lead):
            return np.abs(np.diff(np.array([*lead, *path]), axis=0)).max(axis=1).sum()

        assert length(s.select("least_motion", q).q) == min(map(length, product(*groups)))


@pytest.mark.parametrize("rule", [["x"], None, {}])
def test_rules_that_are_no_text_are_refused_alike(s, rule):
    with pytest.raises(InputError, match="unknown rule.*nearest, least_motion"):
        s.select(rule)


def test_unknown_rule_names_the_rules(s):
    with pytest.raises(InputError, match="nearest, least_motion, mid_limits, manipulability"):
        s.select("closest")


@pytest.mark.parametrize("q", [np.zeros(DOF + 1), np.zeros((N + 1, DOF)), np.full(DOF, np.nan)])
def test_a_reference_of_another_shape_is_refused(s, q):
    with pytest.raises(InputError, match="q must"):
        s.nearest(q)


def test_filter_keeps_what_holds_and_statuses_honest(s):
    kept = s.filter(lambda q: q[:, 0] > 0)
    assert (kept.q[:, 0] > 0).all() and len(kept.q) == (s.q[:, 0] > 0).sum()
    assert np.array_equal(kept.ok, kept.count > 0)
    none = s.filter(lambda q: np.zeros(len(q), bool))
    # lost by the filter: not found; the others keep their own reason
    assert (none.status[s.ok] == Status.NOT_FOUND).all()
    assert np.array_equal(none.status[~s.ok], s.status[~s.ok])
    assert np.array_equal(none.stats.best_q, s.stats.best_q)
    assert same(s.filter(lambda q: np.ones(len(q), bool)), s)
    # nothing to ask about: the predicate is not called
    assert len(none.filter(lambda q: 1 / 0)) == N


@pytest.mark.parametrize("mask", [True, np.ones(3, bool), np.ones(6), np.arange(6)])
def test_filter_refuses_what_is_no_mask(s, mask):
    with pytest.raises(InputError, match=r"\(6,\) of bool"):
        s.filter(lambda q: mask)


def test_padded_holds_every_solution_in_place(s):
    block, filled = s.padded()
    assert block.shape == (N, 3, DOF) and np.array_equal(filled.sum(axis=1), s.count)
    assert np.array_equal(block[filled], s.q) and np.isnan(block[~filled]).all()
    assert np.array_equal(block[2, 1], s[2].q[1])
    block, filled = s[1:2].padded()
    assert block.shape == (1, 0, DOF) and filled.shape == (1, 0)


def test_raise_if_none_names_the_poses_and_how_near_they_came(s):
    assert s[0].raise_if_none().q.shape == (2, DOF)
    with pytest.raises(NoSolution) as error:
        s.raise_if_none()
    text = str(error.value)
    assert "2 of 5 poses" in text and "planar3r" in text
    assert "pose 1: UNREACHABLE" in text and "off by 0.25 m, 0.5 rad" in text
    assert "pose 3: OUT_OF_LIMITS" in text and "nan" not in text


def test_raise_if_none_is_short_for_many_poses(planar):
    many = Solutions(table(np.zeros(1000, int)), Origin(planar, as_task("pose"), ()))
    with pytest.raises(NoSolution, match="and 995 more"):
        many.raise_if_none()


def test_repr_tells_a_newcomer_what_came_out(s):
    assert "5 poses, 6 solutions of planar3r" in repr(s)
    assert "SOLVED 3, OUT_OF_LIMITS 1, UNREACHABLE 1" in repr(s)
    assert "worst error" in repr(s)
    assert "SOLVED: at least one" in repr(s[0]) and "elbow down" in repr(s[0])
    assert "UNREACHABLE: shown that" in repr(s[1])
    assert repr(s[:0]).startswith("Solutions: 0 poses, 0 solutions")


def test_solutions_are_frozen(s):
    for name in ("q", "status", "ok", "anything"):
        with pytest.raises(AttributeError):
            setattr(s, name, None)
    for name in ("q", "pose_index", "branch", "status", "count"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(s, name)[...] = 0


def test_solutions_pickle_and_copy(s):
    assert same(pickle.loads(pickle.dumps(s)), s)
    twin = copy.deepcopy(s)
    assert same(twin, s) and twin.robot == s.robot and twin.branch_labels == s.branch_labels


def test_stats_and_intervals_have_a_row_a_pose(s):
    stats = s.stats
    assert stats.best_q.shape == (N, DOF)
    for name in ("evaluations", "singular", "best_position_error"):
        assert getattr(stats, name).shape == (N,)
    basis = stats.evidence.basis
    assert basis.tolist() == ["measured", "shown", "measured", "measured", "measured"]
    assert all(len(column) == 0 for column in s.intervals)


def test_merged_puts_parts_back_in_order():
    whole = table()
    from kinverse.table import taken

    parts = [(taken(whole, a, b), np.arange(a, b)) for a, b in ((3, 5), (0, 2), (2, 3))]
    again = merged(parts, N)
    for name in Table.__slots__:
        one, other = getattr(again, name), getattr(whole, name)
        if one.dtype.names:
            one, other = np.array(one.tolist()), np.array(other.tolist())
        assert np.array_equal(one, other, equal_nan=True), name


def test_status_texts_and_tasks():
    assert [status.name for status in Status] == [
        "SOLVED",
        "OUT_OF_LIMITS",
        "UNREACHABLE",
        "NOT_FOUND",
    ]
    assert len({status.text for status in Status}) == 4
    assert [task.code for task in TASKS.values()] == list(range(5))
    assert [task.size for task in TASKS.values()] == [6, 3, 5, 3, 4]
    with pytest.raises(InputError, match="pose, position, position_axis, planar, schoenflies"):
        as_task("poses")


@pytest.mark.parametrize("name", TASKS)
def test_constrained_rows_match_the_size(name, puma):
    q = puma.random(4, rng=2)
    task = as_task(name)
    assert task.constrained(puma.jacobian(q), puma.fk(q)).shape == (4, task.size, 6)


def test_position_axis_is_blind_to_the_turn_about_the_tool_axis(puma):
    q = puma.random(5, rng=3)
    T = puma.fk(q)
    about_tool = np.zeros((5, 6, 1))
    about_tool[:, 3:, 0] = T[:, :3, 2]
    assert np.abs(as_task("position_axis").constrained(about_tool, T)).max() < 1e-15


@pytest.mark.slow
def test_a_result_costs_next_to_nothing(planar):
    rows, origin = table(), Origin(planar, as_task("planar"), ())

    def best(call, times=20000):
        spent = []
        for _ in range(5):
            start = time.perf_counter()
            for _ in range(times):
                call()
            spent.append((time.perf_counter() - start) / times)
        return min(spent)

    s = Solutions(rows, origin)
    assert best(lambda: Solutions(rows, origin)) < 1e-6
    assert best(lambda: s.q) - best(lambda: rows.q) < 0.3e-6

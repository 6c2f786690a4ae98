"""What an answer rests on goes with it, whatever is done to the answer."""

import pickle

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import arms, cases
from kinverse.solutions import Origin, Solutions
from kinverse.status import METHODS, Status
from kinverse.table import merged
from test_general_6r import apart, poses_of, search

FIELDS = ("basis", "method", "real_roots", "complex_roots", "root_gap", "root_margin", "weak")


@pytest.fixture(scope="module")
def solved():
    """Poses in and around the workspace: solved, out of limits, unreachable and open ones."""
    robot = kv.load("jaco2")
    _, T = poses_of(robot, 300, seed=21)
    T[:, :3, 3] *= np.linspace(0.2, 2.5, 300)[:, None]
    s = kv.Analytic().fit(robot).solve(T)
    assert (np.bincount(s.status, minlength=4)[:3] > 5).all()
    return robot, T, s


def assert_rows(part, whole, rows):
    for name in FIELDS:
        a, b = getattr(part, name), getattr(whole, name)[rows]
        assert a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f"), name


def test_slices_copies_and_parts_put_together_keep_it(solved):
    _, _, s = solved
    whole = s.stats.evidence
    assert_rows(s[40:90].stats.evidence, whole, slice(40, 90))
    assert_rows(s[-1].stats.evidence, whole, slice(299, 300))
    assert_rows(pickle.loads(pickle.dumps(s)).stats.evidence, whole, slice(None))
    assert_rows(s.select("nearest", np.zeros(6)).stats.evidence, whole, slice(None))
    assert_rows(s[:20].filter(lambda q: q[:, 0] > 0).stats.evidence, s[:20].stats.evidence, ...)
    order = np.random.default_rng(0).permutation(300)
    parts = [(s[int(i)]._table, np.array([i])) for i in order]
    origin = Origin(s.robot, kv.task.as_task("pose"), ())
    assert_rows(Solutions(merged(parts, 300), origin).stats.evidence, whole, slice(None))


def test_every_way_to_the_same_answer_gives_the_same(solved):
    robot, T, s = solved
    checked = kv.Analytic().fit(robot)
    checked._fused = None
    assert_rows(checked.solve(T).stats.evidence, s.stats.evidence, slice(None))
    every = kv.Analytic(windings="all").fit(robot).solve(T)
    assert_rows(every.stats.evidence, s.stats.evidence, slice(None))


def test_unreachable_rests_on_bounds_or_on_roots_complex_by_the_margin(solved):
    _, T, s = solved
    e = s.stats.evidence
    out = s.status == Status.UNREACHABLE
    assert set(e.method[out]) == {"bounds", "elimination"} and not e.weak[out].any()
    rooted = out & (e.method == "elimination")
    assert (e.real_roots[rooted] == 0).all() and (e.complex_roots[rooted] == 16).all()
    assert (e.root_margin[rooted] > 0.02).all() and (e.basis[out] == "shown").all()
    assert (e.real_roots[out & ~rooted] == -1).all()
    # what is not shown is not said
    unsure = (s.count == 0) & (e.weak | ~(e.root_margin > 0.02)) & (e.method != "bounds")
    assert not (unsure & out).any()


def test_where_an_elimination_is_weak_a_search_adds_what_it_can():
    # near a pose at which two solutions meet the elimination cannot count them for sure
    robot = arms.random_arm(6)
    T = robot.fk(cases.rank_deficient(robot, 40))
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    weak = s.stats.evidence.weak
    assert weak.mean() > 0.9 and s.ok.all()
    # the search costs starts of its own, and nothing of what it could find is missing
    assert s.stats.evaluations[weak].min() >= 64 > s.stats.evaluations[~weak].max(initial=0)
    for i in np.flatnonzero(weak)[:6]:
        for row in search(robot, T[i], 200, seed=int(i)):
            assert apart(robot, s[int(i)].q, row).min() < 1e-3


def test_each_family_names_its_method():
    for name, method in [("kr16", "closed form"), ("xarm6", "elimination"), ("iiwa14", "sweep")]:
        robot = kv.load(name)
        T = robot.fk(robot.random(5, rng=1))
        e = kv.Analytic().fit(robot).solve(T).stats.evidence
        assert (e.method == method).all() and e.weak.all() == (method == "sweep")
        far = kv.Analytic().fit(robot).solve(kv.pose([9, 0, 0])).stats.evidence
        assert far.method.tolist() == ["bounds"] and not far.weak[0]
    robot = kv.load("kr16")
    searched = kv.Numerical().fit(robot).solve(robot.fk(robot.random(3, rng=2)))
    assert (searched.stats.evidence.method == "search").all() and searched.stats.evidence.weak.all()
    short = kv.Robot.from_dh([0.2, 0.3, 0.1], 0.1, [0.5, 1.0, 0.3], joints="RRR", name="short")
    e = kv.Analytic().fit(short).solve(short.fk(short.random(5, rng=3))).stats.evidence
    assert (e.method == "elimination").all() and (e.real_roots > 0).all()


def test_a_pose_that_falls_through_has_the_evidence_of_its_answer():
    robot = arms.random_arm(6).with_limits([(-0.5, 0.5)] * 6)
    T = robot.fk(robot.random(3, rng=4))

    class Blind(kv.Solver):
        def _propose(self, T, q_seed, seed):
            return kv.verify.Proposal(np.empty((0, 6)), np.empty(0, np.int64))

        def __init__(
            self,
            *,
            task="pose",
            tol_position=1e-6,
            tol_rotation=1e-6,
            windings="nearest",
            limits="hold",
        ):
            self.task, self.tol_position, self.tol_rotation = task, tol_position, tol_rotation
            self.windings, self.limits = windings, limits

    both = kv.FirstOf([Blind(), kv.Analytic()]).fit(robot).solve(T)
    assert (both.stats.evidence.method == "elimination").all() and both.ok.all()
    none = kv.FirstOf([Blind(), Blind()]).fit(robot).solve(T).stats.evidence
    assert (none.method == "search").all() and none.weak.all()


def test_it_says_itself_in_words(solved):
    _, _, s = solved
    e = s.stats.evidence
    assert len(e) == 300 and len(str(e).splitlines()) == 300
    for i in (0, 150, 299):
        assert e[i].split(":")[0].split(",")[0] in METHODS and e[i] in repr(s[i].stats.evidence)
    i = int(np.argmax(e.real_roots > 1))
    assert f"{e.real_roots[i]} real and {e.complex_roots[i]} complex roots" in e[i]
    assert "300 poses" in repr(e) and "weak" in repr(e)

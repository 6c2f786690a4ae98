import pickle

import numpy as np
import pytest

from fakes import Formless, Newton, Says
from kinverse.errors import InputError, NoClosedForm
from kinverse.solvers import FirstOf, Seeded
from kinverse.solvers.analytic import Analytic
from kinverse.solvers.numerical import Numerical
from kinverse.status import Status

TRUE = np.array([0.4, -0.9, 0.7])


@pytest.fixture(scope="module")
def T(planar):
    """Three poses, x > 0, x < 0 and x > 0; the first is where the joint values TRUE lead."""
    q = np.array([TRUE, TRUE + [np.pi - 0.5, 0, 0], TRUE + [0.1, 0, 0]])
    return planar.fk(q)


def bits(s):
    return [getattr(s._table, name).tobytes() for name in ("q", "pose_index", "branch", "status")]


def test_a_final_word_does_not_fall_through(planar, T):
    newton = Newton("planar")
    s = FirstOf([Says(Status.UNREACHABLE, task="planar"), newton]).fit(planar).solve(T)
    assert s.status.tolist() == [Status.UNREACHABLE] * 3 and len(s.q) == 0
    tight = planar.with_limits(np.tile([-0.1, 0.1], (3, 1)))
    s = FirstOf([Says(rows=[TRUE], task="planar"), newton]).fit(tight).solve(T[:1])
    assert s.status[0] == Status.OUT_OF_LIMITS and len(s.q) == 0
    assert s.stats.evaluations[0] == 7


def test_only_open_poses_fall_through(planar, T):
    denies = Says(Status.UNREACHABLE, task="planar", everywhere=False)
    newton = Newton("planar")
    s = FirstOf([denies, newton]).fit(planar).solve(T)
    alone = newton.clone().fit(planar).solve(T)
    assert s.status.tolist() == [0, Status.UNREACHABLE, 0]
    for i in (0, 2):
        assert bits(s[i]) == bits(alone[i])
    # what was spent is what both spent
    assert np.array_equal(s.stats.evaluations, [7, 7, 7] + alone.stats.evaluations * [1, 0, 1])


def test_a_solver_without_closed_form_is_passed_over(planar, T):
    solver = FirstOf([Formless(task="planar"), Newton("planar")]).fit(planar)
    assert [type(child) for child in solver.solvers_] == [Newton]
    assert bits(solver.solve(T)) == bits(Newton("planar").fit(planar).solve(T))
    with pytest.raises(NoClosedForm, match="planar3r"):
        FirstOf([Formless(), Formless()]).fit(planar)


def test_branches_of_later_solvers_follow_and_keep_their_labels(planar, T):
    first = Says(rows=[TRUE], task="planar", label="told")
    second = Says(rows=[TRUE + [0.1, 0, 0], TRUE], task="planar", label="guessed")
    s = FirstOf([first, second]).fit(planar).solve(T)
    assert s.branch_labels == ("told", "guessed")
    assert s.status.tolist() == [0, 3, 0]
    assert [s.branch_labels[b] for b in s.branch] == ["told", "guessed"]


def test_an_open_pose_keeps_the_best_candidate_of_all(planar, T):
    near, far = Says(rows=[TRUE + 1e-3], task="planar"), Says(rows=[TRUE + 0.5], task="planar")
    for order in ([near, far], [far, near]):
        s = FirstOf(order).fit(planar).solve(T[:1])
        assert s.status[0] == Status.NOT_FOUND
        assert np.allclose(s.stats.best_q[0], TRUE + 1e-3)
    nothing = FirstOf([Says(task="planar"), Says(task="planar")]).fit(planar).solve(T)
    assert np.isnan(nothing.stats.best_q).all() and (nothing.status == Status.NOT_FOUND).all()


def test_a_batch_through_several_solvers_is_its_single_poses(planar, T):
    solver = FirstOf([Says(rows=[TRUE], task="planar"), Newton("planar", starts=2)]).fit(planar)
    for q_seed in (None, TRUE + 0.2):
        s = solver.solve(T, q_seed)
        assert s.ok.all()
        for i in range(3):
            assert bits(s[i]) == bits(solver.solve(T[i], q_seed))
    assert len(solver.solve(T[:0])) == 0


def test_the_first_answer_is_passed_on_without_copying(planar, T):
    solver = FirstOf([Says(task="planar"), Says(task="planar")]).fit(planar)
    table = Newton("planar").fit(planar).solve(T)._table
    calls = []

    def fused(T, q_seed, seed):
        calls.append(seed)
        return table

    solver.solvers_[0]._fused = fused
    solver._bind()
    assert solver.solve(T, rng=9)._table is table and calls == [9]


def test_children_are_cloned(planar, T):
    newton = Newton("planar")
    solver = FirstOf([Says(task="planar"), newton]).fit(planar)
    assert solver.solvers_[1] is not newton and not newton.is_fitted
    clone = solver.clone()
    assert clone == solver and clone.solvers[1] is not newton and not clone.is_fitted
    assert bits(pickle.loads(pickle.dumps(solver)).solve(T)) == bits(solver.solve(T))


@pytest.mark.parametrize(
    ("children", "message"),
    [
        ([], "list of solvers"),
        (None, "list of solvers"),
        ([Newton("planar"), Newton("position")], "one task, got planar, position"),
        ([Newton], "not a class"),
        (["analytic"], "solver objects"),
        ([Newton("plane")], "unknown task"),
    ],
)
def test_wrong_children_are_refused_at_fit(planar, children, message):
    with pytest.raises(InputError, match=message):
        FirstOf(children).fit(planar)


def test_seeded_refines_every_candidate_and_verifies_once(planar, T):
    rough = Says(rows=[TRUE + 0.02, [1.1, 0.9, -0.7]], task="planar", label="rough")
    s = Seeded(rough, Newton("planar")).fit(planar).solve(T[0])
    assert s.ok.all() and np.abs(s.q - TRUE).max(axis=1).min() < 1e-6
    assert s.branch_labels == ("rough",)
    assert not rough.clone().fit(planar).solve(T[0]).ok.any()
    # the answer is the refining solver's in tolerance: a coarse one may stop early
    assert (s.position_error <= 1e-6).all()


def test_seeded_leaves_the_first_solvers_word_where_it_has_no_candidate(planar, T):
    s = Seeded(Says(Status.UNREACHABLE, task="planar"), Newton("planar")).fit(planar).solve(T)
    assert (s.status == Status.UNREACHABLE).all()


def test_seeded_needs_a_solver_that_can_be_seeded(planar):
    with pytest.raises(InputError, match="Says cannot start"):
        Seeded(Newton(), Says()).fit(planar)
    with pytest.raises(InputError, match="one task"):
        Seeded(Says(task="planar"), Newton()).fit(planar)


def test_wrappers_nest(planar, T):
    refined = Seeded(Says(rows=[TRUE + 0.02], task="planar"), Newton("planar"))
    s = FirstOf([refined, FirstOf([Newton("planar")])]).fit(planar).solve(T)
    assert s.ok.all()
    assert "Seeded(first=Says(" in repr(FirstOf([refined]))


def test_any_buffer_falls_through(puma):
    """The native call of the first solver takes buffers of numbers that are no arrays."""
    solver = FirstOf([Analytic(), Says(status=3)]).fit(puma)
    T = np.stack([np.eye(4), puma.fk(np.full(6, 0.3))])
    T[0, :3, 3] = [0.0, 0.0, 1.0]
    q_seed = np.tile(np.linspace(0.1, 0.6, 6), (2, 1))
    solver.solvers_[0]._fused = lambda *call: Says(status=3).fit(puma).solve(T)._table
    solver._bind()
    expected = solver.solve(T, q_seed)
    for given, near in ((memoryview(T), memoryview(q_seed)), (array_of(T), q_seed[0].tolist())):
        s = solver.solve(given, near)
        assert s.status.tolist() == expected.status.tolist() == [3, 3]
        assert s.stats.evaluations.tolist() == [14, 14]


def array_of(T):
    """Something with the shape of poses in a type that is not float64."""
    return T.astype(np.float32)


def test_seeded_refuses_a_refiner_that_counts_from_the_seed(planar):
    near = Numerical(task="planar", max_joint_distance=0.2)
    with pytest.raises(InputError, match="max_joint_distance of Numerical.*first solver or leave"):
        Seeded(Newton("planar"), near).fit(planar)
    # as the first solver it may count, and says at once when there is no seed
    solver = Seeded(near, Numerical(task="planar")).fit(planar)
    with pytest.raises(InputError, match="max_joint_distance is counted from q_seed"):
        solver.solve(planar.fk(TRUE))
    assert solver.solve(planar.fk(TRUE), TRUE + 0.1).ok.all()


@pytest.mark.parametrize("first", [Newton("planar", starts=2), Numerical(task="planar")])
def test_a_later_solver_that_needs_a_seed_says_so_at_once(planar, T, first):
    near = Numerical(task="planar", max_joint_distance=0.2)
    for solver in (FirstOf([first, near]), FirstOf([first, FirstOf([first, near])])):
        solver.fit(planar)
        assert first.clone().fit(planar).solve(T).ok.all()  # nothing falls through
        with pytest.raises(InputError, match="max_joint_distance is counted from q_seed"):
            solver.solve(T)
        assert solver.solve(T, TRUE).ok.all()

import sys

import numpy as np
import pytest

from fakes import Newton, Says
from kinverse import kernels
from kinverse.conformance import CHECKS, check_solver, make_case, widened
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solve import solve
from kinverse.solvers import FirstOf, Proposal, Seeded, Solver, make_solver, solver_names
from kinverse.solvers.numerical import Numerical

FAKES = {
    "newton": (Newton("planar", starts=2, steps=25), "planar"),
    "newton, all windings": (Newton("planar", starts=2, windings="all"), "planar"),
    "newton, no limits": (Newton("position", starts=2, limits="ignore"), "planar"),
    "says": (Says(rows=[[0.1, 0.2, 0.3]], task="planar"), "planar"),
    "first of": (FirstOf([Says(task="planar"), Newton("planar", starts=2)]), "planar"),
    "seeded": (Seeded(Newton("planar", starts=2, steps=3), Newton("planar")), "planar"),
}


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", FAKES)
def test_solvers_in_python_keep_the_contract(name, check, request):
    solver, robot = FAKES[name]
    check(solver.clone(), make_case(request.getfixturevalue(robot), poses=3))


REGISTERED = [
    (name, robot, task)
    for name in solver_names()
    for robot, task in (("puma", "pose"), ("seven", "pose"), ("planar", "planar"))
    if name != "analytic"
] + [("analytic", "puma", "pose"), ("analytic", "planar", "pose")]


@pytest.mark.parametrize(("name", "robot", "task"), REGISTERED)
def test_registered_solvers_keep_the_contract(name, robot, task, request):
    arm = request.getfixturevalue(robot)
    check_solver(make_solver(name, arm, task), arm)


# The suite must find what is wrong -------------------------------------------------------------


class Careless(Newton):
    """Writes to the caller's poses."""

    def _propose(self, T, q_seed, seed):
        if T.flags.writeable:
            T[:, 2, 3] = 1e-12  # planar: seen in no result
        return super()._propose(T, q_seed, seed)


class Streaky(Newton):
    """Draws from one stream for all poses: a pose's answer depends on its place."""

    def _propose(self, T, q_seed, seed):
        rng = np.random.default_rng(seed)
        q = np.array([self._refine(pose[None], self.robot_.random(1, rng))[0] for pose in T])
        return Proposal(q.reshape(-1, 3), np.arange(len(T)))


class Crowded(Solver):
    """Counts otherwise where there are many poses, on so many native threads or more."""

    def __init__(self, threads=1):
        self.threads = threads

    _common = ()

    def _propose(self, T, q_seed, seed):
        evaluations = np.zeros(len(T), int)
        if len(T) >= 1024 and kernels.threads() >= self.threads:
            evaluations[-1] = 1
        return Proposal(np.zeros((0, 3)), np.zeros(0, int), evaluations=evaluations)


class Eager(Newton):
    """Converts a setting in the constructor."""

    def __init__(self, task="planar", starts=2):
        self.task, self.starts, self.steps = task, float(starts), 20

    _common = ("task",)


@pytest.mark.parametrize(
    ("solver", "message"),
    [
        (Careless("planar", starts=1), "wrote to T"),
        (Streaky("planar"), "in a batch|in reverse order|of half"),
        (Crowded(), "in a batch|in reverse order|of half"),
        (Crowded(threads=2), "on two native threads"),
        (Says(2, task="planar"), "UNREACHABLE for a pose made by robot.fk"),
    ],
)
def test_check_solver_finds_faults(solver, message, planar):
    with pytest.raises(AssertionError, match=message):
        check_solver(solver, planar)


def test_quick_solvers_are_checked_on_many_poses_and_singular_ones(puma, planar):
    case = make_case(puma)
    many = widened(Says().fit(puma), case)
    assert len(many.T) >= 1100 and np.array_equal(many.T, puma.fk(many.q))
    zeros = np.isclose(many.q, 0.0)
    assert zeros[:, 4].any() and zeros.all(axis=1).any()  # the wrist straight; the home pose
    slow = make_case(planar)
    assert widened(Newton("planar", starts=9).fit(planar), slow) is slow


def test_check_solver_finds_altered_settings(planar):
    with pytest.raises((AssertionError, TypeError), match="altered its setting|set more"):
        check_solver(Eager(), planar)


# The base class --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["solve", "fit"])
def test_solve_and_fit_are_final(name):
    with pytest.raises(TypeError, match=f"overrides {name}, which is final"):
        type("Clever", (Solver,), {name: lambda self: None})


def test_unfitted_says_what_to_do(planar):
    with pytest.raises(InputError, match=r"call Newton\(...\).fit\(robot\) first"):
        Newton().solve(np.eye(4))
    with pytest.raises(InputError, match=r"fit needs a kinverse.Robot, got str"):
        Newton().fit("kr16")


def test_a_failed_fit_forgets_the_former_one(planar):
    solver = Newton("planar").fit(planar)
    solver.task = "plane"
    with pytest.raises(InputError, match="unknown task"):
        solver.fit(planar)
    assert not solver.is_fitted and not hasattr(solver, "robot_")


def test_settings_take_effect_at_fit(planar):
    solver = Newton("planar").fit(planar)
    solver.set_params(tol_position=1e-3)
    assert solver.settings_.tol_position == 1e-6
    assert solver.fit(planar).settings_.tol_position == 1e-3


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("tol_position", 0),
        ("tol_position", np.nan),
        ("tol_rotation", "small"),
        ("tol_rotation", True),
        ("windings", "one"),
        ("limits", None),
        ("task", ["pose"]),
    ],
)
def test_bad_settings_are_named(planar, setting, value):
    with pytest.raises(InputError, match=setting):
        Newton().set_params(**{setting: value}).fit(planar)


def test_unknown_settings_list_the_names():
    with pytest.raises(TypeError, match="no setting 'start': it has task, starts, steps"):
        Newton().set_params(start=3)


def test_repr_and_eq_show_what_differs_from_the_defaults():
    assert repr(Newton()) == "Newton()"
    assert repr(Newton("position", starts=9)) == "Newton(task='position', starts=9)"
    assert Newton(starts=3) == Newton(starts=3) != Newton(starts=4)
    assert Newton() != Says()


def test_fused_is_asked_first_and_may_decline(planar):
    solver = Newton("planar", starts=2).fit(planar)
    T = planar.fk(planar.random(2))
    expected = solver.solve(T)
    seen = []

    def fused(T, q_seed, seed):
        seen.append((T, q_seed, seed))
        return None if len(seen) < 3 else expected._table

    solver._fused = fused
    # declined twice (as given and as normalised), then proposed and verified
    assert np.array_equal(solver.solve(T.tolist(), [0, 0, 0], rng=4).status, expected.status)
    assert seen[1][0].flags.c_contiguous and seen[1][1].shape == (2, 3) and seen[1][2] == 4
    assert solver.solve(T)._table is expected._table


def test_a_generator_is_drawn_from_once_a_call(planar):
    solver = Newton("planar", starts=2).fit(planar)
    T = planar.fk(planar.random(3))
    used, twin = np.random.default_rng(1), np.random.default_rng(1)
    solver.solve(T, rng=used)
    twin.integers(2**63)
    assert used.random() == twin.random()


# The one verb ----------------------------------------------------------------------------------


def test_solve_clones_the_solver_it_is_given(planar):
    solver = Newton("planar", starts=2)
    assert solve(planar, planar.fk(np.full(3, 0.3)), solver).ok.all()
    assert not solver.is_fitted


def test_solve_refuses_a_task_beside_a_solver_object(planar):
    with pytest.raises(InputError, match="task belongs to the solver object"):
        solve(planar, np.eye(4), Newton("planar"), task="planar")


@pytest.mark.parametrize(
    ("solver", "message"),
    [
        ("numeric", "did you mean 'numerical'.*auto, analytic, numerical"),
        (Newton, "a class: write"),
        (3, "name or a solver object"),
    ],
)
def test_solve_refuses_unknown_solvers(planar, solver, message):
    with pytest.raises(InputError, match=message):
        solve(planar, np.eye(4), solver)


def test_solve_needs_a_robot():
    with pytest.raises(InputError, match=r"kinverse.Robot \(see kinverse.load\), got str"):
        solve("kr16", np.eye(4))


def test_solve_keeps_fitted_solvers_but_not_without_end(planar, monkeypatch):
    solve_module = sys.modules["kinverse.solve"]  # the name itself is the function
    made = []

    def make(name, robot, task):
        made.append(name)
        return Says(task=task)

    monkeypatch.setattr(solve_module, "make_solver", make)
    monkeypatch.setattr(solve_module, "_fitted", {})
    for _ in range(3):
        solve(planar, np.eye(4), "says", task="planar")
    assert len(made) == 1
    for i in range(solve_module.CACHE_SIZE + 3):
        solve(Robot.from_dh(a=[1 + i], d=0, alpha=0, joints="R"), np.eye(4), "says")
    assert len(solve_module._fitted) == solve_module.CACHE_SIZE


@pytest.mark.parametrize("task", [["pose"], {"pose"}, 3, "plane"])
def test_solve_names_the_tasks(planar, task):
    with pytest.raises(InputError, match="unknown task.*the tasks are pose, position"):
        solve(planar, np.eye(4), task=task)


@pytest.mark.parametrize("value", [np.complex128(1), np.complex64(1e-6), 1e-6 + 0j])
@pytest.mark.parametrize("name", ["tol_position", "tol_rotation"])
def test_complex_tolerances_are_refused(planar, name, value):
    with pytest.raises(InputError, match=f"{name} must be a"):
        Newton("planar", **{name: value}).fit(planar)


def test_all_windings_need_limits_and_not_too_many(planar):
    with pytest.raises(InputError, match="windings='all'.*limits='ignore'"):
        Newton("planar", windings="all", limits="ignore").fit(planar)
    turns = 2 * np.pi

    def fitted(count, last=(0, 1)):
        robot = planar.with_limits([(0, 1), (0, (count - 1) * turns), last])
        return Newton("planar", windings="all").fit(robot)

    assert fitted(4096).is_fitted and fitted(2048, (0, turns)).is_fitted
    for call in ((4097,), (2049, (0, turns)), (10**8, (-1e9, 1e9))):
        with pytest.raises(InputError, match=r"more than 4096.* joint2 \("):
            fitted(*call)
    with pytest.raises(InputError, match=r"4098 windings.*joint2 \(2049\), joint3 \(2\)"):
        fitted(2049, (0, turns))


def test_joints_that_cannot_wind_do_not_count():
    slide = Robot.from_dh(a=[0.1, 0], d=0, alpha=0, joints="RP", limits=[(0, 1), (0, 1e9)])
    assert Newton("position", windings="all").fit(slide).is_fitted


@pytest.mark.parametrize("value", [1.1e6, -1e7, 1e300])
def test_seeds_beyond_any_turn_are_refused_by_row(planar, value):
    T = planar.fk(planar.random(3))
    q_seed = np.zeros((3, 3))
    q_seed[2, 1] = value
    solver = Newton("planar", starts=1).fit(planar)
    with pytest.raises(InputError, match=r"q_seed must lie within \+-1e\+06.*row 2"):
        solver.solve(T, q_seed)
    with pytest.raises(InputError, match="q_seed must lie within"):
        FirstOf([Says(task="planar"), solver]).fit(planar).solve(T, q_seed[2])
    with pytest.raises(InputError, match="q_start must lie within"):
        Numerical(task="planar").fit(planar).follow(T, q_seed[2])

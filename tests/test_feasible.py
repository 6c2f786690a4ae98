"""Feasible parts of a path: ends found exactly, reasons true, nothing lost in between."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.paths import Path, condition_5, feasible, named_path, named_samples

FREE = [[-np.pi, np.pi]] * 3
TIGHT = {"task": "planar", "tol_position": 1e-10, "tol_rotation": 1e-10}


@pytest.fixture(scope="module")
def arm():
    return kv.load("planar3r_003")


# errata, section 5, as parameters of the paths: t of the circle, and x or y of the sides
EXACT = {
    "habibkhah_1": [(0.0, 8 * 2.7830234619155942), (8 * 3.969932243936284, 16 * np.pi)],
    "habibkhah_2": [(0.0, 8 * 1.35 * np.pi)],
    "habibkhah_3": [(7.937253933193772 - 5, 31 + 10 - 6.244997998398398)],
    "habibkhah_4": [(0.0, 31 + 10 - 6.244997998398398 - (7.937253933193772 - 5))],
}


@pytest.mark.parametrize("name", EXACT)
def test_the_exact_ends_of_the_errata(arm, name):
    found = feasible(arm.with_limits(FREE), named_path(name), solver=kv.Analytic(**TIGHT))
    ends = [(part.start, part.end) for part in found.feasible]
    np.testing.assert_allclose(ends, EXACT[name], atol=1e-7)
    assert found.whole == (name in ("habibkhah_2", "habibkhah_4"))
    reasons = {part.status for part in found.infeasible if part.length > 1e-4}
    assert reasons <= {kv.Status.UNREACHABLE}


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("limits", [True, False])
def test_it_agrees_with_the_samples_and_the_conditions(arm, name, limits):
    robot = arm if limits else arm.with_limits(FREE)
    found = feasible(robot, named_path(name), task="planar")
    T, s = named_samples(name)
    inside = found.status_at(s) == kv.Status.SOLVED
    assert np.array_equal(inside, kv.solve(robot, T, task="planar").ok)
    if not limits:
        assert np.array_equal(inside, condition_5([10, 7, 5], T).holds)
    if limits:
        assert {part.status for part in found.infeasible} >= {kv.Status.OUT_OF_LIMITS}


@pytest.mark.parametrize("name", EXACT)
def test_parts_join_and_their_ends_are_solved(arm, name):
    path = named_path(name)
    solver = kv.Analytic(**TIGHT).fit(arm)
    found = feasible(arm, path, solver=solver)
    ends = np.array([(part.start, part.end) for part in found.intervals])
    assert ends[0, 0] == 0.0 and ends[-1, 1] == path.length
    assert np.array_equal(ends[1:, 0], ends[:-1, 1]) and (ends[:, 0] <= ends[:, 1]).all()
    states = [part.status for part in found.intervals]
    assert all(a != b for a, b in zip(states, states[1:], strict=False))
    for part in found.feasible:
        assert solver.solve(path([part.start, part.end])).ok.all()
        outside = np.array([part.start - 1e-6, part.end + 1e-6])
        outside = outside[(outside > 0) & (outside < path.length)]
        assert not solver.solve(path(outside)).ok.any()
    # shorter ones are as narrow as the tolerances
    for part in [part for part in found.intervals if part.length > 1e-6]:
        inner = part.start + part.length * np.array([0.1, 0.5, 0.9])
        assert (solver.solve(path(inner)).status == part.status).all()
    share = sum(part.length for part in found.feasible) / path.length
    assert found.share == pytest.approx(share)


def test_ends_do_not_depend_on_how_many_places_are_looked_at(arm):
    path = named_path("habibkhah_1")
    ends = [
        [part.start for part in feasible(arm, path, task="planar", count=n).feasible]
        for n in (50, 777, 3000)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-9)
    np.testing.assert_allclose(ends[0], ends[2], atol=2e-9)


def test_a_path_out_of_reach_and_one_that_turns_on_the_spot():
    robot = kv.load("kr16")
    out = feasible(robot, Path.line([3, 0, 1], [3, 1, 1]), count=20)
    assert [part.status for part in out.intervals] == [kv.Status.UNREACHABLE]
    assert out.share == 0.0 and not out.whole and not out.feasible
    T = kv.pose([0.9, 0.2, 1.2], rpy=[[0, 1.5, 0], [0, 3.0, 0], [0, 4.5, 0]])
    turning = feasible(robot, Path.from_poses(T), count=100)
    assert turning.unit == "rad" and "rad: SOLVED" in repr(turning)
    assert turning.intervals[-1].end == pytest.approx(3.0)


def test_a_third_status_between_two_places_is_found(arm):
    # out of limits lies between solved and unreachable, in one step of the search
    line = Path.line([12, 9, 0], [30, 14, 0], orientation="radial")
    coarse = feasible(arm, line, task="planar", count=2)
    fine = feasible(arm, line, task="planar", count=2000)
    assert [p.status for p in coarse.intervals] == [p.status for p in fine.intervals]
    ends = [[p.end for p in found.intervals] for found in (coarse, fine)]
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-9)


def test_a_solver_object_and_redundant_arms():
    robot = kv.load("iiwa14")
    q = np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1])
    start = robot.fk(q)
    end = start @ kv.pose([0.0, 0.0, 0.15])
    numerical = kv.Numerical(max_starts=50)
    assert feasible(robot, Path.line(start, end), solver=numerical, count=20).whole
    assert not numerical.is_fitted


@pytest.mark.parametrize(
    ("keywords", "says"),
    [
        ({"robot": "kr16"}, "robot must be a kinverse.Robot"),
        ({"path": np.eye(4)}, "path must be a kinverse.paths.Path"),
        ({"count": 1}, "count must be a whole number"),
        ({"count": 2.5}, "count must be a whole number"),
        ({"count": 10**9}, "at most"),
        ({"tolerance": 0.0}, "tolerance must be"),
        ({"tolerance": np.nan}, "tolerance must be"),
        ({"solver": "newton"}, "unknown solver"),
        ({"task": "plane"}, "unknown task"),
        ({"solver": kv.Analytic(), "task": "planar"}, "task belongs to the solver"),
    ],
)
def test_bad_input_is_named(arm, keywords, says):
    given = {"robot": arm, "path": named_path("habibkhah_1"), "task": "planar", **keywords}
    if "solver" in keywords and "task" not in keywords:
        del given["task"]
    with pytest.raises(kv.InputError, match=says):
        feasible(**given)

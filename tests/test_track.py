"""Tracked paths: against every sequence of branches, at singularities, limits and obstacles."""

import itertools

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.bench.splines import Spline
from kinverse.errors import InputError, NoClosedForm
from kinverse.paths import Path, Reason, track
from tracked_paths import ARMS, TOOL, Curve, check, straight


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

"""The bench's swarm section: its budget, its bootstrap, its lines; a fake peer stands for all."""

import copy
import subprocess
import sys
from functools import partial
from importlib.util import find_spec

import numpy as np
import pytest

from kinverse.bench.sections import swarm
from kinverse.bench.swarm_peers import PEERS, Counted, Peer, Spent
from kinverse.optimizers import NAMES, make_optimizer

LOW, HIGH = np.array([-1.0, -2.0]), np.array([2.0, 1.0])


def sphere(x):
    return (x**2).sum(axis=1)


def counted(max_evals, objective=sphere):
    return Counted(objective, LOW, HIGH, max_evals)


# ---------------------------------------------------------------------------- the budget
def test_one_and_many_count_alike_and_remember_the_same():
    x = np.random.default_rng(0).uniform(LOW, HIGH, (40, 2))
    together, apart = counted(40), counted(40)
    f = together.many(x)
    assert [apart.one(row) for row in x] == f.tolist()
    assert together.evaluations == apart.evaluations == 40
    assert np.array_equal(together.x_best, apart.x_best)
    assert together.f_best == apart.f_best == f.min()


def test_what_is_behind_the_budget_counts_for_nothing():
    c = counted(3)
    c.many(np.array([[1.0, 0.9], [0.5, 0.5]]))
    c.many(np.array([[0.7, 0.7], [0.1, 0.0], [0.0, 0.0]]))
    assert c.f_best == 0.5 and c.evaluations == 5 and not c.over
    for ask in (partial(c.one, LOW), partial(c.many, LOW[None])):
        with pytest.raises(Spent):
            ask()
    assert c.over and c.evaluations == 5


@pytest.mark.parametrize("outside", [[-1.1, 0.0], [0.0, 1.01], [2.5, -3.0]])
def test_points_outside_the_box_are_not_remembered(outside):
    c = counted(10, lambda x: np.where((x == outside).all(axis=1), -1.0, sphere(x)))
    c.many(np.array([outside, [1.0, 1.0]]))
    c.one(np.array(outside))
    assert c.f_best == 2.0 and c.evaluations == 3


def test_nan_is_not_the_best():
    c = counted(10, lambda x: np.where(x[:, 0] < 0, np.nan, sphere(x)))
    c.many(np.array([[-0.5, 0.0], [1.0, 1.0], [0.5, 0.5]]))
    c.one(np.array([-0.1, 0.0]))
    assert c.f_best == 0.5 and np.array_equal(c.x_best, [0.5, 0.5])


def test_a_copied_problem_shares_the_count():
    c = counted(10)
    copy.deepcopy({"problem": c})["problem"].one(LOW)
    assert c.evaluations == 1


# ---------------------------------------------------------------------------- peers
def random_search(c, population, steps, seed, each=1):
    """A peer that draws ``each`` populations a step, and never looks at them."""
    rng = np.random.default_rng(seed)
    for _ in range(1 + each * steps):
        c.many(rng.uniform(c.low, c.high, (population, len(c.low))))


def fake(variant="random search", each=1, package="numpy"):
    return Peer(package, variant, partial(random_search, each=each), "a fake")


@pytest.mark.parametrize("each", [1, 2, 7])
def test_steps_are_set_so_that_they_spend_the_budget(each):
    answer = fake(each=each).solve(sphere, LOW, HIGH, 1500, 100, seed=3)
    assert answer.evaluations == 1500
    assert answer.f == sphere(answer.x[None])[0] < 0.05


def test_a_peer_that_wraps_what_stops_it_is_stopped_and_a_broken_one_is_not_hidden():
    def wraps(c, population, steps, seed):
        try:
            while True:
                c.one(np.random.random(2))
        except Exception as error:
            raise RuntimeError("the objective failed") from error

    def broken(c, population, steps, seed):
        raise RuntimeError("broken")

    assert Peer("numpy", "wraps", wraps).solve(sphere, LOW, HIGH, 700, 10, 1).evaluations == 700
    with pytest.raises(RuntimeError, match="broken"):
        Peer("numpy", "broken", broken).solve(sphere, LOW, HIGH, 700, 10, 1)


def test_peers_that_draw_from_numpys_global_stream_repeat_and_leave_it_alone():
    def draws(c, population, steps, seed):
        c.many(np.random.uniform(c.low, c.high, ((steps + 1) * population, 2)))

    before = np.random.get_state()[1].copy()
    peer = Peer("numpy", "draws", draws)
    first, again, other = (peer.solve(sphere, LOW, HIGH, 500, 50, seed) for seed in (4, 4, 5))
    assert first.f == again.f != other.f
    assert np.array_equal(np.random.get_state()[1], before)


def test_every_peer_is_named_once():
    names = [peer.name for group in PEERS.values() for peer in group]
    assert len(names) == len(set(names))
    assert set(PEERS) - {"cma"} == set(NAMES) - {"cibo"}


# SciPy's comes with kinverse; the others where the bench's own environment runs the tests
THERE = [peer for group in PEERS.values() for peer in group if find_spec(peer.package)]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("peer", THERE, ids=lambda peer: peer.name)
def test_peers_that_are_there_keep_to_the_budget_and_repeat(peer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, again = (peer.solve(sphere, LOW, HIGH, 2000, 40, seed=8) for _ in range(2))
    assert first.f == again.f == sphere(first.x[None])[0] < 0.5
    # a peer whose population changes on its way cannot be told how many steps to take
    assert 1500 <= first.evaluations <= 2040
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------------------- the bootstrap
def test_the_ratio_of_a_thing_to_itself_is_one():
    error = np.random.default_rng(1).lognormal(size=(50, 1))
    ratio = swarm.ratio_of_medians(error, error)
    assert ratio.median == ratio.low == ratio.high == 1.0
    doubled = swarm.ratio_of_medians(2 * error, error)
    assert doubled.low == doubled.high == 2.0


def test_the_ratio_uses_the_targets_that_both_have():
    ours = np.concatenate([np.full((10, 3), 4.0), np.full((90, 3), 1.0)])
    assert swarm.ratio_of_medians(ours, np.full((10, 1), 2.0)).median == 2.0


def test_the_interval_holds_the_truth_about_as_often_as_it_says():
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(100):
        ours, theirs = 1.5 * rng.lognormal(size=(60, 2)), rng.lognormal(size=(60, 1))
        ratio = swarm.ratio_of_medians(ours, theirs, draws=200)
        assert ratio.low <= ratio.median <= ratio.high
        held += ratio.low <= 1.5 <= ratio.high
    assert held >= 88


# ---------------------------------------------------------------------------- the section
SMALL = swarm.Amount(targets=6, seeds=2, alone=2, peer_seconds=0.0, peer_targets=3)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(swarm, "EVALUATIONS", 500)


def of(lines, what):
    return [line for line in lines if line.what.startswith(what)]


def test_ours_and_peers_get_their_lines(short):
    rows = {"pso": partial(make_optimizer, "pso"), "pso slow": partial(make_optimizer, "pso")}
    peers = {
        "pso": (fake(), fake("other", each=2), fake("of mealpy", package="numpy")),
        "cma": (fake("alone"),),
    }
    lines = swarm.compare(SMALL, rows, peers)
    assert [line.subject for line in of(lines, "median error m + rad")] == ["pso", "pso slow"]
    assert all(line.figure.median == 0 for line in of(lines, "evaluations off the budget"))
    told = [line for line in lines if "numpy" in line.what and "CPU" not in line.what]
    assert [line.subject for line in told] == ["pso", "pso", "pso", "cma"]
    assert all("3 targets, 500 evaluations" in line.note for line in told)
    # random search does not get near a swarm
    ratios = of(lines, "median error / the best peer's")
    assert [line.subject for line in ratios] == ["pso", "pso slow"]
    (bound,) = of(lines, "lower bound of the ratio")
    assert bound.subject == "pso" and bound.bound == 1.1 and bound.verdict == "PASS"
    assert bound.figure.median >= min(line.figure.low for line in ratios)


def test_a_lucky_peer_with_few_targets_hides_nothing():
    rng = np.random.default_rng(3)
    ours = swarm.Result(3.0 * rng.lognormal(sigma=0.1, size=(100, 2)), [1.0], [1])
    sure = swarm.Result(rng.lognormal(sigma=0.1, size=(100, 1)), [1.0], [1])
    lucky = swarm.Result(np.array([[1e-9], [1e3], [1e-9], [1e3], [1e-9]]), [1.0], [1])
    peers = {fake("sure"): sure, fake("lucky"): lucky}
    lines = swarm._ratio_lines("pso", {"pso": ours}, {"pso": [1.0]}, peers)
    (info,) = of(lines, "median error / the best peer's")
    assert "lucky" in info.note and info.figure.low < 1.1
    (held,) = of(lines, "lower bound of the ratio")
    assert held.verdict == "MISS" and "sure" in held.note and 2.7 < held.figure.median < 3.0


def test_cpu_times_are_set_against_the_libraries_that_are_named(short, monkeypatch):
    monkeypatch.setattr(swarm, "TIMES", {"numpy": 1e9})
    lines = swarm.compare(SMALL, {"pso": swarm.VARIANTS["pso"]}, {"pso": (fake(),)})
    told = of(lines, "CPU: numpy / ours")
    assert [line.what.split(", ")[1] for line in told] == ["alone", "64 together"]
    for line in told:
        assert line.verdict == "MISS" and line.figure.median > 0 and "random search" in line.note


def test_a_solve_does_not_depend_on_how_many_run_beside_it(short, monkeypatch):
    rows = {"pso": swarm.VARIANTS["pso"]}
    errors = []
    for together in (64, 5, 1):
        monkeypatch.setattr(swarm, "TOGETHER", together)
        (line,) = of(swarm.compare(SMALL, rows, {}), "median error")
        errors.append(line.figure)
    assert errors[0] == errors[1] == errors[2]


def test_a_peer_that_is_not_there_is_named_before_anything_is_measured():
    with pytest.raises(ModuleNotFoundError, match="no_such_library"):
        swarm.compare(swarm.FULL, swarm.VARIANTS, {"pso": (fake(package="no_such_library"),)})


def test_variants_are_named_after_their_method():
    assert set(NAMES) <= set(swarm.VARIANTS)
    assert {name.split()[0] for name in swarm.VARIANTS} == set(NAMES)


def test_no_peer_is_imported_before_it_runs():
    code = (
        "import sys; from kinverse.bench.sections import swarm; "
        "sys.exit(len({'mealpy', 'pymoo', 'pygmo', 'pyswarms', 'cma'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

"""The comparison of all methods: targets, judging, the answers that are drawn from figures."""

import numpy as np
import pytest

import kinverse as kv
from kinverse import judge
from kinverse.studies.summary import STUDY
from kinverse.studies.summary.answers import answer
from kinverse.studies.summary.arms import CASES, SITUATIONS, reach_of, situation_of
from kinverse.studies.summary.methods import BUDGET, METHODS, NETWORK
from kinverse.studies.summary.pictures import _error
from kinverse.studies.summary.race import _judged, race, targets_of
from kinverse.studies.summary.tables import by_arm, by_situation, cannot_spend, overall


@pytest.mark.parametrize("arm", sorted({arm for arm, _ in CASES}))
def test_plain_kinematics_are_those_of_the_robot(arm):
    robot = kv.load(arm)
    q = robot.random(20, 3)
    far, turned = judge.errors(robot.fk(q), judge.pose(robot, q))
    assert max(far.max(), turned.max()) < 1e-13
    assert judge.inside(robot, q).all()
    assert not judge.inside(robot, robot.limits[:, 1][None] + 0.1).any()


def test_whole_turns_are_no_difference():
    q = np.array([[0.1, -3.1], [0.0, 0.0]])
    other = np.array([[0.1 + 2 * np.pi, 3.1], [0.5, -0.25]])
    assert judge.apart(q, other) == pytest.approx([2 * np.pi - 6.2, 0.5])


def test_situations_are_told_by_the_library():
    told = {(arm, task): situation_of(kv.load(arm), task) for arm, task in CASES}
    assert set(told.values()) == set(SITUATIONS)
    assert told["kr16", "pose"] == "closed form exists"
    assert told["panda", "pose"] == "redundant"
    assert told["ir361", "pose"] == told["jaco2", "pose"] == "no closed form"
    assert told["kr16", "position"] == "position only"


def test_targets_share_no_stream_with_a_solver():
    robot = kv.load("kr16")
    T = targets_of(robot, 5, 4)
    assert np.array_equal(T, targets_of(robot, 5, 4))
    assert not np.allclose(T, robot.fk(robot.random(4, 5)))


def test_a_wrong_answer_spoils_its_pose():
    robot = kv.load("kr16")
    q = robot.random(3, 1)
    T = judge.pose(robot, q)
    wrong = q + np.array([[0.0], [1e-4], [0.0]])
    row = _judged(robot, T, "pose", np.vstack([q, wrong]), np.tile(np.arange(3), 2), answered=6)
    assert row["solved, %"] == pytest.approx(200 / 3)
    unanswered = _judged(robot, T, "pose", q, np.arange(3), answered=0)
    assert unanswered["solved, %"] == 0.0
    assert max(unanswered["position error, 95 %"], unanswered["rotation error, 95 %"]) < 1e-12


def test_a_pose_without_any_candidate_has_no_bound():
    robot = kv.load("kr16")
    q = robot.random(2, 1)
    row = _judged(
        robot, judge.pose(robot, q), "pose", np.array([[np.nan] * 6]), np.array([1]), answered=0
    )
    errors = [f"{what} error, {which}" for what in KINDS for which in ("median", "95 %")]
    assert [row[name] for name in errors] == [None] * 4


KINDS = ("position", "rotation")


@pytest.fixture(scope="module")
def rows():
    cells = [("kr16", "pose"), ("kr16", "position")]
    families = ("analytic", "numerical", "swarm and descent")
    return [
        row
        for arm, task in cells
        for family in families
        for seed in (1, 2)
        for row in race(arm, task, family, seed, 70 + seed, 3, True)
    ]


def test_every_method_of_the_families_has_a_row(rows):
    names = {row["method"] for row in rows}
    families = ("analytic", "numerical", "swarm and descent")
    assert names == {m.name for m in METHODS if m.family in families}
    none = [row for row in rows if "reason" in row]
    assert {(row["method"], row["task"]) for row in none} == {("Analytic", "position")}


def test_the_budget_is_kept(rows):
    spent = [row["evaluations, most"] for row in rows if "reason" not in row]
    assert max(spent) <= BUDGET
    assert "Analytic" in cannot_spend(rows)


def test_closed_form_and_numerical_solve_all(rows):
    table = {(r["task"], r["method"]): r for r in by_arm(rows)}
    assert table["pose", "Analytic"]["solved, %"] == 100.0
    assert table["position", "Numerical"]["solved, %"] == 100.0
    assert table["position", "Analytic"]["reason"]
    assert len(by_situation(rows)) == 2 * len(overall(rows)) == 14


def _figures(method, lowest, ms, solutions=1.0, arms=2):
    return {
        "situation": "redundant",
        "method": method,
        "call": f"kv.{method}()",
        "arms": 2,
        "arms it applies to": arms,
        "solved, %": lowest,
        "solved, lowest of an arm, %": lowest,
        "time a pose, ms": ms,
        "position error, median, % of reach": 3.0,
        "rotation error, median, deg": 5.0,
        "solutions a pose": solutions,
    }


def test_the_answer_follows_the_figures():
    rows = [
        _figures("Quick", 98.0, 1e-4),
        _figures("Slow", 100.0, 2.0, solutions=7.0),
        _figures("Sound", 99.5, 1e-2),
        _figures("Elsewhere", 100.0, 1e-5, arms=1),
        _figures("de", 40.0, 5.0),
        _figures(NETWORK, 0.0, 1e-3),
    ]
    told = answer("redundant", rows, ["panda"])
    assert told["call"] == "kv.Sound()" and told["arms"] == "panda"
    assert told["use"] == "Sound" and told["for every branch"] == "Slow"
    assert "99.5 % or more" in told["answer"] and "10 us" in told["answer"]
    assert "de solves most" in told["answer"]
    assert "a network alone is 3 % of the arm's reach and 5 deg off" in told["answer"]
    # who gives no more than one solution is next by its time like all others
    many = [_figures("First", 100.0, 1e-3), _figures("Next", 100.0, 2e-3, solutions=1.2)]
    third = _figures("Third", 100.0, 3e-3)
    assert "next Next" in answer("redundant", [*many, third, *rows[4:]])["answer"]
    nothing = answer("redundant", [rows[0], rows[4], rows[5]])
    assert nothing["use"] is None and "Quick" in nothing["answer"]


def test_cells_are_few_and_named_once():
    for quick in (True, False):
        cells = STUDY.tables[0].cells(quick)
        assert len({cell.name for cell in cells}) == len(cells)
        assert all(cell.arguments["target_seed"] != cell.arguments["solver_seed"] for cell in cells)
    assert [spec.name for spec in STUDY.tables] == ["when", "overview", "methods"]


@pytest.mark.slow
def test_networks_are_judged_refined_and_alone():
    rows = race("planar3r", "pose", "learned", 1, 71, 4, True)
    assert [row["method"] for row in rows] == ["Learned", NETWORK, "Fusion loop"]
    assert rows[0]["solved, %"] == 100.0
    assert rows[1]["position error, median"] > 1e-4


def test_every_method_is_named_once_beside_its_marker(rows):
    from kinverse.studies.summary.pictures import solved_figure, time_against_error

    whole = overall(rows)
    figure = time_against_error(whole, 99.0)
    said = [text.get_text() for text in figure.axes[0].texts]
    assert [name for name in said if name in {row["method"] for row in whole}] == [
        name for name in said if "1e" not in name
    ]
    assert len(said) == len(whole) + 2
    grid = solved_figure(by_arm(rows)).axes[0]
    assert [label.get_text() for label in grid.get_xticklabels()] == [
        "kr16, pose",
        "kr16, position",
    ]


def test_the_lowest_share_is_of_an_arm_over_its_seeds(rows):
    mine = [dict(row) for row in rows if row["method"] == "Numerical" and row["task"] == "pose"]
    mine[0]["solved, %"] = 98.0
    [told] = overall(mine)
    assert told["solved, lowest of an arm, %"] == pytest.approx((98.0 + 100.0) / 2)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_what_is_called_is_what_is_made(method):
    made = method.make(method.tasks[0], 1, False)
    called = eval(method.call, {"kv": kv})
    assert type(called) is type(made)
    for name in ("method", "optimizer", "polish", "fallback"):
        assert called.get_params().get(name) == made.get_params().get(name)


def test_a_median_of_two_arms_is_between_them(rows):
    mine = next(dict(row) for row in rows if row["method"] == "Numerical" and row["task"] == "pose")
    pair = [mine | {"arm": arm, "seconds a pose": t} for arm, t in (("a", 1e-6), ("b", 3e-6))]
    [row] = overall(pair)
    assert row["time a pose, ms"] == pytest.approx(2e-3)
    assert row["targets an arm"] == mine["targets"] and row["seeds"] == 1


def test_errors_of_small_and_large_arms_are_compared_by_their_reach(rows):
    """A length drawn ten times as large is the same error of an arm ten times as large."""
    mine = [dict(row) for row in rows if row["method"] == "Numerical"]
    for row in mine:
        row |= {"reach, m": 2.0, "position error, 95 %": 0.1, "rotation error, 95 %": None}
        if row["task"] == "pose":
            row |= {"reach, m": 20.0, "position error, 95 %": 1.0, "rotation error, 95 %": 0.5}
    [told] = overall(mine)
    far, turned = "position error, 95 % below", "rotation error, 95 % below"
    for quartile in ("", ", lower quartile", ", upper quartile"):
        assert told[f"{far}{quartile}, % of reach"] == pytest.approx(5.0)
        assert told[f"{turned}{quartile}, deg"] == pytest.approx(np.degrees(0.5))
    assert not [name for name in told if "m + rad" in name]
    assert _error(told) == pytest.approx(0.5)


def test_reach_is_the_length_of_a_stretched_arm():
    assert reach_of(kv.load("planar3r")) == pytest.approx(0.22, rel=0.01)

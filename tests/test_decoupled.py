"""Three slides and three turning joints: the closed form that turns first and slides then."""

from itertools import combinations

import numpy as np
import pytest

import kinverse as kv
import oracle
from kinverse.bench import arms
from kinverse.bench.search import search
from kinverse.conformance import check_solver
from kinverse.robot_class import robot_class
from kinverse.solvers.closed_form.families import Family, closed_form_spec
from kinverse.status import Status

HALF = np.pi / 2
ORDERS = ["".join("PR"[i in turns] for i in range(6)) for turns in combinations(range(6), 3)]


def gantry(hand=0.1, travel=5.0):
    """Three slides at right angles that carry a spherical wrist."""
    return kv.Robot.from_dh(
        a=0,
        d=[0, 0, 0, 0, 0, hand],
        alpha=[HALF, HALF, 0, -HALF, HALF, 0],
        theta=[0, HALF, 0, 0, 0, 0],
        joints="PPPRRR",
        limits=[(-travel, travel)] * 3 + [(-3, 3)] * 3,
        name="gantry",
    )


def found(robot, s, q, within=1e-5):
    """Whether each generating configuration is among its pose's solutions."""
    d = np.abs(s.q - q[s.pose_index])
    turning = np.array([kind == "R" for kind in robot.kinds])
    d = np.where(turning, np.abs(np.remainder(d + np.pi, 2 * np.pi) - np.pi), d).max(axis=1)
    hit = np.zeros(len(q), bool)
    hit[s.pose_index[d < within]] = True
    return hit


@pytest.mark.parametrize("kinds", ORDERS)
def test_in_any_order_every_configuration_is_found_with_its_one_twin(kinds):
    robot = arms.random_arm(77, kinds)
    assert closed_form_spec(robot).family is Family.DECOUPLED
    q = robot.random(200, rng=0)
    T = robot.fk(q)
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    assert found(robot, s, q).all() and (s.count == 2).all()
    assert not s.stats.evidence.weak.any() and (s.stats.evidence.method == "closed form").all()
    for k in range(0, len(s.q), 20):
        error = oracle.errors("pose", T[s.pose_index[k]], oracle.robot_fk(robot, s.q[k]))
        assert max(error) <= 1e-9


@pytest.mark.parametrize("kinds", ["PPPRRR", "RPRPRP", "PRRRPP"])
def test_a_search_finds_no_third(kinds):
    robot = arms.random_arm(78, kinds)
    T = robot.fk(robot.random(3, rng=0))
    s = kv.Analytic(limits="ignore").fit(robot).solve(T)
    for i, there in enumerate(search(robot, T, 60, np.random.default_rng(0))):
        assert len(there) <= s.count[i]
        for row in there:
            assert found(robot, s[i], row[None]).all()


@pytest.mark.parametrize("hand, travel", [(0.0, 5.0), (0.01, 5.0), (0.001, 50.0), (0.1, 1.0)])
def test_gantries(hand, travel):
    robot = gantry(hand, travel)
    q = robot.random(300, rng=1)
    s = kv.Analytic().fit(robot).solve(robot.fk(q))
    assert found(robot, s, q).all()


def test_a_wrist_in_line_gives_members_inside_the_limits():
    robot = gantry()
    q = robot.random(200, rng=2)
    q[:, 4] = np.where(np.arange(200) % 2, 0.0, 1e-12)
    s = kv.Analytic().fit(robot).solve(robot.fk(q))
    assert s.ok.all() and s.stats.singular.all()
    assert ((s.q >= robot.limits[:, 0]) & (s.q <= robot.limits[:, 1])).all()


def test_a_rotation_out_of_reach_is_unreachable_and_a_short_slide_out_of_limits():
    robot = arms.random_arm(81, "PRPRPR")
    rng = np.random.default_rng(3)
    T = np.array([kv.pose(rng.uniform(-1, 1, 3), rpy=rng.uniform(-3, 3, 3)) for _ in range(60)])
    s = kv.Analytic().fit(robot).solve(T)
    assert not (s.status == Status.NOT_FOUND).any()
    out = s.status == Status.UNREACHABLE
    assert 5 < out.sum() < 55
    there = search(robot, T, 20, np.random.default_rng(0))
    assert [len(rows) > 0 for rows in there] == list(~out)


def test_slides_alone_do_not_turn():
    robot = arms.cartesian()
    q = robot.random(50, rng=4)
    T = robot.fk(q)
    assert found(robot, kv.Analytic().fit(robot).solve(T), q).all()
    turned = T @ kv.pose([0, 0, 0], rpy=[0, 0, 0.3])
    assert (kv.Analytic().fit(robot).solve(turned).status == Status.UNREACHABLE).all()


def test_it_keeps_the_contract_of_every_solver():
    check_solver(kv.Analytic(), arms.random_arm(80, "RPRPPR"))


def test_axes_that_do_not_turn_any_way_are_no_such_arm():
    parallel = kv.Robot.from_dh(
        a=0.2,
        d=0.1,
        alpha=[HALF, HALF, 0.4, 0, HALF, 0],
        joints="PPPRRR",
        limits=[(-1, 1)] * 3 + [(-3, 3)] * 3,
    )
    assert closed_form_spec(parallel).family is Family.GENERAL_6R


def test_its_class_is_told():
    robot = gantry()
    found = robot_class(robot)
    assert (found.family, found.max_branches, found.auto) == ("decoupled", 2, "Analytic")
    assert [s.name for s in found.singularities] == ["slides", "wrist"]
    # seen along the axis in the middle the outer two are in line
    assert np.linalg.matrix_rank(robot.jacobian([0.1, 0.2, 0.3, 0.4, 0.0, 0.5])) == 5
    assert np.linalg.matrix_rank(robot.jacobian([0.1, 0.2, 0.3, 0.4, 0.6, 0.5])) == 6

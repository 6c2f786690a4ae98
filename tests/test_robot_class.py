"""What robot_class says, held to what the Jacobian and the solvers do."""

import json
import re
from dataclasses import asdict

import numpy as np
import pytest
from scipy.optimize import brentq
from typer.testing import CliRunner

import kinverse as kv
from kinverse.axes import axis_pairs, meeting_triples, nearest_point, parallel_runs
from kinverse.geometry import axis_lines
from kinverse.regional import regional_structure
from kinverse.robot_class import robot_class
from kinverse.solvers.closed_form.families import closed_form_spec

HALF = np.pi / 2


def arm(alpha, joints=None, a=0.0, d=0.0, **more):
    joints = joints or "R" * len(alpha)
    limits = [(-2.0, 2.0)] * len(joints)
    return kv.Robot.from_dh(a=a, d=d, alpha=alpha, joints=joints, limits=limits, **more)


def moved_lines(robot, q):
    """Axis lines in a posture, by turning the frames of the chain."""
    frames = robot.frames.copy()
    for i, value in enumerate(q):
        c, s = np.cos(value), np.sin(value)
        motion = np.eye(4)
        if robot.kinds[i] == "R":
            motion[:2, :2] = [[c, -s], [s, c]]
        else:
            motion[2, 3] = value
        frames[i] = frames[i] @ motion
    return axis_lines(frames, robot.kinds)


# ---------------------------------------------------------------------------- axes
def test_pairs_by_what_they_are_and_by_how_much():
    robot = arm([0.0, HALF, 0.7, 0.0, 0.0], a=[0.3, 0.0, 0.2, 0.0, 0.0], d=[0, 0.1, 0, 0.2, 0])
    found = robot_class(robot).pairs
    assert [pair.relation for pair in found] == ["parallel", "meet", "skew", "coincide"]
    np.testing.assert_allclose([p.distance for p in found], [0.3, 0, 0.2, 0], atol=1e-12)
    np.testing.assert_allclose([p.angle for p in found], [0, HALF, 0.7, 0], atol=1e-12)


def test_slides_have_directions_only():
    robot = arm([0.0, HALF, 0.7, 0.0], "RPPR", a=[0.3, 0.1, 0.2, 0.0])
    found = robot_class(robot).pairs
    assert [pair.relation for pair in found] == ["parallel", "square", "oblique"]
    assert [pair.distance for pair in found] == [None] * 3


@pytest.mark.parametrize("miss", [1e-6, 1e-4, 1e-2])
def test_almost_meeting_and_almost_parallel_are_told_by_number(miss):
    pairs = robot_class(arm([HALF, miss, 0], a=[miss, 0.3, 0])).pairs
    assert [pair.relation for pair in pairs] == ["skew", "skew"]
    assert pairs[0].distance == pytest.approx(miss) and pairs[1].angle == pytest.approx(miss)


@pytest.mark.parametrize("name", ["puma560", "ur5", "iiwa14", "panda", "adept_one", "jaco2"])
def test_what_is_said_of_the_axes_holds_in_every_posture(name):
    robot = kv.load(name)
    at_zero = axis_lines(robot.frames, robot.kinds)
    for q in robot.random(3, rng=0):
        lines = moved_lines(robot, q)
        for before, after in zip(
            axis_pairs(at_zero, robot.kinds), axis_pairs(lines, robot.kinds), strict=True
        ):
            assert before.relation == after.relation
            assert before.angle == pytest.approx(after.angle, abs=1e-12)
            if before.distance is not None:
                assert before.distance == pytest.approx(after.distance, abs=1e-12)
        triples = meeting_triples(at_zero, robot.kinds), meeting_triples(lines, robot.kinds)
        assert [t.joints for t in triples[0]] == [t.joints for t in triples[1]]
        assert parallel_runs(at_zero, robot.kinds) == parallel_runs(lines, robot.kinds)


def test_the_nearest_point_of_three_lines():
    direction = np.eye(3)
    at = np.array([0.4, -0.2, 0.7])
    point, distance = nearest_point(direction, at + np.array([[3.0], [5.0], [-2.0]]) * direction)
    np.testing.assert_allclose(point, at, atol=1e-14)
    assert distance < 1e-14
    assert nearest_point(np.tile(direction[2], (3, 1)), direction)[1] == np.inf


def test_meetings_and_parallels():
    assert [m.joints for m in robot_class(kv.load("puma560")).meetings] == [(3, 4, 5)]
    np.testing.assert_allclose(
        robot_class(kv.load("kr16")).meetings[0].point, [1.61, 0, 0.64], atol=1e-9
    )
    assert robot_class(kv.load("ur5")).parallel == ((1, 2, 3),)
    assert robot_class(kv.load("adept_one")).parallel == ((0, 1, 3),)
    assert [m.joints for m in robot_class(kv.load("iiwa14")).meetings] == [
        (0, 1, 2),
        (2, 3, 4),
        (4, 5, 6),
    ]


# ---------------------------------------------------------------------------- branches
@pytest.mark.parametrize(
    ("name", "most", "auto"),
    [
        ("planar3r", 2, "Analytic"),
        ("adept_one", 2, "Analytic"),
        ("pioneer2", 4, "Analytic"),
        ("irb6", 4, "Analytic"),
        ("puma560", 8, "Analytic"),
        ("ur5", 8, "Analytic"),
        ("iiwa14", None, "Numerical"),
    ],
)
def test_branches_and_solver(name, most, auto):
    found = robot_class(kv.load(name))
    assert (found.max_branches, found.auto) == (most, auto)
    assert (found.family is None) == (auto == "Numerical") == bool(found.why_no_family)


@pytest.mark.parametrize("name", ["planar3r", "adept_one", "irb6", "puma560", "rx160l", "ur5"])
def test_no_pose_has_more_branches_and_some_has_as_many(name):
    robot = kv.load(name)
    T = robot.fk(np.random.default_rng(0).uniform(-3, 3, (200, robot.dof)))
    count = kv.Analytic(limits="ignore").fit(robot).solve(T).count
    assert count.max() == robot_class(robot).max_branches


@pytest.mark.parametrize(
    ("joints", "bound"),
    [("RRRRRR", 16), ("RRPRRR", 16), ("RPRPRR", 8), ("PRPRPR", 2), ("RRRR", 16)],
)
def test_bounds_of_general_chains(joints, bound):
    n = len(joints)
    twists = np.linspace(0.4, 1.3, n)
    found = robot_class(arm(twists, joints, a=twists / 3, d=0.1))
    if found.family is None:
        assert found.max_branches == bound


# ---------------------------------------------------------------------------- classes
def test_deficient_general_redundant_and_hyper_redundant():
    def words(n, **more):
        twists = np.resize([HALF, -1.0, 0.7], n)
        return robot_class(arm(twists, a=0.2, d=0.1, **more)).redundancy

    assert [words(n) for n in (3, 5, 6, 7, 8, 9, 12)] == [
        *("deficient", "deficient", "general", "redundant", "redundant"),
        *("hyper-redundant", "hyper-redundant"),
    ]
    # six joints that move in a plane are too many for it and too few for space
    assert robot_class(arm([0.0] * 4, a=0.2)).redundancy == "redundant"
    assert robot_class(arm([0.0] * 6, a=0.2)).redundancy == "hyper-redundant"


@pytest.mark.parametrize(
    ("made", "motion", "rank"),
    [
        (lambda: arm([0, 0, 0], a=0.2), "planar", 3),
        (lambda: arm([HALF, 0.0], "RP"), "planar", 2),
        (lambda: arm([HALF, 0.0], "PP"), "planar", 2),
        (lambda: arm([HALF, -HALF, 0]), "spherical", 3),
        (lambda: arm([0.4, 1.0, 0]), "spherical", 3),
        (lambda: arm([HALF, -HALF, 0], a=0.1), "spatial", 3),
        (lambda: arm([0.0, 0.0], "RP"), "spatial", 2),
        (lambda: arm([HALF, HALF, 0.0], "PPP", theta=[0, HALF, 0]), "spatial", 3),
        (lambda: kv.load("adept_one"), "spatial", 4),
        (lambda: kv.load("puma560"), "spatial", 6),
        (lambda: kv.load("iiwa14"), "spatial", 6),
    ],
)
def test_motion_and_rank(made, motion, rank):
    found = robot_class(made())
    assert (found.motion, found.rank) == (motion, rank)


@pytest.mark.parametrize("name", ["planar3r", "puma560", "iiwa14", "ir361", "adept_one"])
def test_mobility_of_an_open_chain_is_its_free_joints(name):
    robot = kv.load(name)
    assert robot_class(robot).mobility == robot.dof


@pytest.mark.parametrize(
    ("joints", "alpha", "a", "name", "workspace"),
    [
        ("PPP", [HALF, HALF, 0], [0, 0, 0], "Cartesian", "box"),
        ("PPP", [0.7, 0.9, 0], [0, 0, 0], "Cartesian", "parallelepiped"),
        ("PPP", [0, 0, 0], [0, 0, 0], "degenerate", "line"),
        ("PPP", [HALF, 0, 0], [0, 0, 0], "degenerate", "plane"),
        ("RPP", [0, HALF, 0], [0, 0, 0], "cylindrical", "cylinder"),
        ("PRP", [0, HALF, 0], [0, 0, 0], "cylindrical", "cylinder"),
        ("RPP", [0.5, HALF, 0], [0, 0, 0], "general", "revolution"),
        ("RRP", [HALF, HALF, 0], [0, 0, 0], "spherical", "sphere"),
        ("RRP", [HALF, HALF, 0], [0.1, 0, 0], "general", "revolution"),
        ("RRP", [0, 0, 0], [0.4, 0.3, 0], "SCARA", "cylinder"),
        ("PRR", [0, 0, 0], [0, 0.4, 0.3], "SCARA", "cylinder"),
        ("RRRP", [0, 0, 0, 0], [0.4, 0.3, 0, 0], "SCARA", "cylinder"),
        ("RRR", [HALF, 0, 0], [0, 0.4, 0.3], "articulated", "crescent"),
        ("RRR", [0, 0, 0], [0.4, 0.3, 0.2], "planar", "ring"),
        ("RRR", [HALF, HALF, 0], [0, 0, 0], "spherical shoulder", "sphere"),
        ("RRR", [HALF, HALF, 0], [0.1, 0.4, 0.3], "general", "revolution"),
        ("RR", [HALF, 0], [0, 0.3], "pointing", "sphere"),
        ("RR", [HALF, 0], [0.2, 0.3], "general", "torus"),
        ("PR", [0, 0], [0, 0.3], "cylindrical", "cylinder"),
        ("R", [0], [0.3], "one joint", "circle"),
        ("P", [0], [0], "one joint", "line"),
    ],
)
def test_regional_structures(joints, alpha, a, name, workspace):
    # a quarter turn about the second axis, so that three slides need not lie in one plane
    turned = [0, HALF, 0] if name == "Cartesian" else 0.0
    robot = arm(alpha, joints, a=a, theta=turned)
    found = regional_structure(axis_lines(robot.frames, robot.kinds), robot.kinds)
    assert found.name == name and workspace in found.workspace
    assert found.structure == ("SCARA" if name == "SCARA" else joints)


def test_the_notation_of_table_1_4():
    assert robot_class(kv.load("puma560")).regional.axes == "Rz Ry Ry"
    assert robot_class(kv.load("adept_one")).regional.axes == "Rz Rz Pz"
    assert robot_class(arm([0.3, HALF, 0], a=0.1)).regional.axes == "Rz R* R*"


def test_wrists():
    said = {
        name: robot_class(kv.load(name)) for name in ("kr16", "ur5", "irb6", "adept_one", "gen3")
    }
    assert said["kr16"].wrist.startswith("spherical: axes 4, 5, 6 meet")
    assert said["ur5"].wrist.startswith("offset: axes 4, 5, 6")
    assert said["irb6"].wrist.startswith("axes 4, 5 meet")
    assert said["adept_one"].wrist == "one axis, 4"
    assert robot_class(kv.load("iiwa14")).wrist_joints == (4, 5, 6)
    assert robot_class(kv.load("planar3r")).wrist == "none"


# ---------------------------------------------------------------------------- singularities
def lines_of_rows(robot, spec, q):
    """Directions and points of the axes in the order the closed form counts them."""
    lines = moved_lines(robot, q)
    return lines.direction[spec.joint], lines.point[spec.joint]


def conditions(robot, spec, q):
    """The words, written again as numbers that are zero where they hold."""
    z, p = lines_of_rows(robot, spec, q)
    triple = lambda a, b, c: np.dot(a, np.cross(b, c))  # noqa: E731
    n = len(z)
    if spec.family.name == "SCARA":
        return {"elbow": triple(z[0], p[1] - p[0], p[2] - p[0])}
    if spec.family.name == "THREE_PARALLEL":
        c, _ = nearest_point(z[4:6], p[4:6])
        return {
            "shoulder": triple(z[1], z[0], c - p[0]),
            "elbow": triple(z[1], p[2] - p[1], p[3] - p[1]),
            "wrist": triple(z[3], z[4], z[5]),
        }
    c, _ = nearest_point(z[3:n], p[3:n])
    regional = spec.regional.name
    if regional == "PARALLEL_23":
        found = {
            "shoulder": triple(z[1], z[0], c - p[0]),
            "elbow": triple(z[1], p[2] - p[1], c - p[1]),
        }
    elif regional == "PARALLEL_12":
        found = {
            "shoulder": triple(z[0], p[1] - p[0], c - p[0]),
            "elbow": triple(z[0], z[2], c - p[2]),
        }
    elif regional == "INTERSECTING_12":
        o, _ = nearest_point(z[:2], p[:2])
        found = {"shoulder": triple(c - o, z[0], z[1]), "elbow": triple(c - o, z[2], c - p[2])}
    else:
        o, _ = nearest_point(z[1:3], p[1:3])
        found = {"shoulder": triple(c - o, z[0], c - p[0]), "elbow": triple(c - o, z[1], z[2])}
    if n == 6:
        found["wrist"] = triple(z[3], z[4], z[5])
    return found


WRIST = [HALF, -HALF, 0.0]
# made when asked for: a native chain that lives in a module is reported as a leak at exit
SINGULAR = {
    "puma560": lambda: kv.load("puma560"),
    "kr16": lambda: kv.load("kr16"),
    "ur5": lambda: kv.load("ur5"),
    "adept_one": lambda: kv.load("adept_one"),
    "planar3r": lambda: kv.load("planar3r"),
    "parallel_12": lambda: arm(
        [0, 0.8, -HALF, *WRIST], a=[0.4, 0.3, 0.1, 0, 0, 0], d=[0, 0.1, 0, 0.3, 0, 0]
    ),
    "meeting_12": lambda: arm(
        [0.9, 0.8, -HALF, *WRIST], a=[0, 0.3, 0.1, 0, 0, 0], d=[0, 0.1, 0, 0.3, 0, 0]
    ),
    "meeting_23": lambda: arm(
        [0.9, 0.8, -HALF, *WRIST], a=[0.3, 0, 0.1, 0, 0, 0], d=[0, 0.1, 0, 0.3, 0, 0]
    ),
    "wrist first": lambda: arm(
        [HALF, -HALF, 0.9, 0.0, 0.7, 0.0], a=[0, 0, 0.1, 0.4, 0.2, 0.1], d=[0, 0, 0.3, 0.1, 0, 0.1]
    ),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_each_condition_is_singular_and_together_they_are_the_determinant(name):
    robot = SINGULAR[name]()
    spec = closed_form_spec(robot)
    named = {s.name for s in robot_class(robot).singularities}
    rng = np.random.default_rng(5)
    assert named == set(conditions(robot, spec, robot.random(rng=0)))

    def smallest(q):
        return np.linalg.svd(robot.jacobian(q), compute_uv=False)[robot.dof - 1]

    for condition in named:
        found = 0
        for _ in range(60):
            start, way = rng.uniform(-2, 2, robot.dof), rng.normal(size=robot.dof)
            f = lambda t: conditions(robot, spec, start + t * way)[condition]  # noqa: B023, E731
            if f(-1.0) * f(1.0) < 0:
                q = start + brentq(f, -1.0, 1.0, xtol=1e-15) * way
                assert smallest(q) < 1e-9, condition
                found += 1
            if found == 5:
                break
        assert found, f"{condition} never changed sign"
    if robot.dof == 6:
        # no factor is missing: the determinant over their product never grows without bound
        Q = rng.uniform(-3, 3, (300, 6))
        ratio = [
            np.linalg.det(robot.jacobian(q)) / np.prod(list(conditions(robot, spec, q).values()))
            for q in Q
        ]
        np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)


def test_the_elbow_of_seven_joints():
    iiwa = kv.load("iiwa14")
    assert [s.name for s in robot_class(iiwa).singularities] == ["elbow"]
    q = iiwa.random(rng=2)
    assert np.linalg.matrix_rank(iiwa.jacobian(q), tol=1e-9) == 6
    q[3] = 0.0
    assert np.linalg.matrix_rank(iiwa.jacobian(q), tol=1e-9) == 5


# ---------------------------------------------------------------------------- command line
def info(*arguments):
    from kinverse.cli import app

    done = CliRunner().invoke(app, ["info", *arguments], env={"COLUMNS": "80"})
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.parametrize("name", ["puma560", "panda", "adept_one", "planar3r", "ir361"])
def test_info_shows_the_class_in_eighty_columns(name):
    said = info(name)
    assert max(map(len, said.splitlines())) <= 80
    for word in (
        "relation",
        "class:",
        "regional structure:",
        "workspace:",
        "wrist:",
        "solver auto",
    ):
        assert word in said
    assert re.search(r"angle \(rad\)", said) and "angle (deg)" in info(name, "--degrees")


def test_info_as_json_holds_all_of_it():
    data = json.loads(info("adept_one", "--json"))
    said = json.loads(json.dumps(asdict(robot_class(kv.load("adept_one")))))
    assert data["class"] == said
    assert data["class"]["pairs"][1]["distance"] is None

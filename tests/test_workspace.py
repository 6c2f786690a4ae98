"""Planar workspaces: the exact edge against sampling, search and independent formulas."""

import sys
import time

import matplotlib.image
import numpy as np
import pytest
import scipy.optimize

import kinverse as kv
import oracle
from kinverse.paths import condition_5
from kinverse.workspace import PlanarWorkspace, workspace_figure
from kinverse.workspace import boundary as boundary_module

TURN = [-np.pi, np.pi]


def arm(lengths, limits=None, name="arm"):
    count = len(lengths)
    return kv.Robot.from_dh(
        a=lengths, d=0, alpha=0, joints="R" * count, limits=limits or [TURN] * count, name=name
    )


def drawn(count, seed):
    """An arm of random links and limits."""
    rng = np.random.default_rng(seed)
    limits = np.sort(rng.uniform(-3.1, 3.1, (count, 2)), axis=1)
    limits[rng.random(count) < 0.2] = TURN
    return arm(rng.uniform(0.1, 1.0, count), limits.tolist())


ARMS = {f"{n}R {seed}": drawn(n, seed) for n in (2, 3, 4) for seed in range(5)}
ARMS |= {
    "003": kv.load("planar3r_003"),
    "equal links, folding": arm([1, 1, 1], [[0, np.pi], [-np.pi, 0], [0, np.pi]]),
    "equal links, right angles": arm([1, 1, 1], [[0, np.pi / 2]] * 3),
    "first turns fully": arm([0.5, 0.8, 0.3], [TURN, [0.3, 2.0], [-1.0, 0.5]]),
    "joints on one axis": arm([0.5, 0.0, 0.8, 0.0], [[0, 1], [0.2, 0.5], [-0.4, 0.3], [0, 1]]),
    "full": arm([0.5, 0.9, 0.3]),
    "full with a hole": arm([1.0, 0.2, 0.3]),
}
every = pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS.keys())


def box(space, count, seed):
    far = space.annulus[1]
    return space.center + np.random.default_rng(seed).uniform(-far, far, (count, 2)), 4 * far**2


def assert_closed(space, within=1e-6):
    """Gone along with what is reached on the left, where one arc ends another begins."""
    begin, end = [], []
    for arc in space.boundary:
        first, last = arc.points(2)
        begin.append(first if arc.reached == "inside" else last)
        end.append(last if arc.reached == "inside" else first)
    apart = np.linalg.norm(np.array(end)[:, None] - np.array(begin), axis=-1)
    next_arc = scipy.optimize.linear_sum_assignment(apart)[1]
    assert apart[np.arange(len(begin)), next_arc].max() < within * space.annulus[1]


def sampled(space, count, seed):
    """Area by sampling [m^2], and its standard deviation."""
    points, area = box(space, count, seed)
    share = space.reaches(points).mean()
    return area * share, area * np.sqrt(max(share * (1 - share), 1 / count) / count)


# ---------------------------------------------------------------------------- reachable
@every
def test_every_posture_is_inside(robot):
    space = PlanarWorkspace(robot)
    points = space.points(5000, 3)
    reached = space.reaches(points)
    # what lies on the edge within rounding may go either way: none of random postures does
    assert reached.all()
    low, high = space.annulus
    far = np.linalg.norm(points - space.center, axis=1)
    assert (far <= high * (1 + 1e-12)).all() and (far >= low - 1e-12).all()


@every
def test_what_is_reached_can_be_solved_and_the_rest_not(robot):
    space = PlanarWorkspace(robot)
    points, _ = box(space, 300, 5)
    T = kv.pose(np.hstack([points, np.zeros((300, 1))]))
    found = kv.solve(robot, T, solver=kv.Numerical(task="position", max_starts=60))
    reached = space.reaches(points)
    assert np.array_equal(found.ok, reached)
    assert 0 < reached.sum() < 300


@every
def test_the_edge_encloses_the_area_that_is_reached(robot):
    space = PlanarWorkspace(robot)
    area, error = sampled(space, 100_000, 7)
    assert space.area == pytest.approx(area, abs=4 * error)


@every
def test_the_edge_parts_reached_from_not_reached(robot):
    space = PlanarWorkspace(robot)
    step = 1e-6 * space.annulus[1]
    for arc in space.boundary:
        assert arc.end > arc.start and arc.radius > 0
        t = np.linspace(arc.start, arc.end, 9)[1:-1]
        ray = np.stack([np.cos(t), np.sin(t)], axis=1)
        inner = space.reaches(arc.center + (arc.radius - step) * ray)
        outer = space.reaches(arc.center + (arc.radius + step) * ray)
        assert (inner == (arc.reached == "inside")).all()
        assert (outer == (arc.reached == "outside")).all()
    assert_closed(space)


# circles that are nearly one, arcs that touch from outside, and equal links at even angles
CLOSE = {
    "circles 3e-7 m apart": arm(
        [1.288, 1.477, 0.486, 0.673],
        [[0.712, 5.147], [0.387, 4.819], [-0.435, -0.179], [-1.290, 1.565]],
    ),
} | {
    # the outermost circle and that of the bent last link are 0.25 d^2 apart
    f"last joint almost straight, {d:g} rad": arm([1.0, 0.5, 0.5], [[0, 2], [0, 1.5], [-d, 1]])
    for d in (1e-1, 1e-2, 1e-3, 2e-4, 1e-4, 5e-5, 1e-6, 1e-9)
}


@pytest.mark.parametrize("robot", CLOSE.values(), ids=CLOSE.keys())
def test_arcs_that_nearly_coincide_are_counted_once(robot):
    space = PlanarWorkspace(robot)
    area, error = sampled(space, 100_000, 8)
    assert space.area == pytest.approx(area, abs=4 * error)
    assert_closed(space, 1e-4)


def test_the_area_changes_with_a_limit_as_little_as_the_arm():
    # to where arcs are one within rounding; straight is reached from d = 0 on
    def area(d):
        return PlanarWorkspace(arm([1.0, 0.5, 0.5], [[0, 2], [-0.3, 1.5], [-d, 1]])).area

    bare = area(0.0)
    for d in np.geomspace(1e-11, 1e-3, 25):
        assert area(d) == pytest.approx(bare, abs=1e-5 + 0.02 * d)


def nice(count, rng):
    """An arm of even links and angles, whose arcs coincide and touch."""
    limits = np.sort(rng.integers(-6, 7, (count, 2)), axis=1)
    limits[:, 1] += limits[:, 0] == limits[:, 1]
    return arm(rng.choice([0.5, 1.0, 1.0, 2.0], count), (limits * np.pi / 6).tolist())


def plain(count, rng):
    low = rng.uniform(-3.1, 3.0, count)
    limits = np.stack(
        [low, low + rng.choice([0.1, 0.5, 2, 5], count) * rng.uniform(0.2, 1, count)], 1
    )
    limits[rng.random(count) < 0.15] = TURN
    return arm(rng.uniform(0.1, 1.5, count), limits.tolist())


@pytest.mark.slow
@pytest.mark.parametrize("make", [plain, nice])
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_random_arms_have_the_area_that_is_sampled(make, count):
    rng = np.random.default_rng(count)
    for seed in range(100):
        space = PlanarWorkspace(make(count, rng))
        area, error = sampled(space, 20_000, seed)
        # 800 arms in all: five standard deviations are never left by chance
        assert space.area == pytest.approx(area, abs=5 * error), space.robot.limits
        assert_closed(space, 1e-4)


def test_an_edge_that_does_not_close_is_refused(monkeypatch):
    space = PlanarWorkspace(ARMS["003"])
    found = boundary_module._joined
    monkeypatch.setattr(boundary_module, "_joined", lambda *args: found(*args)[1:])
    with pytest.raises(kv.NoSolution, match=r"does not close at \(.*\) m"):
        _ = space.boundary


def test_full_turns_leave_an_annulus():
    for lengths in ([10, 7, 5], [10, 2, 3], [1, 1], [3, 1, 0.5, 0.2, 0.1, 0.05, 0.3]):
        space = PlanarWorkspace(arm(lengths))
        low, high = max(0, 2 * max(lengths) - sum(lengths)), sum(lengths)
        np.testing.assert_allclose(space.annulus, (low, high), atol=1e-12)
        assert space.area == pytest.approx(np.pi * (high**2 - low**2))
        assert [arc.reached for arc in space.boundary] == ["inside", "outside"][: 1 + (low > 0)]
        # the same, by the postures on the edge, which know nothing of the formula
        almost = PlanarWorkspace(
            arm(lengths[:3], [TURN, TURN, [-np.pi, np.pi - 1e-6]][: len(lengths)])
        )
        low, high = almost.annulus
        assert almost.area == pytest.approx(np.pi * (high**2 - low**2), rel=1e-6)


def test_document_003_figure_4():
    # its links and ranges: the outermost arcs, by hand
    space = PlanarWorkspace(kv.load("planar3r_003"))
    arcs = {
        (round(a.center[0], 9), round(a.center[1], 9), round(a.radius, 9)) for a in space.boundary
    }
    assert {(0, 0, 22), (10, 0, 12), (-3, 0, 5), (-17, 0, 5)} <= arcs
    assert (0, 0, round(float(np.hypot(3, 5)), 9)) in arcs
    assert "0 to 22 m, joints have limits" in repr(space)


# ---------------------------------------------------------------------------- dextrous
@pytest.mark.parametrize(
    "lengths", [[10, 7, 5], [10, 2, 3], [5, 5, 1], [3, 2, 9], [1, 2, 0.5, 0.4]]
)
def test_the_dextrous_set_is_where_every_orientation_is_reached(lengths):
    space = PlanarWorkspace(arm(lengths))
    r = np.linspace(0.003, sum(lengths), 97)
    inside = np.zeros(len(r), dtype=bool)
    for low, high in space.dextrous_radii:
        inside |= (low <= r) & (r <= high)
    rest = PlanarWorkspace(arm(lengths[:-1]))
    turn = np.linspace(0, 2 * np.pi, 721)
    wrist = np.stack(
        [r[:, None] - lengths[-1] * np.cos(turn), -lengths[-1] * np.sin(turn) + 0 * r[:, None]], -1
    )
    always = rest.reaches(wrist.reshape(-1, 2)).reshape(len(r), -1).all(axis=1)
    assert np.array_equal(inside, always)


def test_service_is_one_on_the_dextrous_set_only():
    space = PlanarWorkspace(arm([10, 7, 5]))
    np.testing.assert_allclose(space.dextrous_radii, [[0, 2], [8, 12]])
    r = np.array([0.5, 1.9, 2.3, 5.0, 7.8, 8.1, 11.9, 12.3, 21.0, 23.0])
    points = np.stack([r * np.cos(r), r * np.sin(r)], axis=1)
    share = space.service(points, 180)
    assert np.array_equal(
        share == 1, [True, True, False, False, False, True, True, False, False, False]
    )
    assert share[-1] == 0.0
    # condition (5) of document 003 says the same of each orientation
    turn = 2 * np.pi * np.arange(180) / 180
    rpy = np.stack([0 * turn, 0 * turn, turn], axis=1)
    for (x, y), of_all in zip(points, share, strict=True):
        T = kv.pose(np.tile([x, y, 0], (180, 1)), rpy=rpy)
        assert condition_5([10, 7, 5], T).holds.mean() == of_all


def test_service_with_limits_is_the_share_of_postures_direction():
    robot = kv.load("planar3r_003")
    space = PlanarWorkspace(robot)
    points = space.points(40, 2)
    share = space.service(points, 720)
    unlimited = PlanarWorkspace(robot.with_limits([TURN] * 3)).service(points, 720)
    assert (share > 0).all() and (share <= unlimited).all() and (share < 1).all()
    assert not space.service([[-10.0, -10.0]], 720).any()
    with pytest.raises(kv.InputError, match="has joints with limits.*service"):
        _ = space.dextrous_radii


@pytest.mark.parametrize("limits", [None, [[-2, 2], [-1, 2.5]]])
def test_two_joints_give_no_share_of_directions_and_at_once(limits):
    robot = kv.Robot.from_dh([0.5, 0.4], 0, 0, joints="RR", limits=limits)
    space = PlanarWorkspace(robot)
    begun = time.process_time()
    assert not space.service(space.points(2000), 72).any()
    assert time.process_time() - begun < 2.0
    # but where both turn about the tool: every way, or what the limits leave
    even = PlanarWorkspace(arm([0.5, 0.5], None if limits is None else [[-2, 2], [0, TURN[1]]]))
    share = even.service([[0.0, 0.0]], 720)[0]
    assert share == pytest.approx(1.0 if limits is None else 2.0 / np.pi, abs=2e-3)


def test_service_is_what_a_solver_finds():
    rng = np.random.default_rng(6)
    for _ in range(8):
        narrow = np.sort(rng.uniform(-3, 3, (3, 2)), axis=1)
        limits = np.where(rng.random(3)[:, None] < 0.5, TURN, narrow)
        robot = kv.Robot.from_dh(
            rng.uniform(0.1, 0.6, 3), 0, rng.choice([0, np.pi], 3), rng.uniform(-2, 2, 3),
            joints="RRR", limits=limits, base=kv.pose([0.3, 0.2, 0.1], rpy=[0, 0, 0.4]),
        )  # fmt: skip
        space = PlanarWorkspace(robot)
        points = space.points(5, rng)
        turn = 2 * np.pi * np.arange(36) / 36
        flat = robot.with_base(np.linalg.inv(space.frame))
        at_zero = flat.fk(np.zeros(3))[:3, :3]
        T = np.tile(np.eye(4), (5, 36, 1, 1))
        T[..., :3, :3] = [oracle.rot_z(a) @ at_zero for a in turn]
        T[..., :2, 3] = points[:, None]
        solved = kv.Analytic(task="planar").fit(flat).solve(T.reshape(-1, 4, 4)).ok
        np.testing.assert_array_equal(space.service(points, 36), solved.reshape(5, 36).mean(axis=1))


# ---------------------------------------------------------------------------- any plane, any zero
def test_another_plane_base_and_zero_change_nothing():
    limits = [[-0.5, 1.0], [0.2, 2.0], [-1.0, 0.4]]
    plain = PlanarWorkspace(arm([0.5, 0.8, 0.3], limits))
    base = kv.pose([0.3, -0.2, 0.7], rpy=[0.4, 1.2, -0.8])
    tool = kv.pose(rpy=[0.3, 0.1, 0.2])
    placed = PlanarWorkspace(arm([0.5, 0.8, 0.3], limits).with_base(base).with_tool(tool))
    assert placed.area == pytest.approx(plain.area, rel=1e-6)
    q = placed.robot.random(50, 3)
    points = (placed.robot.fk(q)[:, :3, 3] - placed.frame[:3, 3]) @ placed.frame[:3, :3]
    np.testing.assert_allclose(points[:, 2], 0, atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(points[:, :2] - placed.center, axis=1),
        np.linalg.norm(plain.robot.fk(q)[:, :2, 3], axis=1),
    )
    assert placed.reaches(points[:, :2]).all() and (placed.service(points[:, :2]) > 0).all()
    at = plain.robot.fk(q)[:, :2, 3]
    np.testing.assert_allclose(
        placed.service(points[:, :2], 2000), plain.service(at, 2000), atol=2e-3
    )


def test_axes_that_point_the_other_way():
    # rows with a half turn between them, as SCARA tables have
    there = kv.Robot.from_dh(
        a=[0.4, 0.3, 0.2], d=[0.1, 0, 0], alpha=[np.pi, 0, 0], joints="RRR",
        limits=[[-1, 1], [-0.5, 2], [0, 1]],
    )  # fmt: skip
    same = arm([0.4, 0.3, 0.2], [[-1, 1], [-2, 0.5], [-1, 0]])
    assert PlanarWorkspace(there).area == pytest.approx(PlanarWorkspace(same).area, rel=1e-9)
    assert PlanarWorkspace(there).reaches(PlanarWorkspace(there).points(500)).all()


# ---------------------------------------------------------------------------- picture, bad input
def test_the_picture_shows_it(tmp_path, monkeypatch):
    for name, robot in (("limited", ARMS["003"]), ("full", ARMS["full"])):
        file = tmp_path / f"{name}.png"
        space = PlanarWorkspace(robot)
        figure = workspace_figure(space, points=200, orientations=8)
        figure.savefig(file, dpi=40)
        assert matplotlib.image.imread(file)[..., :3].std() > 0.05
        lines = figure.axes[0].get_lines()
        shown = np.vstack([line.get_xydata() for line in lines if line.get_color() == "tab:red"])
        assert np.abs(shown).max() == pytest.approx(space.annulus[1], rel=1e-3)
        assert "[m]" in figure.axes[0].get_xlabel()
    assert workspace_figure(space, points=0, orientations=0).axes
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(kv.MissingExtra, match=r"kinverse\[plot\]"):
        workspace_figure(space)


def test_the_same_seed_gives_the_same_points():
    space = PlanarWorkspace(ARMS["003"])
    assert np.array_equal(space.points(9, 4), space.points(9, 4))
    assert not np.array_equal(space.points(9, 4), space.points(9, 5))
    assert space.points(0).shape == (0, 2) and space.reaches(np.empty((0, 2))).shape == (0,)


def test_robots_that_are_not_planar():
    for robot, says in [
        ("planar", "must be a kinverse.Robot"),
        (kv.load("puma560"), "axis of .* is not parallel"),
        (kv.load("adept_one"), "'joint3' slides"),
        (arm([0.3]), "one joint"),
        (arm([0.0, 0.0]), "does not move its tool"),
    ]:
        with pytest.raises(kv.InputError, match=says):
            PlanarWorkspace(robot)


def test_arguments_that_cannot_be_used():
    space = PlanarWorkspace(ARMS["003"])
    for call, says in [
        (lambda: space.reaches([1, 2]), r"shape \(N, 2\)"),
        (lambda: space.reaches([[1, 2], [np.nan, 0]]), r"points\[1\] \(row 1\) is not finite"),
        (lambda: space.service([[1, 2]], 0), "orientations must be"),
        (lambda: space.points(-1), "count must be"),
        (lambda: PlanarWorkspace(drawn(7, 1)).boundary, "up to 6 joints"),
    ]:
        with pytest.raises(kv.InputError, match=says):
            call()

"""Pictures of searches: what is drawn is what was searched."""

import sys

import matplotlib.image
import numpy as np
import pytest

import kinverse as kv
from kinverse import plots
from kinverse.cli import main
from kinverse.paths import simulate, track
from kinverse.simulation_plots import simulation_figure
from kinverse.workspace import PlanarWorkspace, workspace_figure


@pytest.fixture(scope="module")
def solver():
    return kv.Swarm(max_evals=600).fit(kv.load("puma560"))


@pytest.fixture(scope="module")
def T(solver):
    return solver.robot_.fk(solver.robot_.random(5, 12345))


def axes():
    return plots.new_figure((4, 3)).subplots()


def test_what_is_watched_is_what_is_solved(solver, T):
    history = solver.watch(T, rng=3)
    alone = kv.Swarm(max_evals=600, polish=False).fit(solver.robot_).solve(T, rng=3)
    np.testing.assert_array_equal(history.best[-1], alone.stats.cost)
    assert history.population.shape == (6, 5, 100, 6)
    assert (np.diff(history.best, axis=0) <= 0).all()


def test_the_cost_is_that_of_the_search(solver, T):
    s = kv.Swarm(max_evals=600, polish=False).fit(solver.robot_).solve(T, rng=3)
    assert solver.cost(T[2], s.stats.best_q[2]) == pytest.approx(s.stats.cost[2], rel=1e-12)
    assert solver.cost(T[2], s.stats.best_q[None, :, None]).shape == (1, 5, 1)


def test_convergence_draws_median_and_quartiles(solver, T):
    history, ax = solver.watch(T), axes()
    plots.convergence(ax, {"pso": history})
    (line,) = ax.get_lines()
    np.testing.assert_allclose(line.get_ydata(), np.median(history.best, axis=1))
    np.testing.assert_allclose(line.get_xdata(), np.arange(1, 7) * 100)
    assert len(ax.collections) == 1 and ax.get_yscale() == "log"


def test_history_and_histograms_draw_every_member(solver, T):
    history, ax = solver.watch(T), axes()
    plots.search_history(ax, solver.robot_, history, pose=2, joints=(1, 3))
    drawn = ax.collections[0].get_offsets()
    points = np.degrees(history.population[:, 2])
    np.testing.assert_allclose(drawn, points[..., [1, 3]].reshape(-1, 2))
    assert "deg" in ax.get_xlabel()
    ax = axes()
    plots.joint_histograms(ax, solver.robot_, history, pose=2)
    assert len(ax.patches) == 6


def test_the_surface_is_lowest_where_the_solution_is(solver, T):
    q = kv.solve(solver.robot_, T[0]).q[0]
    ax = axes()
    plots.fitness_surface(ax, solver, T[0], q, joints=(1, 2))
    (mark,) = ax.get_lines()
    np.testing.assert_allclose([*mark.get_xdata(), *mark.get_ydata()], np.degrees(q[1:3]))


@pytest.mark.parametrize("name", ["planar3r", "adept_one", "panda"])
def test_any_arm_can_be_drawn(name, tmp_path):
    robot = kv.load(name)
    solver = kv.Swarm(max_evals=300, optimizer="bees").fit(robot)
    figure = plots.swarm_figure(solver, robot.fk(robot.random(2, 1)))
    figure.savefig(tmp_path / "a.png", dpi=50)
    picture = matplotlib.image.imread(tmp_path / "a.png")
    assert picture.shape[:2] == (400, 550) and picture[..., :3].std() > 0.05


def test_one_joint_is_drawn_over_itself(tmp_path):
    robot = kv.Robot.from_dh([0.3], 0, 0, joints="R")
    plots.swarm_figure(kv.Swarm(max_evals=200).fit(robot), robot.fk([0.3])).savefig(
        tmp_path / "a.svg"
    )


def test_without_matplotlib_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(kv.MissingExtra, match=r"kinverse\[plot\]"):
        plots.new_figure((4, 3))


# ---------------------------------------------------------------------------- joint paths
def heights(ax, style):
    return sorted({line.get_ydata()[0] for line in ax.get_lines() if line.get_ls() in style})


def test_a_joint_path_shows_units_and_the_limits_in_view():
    robot = kv.Robot.from_dh(
        [0.4, 0.3, 0], 0, 0, joints="RRP", limits=[[-0.3, 3], [0.2, 2.9], [-0.5, 0.5]]
    )
    q = np.linspace([-0.3, 0.3, -0.1], [0.4, 1.0, 0.2], 30)
    figure = plots.joint_path_figure(track(robot, robot.fk(q), q_start=q[0]))
    above, below, slides = figure.axes
    assert above.get_ylabel() == "joint values [deg or m]"
    assert below.get_ylabel() == "largest step [deg]" and slides.get_ylabel() == "largest step [m]"
    # 0.2 rad and the slide's ends are among -17 to 57 deg; 2.9 and 3 rad are not
    assert heights(above, ("--",)) == pytest.approx([*np.degrees([-0.3]), -0.5, 0.5, 11.4592], 1e-4)
    np.testing.assert_allclose(below.get_lines()[0].get_ydata(), np.degrees(0.7 / 29), rtol=1e-6)
    np.testing.assert_allclose(slides.get_lines()[0].get_ydata(), 0.3 / 29, rtol=1e-6)


def test_legends_lie_beside_the_curves():
    robot = kv.load("ur5")
    q = np.linspace([0.3, -1, 1, 0.2, 1, 0], [0.8, -1.2, 1.3, 0.4, 0.6, 0.3], 20)
    runs = {"a": simulate(robot, [0.0, 0.1], q[:2]), "b": simulate(robot, [0.0, 0.1], q[1:3])}
    for figure in (
        plots.joint_path_figure(track(robot, robot.fk(q))),
        simulation_figure(runs),
        workspace_figure(PlanarWorkspace(kv.load("planar3r")), points=10, orientations=4),
    ):
        figure.draw_without_rendering()
        legends = figure.legends + [ax.get_legend() for ax in figure.axes if ax.get_legend()]
        boxes = [legend.get_window_extent() for legend in legends]
        assert boxes
        for ax in figure.axes:
            assert not any(box.overlaps(ax.get_window_extent()) for box in boxes)


# ---------------------------------------------------------------------------- command line
POSE = ["--pose", "0.4", "0.3", "1.9", "10", "0", "20", "--degrees"]


def test_solve_draws(tmp_path, capsys):
    path = tmp_path / "search.png"
    assert main(["solve", "kr16", *POSE, "--solver", "swarm:bees", "--plot", str(path)]) == 0
    assert path.stat().st_size > 10_000
    assert "drawn" in capsys.readouterr().err


def test_compare_draws(tmp_path, capsys):
    path = tmp_path / "compare.svg"
    names = "analytic,swarm:pso,swarm:bees"
    given = ["compare", "kr16", "--poses", "3", "--solvers", names, "--plot", str(path)]
    assert main(given) == 0
    text = path.read_text(encoding="utf-8")
    assert text.startswith("<?xml") and "swarm:bees" in text
    capsys.readouterr()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["solve", "kr16", *POSE, "--plot", "a.png"], "swarm:pso"),
        (["solve", "kr16", *POSE, "--solver", "swarm", "--plot", "a.txt"], ".png, .svg or .pdf"),
        (["solve", "kr16", *POSE, "--solver", "swarm", "--plot", "no/a.png"], "no folder"),
        (["compare", "kr16", "--solvers", "analytic", "--plot", "a.png"], "swarm:pso"),
    ],
)
def test_a_picture_that_cannot_be_is_refused(given, said, capsys):
    assert main(given) == 2
    assert said in capsys.readouterr().err

"""Pictures and tables of trainings: what is drawn and told is what was trained."""

import sys

import matplotlib.image
import numpy as np
import pytest

import kinverse as kv
from kinverse import InputError, plots, training_plots
from kinverse.learning import RegressionTable, regression_table
from kinverse.networks import MLP, RBFNetwork
from kinverse.training_report import solver_report, training_report


@pytest.fixture(scope="module")
def rows():
    """Angles of two links from where they reach, and a column that is a length."""
    rng = np.random.default_rng(4)
    q = rng.uniform(0.2, 1.2, (300, 2))
    X = np.stack([np.cos(q).sum(axis=1), np.sin(q).sum(axis=1), q[:, 0]], axis=1)
    return X, np.hstack([q, 0.1 * q[:, :1]])


@pytest.fixture(scope="module")
def network(rows):
    X, y = rows
    return MLP(6, max_iter=5, early_stopping=True, random_state=0).fit(X[:200], y[:200])


def axes(count=None):
    figure = plots.new_figure((6, 3))
    return figure.subplots() if count is None else figure.subplots(1, count)


def seen(figure, path):
    figure.savefig(path, dpi=50)
    return matplotlib.image.imread(path)


# ---------------------------------------------------------------------------- table
def test_the_table_holds_correlation_error_and_epochs(rows, network):
    X, y = rows
    y_pred = network.predict(X)
    table = regression_table(y, y_pred, ("a", "b", "d"), network.n_iter_)
    for k in range(3):
        assert table.r[k] == pytest.approx(np.corrcoef(y[:, k], y_pred[:, k])[0, 1])
        assert table.mse[k] == pytest.approx(np.mean((y[:, k] - y_pred[:, k]) ** 2))
    assert table.names == ("a", "b", "d") and table.epochs == (network.n_iter_,) * 3
    assert table.mean_r == pytest.approx(np.mean(table.r))
    assert table.mean_mse == pytest.approx(np.mean(table.mse))
    assert regression_table(y, y_pred, epochs=(1, 2, 6)).mean_epochs == 3.0
    assert regression_table(y, y_pred).names == ("1", "2", "3")
    with pytest.raises(AttributeError):
        table.r = ()


def test_perfect_opposite_and_constant_predictions():
    y = np.array([[0.0, 1.0, 2.0], [1.0, 0.0, 2.0], [2.0, 5.0, 2.0]])
    table = regression_table(y, y * [1.0, -1.0, 1.0])
    assert table.r[0] == pytest.approx(1.0) and table.mse[0] == 0.0
    assert table.r[1] == pytest.approx(-1.0)
    assert np.isnan(table.r[2]) and table.mse[2] == 0.0 and np.isnan(table.mean_r)
    assert isinstance(regression_table([1.0, 2.0], [1.0, 2.5]), RegressionTable)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (([[1.0]], [[1.0, 2.0]]), "one shape"),
        (([], []), "with rows"),
        (([[1.0], [np.nan]], [[1.0], [1.0]]), "y_true is not finite in row 1"),
        (([1.0, 2.0], [np.inf, 1.0]), "y_pred is not finite in row 0"),
        (([1.0, 2.0], [1.0, 2.0], ("a", "b")), "names must be one for each of 1 columns, got 2"),
        (([1.0, 2.0], [1.0, 2.0], None, (1, 2)), "epochs must be one for each"),
        (([[1.0], [1.0, 2.0]], [1.0]), "ragged"),
    ],
)
def test_a_table_of_what_does_not_belong_together_is_refused(given, says):
    with pytest.raises(InputError, match=says):
        regression_table(*given)


# ---------------------------------------------------------------------------- pictures
def test_the_curve_is_the_record_in_degrees(network):
    ax = axes()
    training_plots.training_curve(ax, network, ("a", "b", "d"), ("deg", "deg", "m"))
    lines = {line.get_label(): line for line in ax.get_lines() if line.get_linestyle() == "-"}
    dashed = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
    scale = np.degrees(1.0) ** 2 * np.array([1.0, 1.0, 0.0]) + [0.0, 0.0, 1.0]
    for k, name in enumerate(("a", "b", "d")):
        np.testing.assert_allclose(
            lines[name].get_ydata(), network.training_mse_[:, k] * scale[k], rtol=1e-12
        )
        np.testing.assert_allclose(
            dashed[k].get_ydata(), network.validation_mse_[:, k] * scale[k], rtol=1e-12
        )
        assert lines[name].get_color() == dashed[k].get_color()
        np.testing.assert_array_equal(lines[name].get_xdata(), np.arange(1, network.n_iter_ + 1))
    assert ax.get_yscale() == "log" and ax.get_ylabel() == "mean squared error [deg², m²]"


def test_a_network_without_rows_held_back_has_no_dashes(rows):
    X, y = rows
    for net in (RBFNetwork(5), RBFNetwork(selection="exact"), MLP(4, max_iter=2)):
        ax = axes()
        training_plots.training_curve(ax, net.fit(X[:60], y[:60]))
        assert [line.get_linestyle() for line in ax.get_lines()] == ["-"] * 3
        assert "held back" not in ax.get_title()


def test_regression_draws_every_row_joint_by_joint(rows, network):
    X, y = rows
    y_pred = network.predict(X)
    three = axes(3)
    training_plots.regression(three, y, y_pred, ("a", "b", "d"), ("deg", "deg", "m"))
    table = regression_table(y, y_pred)
    for k, ax in enumerate(three):
        scale = 1.0 if k == 2 else np.degrees(1.0)
        drawn = ax.collections[0].get_offsets()
        np.testing.assert_allclose(drawn, np.stack([y[:, k], y_pred[:, k]], axis=1) * scale)
        (line,) = ax.get_lines()
        np.testing.assert_array_equal(line.get_xdata(), line.get_ydata())
        assert f"r {table.r[k]:.4f}" in ax.get_title()
        assert f"MSE {table.mse[k] * scale**2:.3g} " in ax.get_title()
        assert ax.get_xlabel() == ("true [m]" if k == 2 else "true [deg]")


def test_the_histogram_counts_what_lies_inside():
    errors = np.radians(np.random.default_rng(0).normal(size=(1000, 2)))
    errors[0, 0] = 50.0  # one that would squeeze all others into one bar
    ax = axes()
    training_plots.error_histogram(ax, errors, ("a", "b"))
    end = np.quantile(np.abs(np.degrees(errors)), 0.99)
    low, high = ax.get_xlim()
    assert high < 1.2 * end < 4.0 and low == pytest.approx(-high)
    beyond = 100.0 * np.mean(np.abs(np.degrees(errors)) > end)
    assert ax.get_title() == f"errors ({beyond:.1f} % are beyond)"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["a", "b"]
    assert ax.get_xlabel() == "predicted less true [deg]"


def test_no_error_at_all_is_drawn():
    ax = axes()
    training_plots.error_histogram(ax, np.zeros((20, 1)), unit="m")
    assert len(ax.patches) == 1 and ax.get_xlabel() == "predicted less true [m]"


def test_what_cannot_be_drawn_is_refused(rows, network):
    X, y = rows
    with pytest.raises(InputError, match="names must be one for each of 3 columns, got 1"):
        training_plots.training_curve(axes(), network, ["a"])
    with pytest.raises(InputError, match="units must be 'deg', 'm', '', got 'rad'"):
        training_plots.training_curve(axes(), network, units=("rad",) * 3)
    with pytest.raises(InputError, match="names must differ"):
        training_plots.training_curve(axes(), network, ("a", "a", "b"))
    with pytest.raises(InputError, match="keeps no record"):
        training_plots.training_curve(axes(), object())
    with pytest.raises(InputError, match="axes must be one for each of 3 columns, got 2"):
        training_plots.regression(axes(2), y, y)
    with pytest.raises(InputError, match="not finite in row 1"):
        training_plots.error_histogram(axes(), [0.0, np.nan])
    with pytest.raises(InputError, match="one shape"):
        training_report(network, X, y[:, :2])


# ---------------------------------------------------------------------------- reports
def test_a_networks_report_has_all_of_it(rows, network, tmp_path):
    X, y = rows
    figure = training_report(network, X[200:], y[200:], ("a", "b", "d"), ("deg", "deg", "m"))
    titles = [ax.get_title() for ax in figure.axes]
    assert titles[0] == "training, dashed: held back" and "regression on 100 rows" in titles
    assert sum(title.startswith("errors") for title in titles) == 2  # degrees and metres
    assert sum("\nr " in title for title in titles) == 3
    table = next(ax for ax in figure.axes if ax.get_title().startswith("regression")).tables[0]
    cells = {place: cell.get_text().get_text() for place, cell in table.get_celld().items()}
    expected = regression_table(y[200:], network.predict(X[200:]))
    assert cells[1, 1] == f"{expected.r[0]:.4f}" and cells[1, 3] == str(network.n_iter_)
    assert cells[4, 0] == "mean" and cells[4, 1] == f"{expected.mean_r:.4f}"
    assert cells[4, 2] == "-"  # squared degrees and squared metres have no mean
    picture = seen(figure, tmp_path / "a.png")
    assert picture.shape[1] == 650 and picture[..., :3].std() > 0.05


def test_any_regressor_has_a_report(rows, tmp_path):
    from sklearn.linear_model import LinearRegression

    X, y = rows
    figure = training_report(LinearRegression().fit(X, y[:, :1]), X, y[:, 0])
    assert figure.axes[0].get_title() == "training: no record"
    seen(figure, tmp_path / "a.png")


@pytest.mark.parametrize(
    ("name", "settings", "curves"),
    [
        ("kr16", {}, 8),
        ("adept_one", {}, 2),
        ("panda", {}, 7),
        ("planar3r_003", {"virtual": "cos_sin", "task": "position"}, 3),
    ],
)
def test_any_arms_solver_has_a_report(name, settings, curves, tmp_path):
    robot = kv.load(name)
    network = MLP(5, max_iter=3, early_stopping=True)
    solver = kv.Learned(network, n_samples=150, **settings).fit(robot)
    rows = solver.held_out(120)
    figure = solver_report(solver, rows)
    lines = figure.axes[0].get_lines()
    assert sum(line.get_linestyle() == "-" for line in lines) == curves
    assert sum(line.get_linestyle() == "--" for line in lines) == curves
    drawn = [ax for ax in figure.axes if "\nr " in ax.get_title()]
    units = training_plots.joint_units(robot)
    assert len(drawn) == robot.dof and units.count("m") == robot.kinds.count("P")
    for k, ax in enumerate(drawn):
        scale = np.degrees(1.0) if units[k] == "deg" else 1.0
        points = np.stack([rows.q[:, k], rows.predicted[:, k]], axis=1)
        np.testing.assert_allclose(ax.collections[0].get_offsets(), points * scale)
    assert seen(figure, tmp_path / "a.png")[..., :3].std() > 0.05


def test_fusion_has_a_report(tmp_path):
    robot = kv.load("ir361")
    centre = robot.limits.mean(axis=1) + [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    solver = kv.Fusion(RBFNetwork(20, spread=3.0), region=(centre, 0.05), n_poses=20).fit(robot)
    figure = solver_report(solver, title="a title")
    assert len(figure.axes[0].get_lines()) == 6
    assert figure.get_suptitle() == "a title"
    assert seen(figure, tmp_path / "a.png")[..., :3].std() > 0.05


def test_an_angle_and_its_whole_turn_are_one():
    robot = kv.load("kr16")
    rows = kv.Learned(MLP(5, max_iter=3), n_samples=150).fit(robot).held_out(120)
    circular = np.ptp(robot.limits, axis=1) >= 2 * np.pi - 1e-6
    assert circular.any()
    assert np.abs(rows.predicted - rows.q)[:, circular].max() <= np.pi + 1e-9


def test_without_matplotlib_the_extra_is_named(rows, network, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(kv.MissingExtra, match=r"kinverse\[plot\]"):
        training_report(network, *rows)

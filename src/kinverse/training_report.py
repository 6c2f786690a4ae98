"""A figure for each trained network or solver; angles in degrees. Needs the extra "plot"."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.learning import RegressionTable, regression_table
from kinverse.learning.regression_table import columns
from kinverse.plots import new_figure
from kinverse.training_plots import (
    UNITS,
    by_name,
    draw_curves,
    error_histogram,
    headed,
    joint_units,
    recorded,
    regression,
    squared,
    training_curve,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["solver_report", "training_report"]

Array = NDArray[np.float64]

ACROSS = 4
"""Regressions side by side."""


def training_report(
    network: Any,
    X: ArrayLike,
    y: ArrayLike,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
    title: str = "",
) -> "Figure":
    """One network: its training, its errors on rows that it has not seen, their regression.

    Args:
        network: fitted; of ``kinverse.networks``, or any regressor without the curve.
        X: (N, n) rows held out.
        y: (N, m) their targets [rad or m].
        names: of the targets; None: "1", "2", ...
        units: "deg" (of radians), "m" or "" for each target; None: all "deg".
        title: over all; None: the network's class.

    Raises:
        MissingExtra: Matplotlib is not installed.
        InputError: what does not belong together in number or shape.

    Example:
        >>> training_report(net, X_test, y_test, units=("deg",) * 6).savefig("net.png")
    """
    y_true = columns(y, "y")
    y_pred = columns(network.predict(X), "predictions")
    names, units = headed(y_true.shape[1], names, units)
    numbers = regression_table(y_true, y_pred, names, getattr(network, "n_iter_", 0))
    figure, ax = _report(y_true, y_pred, numbers, units, title or type(network).__name__)
    if recorded(network) is not None:
        training_curve(ax, network, names, units)
    else:
        _say_nothing(ax)
    return figure


def solver_report(solver: Any, rows: Any = None, title: str = "") -> "Figure":
    """A trained solver: the training of its networks, and predictions held out, joint by joint.

    The rows of all networks are drawn together. With several networks their curves are means over
    the turning joints (over the slides, if none turns).

    Args:
        solver: a fitted ``kv.Learned`` or ``kv.Fusion``.
        rows: what its ``held_out`` gave; None: asked for.
        title: over all; "": the robot and the solver.

    Raises:
        MissingExtra: Matplotlib is not installed.
        InputError: not fitted.

    Example:
        >>> solver_report(kv.Learned().fit(robot)).savefig("learned.png")
    """
    rows = solver.held_out() if rows is None else rows
    robot, experts = solver.robot_, solver.experts_
    names, units = robot.joint_names, joint_units(robot)
    epochs = [getattr(expert.network, "n_iter_", 0) for expert in experts]
    numbers = regression_table(rows.q, rows.predicted, names, round(float(np.mean(epochs))))
    title = title or f"{robot.name}, {type(solver).__name__}, rows held out"
    figure, ax = _report(rows.q, rows.predicted, numbers, units, title)
    records = [
        [expert.joint_errors(mse) for mse in record]
        for expert in experts
        if (record := recorded(expert.network)) is not None
    ]
    if not records:
        _say_nothing(ax)
    elif len(records) == 1:
        training, held = (by_name(mse, names, units) for mse in records[0])
        draw_curves(ax, training, held, units)
    else:
        unit = "deg" if "deg" in units else "m"
        chosen = [k for k, each in enumerate(units) if each == unit]
        labels = [solver.branch_labels_[branch] for branch in solver.branches_.tolist()]
        means = [
            {
                label: each.mean(axis=1) * UNITS[unit] ** 2
                for label, record in zip(labels, records, strict=True)
                if len(each := record[kind][:, chosen])
            }
            for kind in (0, 1)
        ]
        draw_curves(ax, means[0], means[1], [unit])
    return figure


def _report(
    y_true: Array, y_pred: Array, numbers: RegressionTable, units: Sequence[str], title: str
) -> tuple["Figure", "Axes"]:
    """All but the curve, whose axes are given back."""
    names, m = numbers.names, len(numbers.names)
    across = min(m, ACROSS)
    down = -(-m // across)
    figure = new_figure((13.0, 4.2 + 3.2 * down))
    parts = figure.subfigures(2, 1, squeeze=False, height_ratios=[4.2, 3.2 * down])
    above, below = parts.ravel()
    kinds = list(dict.fromkeys(units))
    top = above.subplots(1, 2 + len(kinds), squeeze=False)[0]
    for ax, unit in zip(top[1:], kinds, strict=False):
        of = [k for k, each in enumerate(units) if each == unit]
        error_histogram(ax, (y_pred - y_true)[:, of], [names[k] for k in of], unit)
    _draw_table(top[-1], numbers, units, len(y_true))
    grid = below.subplots(down, across, squeeze=False).ravel()
    regression(grid[:m], y_true, y_pred, names, units)
    for ax in grid[m:]:
        ax.set_axis_off()
    figure.suptitle(title)
    return figure, top[0]


def _draw_table(ax: "Axes", numbers: RegressionTable, units: Sequence[str], rows: int) -> None:
    ax.set_axis_off()
    ax.set_title(f"regression on {rows} rows")
    cells = [
        [name, f"{r:.4f}", squared(mse, unit), f"{epochs}"]
        for name, r, mse, epochs, unit in zip(
            numbers.names, numbers.r, numbers.mse, numbers.epochs, units, strict=True
        )
    ]
    # squared degrees and squared metres have no mean
    mean = squared(numbers.mean_mse, units[0]) if len(set(units)) == 1 else "-"
    means = ["mean", f"{numbers.mean_r:.4f}", mean, f"{numbers.mean_epochs:.6g}"]
    made = ax.table(
        [*cells, means],
        colLabels=["", "r", "MSE", "epochs"],
        loc="upper center",
        edges="horizontal",
        cellLoc="right",
    )
    made.auto_set_font_size(False)
    made.set_fontsize(9)
    made.auto_set_column_width([0, 1, 2, 3])


def _say_nothing(ax: "Axes") -> None:
    ax.set_axis_off()
    ax.set_title("training: no record")

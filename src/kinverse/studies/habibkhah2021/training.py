"""Figures 15 and 16: how the network trains, its errors, and prediction against truth."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.plots import new_figure
from kinverse.studies.cell import Row
from kinverse.studies.habibkhah2021.arm import arm, parameter
from kinverse.studies.habibkhah2021.plan import first, main_cells
from kinverse.studies.rows import as_number, select, spread
from kinverse.studies.table import Picture, Table, TableSpec, Verdict
from kinverse.training_plots import error_histogram, regression

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TRAINING"]


def _build(found: dict[str, list[Row]]) -> Table:
    every = [row for rows in found.values() for row in rows]
    rows: list[Row] = []
    for name in arm().joint_names:
        of_joint = select(every, part="joint", joint=name)
        row: Row = {"joint": name, **spread(of_joint, "rms_deg").columns("test rms [deg]")}
        rows.append(row | spread(of_joint, "r").columns("correlation"))
    runs = select(every, part="run")
    test, training = spread(runs, "test_rms_deg"), spread(runs, "training_rms_deg")
    spent, tool = spread(runs, "seconds"), spread(runs, "tool_median")
    shown = first(found)
    said = ", ".join(f"{as_number(row, 'correlation'):.4f}" for row in rows)
    return Table(
        title="Figures 15 and 16: training, errors and regression of the network",
        rows=rows,
        verdict=Verdict.CANNOT_CHECK,
        residual=(
            f"no error is printed; ours on {parameter('test samples'):.0f} test samples:"
            f" {test.median:.3g} deg rms over the joints, tool {tool.median:.3g} m off in the"
            " median"
        ),
        note=(
            f"{parameter('hidden neurons'):.0f} hidden neurons,"
            f" {parameter('training samples'):.0f} training samples,"
            f" trainer {runs[0]['trainer']}, {runs[0]['epochs']} epochs, {len(runs)}"
            f" seed{'s' * (len(runs) > 1)}:"
            f" {training.median:.3g} deg rms in training,"
            f" {spent.median:.3g} s of processor time. Numbers are medians over seeds."
        ),
        pictures=(
            Picture(
                "Training and errors (figures 15, 16)",
                f"Left, the squared error falls over {runs[0]['epochs']} epochs; right, test errors"
                f" of the three joints gather about zero, {test.median:.3g} deg rms.",
                lambda: _draw_errors(shown),
            ),
            Picture(
                "Prediction against truth",
                "Three clouds of test samples, one for each joint, along the diagonal;"
                f" correlations {said} (medians over seeds).",
                lambda: _draw_regression(shown),
            ),
        ),
    )


def _test_rows(rows: list[Row], what: str) -> NDArray[np.float64]:
    names = [f"{name}_{what}_deg" for name in arm().joint_names]
    values = [[as_number(row, name) for name in names] for row in select(rows, part="test")]
    return np.asarray(np.radians(values))


def _draw_errors(rows: list[Row]) -> "Figure":
    figure = new_figure((10.0, 4.0))
    left, right = figure.subplots(1, 2)
    epochs = select(rows, part="epoch")
    left.plot([row["epoch"] for row in epochs], [row["mse_deg2"] for row in epochs])
    left.set_yscale("log")
    left.set_xlabel("epoch")
    left.set_ylabel("mean squared error [deg²]")
    left.set_title("training")
    errors = _test_rows(rows, "predicted") - _test_rows(rows, "true")
    error_histogram(right, errors, arm().joint_names)
    return figure


def _draw_regression(rows: list[Row]) -> "Figure":
    figure = new_figure((10.0, 3.8))
    axes = figure.subplots(1, 3)
    true, said = _test_rows(rows, "true"), _test_rows(rows, "predicted")
    regression(axes, true, said, arm().joint_names)
    return figure


TRAINING = TableSpec(
    "figs-15-16", "Training and errors (section 4.2, figures 15 and 16)", main_cells, _build
)

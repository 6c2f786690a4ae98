"""Pictures of trained networks; angles in degrees. Needs the extra "plot"."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import InputError
from kinverse.learning import regression_table
from kinverse.learning.regression_table import columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from kinverse.robot import Robot

__all__ = [
    "UNITS",
    "by_name",
    "draw_curves",
    "error_histogram",
    "headed",
    "joint_units",
    "recorded",
    "regression",
    "squared",
    "training_curve",
]

Array = NDArray[np.float64]
Curves = dict[str, Array]

UNITS = {"deg": float(np.degrees(1.0)), "m": 1.0, "": 1.0}
"""What a column is drawn in, and how much of that one of its own units is."""
INSIDE = 0.99
"""Share of the errors between the ends of a histogram."""
LEAST = 1e-16
"""Squared errors are drawn on a logarithmic scale from here."""


def joint_units(robot: "Robot") -> tuple[str, ...]:
    """The unit each joint is drawn in: "deg" where it turns, "m" where it slides."""
    source = robot.source.tolist()
    kinds = [robot.kinds[source.index(joint)] for joint in range(robot.dof)]
    return tuple("m" if kind == "P" else "deg" for kind in kinds)


def training_curve(
    ax: "Axes",
    network: Any,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
) -> None:
    """Mean squared error of each output after each epoch, dashed on the rows held back.

    Args:
        ax: where to draw.
        network: a fitted network of ``kinverse.networks``.
        names: of its outputs; None: "1", "2", ...
        units: "deg" (of outputs in radians), "m" or "" for each output; None: all "deg".

    Raises:
        InputError: names or units of another number, or a network that keeps no record.

    Example:
        >>> training_curve(ax, net, names=robot.joint_names)
    """
    record = recorded(network)
    if record is None:
        raise InputError(f"{type(network).__name__} keeps no record of its training")
    names, units = headed(record[0].shape[1], names, units)
    training, held = (by_name(mse, names, units) for mse in record)
    draw_curves(ax, training, held, units)


def regression(
    axes: "Sequence[Axes]",
    y_true: ArrayLike,
    y_pred: ArrayLike,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
) -> None:
    """Predictions against the truth, one picture for each column: document 004, figure 7.10.

    Args:
        axes: as many as columns.
        y_true: (N, m) [rad or m].
        y_pred: (N, m).
        names: of the columns; None: "1", "2", ...
        units: "deg" (of radians), "m" or "" for each column; None: all "deg".

    Raises:
        InputError: what does not belong together in number or shape.

    Example:
        >>> regression(figure.subplots(1, 3), y, net.predict(X))
    """
    numbers = regression_table(y_true, y_pred)
    names, units = headed(len(numbers.r), names, units)
    if len(axes) != len(names):
        raise InputError(f"axes must be one for each of {len(names)} columns, got {len(axes)}")
    scale = np.array([UNITS[unit] for unit in units])
    true, pred = columns(y_true, "y_true") * scale, columns(y_pred, "y_pred") * scale
    for k, ax in enumerate(axes):
        ends = [min(true[:, k].min(), pred[:, k].min()), max(true[:, k].max(), pred[:, k].max())]
        ax.plot(ends, ends, color="0.6", linewidth=1.0, zorder=1)
        ax.scatter(true[:, k], pred[:, k], s=6, alpha=0.4, linewidths=0, zorder=2, rasterized=True)
        ax.set_aspect("equal", adjustable="box")
        bracket = f" [{units[k]}]" if units[k] else ""
        ax.set_xlabel("true" + bracket)
        ax.set_ylabel("predicted" + bracket)
        mse = squared(numbers.mse[k], units[k])
        ax.set_title(f"{names[k]}: r {numbers.r[k]:.4f}, MSE {mse}", fontsize="medium")


def error_histogram(
    ax: "Axes", errors: ArrayLike, names: Sequence[str] | None = None, unit: str = "deg"
) -> None:
    """How the errors of each column spread: document 003, figure 16.

    The axis ends where 99 % of all errors lie inside; the rest is counted in the title.

    Args:
        ax: where to draw.
        errors: (N, m), predicted less true, of one unit [rad or m].
        names: of the columns; None: "1", "2", ...
        unit: "deg" (of radians), "m" or "".

    Raises:
        InputError: names of another number, an unknown unit, no errors or NaN.

    Example:
        >>> error_histogram(ax, net.predict(X) - y)
    """
    rows = columns(errors, "errors")
    names, units = headed(rows.shape[1], names, [unit] * rows.shape[1])
    shown = rows * UNITS[units[0]]
    end = float(np.quantile(np.abs(shown), INSIDE)) or 1.0
    bins = np.linspace(-end, end, 41).tolist()
    for k, name in enumerate(names):
        ax.hist(shown[:, k], bins=bins, histtype="step", label=name, linewidth=1.2)
    ax.axvline(0.0, color="0.6", linewidth=1.0, zorder=1)
    ax.set_xlabel("predicted less true" + (f" [{unit}]" if unit else ""))
    ax.set_ylabel("rows")
    beyond = 100.0 * float((np.abs(shown) > end).mean())
    ax.set_title(f"errors ({beyond:.1f} % are beyond)")
    ax.legend(frameon=False, fontsize="small")


# How they are drawn ---------------------------------------------------------------------------


def draw_curves(ax: "Axes", training: Curves, held: Curves, units: Sequence[str]) -> None:
    """Squared errors by name, each after each epoch; those held back dashed."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for name, values in training.items():
        epochs = np.arange(1, len(values) + 1)
        marker = "o" if len(values) == 1 else None
        (line,) = ax.plot(epochs, np.maximum(values, LEAST), marker=marker, label=name)
        if len(other := held.get(name, values[:0])):
            colour = line.get_color()
            ax.plot(epochs[: len(other)], np.maximum(other, LEAST), "--", color=colour)
    ax.set_yscale("log")
    # numbers that stand between the powers of ten, and no powers
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("epoch")
    kinds = dict.fromkeys(f"{unit}²" if unit else "1" for unit in units)
    ax.set_ylabel(f"mean squared error [{', '.join(kinds)}]")
    dashed = ", dashed: held back" if any(len(values) for values in held.values()) else ""
    ax.set_title("training" + dashed)
    ax.legend(frameon=False, fontsize="small")


def squared(mse: float, unit: str) -> str:
    """A mean squared error [rad^2 or m^2] in the unit it is shown in."""
    return f"{mse * UNITS[unit] ** 2:.3g}" + (f" {unit}²" if unit else "")


def recorded(network: Any) -> tuple[Array, Array] | None:
    """Squared errors (E, m) of training and (E or 0, m) of the rows held back."""
    training = getattr(network, "training_mse_", None)
    if training is None:
        return None
    return training, getattr(network, "validation_mse_", training[:0])


def by_name(mse: Array, names: Sequence[str], units: Sequence[str]) -> Curves:
    """Squared errors (E, m) in squared units that are drawn, column by column."""
    return {
        name: mse[:, k] * UNITS[unit] ** 2
        for k, (name, unit) in enumerate(zip(names, units, strict=True))
    }


def headed(
    count: int, names: Sequence[str] | None, units: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of so many columns, checked (InputError)."""
    titles = tuple(str(k + 1) for k in range(count)) if names is None else tuple(map(str, names))
    kinds = ("deg",) * count if units is None else tuple(units)
    for what, given in (("names", titles), ("units", kinds)):
        if len(given) != count:
            raise InputError(f"{what} must be one for each of {count} columns, got {len(given)}")
    if len(set(titles)) < count:
        raise InputError(f"names must differ, got {', '.join(titles)}")
    for unit in kinds:
        if unit not in UNITS:
            raise InputError(f"units must be {', '.join(map(repr, UNITS))}, got {unit!r}")
    return titles, kinds

"""Figures 7.1 to 7.5: networks on the planar arm."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.studies.cell import Cell, Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.flags import flag_rows
from kinverse.studies.jha2015.networks.sets import floor_cell, floor_of, output_names
from kinverse.studies.jha2015.networks.training import train_network
from kinverse.studies.rows import as_number, quartiles
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TABLES", "planar_cells"]

ARM, FIXED = "planar3r", "planar3r_60"
READINGS = {ARM: "free", FIXED: "60 deg"}
"""How rows are drawn: every joint by itself, or with the sum that the joints of table 7.1 have."""
LAYOUTS = {"2-3-2-3": "3-2", "2-4-4-3": "4-4", "2-5-5-3": "5-5"}
"""As printed, and the hidden layers of it."""
EPOCHS = 100
TRAIN, TEST = 900, 100
SEEDS, QUICK_SEEDS = 15, 3
NETWORKS = {
    **{f"MLP {layout}, back-propagation": ("gdm", hid) for layout, hid in LAYOUTS.items()},
    **{f"MLP {layout}, Levenberg-Marquardt": ("lm", hid) for layout, hid in LAYOUTS.items()},
    "PPN, degree 3": ("ppn", "3"),
    "Pi-Sigma, order 3": ("pi-sigma", "3"),
}


def planar_cells(quick: bool) -> list[Cell]:
    """Every network and the floor, of both ways to draw rows; pairs and epochs of the first."""
    return [
        *(
            Cell(
                _name(arm, network, hidden),
                train_network,
                {
                    "geometry_name": arm,
                    "network": network,
                    "hidden": hidden,
                    "train": TRAIN,
                    "test": TEST,
                    "seeds": QUICK_SEEDS if quick else SEEDS,
                    "budget": EPOCHS,
                    "keep": arm == ARM,
                },
            )
            for arm in READINGS
            for network, hidden in NETWORKS.values()
        ),
        *(floor_cell(arm, quick) for arm in READINGS),
    ]


def _name(arm: str, network: str, hidden: str) -> str:
    return f"network-{'planar' if arm == ARM else 'planar-60'}-{network}-{hidden}"


def _build(cells: dict[str, list[Row]]) -> Table:
    rows = [row for arm in READINGS for row in _rows(cells, arm)]
    seeds = min(as_number(row, "seeds") for row in rows)
    negative = int((printed("jha2015", "table_7_1").numbers(["theta3_deg"]) < 0).sum())
    [same] = [
        row for row in flag_rows() if row["table"] == "7.1" and "theta1 +" in str(row["flag"])
    ]
    best = {
        arm: sorted((_pooled(cells, arm, label), label) for label in NETWORKS) for arm in READINGS
    }
    told = {
        arm: ", ".join(f"{label} {value:.2g}" for value, label in found)
        for arm, found in best.items()
    }
    return Table(
        "Figures 7.1 to 7.5: networks on the planar 3R arm",
        rows,
        Verdict.CANNOT_CHECK,
        "figures without numbers; our test mse of all joints, best first [rad^2]:"
        f" {told[ARM]}; with the sum of the joints fixed at 60 deg: {told[FIXED]}",
        f"Links 10, 7, 5 and joints 0 to 180 deg as in section 7.2.1; {negative} of the 10 rows of"
        f" table 7.1 have a negative theta3, and in {same['count']} of {same['of']}"
        f" {same['flag']} ({same['detail']}). Rows are drawn in two ways: every joint by"
        " itself, where a point of the plane leaves one joint free and no function of X and Y is"
        " expected to have a smaller error than the least shown; and with that sum (theta3 outside"
        " its range, as printed), where the point determines the joints and what is shown as least"
        f" is the distance of neighbours. {TRAIN} training and {TEST} test rows,"
        f" {EPOCHS} epochs, {seeds:g} seeds. The rate of back-propagation is not printed:"
        " 0.1, momentum 0.9.",
        (_pairs_picture(cells), _epochs_picture(cells)),
    )


def _rows(cells: dict[str, list[Row]], arm: str) -> list[Row]:
    floors = floor_of(cells, arm)
    rows: list[Row] = []
    for label, (network, hidden) in NETWORKS.items():
        found = cells[_name(arm, network, hidden)]
        for name in output_names(arm):
            mine = [r for r in found if r["kind"] == "error" and r["output"] == name]
            test = np.array([row["test"] for row in mine], dtype=np.float64)
            low, middle, high = quartiles(test)
            training = np.array([row["training"] for row in mine], dtype=np.float64)
            seconds = np.array([row["seconds"] for row in mine], dtype=np.float64)
            rows.append(
                {
                    "network": label,
                    "sum of the joints": READINGS[arm],
                    "joint": name,
                    "seeds": len(mine),
                    "test mse, median [rad^2]": middle,
                    "lower quartile [rad^2]": low,
                    "upper quartile [rad^2]": high,
                    "training mse, median [rad^2]": float(np.median(training)),
                    "least of any function of X, Y, fresh rows [rad^2]": floors[name].least,
                    "mse of the mean joint [rad^2]": floors[name].constant,
                    "CPU, median [s]": float(np.median(seconds)),
                }
            )
    return rows


def _pooled(cells: dict[str, list[Row]], arm: str, label: str) -> float:
    """Median over the seeds of the test error, all joints together."""
    network, hidden = NETWORKS[label]
    found = [r for r in cells[_name(arm, network, hidden)] if r["kind"] == "error"]
    test = np.array([row["test"] for row in found], dtype=np.float64)
    return float(np.median(test.reshape(-1, len(output_names(ARM))).mean(axis=1)))


def _pairs_picture(cells: dict[str, list[Row]]) -> Picture:
    r = []
    for layout, hidden in LAYOUTS.items():
        found = [row for row in cells[f"network-planar-gdm-{hidden}"] if row["kind"] == "error"]
        values = [float(row["r_test"]) for row in found if row["r_test"] is not None]
        r.append(f"{layout}: {np.median(values):.2f}")
    return Picture(
        "Figures 7.1 to 7.3: wanted and predicted joints on test rows, back-propagation",
        "Nine scatter plots, three layouts by three joints, of predictions against wanted joint"
        f" angles with the diagonal. Median correlation: {', '.join(r)}.",
        partial(_pairs, cells),
    )


def _pairs(cells: dict[str, list[Row]]) -> "Figure":
    figure = new_figure((8.0, 7.6))
    axes = figure.subplots(3, 3, sharex=True, sharey=True)
    for line, (layout, hidden) in zip(axes, LAYOUTS.items(), strict=True):
        found = [row for row in cells[f"network-planar-gdm-{hidden}"] if row["kind"] == "pair"]
        for ax, name in zip(line, output_names(ARM), strict=True):
            mine = [row for row in found if row["output"] == name]
            wanted, guess = (
                np.degrees(np.array([row[part] for row in mine], dtype=np.float64))
                for part in ("wanted", "predicted")
            )
            ax.plot([0, 180], [0, 180], color="0.6", lw=0.8)
            ax.plot(wanted, guess, ls="", marker=".", ms=4)
            ax.set_title(f"{layout}, {name}", fontsize="medium")
    for ax in axes[-1]:
        ax.set_xlabel("wanted [deg]")
    for ax in axes[:, 0]:
        ax.set_ylabel("predicted [deg]")
    return figure


def _epochs_picture(cells: dict[str, list[Row]]) -> Picture:
    ends = [row for row in cells["network-planar-pi-sigma-3"] if row["kind"] == "epoch"][-3:]
    told = ", ".join(f"{row['output']} {row['training']:.2g}" for row in ends)
    return Picture(
        "Figures 7.4 and 7.5: training errors of the PPN and the Pi-Sigma network",
        "Mean squared errors of three joints over the epochs of the Pi-Sigma network, and as level"
        f" lines those of the PPN, which is solved in one. Pi-Sigma ends at {told} rad^2.",
        partial(_epochs, cells),
    )


def _epochs(cells: dict[str, list[Row]]) -> "Figure":
    figure = new_figure((6.5, 3.6))
    ax = figure.subplots()
    for k, name in enumerate(output_names(ARM)):
        for network, style in (("pi-sigma", "-"), ("ppn", "--")):
            found = cells[f"network-planar-{network}-3"]
            mine = [r for r in found if r["kind"] == "epoch" and r["output"] == name]
            errors = np.array([row["training"] for row in mine], dtype=np.float64)
            if network == "ppn":
                ax.axhline(errors[-1], color=f"C{k}", ls=style, label=f"PPN, {name}")
            else:
                ax.plot(np.arange(1, 1 + len(errors)), errors, style, label=f"Pi-Sigma, {name}")
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("epoch")
    ax.set_ylabel("training mse [rad$^2$]")
    ax.legend(frameon=False, fontsize="small", ncols=2)
    return figure


TABLES: tuple[TableSpec, ...] = (
    TableSpec(
        "fig-7.1",
        "Networks on the planar 3R arm, figures 7.1 to 7.5",
        planar_cells,
        _build,
        covers=("fig-7.2", "fig-7.3", "fig-7.4", "fig-7.5"),
    ),
)

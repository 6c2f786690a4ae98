"""Table 7.3: joint values of the SCARA arm and what the printed perceptron gives for them."""

from functools import partial

import numpy as np

from kinverse.studies.cell import Row
from kinverse.studies.data import printed
from kinverse.studies.jha2015.geometries import geometry
from kinverse.studies.jha2015.networks.scara_5r import errors_of, scara_5r_cells
from kinverse.studies.jha2015.networks.sets import CONFIGURATIONS, known_quartiles, output_names
from kinverse.studies.table import Table, TableSpec, Verdict

__all__ = ["TABLES"]

ARM, NETWORK = "SCARA", "MLP"
MATCHING = 0.99
"""Correlations of table 7.4 are above this."""


def _build(cells: dict[str, list[Row]]) -> Table:
    each = CONFIGURATIONS[ARM]
    robot = geometry(each.geometry)
    names = output_names(each.geometry)
    slides = np.array([kind == "P" for kind in robot.kinds])
    told = printed("jha2015", "table_7_3")
    units = ["" if slide else "_deg" for slide in slides]
    pair = zip(names, units, strict=True)
    heads = [(f"{name}_analytic{unit}", f"{name}_mlp{unit}") for name, unit in pair]
    wanted, guess = (told.numbers([head[k] for head in heads]) for k in (0, 1))
    R = printed("jha2015", "table_7_4").numbers(["regression_R"])[:, 0]
    rows: list[Row] = []
    for k, name in enumerate(names):
        ours = known_quartiles(errors_of(cells, ARM, NETWORK, name), "test")
        factor = 1e3 if slides[k] else float(np.degrees(1.0))
        rows.append(
            {
                "joint": name,
                "unit": "mm" if slides[k] else "deg",
                "printed pairs": len(told),
                "their rms difference": float(np.sqrt(np.mean((guess - wanted)[:, k] ** 2))),
                "their largest difference": float(np.abs(guess - wanted)[:, k].max()),
                "their correlation": float(np.corrcoef(wanted[:, k], guess[:, k])[0, 1]),
                "R, printed in table 7.4": float(R[k]),
                "ours, rms on test rows, median": ours and float(np.sqrt(ours[1])) * factor,
                "lower quartile": ours and float(np.sqrt(ours[0])) * factor,
                "upper quartile": ours and float(np.sqrt(ours[2])) * factor,
            }
        )
    scale = np.where(slides, 1e-3, np.radians(1.0))
    places = [robot.fk(values * scale)[:, :3, 3] for values in (wanted, guess)]
    apart = 1e3 * np.linalg.norm(places[0] - places[1], axis=1)
    low = [row["joint"] for row in rows if float(str(row["their correlation"])) < MATCHING]
    return Table(
        "Table 7.3: printed joint values and printed predictions, SCARA",
        rows,
        Verdict.NOT_REPRODUCED if low else Verdict.REPRODUCED,
        f"the printed pairs of {len(low)} of {len(names)} joints correlate below the"
        f" {R.min():.3f} to {R.max():.3f} of table 7.4; their tools are {np.median(apart):.0f} mm"
        f" apart in the median, {apart.max():.0f} mm at most",
        "Both columns of joint values are as printed, positions are not. d3 has no printed unit and"
        " is read in mm. Ours: the perceptron of table 7.4, rows drawn uniformly in the printed"
        " limits; joint 4 does not move the position.",
    )


TABLES: tuple[TableSpec, ...] = (
    TableSpec(
        "7.3",
        "Printed joint values beside the printed perceptron's, SCARA, table 7.3",
        partial(scara_5r_cells, ARM, (NETWORK,)),
        _build,
    ),
)

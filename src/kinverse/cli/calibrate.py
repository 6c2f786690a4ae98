"""``kinverse calibrate``: which error model fits measurements of a real arm."""

from pathlib import Path
from typing import Annotated

import typer

from kinverse.cli._args import Base, Json, RobotName, Tip, Tool
from kinverse.errors import InputError

__all__ = ["calibrate"]


def calibrate(
    robot: RobotName,
    measurements: Annotated[
        Path,
        typer.Argument(
            metavar="CSV",
            help="Columns by name and unit: 'joint1 [deg]' ... and 'x [mm]', 'y [mm]', 'z [mm]'.",
        ),
    ],
    model: Annotated[
        list[str] | None,
        typer.Option(
            help="fourier:HARMONICS, polynomial:DEGREE[:BASIS], geometric[:HARMONICS], or several"
            " joined by +; give it more than once to compare; a usual choice of nine if left out."
        ),
    ] = None,
    folds: Annotated[int, typer.Option(help="Parts for cross-validation.")] = 5,
    rng: Annotated[int, typer.Option(help="Seed of the split into parts.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Save the best model to this .npz.")] = None,
    json: Json = False,
    tool: Tool = None,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Fit models of the tool's error and compare them on measurements held back.

    If the point that was measured is not the robot's tool point, --tool says where it is. Exit
    status 1 if no model is better than none.
    """
    import json as text
    import warnings

    import kinverse as kv
    from kinverse import calibration
    from kinverse.calibration.choice import NONE
    from kinverse.calibration.named import CANDIDATES
    from kinverse.cli._show import note, show_table, table
    from kinverse.cli._tool import with_tool

    if out is not None and (out.suffix != ".npz" or not out.parent.is_dir()):
        raise InputError(f"--out must be an .npz file in a folder that is there, got {out}")
    if rng < 0:
        raise InputError(f"--rng must not be negative, got {rng}")
    arm = with_tool(kv.load(robot, base=base, tip=tip), tool, degrees=False)
    names = [name for name in dict.fromkeys(model or CANDIDATES) if name != NONE]
    models = {name: calibration.make_model(name, arm) for name in names}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        measured = calibration.read_measurements(measurements, arm)
        chosen = calibration.choose(models, measured.q, measured.error, folds, rng)
    if measured.ignored:
        note(f"columns that were not read: {', '.join(measured.ignored)}")
    for said in dict.fromkeys(str(warning.message) for warning in caught):
        note(said)
    if chosen.postures < len(measured.q):
        note(f"{chosen.postures} different postures: repeats of one are held back together")
    if out is not None:
        calibration.save(chosen.model, out, arm)
    if json:
        rows = [row._asdict() for row in chosen.table]
        counts = {"measurements": len(measured.q), "postures": chosen.postures}
        answer = {"robot": arm.name, **counts, "unit": "m"}
        print(text.dumps({**answer, "chosen": chosen.name, "table": rows}))
    else:
        shown = table(
            "model", ">held-out rms mm", ">best fold", ">worst fold",
            title=f"{arm.name}, {len(measured.q)} measurements, {folds} folds",
        )  # fmt: skip
        for row in chosen.table:
            millimetres = (f"{1e3 * value:.4f}" for value in (row.rms, row.low, row.high))
            shown.add_row(row.name, *millimetres)
        show_table(shown)
        before, after = 1e3 * chosen.before.rms, 1e3 * chosen.table[0].rms
        print(f"chosen: {chosen.name}, {before:.4f} mm before, {after:.4f} mm after")
        if out is not None:
            print(f"saved to {out}")
    return 1 if chosen.name == NONE else 0

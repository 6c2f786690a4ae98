"""``kinverse train``: a solver that learned a robot, in a file that ``solve`` takes."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinverse.cli._args import Base, Degrees, Json, RobotName, Task, Tip, check_plot
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["train"]


class Kind(StrEnum):
    """The solvers that are trained."""

    LEARNED = "learned"
    FUSION = "fusion"


def train(
    robot: RobotName,
    out: Annotated[Path, typer.Option(help="Write the trained solver to this .npz file.")],
    network: Annotated[
        str | None,
        typer.Option(help="mlp, rbfnetwork, anfis ..., as it is by itself; else the solver's own."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A setting, such as hidden=60,60."),
    ] = None,
    solver: Annotated[Kind, typer.Option(help="What is trained.")] = Kind.LEARNED,
    samples: Annotated[
        int | None, typer.Option(help="learned: examples for each network; 5000.")
    ] = None,
    poses: Annotated[
        int | None, typer.Option(help="fusion: poses, all pairs are learned; 70.")
    ] = None,
    features: Annotated[
        str | None,
        typer.Option(help="Of a pose: xyz+matrix, xyz+quat, xyz+rpy, xyz+yaw, xyz, xy+yaw or xy."),
    ] = None,
    virtual: Annotated[
        str | None,
        typer.Option(help="learned: angle_sum, cos, cos_sin, arm_angle or joint:NAME."),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            metavar="Q... WIDTH", help="fusion: joint values, and how far about them: one or each."
        ),
    ] = None,
    refine: Annotated[
        str | None, typer.Option(help="learned: newton, lm or none after the prediction.")
    ] = None,
    task: Task = "pose",
    rng: Annotated[int, typer.Option("--rng", "--random-state", help="Seed of it all.")] = 0,
    degrees: Degrees = False,
    json: Json = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the training to this .png, .svg or .pdf.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
) -> int:
    """Train networks for a robot, test them on poses they have not seen, and write them."""
    import kinverse as kv
    from kinverse.cli import _training
    from kinverse.cli._session import Session
    from kinverse.cli._show import note

    _check_out(out)
    if plot is not None:
        check_plot(plot)
    fusion = solver is Kind.FUSION
    for option, value, mine in (
        ("--samples", samples, not fusion),
        ("--virtual", virtual, not fusion),
        ("--refine", refine, not fusion),
        ("--poses", poses, fusion),
        ("--region", region, fusion),
    ):
        if value is not None and not mine:
            other = Kind.LEARNED if fusion else Kind.FUSION
            raise InputError(f"{option} belongs to --solver {other}")
    arm = kv.load(robot, base=base, tip=tip)
    session = Session()
    made = kv.Fusion() if fusion else kv.Learned()
    settings: dict[str, Any] = {
        "network": _chosen(made, network, set_ or []),
        "features": features,
        "n_samples": samples,
        "n_poses": poses,
        "virtual": virtual,
        "region": None if region is None else _region(arm, region, degrees),
        "refine": refine,
    }
    settings = {key: value for key, value in settings.items() if value is not None}
    if refine is not None and refine.lower() == "none":
        settings["refine"] = None
    if plot is not None:
        from kinverse import plots

        plots.new_figure((1.0, 1.0))  # a missing package is told before the work
    if fusion and region is None:
        note("no --region: over all of the limits the loop seldom arrives and Numerical takes over")
    made.set_params(**settings, task=task, random_state=rng, progress=session)
    with session.watching():
        made.fit(arm)
    made.save(out)
    if session.interrupted:
        note("interrupted: the networks keep what they had learned, and are written")
    tested = _training.test(made)
    if plot is not None:
        _training.draw(plot, made, tested)
    if json:
        print(_training.as_json(made, tested, out, session.interrupted))
    else:
        _training.show(made, tested, out, session.interrupted)
    return 1 if session.interrupted else 0


def _chosen(made: Any, name: str | None, settings: list[str]) -> Any:
    """The network to train: a name's, or the solver's own with settings changed; None as it is."""
    from kinverse.cli import _network

    if name is not None:
        return _network.network(name, settings)
    return _network.changed(made._default_network(), settings) if settings else None


def _check_out(path: Path) -> None:
    """Refuse a file that cannot be written, before the work."""
    import tempfile

    if path.suffix != ".npz":
        raise InputError(f"--out must end in .npz, got {path.name!r}")
    if not path.parent.is_dir():
        raise InputError(f"--out: there is no folder {path.parent}")
    if path.is_dir():
        raise InputError(f"--out: {path} is a folder")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise InputError(f"--out: cannot write in {path.parent}: {error.strerror}") from error


def _region(arm: "Robot", text: str, degrees: bool) -> tuple[Any, Any]:
    """Centre (n,) and half width (n,) from n + 1 numbers or 2 n."""
    import numpy as np

    from kinverse.cli._args import all_numbers
    from kinverse.cli._show import joint_kinds, note_turns

    n, kinds = arm.dof, joint_kinds(arm)
    given = all_numbers(text, "--region")
    if len(given) not in (n + 1, 2 * n):
        raise InputError(
            f"--region needs {n} joint values ({' '.join(arm.joint_names)}) and one half width or"
            f" {n}, got {len(given)} numbers"
        )
    if len(given) == n + 1 and "P" in kinds and "R" in kinds:
        raise InputError(
            f"--region: {arm.name} turns and slides, so that it needs {n} half widths, one for"
            " each joint"
        )
    centre, width = np.array(given[:n]), np.resize(given[n:], n)
    turns = np.array([kind == "R" for kind in kinds])
    note_turns([*centre[turns].tolist(), *width[turns].tolist()], degrees)
    if degrees:
        centre, width = (np.where(turns, np.radians(each), each) for each in (centre, width))
    return centre, width

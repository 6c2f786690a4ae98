"""``kinverse study``: a source document run again, its tables with our figures beside them."""

from pathlib import Path
from typing import Annotated

import typer

from kinverse.errors import InputError

__all__ = ["study"]


def study(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="A study, or all; left out: lists them.")
    ] = None,
    table: Annotated[str | None, typer.Option(help="One table of it only.")] = None,
    list_: Annotated[
        bool, typer.Option("--list", help="Its tables by name and title; nothing is run.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Few repetitions: minutes.")] = False,
    out: Annotated[
        Path, typer.Option(help="Folder for pages, CSV files and finished cells.")
    ] = Path("studies"),
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes; one for each core if left out.")
    ] = None,
) -> int:
    """Run a source document again; exit status 1 if something failed. Ctrl-C loses no cell."""
    from kinverse import plots
    from kinverse.cli import _study
    from kinverse.cli._bar import Bar
    from kinverse.cli._show import note
    from kinverse.studies.registry import study_names
    from kinverse.studies.report import write_report
    from kinverse.studies.runner import run

    if name is None:
        if table is not None:
            raise InputError("--table needs a study")
        _study.show_studies()
        return 0
    if list_:
        for listed in study_names() if name == "all" else [name]:
            _study.show_tables(listed)
        return 0
    plots.new_figure((1.0, 1.0))  # a missing package is told before the work
    try:
        with Bar(name) as bar:
            made = run(
                name,
                table,
                quick=quick,
                out=out,
                jobs=-1 if jobs is None else jobs,
                progress=lambda text, share: bar(text or name, share),
            )
    except KeyboardInterrupt:
        note(f"finished cells are kept in {out}: the same command goes on from there")
        raise
    for each in made:
        path = write_report(each, out)
        _study.show(each, path, brief=name == "all")
    _study.show_failures(made)
    return 0 if all(each.ok for each in made) else 1

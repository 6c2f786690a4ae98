"""The ``kinverse`` command. Exit status: 0 all solved, 1 some not, 2 bad input.

Every command lives in a module of its own; what is heavy (NumPy, the native core) is imported
inside the commands, so that ``kinverse --help`` answers at once. Degrees exist here only.
"""

import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from kinverse.cli._args import LISTS, join_numbers
from kinverse.cli.calibrate import calibrate
from kinverse.cli.compare import compare
from kinverse.cli.fk import fk
from kinverse.cli.info import info
from kinverse.cli.robots import robots
from kinverse.cli.simulate import simulate
from kinverse.cli.solve import solve
from kinverse.cli.study import study
from kinverse.cli.track import track
from kinverse.cli.train import train
from kinverse.errors import KinverseError

__all__ = ["app", "main"]

INTERRUPTED = 130
"""The exit status after Ctrl-C that no command has taken, as shells have it and typer."""

app = typer.Typer(
    name="kinverse",
    help="Inverse kinematics of robot arms: every answer verified.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for _command in (robots, info, fk, solve, compare, train, track, simulate, calibrate, study):
    app.command()(_command)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(version("kinverse"))
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Inverse kinematics of robot arms: every answer verified."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: arguments without the program's name; None: those of the process.

    Returns:
        The exit status: 0 all solved, 1 some not, 2 bad input, 130 interrupted.

    Example:
        >>> main(["robots"])
        0
    """
    arguments = join_numbers(sys.argv[1:] if argv is None else argv)
    try:
        code = app(arguments or ["--help"], prog_name="kinverse", standalone_mode=False)
    except typer.TyperException as error:
        said = error.format_message().replace("Value error, ", "")
        if "extra argument" in said and any(word.startswith(LISTS) for word in arguments):
            said += f"; {', '.join(LISTS)} take numbers"
        return _refuse(said)
    except KinverseError as error:
        # the library's words for two arguments are options here
        said = re.sub(r"\b(base|tip)=", r"--\1 ", str(error))
        return _refuse(said.replace("base and tip choose", "--base and --tip choose"))
    except FileNotFoundError as error:
        return _refuse(f"no such file: {error.filename}")
    except OSError as error:
        return _refuse(f"{error.strerror}: {error.filename}" if error.filename else str(error))
    except (KeyboardInterrupt, typer.Abort):
        return _refuse("interrupted", INTERRUPTED)
    if code == INTERRUPTED:
        return _refuse("interrupted", INTERRUPTED)
    return code if isinstance(code, int) else 0


def _refuse(message: str, code: int = 2) -> int:
    # one line, whatever the message was
    print("kinverse: error:", " ".join(message.split()), file=sys.stderr)
    return code

"""Numbers on the command line: as many as follow an option, negative ones included."""

import math
from collections.abc import Iterable
from typing import Annotated

import typer

from kinverse.errors import InputError

__all__ = ["Base", "Degrees", "Json", "RobotName", "Task", "Tip", "join_numbers", "numbers"]

RobotName = Annotated[
    str, typer.Argument(metavar="ROBOT", help="A catalogue name or a .urdf, .xml or .toml file.")
]
Base = Annotated[str | None, typer.Option(help="Link the chain starts from (files only).")]
Tip = Annotated[str | None, typer.Option(help="Link the chain ends at (files only).")]
Degrees = Annotated[bool, typer.Option("--degrees", help="All angles in degrees, not radians.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]
Task = Annotated[str, typer.Option(help="pose, position, position_axis, planar or schoenflies.")]

LISTS = ("--pose", "--q", "--q-seed")


def join_numbers(argv: Iterable[str]) -> list[str]:
    """Gather the numbers behind an option into one word: ``--q 0 -1 2`` is ``--q=0,-1,2``.

    An option parser takes a fixed count of words and may read ``-1`` as an option.
    """
    words: list[str] = []
    collecting = False
    for word in argv:
        if word in LISTS:
            collecting = True
            words.append(word + "=")
        elif collecting and _is_number(word):
            words[-1] += ("" if words[-1].endswith("=") else ",") + word
        else:
            collecting = False
            words.append(word)
    return words


def _is_number(word: str) -> bool:
    try:
        for part in word.split(","):
            float(part)
    except ValueError:
        return False
    return True


def numbers(text: str, count: int, option: str, names: str) -> list[float]:
    """The numbers of one option.

    Raises:
        InputError: not so many, or not finite.
    """
    try:
        values = [float(part) for part in text.split(",")] if text else []
    except ValueError as error:
        raise InputError(f"{option}: {text!r} is not a list of numbers") from error
    if len(values) != count:
        raise InputError(f"{option} needs {count} numbers ({names}), got {len(values)}")
    if not all(map(math.isfinite, values)):
        raise InputError(f"{option} must be finite, got {text}")
    return values

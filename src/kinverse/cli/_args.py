"""Numbers on the command line: as many as follow an option, negative ones included."""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from kinverse.errors import InputError

__all__ = [
    "LISTS",
    "Base",
    "Degrees",
    "ErrorModel",
    "Json",
    "PathName",
    "RobotName",
    "Task",
    "Tip",
    "Tool",
    "all_numbers",
    "check_plot",
    "join_numbers",
    "numbers",
    "pose_numbers",
]

RobotName = Annotated[
    str, typer.Argument(metavar="ROBOT", help="A catalogue name or a .urdf, .xml or .toml file.")
]
PathName = Annotated[
    str,
    typer.Argument(
        metavar="PATH",
        help="A .csv, .npz or .npy file of poses, or a named path such as masajedi_straight. A .csv"
        " has a header: x y z with roll pitch yaw or qw qx qy qz, in m and rad (with --degrees"
        " deg);"
        ' "x [mm]" or "roll [deg]" in it states another unit.',
    ),
]
Base = Annotated[str | None, typer.Option(help="Link the chain starts from (files only).")]
Tip = Annotated[str | None, typer.Option(help="Link the chain ends at (files only).")]
Degrees = Annotated[bool, typer.Option("--degrees", help="All angles in degrees, not radians.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]
Task = Annotated[str, typer.Option(help="pose, position, position_axis, planar or schoenflies.")]

Tool = Annotated[
    str | None,
    typer.Option(
        "--tool",
        metavar="X Y Z [ROLL PITCH YAW]",
        help="The tool in the frame of the robot's tool point [m, rad], added behind it.",
    ),
]
ErrorModel = Annotated[
    Path | None,
    typer.Option(help="A .npz file of calibrate: answers are for the real tool that it tells of."),
]

LISTS = (
    "--tool",
    *("--pose", "--q", "--q-seed", "--q-start", "--region"),
    *("--velocity", "--acceleration", "--gravity", "--max-velocity", "--max-acceleration"),
)


def join_numbers(argv: Iterable[str]) -> list[str]:
    """Gather the numbers behind an option into one word: ``--q 0 -1 2`` is ``--q=0,-1,2``.

    An option parser takes a fixed count of words and may read ``-1`` as an option. A list in one
    word and a word among the numbers that is none are gathered too: ``numbers`` names the latter.
    """
    given = list(argv)
    words: list[str] = []
    collecting = False
    for word, after in zip(given, [*given[1:], ""], strict=False):
        if word in LISTS or word.startswith(tuple(name + "=" for name in LISTS)):
            collecting = True
            words.append(word if "=" in word else word + "=")
        elif collecting and (_is_number(word) or _is_meant(word, after)):
            words[-1] += ("" if words[-1].endswith("=") else ",") + word
        else:
            collecting = False
            words.append(word)
    return words


def check_plot(path: Path) -> None:
    """Raise InputError unless a picture can be written there."""
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise InputError(f"--plot must end in .png, .svg or .pdf, got {path.name!r}")
    if not path.parent.is_dir():
        raise InputError(f"--plot: there is no folder {path.parent}")


def _is_number(word: str) -> bool:
    try:
        for part in _parts(word):
            float(part)
    except ValueError:
        return False
    return bool(word.strip())


def _is_meant(word: str, after: str) -> bool:
    # a list that holds something else, or a word between numbers
    if word.startswith("-"):
        return False
    return bool(re.search(r"[,\s]", word)) or _is_number(after)


def _parts(text: str) -> list[str]:
    return re.split(r"\s*,\s*|\s+", text.strip())


def numbers(text: str, count: int, option: str, names: str) -> list[float]:
    """The numbers of one option.

    Raises:
        InputError: not so many, not finite, or something that is no number.
    """
    values = _floats(text, option)
    if len(values) != count:
        raise InputError(f"{option} needs {count} numbers ({names}), got {len(values)}")
    return _finite(values, option, text)


def all_numbers(text: str, option: str) -> list[float]:
    """The numbers of one option, however many.

    Raises:
        InputError: not finite, or something that is no number.
    """
    return _finite(_floats(text, option), option, text)


def _floats(text: str, option: str) -> list[float]:
    values = []
    for part in _parts(text) if text.strip() else []:
        try:
            values.append(float(part))
        except ValueError:
            raise InputError(f"{option}: {part!r} is not a number") from None
    return values


def _finite(values: list[float], option: str, text: str) -> list[float]:
    if not all(map(math.isfinite, values)):
        raise InputError(f"{option} must be finite, got {text}")
    return values


def pose_numbers(text: str, task: str) -> list[float]:
    """The numbers of --pose: six, or three where only the position counts.

    Raises:
        InputError: as :func:`numbers`.
    """
    count = len(_parts(text)) if text.strip() else 0
    if count == 3 and task == "position":
        return numbers(text, 3, "--pose", "x y z")
    hint = "; x y z alone are for --task position" if count == 3 else ""
    return numbers(text, 6, "--pose", "x y z roll pitch yaw" + hint)

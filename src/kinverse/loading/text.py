"""Files, XML and numbers, with errors that say where."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from kinverse.errors import ModelError

__all__ = ["LARGEST_NUMBER", "choices", "numbers", "parse_xml", "read_bytes"]

LARGEST_FILE = 64 * 2**20
"""Bytes; a robot description is far smaller, so more than this is a mistake or an attack."""

LARGEST_NUMBER = 1e12
"""Metres or radians; beyond it, files are mistakes and sums could overflow."""


def read_bytes(path: Path) -> bytes:
    """The content of a model file.

    Raises:
        ModelError: no such file, a directory, no permission, or more than 64 MiB.
    """
    try:
        if path.is_dir():
            raise ModelError(f"{path} is a directory, not a robot file")
        if path.stat().st_size > LARGEST_FILE:
            raise ModelError(f"{path} is larger than {LARGEST_FILE >> 20} MiB")
        return path.read_bytes()
    except FileNotFoundError as error:
        raise ModelError(f"no such robot file: {path}") from error
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        raise ModelError(f"cannot read robot file {str(path)!r}: {error}") from error


def parse_xml(data: bytes, where: str) -> Element:
    """Parse XML; any DOCTYPE or entity is refused, so nothing outside the text is ever read.

    Raises:
        ModelError: malformed text (with its line), a DOCTYPE, an unknown encoding.
    """
    from defusedxml import DefusedXmlException
    from defusedxml import ElementTree as defused

    try:
        root: Element = defused.fromstring(data, forbid_dtd=True)
    except DefusedXmlException as error:
        raise ModelError(f"{where}: a DOCTYPE or an entity is not allowed") from error
    except SyntaxError as error:  # ElementTree's ParseError; it holds line and column
        raise ModelError(f"{where}: not well-formed XML: {error}") from error
    except (ValueError, LookupError) as error:
        raise ModelError(f"{where}: unknown text encoding: {error}") from error
    return root


def numbers(text: str, count: int | Iterable[int], where: str) -> list[float]:
    """Finite decimal numbers separated by blanks.

    Args:
        text: as found in the file.
        count: how many there must be, or the lengths that are allowed.
        where: what is read, for the message.

    Raises:
        ModelError: another count, or something that is not a finite number.
    """
    allowed = [count] if isinstance(count, int) else list(count)
    out = []
    for word in text.split():
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        # float() takes 1_000 and nan, a robot file must not; a limit keeps sums finite
        if "_" in word or not abs(value) <= LARGEST_NUMBER:
            raise ModelError(f"{where}: {word!r} is not a finite number")
        out.append(value)
    if len(out) not in allowed:
        wanted = " or ".join(map(str, allowed))
        raise ModelError(f"{where}: needs {wanted} numbers, got {len(out)}: {text!r}")
    return out


def choices(wrong: Any, valid: Iterable[str], what: str = "valid") -> str:
    """The end of a message: close matches of a wrong name, then the names there are."""
    names = list(valid)
    near = get_close_matches(str(wrong), names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    shown = ", ".join(names[:40]) + (f" and {len(names) - 40} more" if len(names) > 40 else "")
    return f"{hint}{what}: {shown or 'none'}"

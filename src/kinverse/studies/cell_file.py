"""Rows of a finished cell in a file of its own, trusted only if they are whole and of this code."""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import Any

from kinverse.errors import InputError
from kinverse.files import write_atomically
from kinverse.studies.cell import Cell, Row

__all__ = ["Finished", "check_rows", "fingerprint", "read_cell", "write_cell"]


@dataclass(frozen=True)
class Finished:
    """What a cell came to.

    Attributes:
        rows: as the cell's function returned them.
        seconds: of the processor, spent by the process that computed them.
        machine: facts of where they were computed, by name: ``kinverse.studies.machine``.
        date: when, in UTC: "2026-01-31 17:05".
    """

    rows: list[Row]
    seconds: float
    machine: dict[str, str]
    date: str


def fingerprint(cell: Cell, source: Callable[[str], str]) -> str:
    """What the rows depend on: function, arguments, and the source of its module.

    Args:
        cell: its name does not count.
        source: hash of the source of a module, by its name.

    Raises:
        InputError: arguments that are no JSON values.
    """
    try:
        arguments = json.dumps(cell.arguments, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"arguments of cell {cell.name}: {error}") from error
    module = cell.function.__module__
    return _hash(f"{module}.{cell.function.__qualname__}({arguments}) {source(module)}")


def check_rows(rows: Any) -> list[Row]:
    """The rows as they are read back from a file.

    Raises:
        TypeError, ValueError: rows are no list of flat mappings to JSON values, or hold NaN.
    """
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise TypeError("a cell returns a list of rows, each a dict")
    for number, row in enumerate(rows):
        for column, value in row.items():
            where = f"row {number}, column {column!r}"
            if value is not None and not isinstance(value, (str, int, float)):
                raise TypeError(f"{where}: {type(value).__name__} is no plain value")
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{where}: {value}; what is not known is None")
    read: list[Row] = json.loads(json.dumps(rows))
    return read


def write_cell(path: Path, cell: Cell, mark: str, done: Finished) -> None:
    """Write the rows with all that they depend on."""
    whole = asdict(done)
    record = {
        "cell": cell.name,
        "function": f"{cell.function.__module__}.{cell.function.__qualname__}",
        "arguments": cell.arguments,
        "fingerprint": mark,
        "checksum": _hash(json.dumps(whole)),
        **whole,
    }
    write_atomically(path, json.dumps(record, indent=1))


def read_cell(path: Path, mark: str) -> Finished | None:
    """The rows of a file; None if it is missing, damaged, half written or of other work."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        whole = {each.name: record[each.name] for each in fields(Finished)}
        if record["checksum"] != _hash(json.dumps(whole)) or record["fingerprint"] != mark:
            return None
        done = Finished(**whole)
        check_rows(done.rows)
        _check_origin(done)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return done


def _check_origin(done: Finished) -> None:
    if not isinstance(done.seconds, float) or not 0.0 <= done.seconds < math.inf:
        raise ValueError(f"{done.seconds!r} is no time")
    facts = done.machine
    if not isinstance(facts, dict) or not all(isinstance(text, str) for text in facts.values()):
        raise TypeError("facts of a machine are texts")
    datetime.fromisoformat(done.date)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()

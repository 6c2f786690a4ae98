"""Where the files of a run go: each kind of run has folders of its own, and alters no other's."""

import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinverse.errors import InputError

__all__ = ["Places", "places", "rows_file"]


@dataclass(frozen=True)
class Places:
    """Folders of a run.

    Attributes:
        cells: of the finished cells; runs of the same depth share them.
        pages: of the page and its CSV files.
    """

    cells: Path
    pages: Path

    def check(self, cells: Iterable[str], pages: Iterable[str]) -> None:
        """Make the folders, and see that files of these names can be written there.

        Raises:
            InputError: a folder cannot be written, or something else has the name of a file.
        """
        for folder in (self.cells, self.pages):
            _check_folder(folder)
        files = (*(self.cells / name for name in cells), *(self.pages / name for name in pages))
        for file in files:
            if file.exists() and not file.is_file():
                raise InputError(f"{file} has to be a file and is none: remove it")


def places(out: str | Path, study: str, quick: bool, asked: Sequence[str] = ()) -> Places:
    """The folders of a run.

    Args:
        out: folder for everything.
        study: name of the study.
        quick: few repetitions; all its files are in ``OUT/STUDY/quick``.
        asked: names of the tables asked for; empty: all of the study.

    Example:
        >>> places("studies", "jha2015", quick=True, asked=["7.7"]).pages
        PosixPath('studies/jha2015/quick/table-7.7')
    """
    root = Path(out) / study / "quick" if quick else Path(out) / study
    return Places(root / "cells", root / f"table-{'-'.join(asked)}" if asked else root)


def rows_file(function: Callable[..., Any]) -> str:
    """Name of the CSV file with the rows of all cells of a function.

    Example:
        >>> rows_file(search)
        'cells-jha2015.swarm.search.search.csv'
    """
    module = function.__module__.removeprefix("kinverse.studies.")
    return f"cells-{module}.{function.__qualname__}.csv"


def _check_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InputError(f"cannot write in {folder}: {error.strerror}") from error

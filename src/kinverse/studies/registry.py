"""The studies there are: the packages of this folder, imported when they are asked for."""

import importlib
import pkgutil
from collections.abc import Iterable

from kinverse import studies
from kinverse.errors import InputError
from kinverse.studies.study import Study
from kinverse.studies.table import TableSpec

__all__ = ["choose_tables", "load_study", "study_names"]


def study_names() -> list[str]:
    """Names of all studies, sorted.

    Example:
        >>> study_names()
        ['chiddarwar2010', 'habibkhah2021', 'jha2015', 'masajedi2013', 'summary']
    """
    return sorted(found.name for found in pkgutil.iter_modules(studies.__path__) if found.ispkg)


def load_study(name: str) -> Study:
    """A study by its name.

    Raises:
        InputError: no such study; the message lists them.

    Example:
        >>> load_study("jha2015").title
    """
    if name not in study_names():
        raise InputError(f"there is no study {name!r}; there are {', '.join(study_names())}")
    study: Study = importlib.import_module(f"kinverse.studies.{name}").STUDY
    return study


def choose_tables(study: Study, names: Iterable[str] | None) -> tuple[TableSpec, ...]:
    """Tables of a study by their names or by what else they cover, in its order; None: all.

    Raises:
        InputError: no such table; the message lists them.

    Example:
        >>> [spec.name for spec in choose_tables(load_study("jha2015"), ["7.7"])]
        ['7.7']
    """
    if names is None:
        return study.tables
    wanted = set(names)
    known = {name for spec in study.tables for name in (spec.name, *spec.covers)}
    for name in sorted(wanted - known):
        each = ", ".join(spec.name for spec in study.tables)
        raise InputError(f"{study.name} has no table {name!r}; it has {each}")
    return tuple(spec for spec in study.tables if wanted & {spec.name, *spec.covers})

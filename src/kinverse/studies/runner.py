"""Runs studies: cells in parallel, every finished one kept at once, tables from their rows."""

import re
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from kinverse.errors import InputError, KinverseError, MissingExtra
from kinverse.studies.cell import Cell
from kinverse.studies.cell_file import Finished, check_rows, fingerprint, read_cell, write_cell
from kinverse.studies.machine import machine, now
from kinverse.studies.places import places, rows_file
from kinverse.studies.registry import choose_tables, load_study, study_names
from kinverse.studies.sources import source_hash
from kinverse.studies.study import Study
from kinverse.studies.study_run import Failure, StudyRun
from kinverse.studies.table import Table, TableSpec

__all__ = ["run", "run_studies"]

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
Progress = Callable[[str, float], object]


def run(
    name: str,
    table: str | None = None,
    *,
    quick: bool = False,
    out: str | Path = "studies",
    jobs: int | None = None,
    progress: Progress | None = None,
) -> list[StudyRun]:
    """Run a study or all of them.

    Every cell that is finished is one file ``OUT/NAME/cells/CELL.json`` (quick runs:
    ``OUT/NAME/quick/cells``), written at once: a run that was interrupted goes on where it was.

    Args:
        name: of a study, or "all".
        table: one table of the study only.
        quick: few repetitions, minutes together.
        out: folder for everything.
        jobs: processes; None: as ``joblib.parallel_config`` around the call says, else one. Any
            backend of joblib takes the cells.
        progress: called with the cell just finished and the share of the work that is done.

    Returns:
        For each study its tables. What raised is in ``failures``; the rest went on.

    Raises:
        InputError: unknown study or table, or a folder that cannot be written.
        MissingExtra: joblib is not installed.

    Example:
        >>> [ours] = run("jha2015", "7.7", quick=True)
        >>> ours.tables["7.7"].verdict
        <Verdict.OTHER_READING: 'reproduced under another reading'>
    """
    if name == "all" and table is not None:
        raise InputError(f"table {table!r} of which study? {', '.join(study_names())}")
    studies = [load_study(each) for each in (study_names() if name == "all" else [name])]
    chosen = [
        (study, choose_tables(study, None if table is None else [table])) for study in studies
    ]
    return run_studies(chosen, quick=quick, out=out, jobs=jobs, progress=progress)


def run_studies(
    chosen: list[tuple[Study, tuple[TableSpec, ...]]],
    *,
    quick: bool,
    out: str | Path,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> list[StudyRun]:
    """As ``run``, for studies that are at hand, with the tables to make of each."""
    mark = _marks()
    plans = [_cells_of(study, specs, quick) for study, specs in chosen]
    works: dict[str, _Work] = {}
    for (study, specs), cells in zip(chosen, plans, strict=True):
        where = places(out, study.name, quick, _asked(study, specs))
        tables = {f"{spec.name}.csv" for spec in specs}
        rows = {rows_file(cell.function) for cell in cells.values()}
        where.check((f"{name}.json" for name in cells), {"index.html", *tables, *rows})
        for cell in cells.values():
            work = works.setdefault(mark(cell), _Work(cell))
            work.files.append((where.cells / f"{cell.name}.json", cell))
    _work_off(works, jobs, progress or (lambda text, share: None))
    return [
        _tables(study, specs, quick, cells, {name: works[mark(c)] for name, c in cells.items()})
        for (study, specs), cells in zip(chosen, plans, strict=True)
    ]


@dataclass
class _Work:
    """A cell, all files that its rows go to, and what came of it."""

    cell: Cell
    files: list[tuple[Path, Cell]] = field(default_factory=list)
    done: Finished | None = None
    failure: Failure | None = None
    computed: bool = False


def _work_off(works: dict[str, _Work], jobs: int | None, progress: Progress) -> None:
    for mark, work in works.items():
        for path, _ in work.files:
            work.done = work.done or read_cell(path, mark)
        if work.done:
            _keep(work, mark, work.done)
    left = {mark: work for mark, work in works.items() if work.done is None}
    finished = len(works) - len(left)
    progress("", finished / max(1, len(works)))
    for mark, outcome in _compute_all(left, jobs):
        work = left[mark]
        if isinstance(outcome, Failure):
            work.failure = outcome
        else:
            work.done, work.computed = outcome, True
            _keep(work, mark, outcome)
        finished += 1
        progress(work.cell.name, finished / len(works))


def _keep(work: _Work, mark: str, done: Finished) -> None:
    for path, cell in work.files:
        if read_cell(path, mark) is None:
            write_cell(path, cell, mark, done)


def _compute_all(
    left: dict[str, _Work], jobs: int | None
) -> Iterator[tuple[str, Finished | Failure]]:
    if not left:
        return
    try:
        import joblib
    except ImportError as error:
        raise MissingExtra("kinverse.studies", "study") from error

    # one cell a batch: a cell that is finished is never held back by another
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
    outcomes = parallel(joblib.delayed(_compute)(mark, work.cell) for mark, work in left.items())
    try:
        yield from outcomes
    except BrokenExecutor as error:
        raise KinverseError(
            "a worker process was ended from outside, for want of memory perhaps; finished cells"
            " are kept: run again to go on"
        ) from error
    finally:
        outcomes.close()


def _compute(mark: str, cell: Cell) -> tuple[str, Finished | Failure]:
    """In a worker: the rows of a cell with one BLAS thread, or what it raised."""
    import scipy.linalg  # noqa: F401  # brings a BLAS of its own, limited only once it is loaded
    from threadpoolctl import threadpool_limits

    start = time.process_time()
    try:
        with threadpool_limits(1):
            rows = check_rows(cell.function(**cell.arguments))
    except Exception as error:
        return mark, _failure(f"cell {cell.name}", error)
    return mark, Finished(rows, time.process_time() - start, machine(), now())


def _tables(
    study: Study,
    specs: tuple[TableSpec, ...],
    quick: bool,
    cells: dict[str, Cell],
    works: dict[str, _Work],
) -> StudyRun:
    made: dict[str, Table] = {}
    done = {name: (cells[name], work.done) for name, work in works.items() if work.done}
    failed: dict[str, Failure] = {
        name: Failure(f"cell {name}", work.failure.error, work.failure.trace)
        for name, work in works.items()
        if work.failure
    }
    failures = list(failed.values())
    for spec in specs:
        names = [cell.name for cell in spec.cells(quick)]
        missing = [name for name in names if name in failed]
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            failures.append(Failure(f"table {spec.name}", f"needs cell {missing[0]}{more}"))
            continue
        try:
            made[spec.name] = spec.build({name: done[name][1].rows for name in names})
        except Exception as error:
            failures.append(_failure(f"table {spec.name}", error))
    computed = sum(work.computed for work in works.values())
    asked = _asked(study, specs)
    return StudyRun(study, quick, asked, made, done, tuple(failures), computed)


def _asked(study: Study, specs: tuple[TableSpec, ...]) -> tuple[str, ...]:
    return () if specs == study.tables else tuple(spec.name for spec in specs)


def _cells_of(study: Study, specs: tuple[TableSpec, ...], quick: bool) -> dict[str, Cell]:
    """Cells of the tables by name."""
    names = [spec.name for spec in study.tables]
    for name in names:
        if not NAME.fullmatch(name) or names.count(name) > 1:
            raise InputError(f"{study.name}: table name {name!r}, which must be one word and once")
    cells: dict[str, Cell] = {}
    for spec in specs:
        for cell in spec.cells(quick):
            if not NAME.fullmatch(cell.name):
                raise InputError(f"{study.name}, table {spec.name}: cell name {cell.name!r}")
            if cells.setdefault(cell.name, cell) != cell:
                raise InputError(f"{study.name}: two cells are named {cell.name!r}")
    return cells


def _marks() -> Callable[[Cell], str]:
    """Fingerprints, each source read once."""
    source = cache(source_hash)
    return lambda cell: fingerprint(cell, source)


def _failure(what: str, error: BaseException) -> Failure:
    text = "".join(traceback.format_exception(error))
    return Failure(what, f"{type(error).__name__}: {error}", text)

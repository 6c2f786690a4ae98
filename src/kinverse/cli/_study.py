"""Studies and their tables, printed."""

from pathlib import Path

from rich.markup import escape
from rich.measure import Measurement

from kinverse.cli._show import console, note, show_table, table
from kinverse.studies.registry import load_study, study_names
from kinverse.studies.shown import columns, is_numeric, shown
from kinverse.studies.study_run import StudyRun
from kinverse.studies.table import CAUTION, Table

__all__ = ["show", "show_failures", "show_studies", "show_tables"]

MOST_ROWS = 12
"""Of a table on the terminal."""


def show_studies() -> None:
    """Name, title and tables of every study."""
    made = table("study", "title", ">tables")
    for name in study_names():
        study = load_study(name)
        made.add_row(name, study.title, str(len(study.tables)))
    show_table(made)


def show_tables(name: str) -> None:
    """Name and title of every table of a study, and what else it answers to."""
    made = table("table", "title", "answers to")
    for spec in load_study(name).tables:
        made.add_row(spec.name, escape(spec.title), " ".join(spec.covers))
    show_table(made)


def show(run: StudyRun, page: Path, brief: bool = False) -> None:
    """Every table with its verdict, then where it all is; in brief without notes and rows."""
    tell = console().print
    if brief:
        tell(f"\n{run.study.title}", markup=False, style="bold")
    for name, each in run.tables.items():
        caution = f" ({CAUTION})" if run.quick and not brief else ""
        verdict = f"{each.verdict}{caution}: {each.residual}"
        if brief:
            tell(f"{name}: {verdict}", markup=False)
            continue
        tell(f"\n{each.title}", markup=False, style="bold")
        tell(verdict, markup=False)
        if each.note:
            tell(each.note, markup=False)
        _show_rows(each, page.parent / f"{name}.csv")
    counts = f"{len(run.tables)} tables from {len(run.cells)} cells, {run.computed} computed now"
    tell(f"\n{run.study.name}: {counts}", markup=False)
    tell(f"written: {page}", markup=False)


def show_failures(runs: list[StudyRun]) -> None:
    """What raised, on standard error."""
    for run in runs:
        for failure in run.failures:
            note(f"failed: {run.study.name}: {failure.what}: {failure.error}")


def _show_rows(each: Table, csv: Path) -> None:
    """As many rows and columns as the terminal has room for; a note tells what is left out."""
    out = console()
    heads, rows = columns(each.rows), each.rows[:MOST_ROWS]
    fitting = len(heads)
    while True:
        made = table(*(">" * is_numeric(rows, head) + escape(head) for head in heads[:fitting]))
        for row in rows:
            made.add_row(*(escape(shown(row.get(head))) for head in heads[:fitting]))
        wide = Measurement.get(out, out.options.update(width=10_000), made).maximum
        if wide <= out.width or fitting <= 1:
            break
        fitting -= 1
    out.print(made)
    left = []
    if len(rows) < len(each.rows):
        left.append(f"{len(each.rows) - len(rows)} more rows")
    if fitting < len(heads):
        left.append(f"{len(heads) - fitting} more columns")
    if left:
        out.print(f"{' and '.join(left)} in {csv}", markup=False)

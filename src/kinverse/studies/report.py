"""A study's page: one HTML file that needs no other, and every table as CSV."""

import base64
import io
from html import escape
from importlib import resources
from pathlib import Path

from kinverse.files import write_atomically
from kinverse.studies.grid import grid
from kinverse.studies.method import cell_rows, method
from kinverse.studies.places import places
from kinverse.studies.shown import as_csv
from kinverse.studies.study_run import StudyRun
from kinverse.studies.table import CAUTION, Picture, Table, Verdict

__all__ = ["write_report"]

MOST_ROWS = 120
"""Of a table on the page; all of them are in its CSV file."""
LARGEST_SVG = 300_000
"""Bytes; a larger drawing becomes a bitmap."""
COLOURS = {
    Verdict.REPRODUCED: "good",
    Verdict.OTHER_READING: "other",
    Verdict.NOT_REPRODUCED: "bad",
    Verdict.CANNOT_CHECK: "grey",
    Verdict.OURS: "ours",
}


def write_report(run: StudyRun, out: str | Path) -> Path:
    """Write ``OUT/NAME/index.html`` and ``OUT/NAME/TABLE.csv`` for every table.

    Rows of the cells, from which tables and pictures are made, are in ``cells-FUNCTION.csv``.
    A quick run is written to ``OUT/NAME/quick``, one of some tables only to a folder
    ``table-TABLES`` beside the whole page: neither alters the whole page or its CSV files.

    Args:
        run: of ``kinverse.studies.runner.run``.
        out: the folder given there.

    Returns:
        The page.

    Raises:
        MissingExtra: a table has pictures and Matplotlib is not installed.

    Example:
        >>> [ours] = run("jha2015", quick=True, out="studies")
        >>> write_report(ours, "studies")
        PosixPath('studies/jha2015/quick/index.html')
    """
    folder = places(out, run.study.name, run.quick, run.asked).pages
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in run.tables.items():
        write_atomically(folder / f"{name}.csv", as_csv(table.rows))
    for name, rows in cell_rows(run).items():
        write_atomically(folder / name, as_csv(rows))
    path = folder / "index.html"
    write_atomically(path, page(run))
    return path


def page(run: StudyRun) -> str:
    """The whole page."""
    study = run.study
    style = resources.files("kinverse.studies").joinpath("report.css").read_text(encoding="utf-8")
    title = f"{study.title} ({CAUTION})" if run.quick else study.title
    sections = "".join(_section(name, table, run.quick) for name, table in run.tables.items())
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(study.name)}: {escape(title)}</title>
<style>
{style}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
<p class="source">{escape(study.source)}</p>
<p>{escape(_total(run))}</p>
</header>
<main>
{_failures(run)}{_contents(run)}
{sections}{method(run)}</main>
</body>
</html>
"""


def _total(run: StudyRun) -> str:
    verdicts = [table.verdict for table in run.tables.values()]
    counts = [f"{verdicts.count(v)} {v}" for v in Verdict if v in verdicts]
    depth = "A quick run" if run.quick else "A full run"
    of = f"{len(verdicts)} of {len(run.study.tables)} tables"
    return (
        f"{depth}, {of}: {', '.join(counts) or 'none'}. Verdicts are properties of the"
        " printed numbers; no cause is claimed."
    )


def _failures(run: StudyRun) -> str:
    if run.ok:
        return ""
    items = "".join(f"<li><b>{escape(f.what)}</b>: {escape(f.error)}</li>" for f in run.failures)
    return f'<section aria-label="Failures"><h2>Not finished</h2><ul>{items}</ul></section>\n'


def _contents(run: StudyRun) -> str:
    items = "".join(
        f'<li><a href="#t-{escape(name)}">{escape(table.title)}</a>'
        f"{_badges(table, run.quick)}</li>\n"
        for name, table in run.tables.items()
    )
    return f"""<nav aria-label="Tables">
<h2>Tables</h2>
<ol>
{items}<li><a href="#method">How this was made</a></li>
</ol>
</nav>"""


def _badges(table: Table, quick: bool) -> str:
    """The verdict, and beside it what it does not rest on."""
    verdict = table.verdict
    badge = f'<span class="verdict badge {COLOURS[verdict]}">{escape(verdict)}</span>'
    caution = f' <span class="badge caution">{CAUTION}</span>'
    return f"<span>{badge}{caution if quick else ''}</span>"


def _section(name: str, table: Table, quick: bool) -> str:
    notes = "".join(f"<p>{escape(part)}</p>\n" for part in table.note.split("\n\n") if part)
    return f"""<section id="t-{escape(name)}">
<h2>{escape(table.title)}</h2>
<p>{_badges(table, quick)} {escape(table.residual)}</p>
{notes}{_table(name, table)}
{"".join(_figure(picture) for picture in table.pictures)}</section>
"""


def _table(name: str, table: Table) -> str:
    rows = table.rows[:MOST_ROWS]
    more = f", the first {len(rows)} here" if len(rows) < len(table.rows) else ""
    what = f'{len(table.rows)} rows{more}; all digits in <a href="{name}.csv">{name}.csv</a>'
    return grid(rows, f"Table {escape(name)}: {what}", f"Table {name}")


def _figure(picture: Picture) -> str:
    return f"""<figure>
<img src="{_data_uri(picture)}" alt="{escape(picture.alt)}">
<figcaption>{escape(picture.title)}</figcaption>
</figure>
"""


def _data_uri(picture: Picture) -> str:
    figure = picture.draw()
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None}, bbox_inches="tight")
    kind = "svg+xml"
    if file.tell() > LARGEST_SVG:
        file, kind = io.BytesIO(), "png"
        figure.savefig(file, format="png", dpi=130, bbox_inches="tight")
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode()}"

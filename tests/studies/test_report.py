"""The page of a study: whole, readable by anyone, and in need of nothing else."""

import csv
import re
from html.parser import HTMLParser

import pytest
import work

from kinverse.studies.cell import Cell
from kinverse.studies.report import MOST_ROWS, write_report
from kinverse.studies.runner import run_studies
from kinverse.studies.table import Picture, Table, TableSpec, Verdict

VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Opens and closes every tag in order, and keeps what it met."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.text = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def all(self, tag):
        return [attrs for name, attrs in self.tags if name == tag]

    def words(self):
        return " ".join("".join(self.text).split())


def seeded(seed):
    return [{"name": f"<{seed}>", "error, mm": 0.5 * seed, "solved": seed > 1, "lost": None}]


def draw(points):
    def figure():
        from kinverse.plots import new_figure

        made = new_figure((3.0, 2.0))
        made.subplots().scatter(range(points), [k % 7 for k in range(points)])
        return made

    return figure


def many(n):
    return [{"k": k, "value": k / 3} for k in range(n)]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    seeds = [Cell(f"s{k}", seeded, {"seed": k}) for k in (0, 1, 2, 5)]
    pictures = (Picture("A curve", 'It falls & "rises"', draw(20)),)

    def table(rows):
        every = [row for cell in rows.values() for row in cell]
        note = "One < two.\n\nAnd more."
        return Table("Table <1>", every, Verdict.NOT_REPRODUCED, "5 mm", note, pictures)

    def long(rows):
        return Table("Long", rows["long"], Verdict.OURS, "none")

    study = work.study_of(
        TableSpec("t.1", "", lambda quick: seeds, table),
        TableSpec("long", "", lambda quick: [Cell("long", many, {"n": 500})], long),
        work.table_of("bad", work.cells(work.squares_but_three, out / "log")),
    )
    [run] = run_studies([(study, study.tables)], quick=False, out=out)
    path = write_report(run, out)
    return out, path, path.read_text()


def test_the_page_is_whole_and_says_its_language(made):
    page = Page(made[2])
    assert made[2].startswith("<!DOCTYPE html>")
    assert page.all("html") == [{"lang": "en"}]
    assert len(page.all("h1")) == 1 and len(page.all("title")) == 1 and len(page.all("main")) == 1


def test_nothing_outside_is_needed(made):
    page = Page(made[2])
    assert not page.all("script") and not page.all("link") and not page.all("iframe")
    for _, attrs in page.tags:
        assert "style" not in attrs and not [name for name in attrs if name.startswith("on")]
        assert re.match(
            r"data:image/(svg\+xml|png);base64,", attrs.get("src", "data:image/png;base64,")
        )
        assert re.fullmatch(r"#[\w.-]+|[\w.-]+\.csv", attrs.get("href", "#x"))
    assert "url(" not in made[2] and "@import" not in made[2] and "http" not in made[2]


def test_every_link_leads_somewhere(made):
    page = Page(made[2])
    ids = {attrs["id"] for _, attrs in page.tags if "id" in attrs}
    for attrs in page.all("a"):
        target = attrs["href"]
        assert target[1:] in ids if target[0] == "#" else (made[1].parent / target).is_file()


def test_pictures_have_their_words(made):
    page = Page(made[2])
    [image] = page.all("img")
    assert image["alt"] == 'It falls & "rises"'
    assert len(page.all("figure")) == len(page.all("figcaption")) == 1
    assert "A curve" in page.words()


def test_tables_have_captions_and_scopes(made):
    page = Page(made[2])
    assert len(page.all("caption")) == len(page.all("table")) == 4
    assert all(attrs["scope"] in ("col", "row") for attrs in page.all("th"))
    assert "Table t.1: 4 rows" in page.words()


def test_verdict_residual_notes_and_text_are_escaped(made):
    words = Page(made[2]).words()
    assert "not reproduced 5 mm" in words and "Table <1>" in words and "<5>" in words
    assert "One < two." in words and "And more." in words
    assert "A full run, 2 of 3 tables: 1 not reproduced, 1 ours, nothing printed." in words


def test_what_failed_is_on_the_page(made):
    words = Page(made[2]).words()
    assert "cell squares_but_three-3: ArithmeticError: three is refused" in words
    assert "table bad: needs cell squares_but_three-3" in words


def test_method_tells_seeds_versions_and_machine(made):
    words = Page(made[2]).words()
    assert "seed 0-2, 5" in words and "one BLAS thread" in words and "cores" in words
    for name in ("kinverse", "numpy", "Python", "processor", "UTC"):
        assert name in words
    assert re.search(r"test_report.seeded\s*4", words)


def counted(seeds, solver_seed):
    return [{"k": k} for k in range(seeds)]


def test_counts_of_seeds_and_seeds_that_are_no_arguments_are_told(tmp_path):
    from dataclasses import replace

    cells = [Cell("c", counted, {"seeds": 4, "solver_seed": 9})]
    table = TableSpec(
        "t", "", lambda q: cells, lambda rows: Table("T", rows["c"], Verdict.OURS, "")
    )
    study = replace(work.study_of(table), seeds={"weights": "4100 + seed"})
    [run] = run_studies([(study, study.tables)], quick=False, out=tmp_path)
    words = Page(write_report(run, tmp_path).read_text()).words()
    assert "seed 0-3; solver seed 9; weights 4100 + seed; what has no seed here" in words


def test_long_tables_are_cut_on_the_page_only(made):
    page = made[2]
    assert f"500 rows, the first {MOST_ROWS} here" in page
    lines = (made[1].parent / "long.csv").read_text().splitlines()
    assert len(lines) == 501 and lines[500] == f"499,{499 / 3!r}"


def test_csv_has_all_digits_and_empty_for_unknown(made):
    text = (made[1].parent / "t.1.csv").read_text()
    rows = list(csv.DictReader(text.splitlines()))
    assert rows[3] == {"name": "<5>", "error, mm": "2.5", "solved": "True", "lost": ""}


def test_every_row_of_the_cells_is_in_a_csv_file_of_their_function(made):
    text = (made[1].parent / "cells-test_report.seeded.csv").read_text()
    rows = list(csv.DictReader(text.splitlines()))
    assert [row["cell"] for row in rows] == ["s0", "s1", "s2", "s5"]
    assert [row["argument seed"] for row in rows] == ["0", "1", "2", "5"]
    assert [row["error, mm"] for row in rows] == ["0.0", "0.5", "1.0", "2.5"]
    links = [attrs["href"] for attrs in Page(made[2]).all("a")]
    assert "cells-test_report.seeded.csv" in links and "cells-test_report.many.csv" in links


def test_the_machines_are_those_of_the_cells(made, tmp_path):
    """As after a cluster, or a folder that was taken elsewhere."""
    from dataclasses import replace

    cells = work.cells(work.squares, tmp_path / "log", count=3)
    study = work.study_of(work.table_of("t", cells))
    [run] = run_studies([(study, study.tables)], quick=False, out=tmp_path)
    facts = {"processor": "Abacus", "kinverse": "0.0.7"}
    cell, done = run.cells["squares-1"]
    moved = replace(done, machine=facts, date="1999-12-31 23:59")
    run = replace(run, cells={**run.cells, "squares-1": (cell, moved)})
    words = Page(write_report(run, tmp_path).read_text()).words()
    assert re.search(r"Abacus\s*1\s*1999-12-31 23:59\s*1999-12-31 23:59", words)
    assert "0.0.7" in words
    again = go_on(study, tmp_path).cells["squares-0"][1]
    assert again == run.cells["squares-0"][1]  # as it was computed: seconds, machine and date


def go_on(study, out):
    [run] = run_studies([(study, study.tables)], quick=False, out=out)
    assert run.computed == 0
    return run


def test_a_heavy_picture_becomes_a_bitmap(tmp_path):
    pictures = (Picture("Many", "Many points", draw(5_000)),)

    def table(rows):
        return Table("T", rows["long"], Verdict.OURS, "none", pictures=pictures)

    study = work.study_of(TableSpec("t", "", lambda q: [Cell("long", many, {"n": 3})], table))
    [run] = run_studies([(study, study.tables)], quick=True, out=tmp_path)
    [image] = Page(write_report(run, tmp_path).read_text()).all("img")
    assert image["src"].startswith("data:image/png")


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("tables", [1, 2])
def test_no_other_run_alters_the_whole_page_or_its_numbers(tmp_path, quick, tables):
    def build(rows):
        return Table("T", [{"a": 1}], Verdict.REPRODUCED, "0 mm")

    def other(rows):
        return Table("T", [{"a": 2}], Verdict.REPRODUCED, "0 mm")

    def study(build):
        return work.study_of(*(TableSpec(name, "", lambda q: [], build) for name in "ab"))

    whole = study(build)
    [run] = run_studies([(whole, whole.tables)], quick=False, out=tmp_path)
    path = write_report(run, tmp_path)
    before = {each: each.read_text() for each in (path, *path.parent.glob("*.csv"))}
    later = study(other)
    [run] = run_studies([(later, later.tables[:tables])], quick=quick, out=tmp_path)
    page = write_report(run, tmp_path)
    if (quick, tables) == (False, 2):
        assert page == path  # the same run once more
        return
    assert len(before) == 3 and {each: each.read_text() for each in before} == before
    assert (page.parent / "a.csv").read_text() == "a\n2\n"


def test_a_run_of_one_table_is_in_a_folder_of_its_name(tmp_path):
    study = work.study_of(*(TableSpec(name, "", lambda q: [], toy) for name in "ab"))
    [run] = run_studies([(study, study.tables[:1])], quick=True, out=tmp_path)
    page = write_report(run, tmp_path)
    assert page == tmp_path / "toy" / "quick" / "table-a" / "index.html"
    assert "A quick run" in page.read_text()


@pytest.mark.parametrize("quick", [False, True])
def test_a_quick_run_says_so_in_its_heading_and_beside_every_verdict(tmp_path, quick):
    study = work.study_of(*(TableSpec(name, "", lambda q: [], toy) for name in "ab"))
    [run] = run_studies([(study, study.tables)], quick=quick, out=tmp_path)
    text = write_report(run, tmp_path).read_text()
    caution = "quick run, not for conclusions"
    assert (f"<h1>A toy ({caution})</h1>" in text) == quick
    assert (f"<title>toy: A toy ({caution})</title>" in text) == quick
    verdict = '<span class="verdict badge good">reproduced</span>'
    beside = f'{verdict} <span class="badge caution">{caution}</span>'
    assert text.count(verdict) == 4  # two tables, each in the list and in its section
    assert text.count(beside) == (4 if quick else 0)


def toy(rows):
    return Table("T", [{"a": 1}], Verdict.REPRODUCED, "0 mm")

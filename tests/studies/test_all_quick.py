"""Every study, quickly: all cells run, all tables have a verdict and are on a page."""

import html.parser
import json
import re

import pytest

from kinverse.studies.registry import study_names
from kinverse.studies.report import write_report
from kinverse.studies.runner import run
from kinverse.studies.table import Verdict

RANGE = re.compile(r"\d\S* (to|/) -?\d\S*$")
"""Two numbers in one column, which no program can read; parts of a path may be any number."""
NAMES = ["chiddarwar2010", "habibkhah2021", "jha2015", "masajedi2013", "summary"]


class Page(html.parser.HTMLParser):
    """What a page refers to, and its pictures' texts."""

    def __init__(self):
        super().__init__()
        self.outside, self.texts = [], []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag == "img":
            self.texts.append(given.get("alt", ""))
        for key in ("src", "href"):
            address = given.get(key, "")
            if address and not address.startswith(("data:", "#")):
                self.outside.append(address)


def test_the_five_studies_are_found():
    assert study_names() == NAMES


@pytest.mark.slow
def test_all_studies_run_quickly(tmp_path):
    runs = run("all", quick=True, out=tmp_path, jobs=1)
    assert [each.study.name for each in runs] == NAMES
    for each in runs:
        assert not each.failures, each.failures
        assert list(each.tables) == [spec.name for spec in each.study.tables]
        for table in each.tables.values():
            assert table.rows
            assert not [
                (column, value)
                for row in table.rows
                for column, value in row.items()
                if RANGE.match(str(value)) and not column.startswith("feasible parts")
            ]
            assert table.residual
            assert isinstance(table.verdict, Verdict)
        page = Page()
        written = write_report(each, tmp_path)
        page.feed(written.read_text(encoding="utf-8"))
        for address in page.outside:  # the numbers of a table, beside the page
            assert (written.parent / address).is_file()
        assert all(page.texts)
    # a second run trusts what is on disk, but for the file that was cut short
    cell = next((tmp_path / "jha2015" / "quick" / "cells").glob("*.json"))
    text = cell.read_text(encoding="utf-8")
    cell.write_text(text[: len(text) // 2], encoding="utf-8")
    again = run("all", quick=True, out=tmp_path, jobs=1)
    assert [each.computed for each in again] == [0, 0, 1, 0, 0]
    json.loads(cell.read_text(encoding="utf-8"))

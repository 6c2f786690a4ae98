"""Whose source counts: a cell's module, what it imports of its package, and the data beside it."""

import sys
import types

import pytest

from kinverse.errors import InputError
from kinverse.studies.sources import library_hash, source_hash


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "kinverse_toy" / "part"
    (folder / "data").mkdir(parents=True)
    files = {
        "../__init__.py": "",
        "__init__.py": "",
        "cells.py": "from kinverse_toy.part.helper import f\n",
        "helper.py": "def f():\n    from kinverse_toy.part import deep\n    return deep\n",
        "deep.py": "x = 1\n",
        "other.py": "y = 1\n",
        "data/printed.csv": "a\n1\n",
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    yield folder
    for name in [name for name in sys.modules if name.startswith("kinverse_toy")]:
        del sys.modules[name]


@pytest.mark.parametrize("name", ["cells.py", "helper.py", "deep.py", "data/printed.csv"])
def test_what_rows_come_from_counts(package, name):
    before = source_hash("kinverse_toy.part.cells")
    assert source_hash("kinverse_toy.part.cells") == before
    (package / name).write_text((package / name).read_text() + "\n")
    assert source_hash("kinverse_toy.part.cells") != before


def test_other_modules_do_not_count(package):
    before = source_hash("kinverse_toy.part.cells")
    (package / "other.py").write_text("y = 2\n")
    assert source_hash("kinverse_toy.part.cells") == before


def test_the_version_counts(package, monkeypatch):
    before = source_hash("kinverse_toy.part.cells")
    monkeypatch.setattr("kinverse.studies.sources.version", lambda name: "99")
    assert source_hash("kinverse_toy.part.cells") != before


def test_a_module_without_a_file_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "nowhere", types.ModuleType("nowhere"))
    with pytest.raises(InputError, match="nowhere has no file"):
        source_hash("nowhere")


@pytest.mark.parametrize("name", ["robot.py", "robots/kr16.toml", "_core.so"])
def test_the_library_and_its_core_count(tmp_path, name):
    folders = [tmp_path / "a", tmp_path / "b", tmp_path / "c"]
    for folder in folders:
        for path in ("robot.py", "robots/kr16.toml", "_core.so", "cli/main.py"):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text("1")
    (folders[1] / name).write_text("2")
    (folders[2] / "cli/main.py").write_text("2")
    a, b, c = (library_hash(folder, folder / "_core.so") for folder in folders)
    assert a != b and a == c


def test_the_library_is_part_of_every_mark(package, monkeypatch):
    before = source_hash("kinverse_toy.part.cells")
    monkeypatch.setattr("kinverse.studies.sources.library_hash", lambda *given: "other")
    assert source_hash("kinverse_toy.part.cells") != before

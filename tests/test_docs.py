"""Every example and every block of the pages runs; what they promise is there."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

from kinverse.cli import main

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NOT_HERE = ("pip ", "make ")


def blocks(*languages):
    for page in PAGES:
        for k, match in enumerate(BLOCK.finditer(page.read_text(encoding="utf-8"))):
            if match[1] in languages:
                yield pytest.param(match[2], id=f"{page.name}-{k}")


def commands():
    for block in blocks("console", "bash"):
        lines = [line.removeprefix("$ ") for line in block.values[0].splitlines()]
        lines = [line for line in lines if line and not line.startswith(NOT_HERE)]
        if lines:
            yield pytest.param(lines, id=block.id)


@pytest.mark.parametrize("code", list(blocks("python")))
def test_python_blocks_run(code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write a file
    exec(compile(code, "page", "exec"), {"__name__": "page"})


@pytest.mark.parametrize("lines", list(commands()))
def test_commands_of_the_pages_run(lines, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some draw a picture, and some write what the next one reads
    for line in lines:
        program, *arguments = shlex.split(line)
        assert program == "kinverse"
        assert main(arguments) == 0, line
        assert capsys.readouterr().out, line


@pytest.mark.parametrize("name", ["README.md", "docs/info.md"])
def test_pages_show_what_their_command_prints(name, capsys):
    page = (ROOT / name).read_text(encoding="utf-8")
    command = re.search(r"^\$ kinverse (.*)$", page, re.MULTILINE)[1]
    shown = [match[2] for match in BLOCK.finditer(page) if match[1] == "text"][0]
    main(shlex.split(command))
    printed = capsys.readouterr().out

    def words(text):
        # the errors are of the last bit's size and differ between processors
        return [w for w in text.split() if not re.fullmatch(r"\d\.\de-\d+|0|-?0\.000|[─]+", w)]

    assert words(shown) == words(printed)


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.name)
def test_examples_run(file):
    done = subprocess.run(
        [sys.executable, "-W", "error", file],
        capture_output=True, text=True, check=False, env=os.environ | {"PYTHONUTF8": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout and done.stderr == ""


def test_the_urdf_example_carries_a_file():
    arm = [ROOT / "examples" / "small_arm.urdf", "base_link", "tool0"]
    done = subprocess.run(
        [sys.executable, "-W", "error", ROOT / "examples" / "from_urdf.py", *arm],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "small_arm: 6 joints" in done.stdout and "branch" in done.stdout


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.name)
def test_examples_are_short(file):
    assert len(file.read_text(encoding="utf-8").splitlines()) <= 40


def test_links_of_the_pages_lead_somewhere():
    for page in [*PAGES, ROOT / "CONTRIBUTING.md"]:
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_version_stands_in_one_place():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert version("kinverse") == project["version"]
    assert project["version"] in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")

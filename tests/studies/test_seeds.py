"""Every number that a study draws from is told on its page, found by reading the code."""

import ast
import importlib
import re
from pathlib import Path

import pytest

from kinverse import studies
from kinverse.studies.registry import load_study, study_names

FOLDER = Path(studies.__path__[0])


def drawn_from(path):
    """Whole numbers and constants that are seeds: in ``default_rng``, ``rng=``, ``NAME + seed``."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            given = list(node.args) if called == "default_rng" else []
            given += [each.value for each in node.keywords if each.arg in ("rng", "random_state")]
            for each in given:
                yield from ast.walk(each)
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            if isinstance(node.right, ast.Name) and "seed" in node.right.id:
                yield node.left
        elif isinstance(node, ast.Name) and node.id.endswith(("_SEED", "_STREAM")):
            yield node


def values_of(path):
    name = ".".join(("kinverse.studies", *path.relative_to(FOLDER).with_suffix("").parts))
    module = importlib.import_module(name.removesuffix(".__init__"))
    for node in drawn_from(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, int):
            yield node.value
        elif isinstance(node, ast.Name) and node.id.isupper():
            yield getattr(module, node.id)


@pytest.mark.parametrize("name", study_names())
def test_every_seed_in_the_code_is_told(name):
    told = {int(text) for text in re.findall(r"\d+", " ".join(load_study(name).seeds.values()))}
    found = {value for path in (FOLDER / name).rglob("*.py") for value in values_of(path)}
    assert found - told == set()


def test_the_code_is_read():
    found = set(values_of(FOLDER / "chiddarwar2010" / "loop.py"))
    assert {41_000, 44_000, 45_000} <= found

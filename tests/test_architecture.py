"""The shape of the package, held by reading its imports."""

import ast
import statistics
import subprocess
import sys
import time
from pathlib import Path

import pytest

import kinverse

ROOT = Path(kinverse.__file__).parent

# DESIGN.md, Layout: a module imports strictly lower ranks only. The module that is not named here
# fails the test: a new one gets its rank when it is written.
RANKS = {
    "_core": 0,
    "errors": 0,
    "files": 0,
    "seeds": 0.5,
    "settings": 0,
    "se3": 1,
    "geometry": 1,
    "kernels": 1,
    "status": 1,
    "optimizers": 1,
    "networks": 2,
    "dh": 2,
    "dh_table": 2,
    "pairs": 2,
    "dual_quaternion": 2,
    "screw": 2,
    "representations": 3,
    "velocity": 3,
    "axes": 2,
    "regional": 3,
    "singularities": 6,
    "singular_search": 6,
    "robot_class": 6,
    "robot": 2,
    "task": 2,
    "table": 2,
    "ranking": 2,
    "loading": 3,
    "load": 3,
    "evidence": 3,
    "judge": 3,
    "solutions": 3,
    "verify": 4,
    "learning": 4,
    "solvers": 5,
    "solve": 6,
    "conformance": 6,
    "plots": 7,
    "simulation_plots": 7.5,
    "training_plots": 7,
    "training_report": 7.5,  # a figure of their pictures
    "paths": 7,
    "calibration": 7,
    "workspace": 7,
    "export": 7,
    "studies": 8,
    "bench": 8,
    "studio": 9,
    "cli": 9,
}
# Neighbours of one rank that may see each other, in this direction.
BESIDE = {
    ("robot", "dh"),  # Robot.from_dh
    ("robot", "dh_table"),  # Robot.to_dh
    ("dh_table", "dh"),
    ("ranking", "table"),
    ("solutions", "evidence"),
    ("ranking", "task"),
    ("load", "loading"),
    ("robot_class", "singularities"),
    ("robot_class", "singular_search"),
    ("singular_search", "singularities"),
    ("workspace", "plots"),  # its pictures
    ("bench", "studies"),  # it measures them
}
SOLVER_RANKS = {
    "_base": 0,
    "numerical": 0.3,
    "descent": 0.5,
    "closed_form": 0.6,
    "population": 1.6,  # it descends with Numerical
    "swarm": 1.8,
    "trained": 1.6,  # it descends with Numerical, and Analytic labels its examples
    "learned": 1.8,
    "fusion": 1.8,
    "compose": 2,
    "registry": 3,
    "__init__": 4,
}  # the solvers themselves: 1
HEAVY = {
    *("scipy", "typer", "rich", "defusedxml", "sklearn", "matplotlib", "mujoco", "toppra"),
    *("ruckig", "viser", "dask", "zarr", "xarray", "joblib", "pandas", "torch", "click"),
}
# Packages that are the edge of the library may load what they are made of.
MAY_LOAD = {
    "cli": {"typer", "rich", "click"},
    "bench": {"rich"},
    "networks": {"sklearn"},
    "calibration": {"sklearn"},
}


def modules():
    return sorted(ROOT.rglob("*.py"))


def dotted(path):
    """("solvers", "_base") for solvers/_base.py; packages end in "__init__"."""
    return path.relative_to(ROOT).with_suffix("").parts


def imports(path, top_level_only=False):
    """Full dotted names that a module imports; those for type checking only are left out."""
    found = []

    def visit(node, inside):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            if isinstance(child, ast.Import) and not (inside and top_level_only):
                found.extend(alias.name for alias in child.names)
            elif isinstance(child, ast.ImportFrom) and not (inside and top_level_only):
                assert child.level == 0, f"{path}: relative import"
                found.extend(resolved(child.module, alias.name) for alias in child.names)
            function = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
            visit(child, inside or isinstance(child, function))

    visit(ast.parse(path.read_text()), False)
    return found


def resolved(module, name):
    """``from kinverse import se3`` imports a module; ``from kinverse.se3 import pose`` a name."""
    if module.split(".")[0] != "kinverse":
        return module
    inner = ROOT.joinpath(*module.split(".")[1:], name)
    is_module = inner.with_suffix(".py").exists() or inner.is_dir() or name == "_core"
    return f"{module}.{name}" if is_module else module


def own_imports(path):
    """The part of kinverse each own import names: ("solvers", "_base"), ("",) for the top."""
    for name in imports(path):
        head, *rest = name.split(".")
        if head == "kinverse":
            yield tuple(rest) or ("",)


def test_every_module_has_a_rank():
    unknown = {dotted(path)[0] for path in modules()} - RANKS.keys() - {"__init__"}
    assert not unknown, f"give these a rank in test_architecture.py: {sorted(unknown)}"


@pytest.mark.parametrize("path", modules(), ids=lambda path: "/".join(dotted(path)))
def test_imports_go_strictly_down(path):
    here = dotted(path)
    if here == ("__init__",):
        return
    for there in own_imports(path):
        if there == ("",):
            # the whole package: for those on top of it only
            assert RANKS[here[0]] >= 8, f"{here} imports kinverse itself"
            continue
        if there[0] == here[0]:
            continue  # within a package: see the next tests
        down = RANKS[there[0]] < RANKS[here[0]]
        assert down or (here[0], there[0]) in BESIDE, f"{here} imports {there}"


def test_imports_make_no_cycle():
    graph = {}
    for path in modules():
        here = dotted(path)
        here = here[:-1] if here[-1] == "__init__" else here
        # a function may import upwards in its own package only when called: still a cycle here
        graph[here] = {node for node in own_imports(path) if node != ("",)} - {here}
    done, open_ = set(), []

    def walk(node):
        assert node not in open_, f"cycle: {open_[open_.index(node) :]}"
        if node in done or node not in graph:
            return
        open_.append(node)
        for below in sorted(graph[node]):
            walk(below)
        done.add(open_.pop())

    for node in sorted(graph):
        if node:
            walk(node)


def test_one_module_imports_the_native_core():
    users = {dotted(path) for path in modules() if "kinverse._core" in imports(path)}
    assert users == {("kernels",)}


@pytest.mark.parametrize("path", modules(), ids=lambda path: "/".join(dotted(path)))
def test_heavy_packages_are_imported_where_they_are_used(path):
    top = {name.split(".")[0] for name in imports(path, top_level_only=True)}
    found = top & HEAVY - MAY_LOAD.get(dotted(path)[0], set())
    assert not found, f"import {sorted(found)} inside the function that needs it"


def test_only_the_base_of_solvers_verifies():
    for path in sorted((ROOT / "solvers").rglob("*.py")):
        if path.stem != "_base":
            made = {there[0] for there in own_imports(path)} & {"solutions", "verify"}
            assert not made, f"{path.name} imports {made}: solvers propose, the base verifies"


def test_solvers_are_ordered_among_themselves():
    for path in sorted((ROOT / "solvers").glob("*.py")):
        here = SOLVER_RANKS.get(path.stem, 1)
        for there in own_imports(path):
            if there[0] == "solvers" and len(there) > 1:
                below = SOLVER_RANKS.get(there[1], 1)
                assert below < here, f"{path.stem} imports {there[1]}"


# What an import costs --------------------------------------------------------------------------


def fresh(code):
    """Seconds a fresh interpreter takes, and what it says."""
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return time.perf_counter() - start, done.stdout


def test_import_loads_numpy_and_the_core_only():
    code = "import numpy, sys; a = set(sys.modules); import kinverse; print(*set(sys.modules) - a)"
    loaded = {name.split(".")[0] for name in fresh(code)[1].split()}
    assert not loaded & HEAVY
    assert "numpy.random" not in fresh(code)[1].split()
    allowed = set(sys.stdlib_module_names) | {"kinverse", "numpy"}
    assert loaded <= allowed, loaded - allowed


@pytest.mark.slow
def test_import_takes_at_most_one_and_a_half_times_numpys():
    codes = {"bare": "pass", "numpy": "import numpy", "kinverse": "import kinverse"}

    def ratio():
        spent = {name: [] for name in codes}
        for _ in range(15):
            for name, code in codes.items():
                spent[name].append(fresh(code)[0])
        bare, numpy, own = (statistics.median(times) for times in spent.values())
        return (own - bare) / (numpy - bare)

    # a busy machine disturbs: the budget counts as kept if one of eight series keeps it
    ratios = []
    for _ in range(8):
        ratios.append(ratio())
        if ratios[-1] <= 1.5:
            return
    raise AssertionError(f"import kinverse takes {min(ratios):.2f} times numpy's own import")

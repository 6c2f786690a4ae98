"""The code that rows come from, so that rows of other code are not taken for them."""

import ast
import hashlib
import importlib
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path

import kinverse
from kinverse.errors import InputError

__all__ = ["library_hash", "source_hash"]

ASIDE = ("bench", "cli", "studies")
"""Parts of the library that no row comes from, but for what ``source_hash`` looks at itself."""


def source_hash(module: str) -> str:
    """A hash over a module, the modules of its package that it imports, and their data folders.

    The package is the first two parts of the name (``kinverse.studies``); all other code of
    kinverse counts as a whole.

    Args:
        module: dotted name of a module that can be imported.

    Raises:
        InputError: the module has no file.

    Example:
        >>> len(source_hash("kinverse.studies.cell"))
        64
    """
    package = ".".join(module.split(".")[:2])
    origin = getattr(importlib.import_module(module), "__file__", None)
    if origin is None:
        raise InputError(f"module {module} has no file: a cell's function is in a module that has")
    file = Path(origin)
    root = file.parents[module.count(".") + (file.name == "__init__.py")]
    found = {module: file}
    waiting = [file]
    while waiting:
        for name in _imports(waiting.pop()):
            path = _file(root, name) if name.startswith(package + ".") else None
            if path is not None and name not in found:
                found[name] = path
                waiting.append(path)
    files = set(found.values())
    for folder in {path.parent / "data" for path in files}:
        files.update(path for path in folder.glob("*") if path.is_file())
    core = importlib.import_module("kinverse._core").__file__  # editable installs have it elsewhere
    library = library_hash(Path(kinverse.__file__).parent, Path(str(core)))
    return _digest(files, version("kinverse") + library)


@cache
def library_hash(folder: Path, core: Path) -> str:
    """A hash over the library in a folder, sources and data, and its native core."""
    files = {
        path
        for path in folder.rglob("*")
        if path.is_file()
        and path.suffix in (".py", ".toml")
        and path.relative_to(folder).parts[0] not in ASIDE
    }
    return _digest(files | {core})


def _digest(files: set[Path], first: str = "") -> str:
    whole = hashlib.sha256(first.encode())
    # sorted by content: the same code in another folder is the same code
    for digest in sorted(hashlib.sha256(path.read_bytes()).digest() for path in files):
        whole.update(digest)
    return whole.hexdigest()


def _file(root: Path, name: str) -> Path | None:
    """Where a module's source is; None for what is no module. Nothing is imported for it."""
    path = root.joinpath(*name.split("."))
    files = (path.with_name(f"{path.name}.py"), path / "__init__.py")
    return next((each for each in files if each.is_file()), None)


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)

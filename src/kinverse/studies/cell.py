"""A piece of work whose rows are kept on disk: what a study is computed from."""

from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["Cell", "Row", "Value"]

Value = str | float | int | bool | None
Row = dict[str, Value]


@dataclass(frozen=True)
class Cell:
    """A function of a module called with plain arguments: it returns rows of plain values.

    Two cells of the same function and arguments are the same work: it runs in any process, in any
    order, and once.

    Args:
        name: unique in its study; a file is named after it (letters, digits, ``-``, ``_``, ``.``).
        function: defined at the top of a module; it returns a list of rows.
        arguments: keyword arguments, JSON values only (seeds among them).

    Example:
        >>> Cell("swarm-scara-pso-0", run_swarm, {"arm": "adept_one", "seed": 0})
    """

    name: str
    function: Callable[..., list[Row]]
    arguments: dict[str, Value] = field(default_factory=dict)

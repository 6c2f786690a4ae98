"""The path between two nodes of a tree of links or bodies."""

from collections.abc import Mapping

from kinverse.errors import ModelError
from kinverse.loading.text import choices

__all__ = ["path_between"]


def path_between(
    parents: Mapping[str, str | None],
    base: str | None,
    tip: str | None,
    where: str,
    what: str,
) -> list[str]:
    """The nodes below base, down to and including tip.

    Args:
        parents: each node's parent; None for a root.
        base: where to start; None: the only root.
        tip: where to end; None: the only leaf below base.
        where: the file, for messages.
        what: "link" or "body".

    Raises:
        ModelError: names that do not exist, several roots or leaves to choose from, a cycle, or
            a tip that is not below the base.
    """
    for role, name in (("base", base), ("tip", tip)):
        if name is not None and name not in parents:
            raise ModelError(
                f"{where}: {role} {name!r} is no {what}; {choices(name, parents, f'{what}s')}"
            )
    if base is None:
        roots = [node for node, parent in parents.items() if parent is None]
        if not roots:
            raise ModelError(f"{where}: every {what} has a parent: the joints go in a circle")
        if len(roots) > 1:
            raise ModelError(
                f"{where}: {len(roots)} {what}s have no parent: {', '.join(roots)};"
                f" choose one with base="
            )
        base = roots[0]
    if tip is None:
        tip = _only_leaf(parents, base, where, what)
    path = _climb(parents, tip, where, what)
    if base not in path:
        swapped = tip in _climb(parents, base, where, what)
        hint = f"; it is the other way round: base={tip!r}, tip={base!r}" if swapped else ""
        raise ModelError(f"{where}: {what} {tip!r} is not below {base!r}{hint}")
    return path[: path.index(base)][::-1]


def _climb(parents: Mapping[str, str | None], start: str, where: str, what: str) -> list[str]:
    path, node, seen = [start], parents[start], {start}
    while node is not None:
        if node in seen:
            raise ModelError(f"{where}: {what} {node!r} is its own ancestor: a circle of joints")
        seen.add(node)
        path.append(node)
        node = parents[node]
    return path


def _only_leaf(parents: Mapping[str, str | None], base: str, where: str, what: str) -> str:
    children: dict[str, list[str]] = {}
    for node, parent in parents.items():
        if parent is not None:
            children.setdefault(parent, []).append(node)
    leaves, front, seen = [], [base], {base}
    while front:
        node = front.pop()
        below = children.get(node, [])
        if not below:
            leaves.append(node)
        for child in below:
            if child in seen:
                raise ModelError(
                    f"{where}: {what} {child!r} is its own ancestor: a circle of joints"
                )
            seen.add(child)
            front.append(child)
    if len(leaves) != 1:
        raise ModelError(
            f"{where}: {len(leaves)} {what}s have no child: {', '.join(sorted(leaves))};"
            f" choose one with tip="
        )
    return leaves[0]

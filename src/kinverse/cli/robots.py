"""``kinverse robots``: what the catalogue holds."""

from kinverse.cli._args import Json

__all__ = ["robots"]


def robots(json: Json = False) -> None:
    """List the robots that come with kinverse."""
    import json as text
    import textwrap

    import kinverse as kv
    from kinverse.cli._show import console, show_table, table
    from kinverse.load import names
    from kinverse.robot_class import robot_class

    rows = []
    for name in names():
        robot = kv.load(name)
        rows.append(
            {
                "name": name,
                "dof": robot.dof,
                "joints": robot.kinds,
                "closed_form": robot_class(robot).family,
                "source": robot.source_note,
                "unverified": list(robot.unverified),
            }
        )
    if json:
        print(text.dumps(rows))
        return
    heads = ["name", "joints", "closed form", "source (see info NAME)"]
    shown = table(*heads)
    cells = [[str(row["name"]), str(row["joints"]), str(row["closed_form"] or "-")] for row in rows]
    columns = zip(heads[:3], *cells, strict=True)
    used = sum(max(map(len, column)) + 2 for column in columns)
    room = max(console().width - used - 3, 24)  # the rest of the line is the source's
    for row, cell in zip(rows, cells, strict=True):
        source = " ".join(str(row["source"]).split())
        shown.add_row(*cell, textwrap.shorten(source, room, placeholder=" ..."))
    show_table(shown)

"""``kinverse robots``: what the catalogue holds."""

from kinverse.cli._args import Json

__all__ = ["robots"]


def robots(json: Json = False) -> None:
    """List the robots that come with kinverse."""
    import json as text

    import kinverse as kv
    from kinverse.cli._show import console, table
    from kinverse.load import names

    rows = []
    for name in names():
        robot = kv.load(name)
        rows.append(
            {
                "name": name,
                "dof": robot.dof,
                "joints": robot.kinds,
                "source": robot.source_note,
                "unverified": list(robot.unverified),
            }
        )
    if json:
        print(text.dumps(rows))
        return
    shown = table("name", "joints", "source (kinverse info NAME has it whole)")
    for column in shown.columns[:2]:  # only the source is cut
        column.min_width = 16
    for row in rows:
        shown.add_row(str(row["name"]), str(row["joints"]), " ".join(str(row["source"]).split()))
    console().print(shown)

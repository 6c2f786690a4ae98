"""Rows as an HTML table."""

from html import escape

from kinverse.studies.cell import Row
from kinverse.studies.shown import columns, is_numeric, shown

__all__ = ["grid"]

WIDE = 11
"""Columns; more are printed smaller."""


def grid(rows: list[Row], caption: str, label: str) -> str:
    """A table in a box that scrolls.

    Args:
        rows: what of them is not known is a dash.
        caption: HTML.
        label: of the box, for readers who cannot see it.
    """
    heads = columns(rows)
    right = {head: ' class="n"' if is_numeric(rows, head) else "" for head in heads}
    top = "".join(f'<th scope="col"{right[head]}>{escape(head)}</th>' for head in heads)
    body = "".join(f"<tr>{_cells(row, heads, right)}</tr>\n" for row in rows)
    wide = ' class="wide"' if len(heads) > WIDE else ""
    return f"""<div class="scroll" tabindex="0" role="region" aria-label="{escape(label)}">
<table{wide}>
<caption>{caption}</caption>
<thead><tr>{top}</tr></thead>
<tbody>
{body}</tbody>
</table>
</div>"""


def _cells(row: Row, heads: list[str], right: dict[str, str]) -> str:
    texts = [(escape(shown(row.get(head))), right[head]) for head in heads]
    first = "".join(f'<th scope="row"{side}>{text}</th>' for text, side in texts[:1])
    return first + "".join(f"<td{side}>{text}</td>" for text, side in texts[1:])

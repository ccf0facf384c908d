"""A table of figures as HTML: words and numbers in, nothing of them taken for markup."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def figures_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """The first cell of each line names it."""
    top = "".join(f"<th scope=col>{escape(cell)}</th>" for cell in head)
    body = "".join(
        f"<tr><th scope=row>{escape(line[0])}</th>"
        + "".join(f"<td class=num>{escape(cell)}</td>" for cell in line[1:])
        + "</tr>"
        for line in lines
    )
    table = f"<thead><tr>{top}</tr></thead><tbody>{body}</tbody>"
    return f'<table class="bench-table" style="max-width: 760px">{table}</table>'

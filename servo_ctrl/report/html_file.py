"""A page as one file of HTML that opens without a network, for the reports of servo_ctrl and of reconcile.

Only this file uses the plotly package. plotly.js, style, script and the data of all figures are inlined once.
"""

import base64
import html
import json
from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import Any

from plotly.offline import get_plotlyjs

from kernels.arrays import Array
from servo_ctrl.files.html_template import Markup, filled

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content security policy: the page may load nothing, all it shows is in it."""


def html_file(room: str, title: str, body: str, figures: dict[str, Any]) -> str:
    """The whole page around `body`, which is HTML, with `page.css` and `page.js` of the package `room`.

    `figures` are data and layout for plotly.js by the names that the body refers to.
    """
    # a "<" in a name could end the script element or begin another
    data = json.dumps(figures, allow_nan=False).replace("<", "\\u003c")
    style, script = (
        files(room).joinpath(f"page.{kind}").read_text(encoding="utf-8") for kind in ("css", "js")
    )
    parts = {"body": body, "style": style, "script": script, "data": data, "policy": POLICY}
    html_parts = {name: Markup(part) for name, part in parts.items()}  # made here, of escaped text
    return filled(
        "servo_ctrl.report",
        "page.html.j2",
        title=title,
        plotly=Markup(get_plotlyjs()),  # of the package
        **html_parts,
    )


def escape(value: object) -> str:
    """The text of a value with the characters escaped that HTML reads."""
    return html.escape(str(value))


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int] = ()) -> str:
    """A table; the cells of `rows` are HTML, the `numeric` columns are aligned to the right."""
    right = set(numeric)

    def cells(tag: str, row: Sequence[str]) -> str:
        marks = [' class="number"' if column in right else "" for column in range(len(row))]
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    top = f"<tr>{cells('th', list(map(escape, head)))}</tr>" if any(head) else ""
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table>{top}{body}</table></div>'


def packed(values: Array) -> dict[str, str]:
    """An array (n,) as plotly.js reads it: four bytes a value in base64 instead of the digits of a number."""
    return {"dtype": "f4", "bdata": base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")}

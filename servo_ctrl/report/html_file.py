"""Makes a page as one HTML file that opens without a network, for reports of servo_ctrl and reconcile.

Only this file uses the plotly package. It inlines plotly.js, style, script and the data of all figures once.
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
"""Content security policy: the page contains everything and must load nothing."""


def html_file(room: str, title: str, body: str, figures: dict[str, Any]) -> str:
    """Return the page around `body`, which is HTML, with `page.css` and `page.js` of the package `room`.

    `figures`: data and layout for plotly.js, by the names in the body.
    """
    # a "<" in a name could end the script element or start another
    data = json.dumps(figures, allow_nan=False).replace("<", "\\u003c")
    style, script = (
        files(room).joinpath(f"page.{kind}").read_text(encoding="utf-8") for kind in ("css", "js")
    )
    parts = {"body": body, "style": style, "script": script, "data": data, "policy": POLICY}
    html_parts = {name: Markup(part) for name, part in parts.items()}  # made of escaped text
    return filled(
        "servo_ctrl.report",
        "page.html.j2",
        title=title,
        plotly=Markup(get_plotlyjs()),  # of the package
        **html_parts,
    )


def escape(value: object) -> str:
    """Return the text of a value, escaped for HTML."""
    return html.escape(str(value))


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int] = ()) -> str:
    """Return a table; the cells of `rows` are HTML, the `numeric` columns are aligned right."""
    right = set(numeric)

    def cells(tag: str, row: Sequence[str]) -> str:
        marks = [' class="number"' if column in right else "" for column in range(len(row))]
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    top = f"<tr>{cells('th', list(map(escape, head)))}</tr>" if any(head) else ""
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table>{top}{body}</table></div>'


def packed(values: Array) -> dict[str, str]:
    """Encode an array (n,) for plotly.js as float32 in base64, which is shorter than digits."""
    return {"dtype": "f4", "bdata": base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")}

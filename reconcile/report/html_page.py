"""HTML files that open without a network: figures, tables and the page around them.

Only this file uses the plotly package. plotly.js, style, script and the data of all figures are inlined once.
Every function escapes the text that it is given, or says that it takes HTML.
"""

import html
import json
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from plotly.offline import get_plotlyjs

from reconcile.report.traces import Figure
from servo_ctrl.files.whole_file import write_text_whole

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""The page may load nothing: what it shows is in it."""


class HtmlPage:
    """A page under construction; `card` registers the figures that its body refers to."""

    def __init__(self) -> None:
        self._figures: dict[str, dict[str, Any]] = {}

    def card(self, name: str, figure: Figure, *, wide: bool = False, attributes: str = "") -> str:
        """Return the HTML of a figure with heading and note; `name` is unique in the page."""
        self._figures[name] = {"data": figure.data, "layout": figure.layout}
        return (
            f'<figure class="card{" wide" if wide else ""}"{attributes}>'
            f"<h3>{escape(figure.heading)}</h3>"
            f'<div class="plot" id="{escape(name)}" data-figure="{escape(name)}"></div>'
            f'<figcaption class="note">{escape(figure.note)}</figcaption></figure>'
        )

    def html(self, title: str, body: str) -> str:
        """Return the whole page around `body`, which is HTML."""
        # a "<" in a name could end the script element or begin another
        data = json.dumps(self._figures, allow_nan=False).replace("<", "\\u003c")
        here = files("reconcile.report")
        style, script = (here.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
        return (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>reconcile: {escape(title)}</title><style>{style}</style></head>"
            f"<body><main>{body}</main>"
            f'<script type="application/json" id="figures">{data}</script>'
            f"<script>{get_plotlyjs()}</script><script>{script}</script></body></html>\n"
        )

    def write(self, path: Path, title: str, body: str) -> None:
        """Write the page. Raises OSError; leaves nothing half written."""
        content = self.html(title, body)
        write_text_whole(path, content)


def escape(value: object) -> str:
    """Return the text of a value with the characters escaped that HTML reads."""
    return html.escape(str(value))


def answer(word: str, sentence: str, *details: str) -> str:
    """Return the card on top of a page: a word, a sentence, then `details`, which are HTML."""
    return (
        f'<section class="card answer"><span class="word">{escape(word)}</span>'
        f"<h1>{escape(sentence)}</h1>{''.join(details)}</section>"
    )


def section(heading: str, *content: str) -> str:
    """Return a heading and a card with `content`, which is HTML."""
    return f'<h2>{escape(heading)}</h2><section class="card">{"".join(content)}</section>'


def grid(cards: Iterable[str]) -> str:
    """Return cards, which are HTML, side by side where the window is wide enough."""
    return f'<div class="plots">{"".join(cards)}</div>'


def note(text: str) -> str:
    """Return a paragraph in small grey letters."""
    return f'<p class="note">{escape(text)}</p>'


def bullets(texts: Iterable[str]) -> str:
    """Return an unnumbered list."""
    return f"<ul>{''.join(f'<li>{escape(one)}</li>' for one in texts)}</ul>"


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numeric: Iterable[int] = ()) -> str:
    """Return a table; the cells of `rows` are HTML, the `numeric` columns are aligned to the right."""
    right = set(numeric)

    def cells(tag: str, row: Sequence[str]) -> str:
        marks = [' class="number"' if column in right else "" for column in range(len(row))]
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{cells("th", list(map(escape, head)))}</tr>{body}</table></div>'


def bar(share: float) -> str:
    """Return a horizontal bar filled to a share of one."""
    return f'<span class="bar"><i style="width:{100.0 * min(max(share, 0.0), 1.0):.0f}%"></i></span>'

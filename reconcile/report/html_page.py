"""The pages of reconcile: cards with figures, and the HTML around them; `html_file` makes the file.

Every function escapes its text, unless its docstring says that it takes HTML.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from reconcile.report.traces import Figure
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.report.html_file import escape, html_file


class HtmlPage:
    """A page under construction; `card` registers the figures that its body refers to."""

    def __init__(self) -> None:
        self._figures: dict[str, dict[str, Any]] = {}

    def card(self, name: str, figure: Figure, *, wide: bool = False, attributes: str = "") -> str:
        """Return the HTML of a figure with heading and note; `name` is unique in the page."""
        return (
            f'<figure class="card{" wide" if wide else ""}"{attributes}>'
            f"<h3>{escape(figure.heading)}</h3>{self.plot(name, figure)}</figure>"
        )

    def plot(self, name: str, figure: Figure) -> str:
        """Return the contents of a `<figure>`, drawing and note, for a card with further contents."""
        self._figures[name] = {"data": figure.data, "layout": figure.layout}
        return (
            f'<div class="plot" id="{escape(name)}" data-figure="{escape(name)}"></div>'
            f'<figcaption class="note">{escape(figure.note)}</figcaption>'
        )

    def html(self, title: str, body: str) -> str:
        """Return the whole page around `body`, which is HTML."""
        return html_file("reconcile.report", f"reconcile: {title}", body, self._figures)

    def write(self, path: Path, title: str, body: str) -> None:
        """Write the page atomically. Raises OSError."""
        write_text_whole(path, self.html(title, body))


def answer(word: str, sentence: str, *details: str) -> str:
    """Return the card at the top of a page: a word, a sentence, then `details`, which are HTML."""
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


def bar(share: float) -> str:
    """Return a horizontal bar filled to a share of one."""
    return f'<span class="bar"><i style="width:{100.0 * min(max(share, 0.0), 1.0):.0f}%"></i></span>'

"""`report.html`: the verdict with its pictures, in one file that opens without a network.

plotly.js is inlined once; the pictures are plain data (`report_figures`). This file is all that knows plotly.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from plotly.offline import get_plotlyjs

from reconcile import report_sections as sections
from reconcile.report_figures import figures
from reconcile.report_replay import replay_figures
from reconcile.report_sections import text
from reconcile.report_words import SENSES
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reconcile.replay_models import Replayed
    from reconcile.report_figures import Figure
    from reconcile.views import View

MOST_BYTES = 2_000_000
"""Of all the series over time together; plotly.js has 4.8 MB, and the page is to stay below 8 MB."""
BYTES_A_BUCKET = 92
"""Three series and half of one, two points of two numbers, four bytes each, as base64."""
BUCKETS = (150, 1200)
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""The page may load nothing: what it shows is in it."""


def write_report(
    verdict: Mapping[str, Any], views: Sequence[View], path: Path, replayed: Sequence[Replayed] = ()
) -> None:
    """Write the page. Raises OSError; leaves nothing half written."""
    content = page(verdict, views, replayed)
    write_whole(path, lambda temporary: temporary.write_text(content, encoding="utf-8"))


def page(verdict: Mapping[str, Any], views: Sequence[View], replayed: Sequence[Replayed] = ()) -> str:
    """The whole page."""
    series = max(sum(len(view.rests) for view in views), 1)
    buckets = min(max(MOST_BYTES // (BYTES_A_BUCKET * series), BUCKETS[0]), BUCKETS[1])
    drawn: dict[str, Any] = {}
    pictures = [_pictures(view, figures(view, buckets), drawn) for view in views]
    loops = "".join(
        card(f"{axis}-replay", figure, drawn, classes="card wide")
        for axis, figure in replay_figures(replayed, buckets).items()
    )
    sources = list(dict.fromkeys(rest.source for view in views for rest in view.rests))
    body = (
        f"{sections.answer(verdict, sources)}{sections.findings(verdict)}{sections.places(verdict)}"
        f"{sections.fit(verdict)}{sections.replays(verdict, loops)}{''.join(pictures)}"
        f"{sections.remarks(verdict)}"
    )
    return document(verdict["verdict"], body, drawn)


def document(title: str, body: str, drawn: Mapping[str, Any]) -> str:
    """A page that opens without a network; `drawn` has data and layout of each plot of `body`, by name."""
    # a "<" in a name could end the script element or begin another
    data = json.dumps(drawn, allow_nan=False).replace("<", "\\u003c")
    asset = files("reconcile")
    style = asset.joinpath("report_page.css").read_text(encoding="utf-8")
    script = asset.joinpath("report_page.js").read_text(encoding="utf-8")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>reconcile: {text(title)}</title><style>{style}</style></head><body><main>{body}</main>"
        f'<script type="application/json" id="figures">{data}</script>'
        f"<script>{get_plotlyjs()}</script><script>{script}</script></body></html>\n"
    )


def _pictures(view: View, given: Sequence[Figure], drawn: dict[str, Any]) -> str:
    """The cards of one difference; of those over time one recording is shown, the others are a choice."""
    place = f"{view.axis}-{view.sense.value}"
    cards = []
    times = [figure for figure in given if figure.name.startswith("time-")]
    if len(times) > 1:
        options = "".join(
            f'<option value="{number}">{text(rest.source)}</option>' for number, rest in enumerate(view.rests)
        )
        cards.append(f'<p class="wide">Recording: <select data-group="{text(place)}">{options}</select></p>')
    for number, figure in enumerate(given):
        in_time = number < len(times)
        member = f' data-member="{text(place)}" data-number="{number}"' if in_time else ""
        hidden = " hidden" if in_time and number > 0 else ""
        classes = "card wide" if in_time else "card"
        cards.append(
            card(f"{place}-{figure.name}", figure, drawn, classes=classes, marks=f"{member}{hidden}")
        )
    heading = f"Axis {text(view.axis)}: {text(SENSES[view.sense.value])}"
    return f'<h2>{heading}</h2><div class="plots">{"".join(cards)}</div>'


def card(name: str, figure: Figure, drawn: dict[str, Any], *, classes: str, marks: str = "") -> str:
    """A picture with its words, entered in `drawn`."""
    drawn[name] = {"data": figure.data, "layout": figure.layout}
    return (
        f'<figure class="{classes}"{marks}>'
        f"<h3>{text(figure.heading)}</h3>"
        f'<div class="plot" id="{text(name)}" data-figure="{text(name)}"></div>'
        f'<figcaption class="note">{text(figure.note)}</figcaption></figure>'
    )

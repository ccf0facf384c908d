"""`report.html`: verdict and figures of a diagnosis in one file that opens without a network."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reconcile.location.residual_analysis import ResidualAnalysis
from reconcile.replay.model_replays import ReplayComparison
from reconcile.report import sections
from reconcile.report.figures import figures
from reconcile.report.html_page import HtmlPage, grid
from reconcile.report.replay_figures import replay_figures
from reconcile.report.unnamed_curve import unnamed_curve
from reconcile.report.unnamed_map import unnamed_map
from reconcile.report.words import CHANNEL_NAMES
from servo_ctrl.report.html_file import escape

MAX_SERIES_BYTES = 2_000_000
"""Bounds all time series of a page together: plotly.js has 4.8 MB, and the page is to stay below 8 MB."""
BYTES_PER_BUCKET = 92
"""Three and a half series, two points of two numbers each, four bytes a number as base64."""
FEWEST_BUCKETS, MOST_BUCKETS = 150, 1200
"""Buckets of a time series: 150 still show every oscillation, 1200 fill a wide screen."""


def write_report(
    verdict: Mapping[str, Any],
    analyses: Sequence[ResidualAnalysis],
    path: Path,
    replays: Sequence[ReplayComparison] = (),
) -> None:
    """Write the page of a verdict atomically. Raises OSError."""
    page = HtmlPage()
    series = max(sum(len(analysis.residuals) for analysis in analyses), 1)
    buckets = min(max(MAX_SERIES_BYTES // (BYTES_PER_BUCKET * series), FEWEST_BUCKETS), MOST_BUCKETS)
    residual_figures = [_residual_figures(analysis, buckets, page) for analysis in analyses]
    rotary = {analysis.axis for analysis in analyses if analysis.nominal.rotary}
    replay_cards = [
        page.card(f"{axis}-replay", figure, wide=True)
        for axis, figure in replay_figures(replays, buckets, rotary).items()
    ]
    sources = list(dict.fromkeys(residual.source for analysis in analyses for residual in analysis.residuals))
    body = (
        sections.verdict_card(verdict, sources),
        sections.findings(verdict, _curves(verdict, page)),
        sections.proof(verdict),
        sections.accounted(verdict),
        sections.locations(verdict),
        sections.fit(verdict),
        sections.replays(verdict, replay_cards),
        *residual_figures,
        sections.remarks(verdict),
    )
    page.write(path, verdict["verdict"], "".join(body))


def _curves(verdict: Mapping[str, Any], page: HtmlPage) -> dict[int, str]:
    """Return the pictures of unnamed terms, by their index among the findings."""
    curves = enumerate(unnamed_curve(one) or unnamed_map(one) for one in verdict["findings"])
    return {
        index: f'<figure style="margin:0">{page.plot(f"curve-{index}", curve)}</figure>'
        for index, curve in curves
        if curve is not None
    }


def _residual_figures(analysis: ResidualAnalysis, buckets: int, page: HtmlPage) -> str:
    """Return the figures of one residual; a list selects which of several recordings is shown over time."""
    name = f"{analysis.axis}-{analysis.channel.value}"
    drawn = figures(analysis, buckets)
    over_time = [figure for figure in drawn if figure.name.startswith("time-")]
    cards = []
    if len(over_time) > 1:
        options = "".join(
            f'<option value="{number}">{escape(residual.source)}</option>'
            for number, residual in enumerate(analysis.residuals)
        )
        cards.append(f'<p class="wide">Recording: <select data-group="{escape(name)}">{options}</select></p>')
    for number, figure in enumerate(over_time):
        hidden = " hidden" if number else ""
        attributes = f' data-member="{escape(name)}" data-number="{number}"{hidden}'
        cards.append(page.card(f"{name}-{figure.name}", figure, wide=True, attributes=attributes))
    cards += [page.card(f"{name}-{figure.name}", figure) for figure in drawn[len(over_time) :]]
    heading = f"Axis {escape(analysis.axis)}: {escape(CHANNEL_NAMES[analysis.channel.value])}"
    return f"<h2>{heading}</h2>{grid(cards)}"

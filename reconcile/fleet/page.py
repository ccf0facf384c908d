"""`fleet.html`: which models lack which physics, how large it is, and which axes were not diagnosed."""

from collections.abc import Sequence
from pathlib import Path

from kernels.readable_units import display_unit
from reconcile.fleet.figures import effect_map, size_spreads
from reconcile.fleet.rows import Row
from reconcile.fleet.store import axis_folder
from reconcile.fleet.summary import DIAGNOSED, FleetSummary, ParameterSpread, SharedEffect, summarise
from reconcile.formats.table import short_list
from reconcile.report.html_page import HtmlPage, answer, bar, grid, note, section
from reconcile.report.words import display_name, join_words, parameter_names, percent, quantity
from servo_ctrl.files.diagnosis_files import REPORT_FILE, VERDICT_FILE
from servo_ctrl.report.html_file import escape, table

MAX_ROWS, MAX_GROUPS = 500, 60
"""Rows of a table; results.parquet has all."""
MAX_NAMES, MAX_PARAMETERS = 24, 6
"""Names in one cell, and parameters of one effect."""
MEANINGS = {
    "effects": "physics is missing",
    "parameters": "only values are off",
    "consistent": "the model holds",
    "unknown": "something that nothing of the catalogue explains",
    "unusable": "the recordings cannot be used",
    "unreadable": "the files could not be read",
    "no model": "there is no model",
    "killed": "its workers died",
    "over time": "took too long",
    "failed": "the diagnosis failed",
}


def write_page(rows: Sequence[Row], ignored: Sequence[str], path: Path) -> None:
    """Write the page with links to the reports beside it, atomically. Raises OSError."""
    found = summarise(rows)
    page = HtmlPage()
    figures = (effect_map(found), size_spreads(found))
    cards = [page.card(figure.name, figure, wide=True) for figure in figures if figure is not None]
    body = (
        _answer(found),
        grid(cards),
        _shared_effects(found),
        _groups(found),
        _failures(found, ignored),
        _axes(found, path.parent),
    )
    page.write(path, "fleet", "".join(body))


def _answer(found: FleetSummary) -> str:
    lacking = [group for group in found.groups if group.effects]
    machines = sum(len(group.machines) for group in lacking)
    if found.shared:
        first = found.shared[0]
        sentence = (
            f"{machines} of {len(found.machines)} machines have physics that their models leave out; most "
            f"often {display_name(first.effect)}, on {_count(len(first.machines), 'machine')}."
        )
    else:
        sentence = f"No missing physics was found on {_count(len(found.machines), 'machine')}."
    verdicts = [
        [escape(word), escape(MEANINGS.get(word, "")), str(count), bar(count / max(len(found.rows), 1))]
        for word, count in found.counts.items()
    ]
    counted = table(["verdict", "meaning", "axes", ""], verdicts, numeric=[2])
    return answer(_count(len(found.rows), "axis", "axes"), sentence, counted)


def _shared_effects(found: FleetSummary) -> str:
    """Return a card for each effect: which machines have it, and how its parameters are distributed."""
    return f"<h2>Who shares what</h2>{grid(map(_shared_effect, found.shared))}" if found.shared else ""


def _shared_effect(one: SharedEffect) -> str:
    names = parameter_names({spread.name: {"unit": spread.unit} for spread in one.spreads})
    rows = [_spread(names[spread.name], spread) for spread in one.spreads[:MAX_PARAMETERS]]
    head = ["parameter", "median", "10 to 90 % of the axes", "largest"]
    counted = f"{_count(len(one.machines), 'machine')}, {_count(len(one.axes), 'axis', 'axes')}"
    machines = escape(short_list(one.machines, MAX_NAMES))
    gain = f"worth {percent(one.median_gain)} of the squares that were held out, in the median"
    return (
        f'<article class="card"><h3>{escape(display_name(one.effect))}</h3>'
        f'<p class="faint">{escape(counted)}; {escape(gain)}</p>'
        f"{table(head, rows) if rows else ''}"
        f"<details><summary>Machines</summary><p>{machines}</p></details></article>"
    )


def _spread(name: str, spread: ParameterSpread) -> list[str]:
    factor, unit = display_unit(spread.unit, spread.median)
    at = "/".join(spread.largest_at)
    return [
        escape(name),
        escape(quantity(spread.median, spread.unit)),
        escape(f"{spread.low / factor:.3g} to {spread.high / factor:.3g} {unit}".rstrip()),
        escape(f"{quantity(spread.largest, spread.unit)} at {at}"),
    ]


def _groups(found: FleetSummary) -> str:
    rows = [
        [
            str(len(group.machines)),
            escape(join_words(map(display_name, group.effects)) or "nothing"),
            escape(short_list(group.machines, MAX_NAMES)),
        ]
        for group in found.groups[:MAX_GROUPS]
    ]
    if not rows:
        return ""
    listed = table(["machines", "their models leave out", "which"], rows, numeric=[0])
    return section("Machines alike", listed, _more(len(found.groups), MAX_GROUPS))


def _failures(found: FleetSummary, ignored: Sequence[str]) -> str:
    rows = [
        [escape(f"{row['machine']}/{row['axis']}"), escape(row["status"]), escape(row["error"] or "")]
        for row in found.failed
    ]
    rows += [
        [
            escape(f"{row['machine']}/{row['axis']}"),
            "without one file",
            escape(f"{one['file']}: {one['reason']}"),
        ]
        for row in found.with_bad_files
        for one in row["bad_files"]
    ]
    if not rows and not ignored:
        return ""
    listed = table(["axis", "what", "why"], rows[:MAX_ROWS]) if rows else ""
    left = f"({len(ignored)}): {short_list(ignored, MAX_NAMES)}"
    aside = f"Left aside, as of no axis or no Parquet {left}." if ignored else ""
    return section("What was not diagnosed", listed, _more(len(rows), MAX_ROWS), note(aside))


def _axes(found: FleetSummary, out: Path) -> str:
    rows = [_axis(row, out) for row in found.rows[:MAX_ROWS] if row["status"] == DIAGNOSED]
    if not rows:
        return ""
    head = ["axis", "verdict", "what", "force error, held out: nominal", "with effects"]
    return section("Axes", table(head, rows, numeric=[3, 4]), _more(len(found.rows), MAX_ROWS))


def _axis(row: Row, out: Path) -> list[str]:
    folder = axis_folder(row["machine"], row["axis"])
    name = escape(f"{row['machine']}/{row['axis']}")
    for file in (REPORT_FILE, VERDICT_FILE):
        if (out / folder / file).is_file():
            # the percent signs are part of the folder's name, not an escape of the URL
            name = f'<a href="{escape(folder.replace("%", "%25"))}/{file}">{name}</a>'
            break
    effects = join_words(
        f"{display_name(one['effect'])} ({percent(one['confidence'] or 0.0)})" for one in row["effects"]
    )
    levels = [row["force_before_n"], row["force_after_n"]]
    return [
        name,
        escape(row["verdict"]),
        escape(effects),
        *("" if level is None else escape(quantity(level, "N")) for level in levels),
    ]


def _more(count: int, shown: int) -> str:
    return note(f"{count - shown} more are in results.parquet.") if count > shown else ""


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"

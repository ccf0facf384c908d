"""`fleet.html`: which machines share which missing physics; one file that opens without a network."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reconcile.fleet_figures import heat, spreads
from reconcile.fleet_store import folder
from reconcile.fleet_summary import DIAGNOSED, summarise
from reconcile.report import card, document
from reconcile.report_sections import bar, tabulated, text
from reconcile.report_words import listed, parameter_names, percent, quantity, reading, title
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from reconcile.fleet_rows import Row
    from reconcile.fleet_summary import FleetSummary, Shared, Spread

MOST_ROWS = 500
"""Of a table; results.parquet has all."""
MOST_NAMES = 24
MOST_GROUPS = 60
WORDS = {
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
    """Write the page. Raises OSError; leaves nothing half written."""
    content = page(rows, ignored, path.parent)
    write_whole(path, lambda temporary: temporary.write_text(content, encoding="utf-8"))


def page(rows: Sequence[Row], ignored: Sequence[str], out: Path) -> str:
    """The whole page; reports are linked where they are in `out`."""
    found = summarise(rows)
    drawn: dict[str, Any] = {}
    pictures = [
        card(figure.name, figure, drawn, classes="card wide")
        for figure in (heat(found), spreads(found))
        if figure is not None
    ]
    body = (
        f'{_answer(found)}<div class="plots">{"".join(pictures)}</div>{_shared(found)}{_groups(found)}'
        f"{_failures(found, ignored)}{_axes(found, out)}"
    )
    return document("fleet", body, drawn)


def _answer(found: FleetSummary) -> str:
    lacking = [group for group in found.groups if group.effects]
    machines = sum(len(group.machines) for group in lacking)
    if found.shared:
        first = found.shared[0]
        sentence = (
            f"{machines} of {len(found.machines)} machines have physics that their models leave out; most "
            f"often {title(first.effect)}, on {_count(len(first.machines), 'machine')}."
        )
    else:
        sentence = f"No missing physics was found on {_count(len(found.machines), 'machine')}."
    told = [
        [text(word), text(WORDS.get(word, "")), str(count), bar(count / max(len(found.rows), 1))]
        for word, count in found.counts.items()
    ]
    table = tabulated(["verdict", "meaning", "axes", ""], told, numbers=[2])
    return (
        f'<section class="card answer"><span class="word">{_count(len(found.rows), "axis", "axes")}</span>'
        f"<h1>{text(sentence)}</h1>{table}</section>"
    )


def _shared(found: FleetSummary) -> str:
    """A card for each effect: who has it, and how far its parameters lie apart."""
    cards = "".join(_effect(one) for one in found.shared)
    return f'<h2>Who shares what</h2><div class="plots">{cards}</div>' if cards else ""


def _effect(one: Shared) -> str:
    names = parameter_names({spread.name: {"unit": spread.unit} for spread in one.spreads})
    rows = [_spread(names[spread.name], spread) for spread in one.spreads[:6]]
    head = ["parameter", "median", "10 to 90 % of the axes", "largest"]
    counted = f"{_count(len(one.machines), 'machine')}, {_count(len(one.axes), 'axis', 'axes')}"
    note = f"worth {percent(one.worth)} of the squares that were held out, in the median"
    return (
        f'<article class="card"><h3>{text(title(one.effect))}</h3>'
        f'<p class="faint">{text(counted)}; {text(note)}</p>'
        f"{tabulated(head, rows) if rows else ''}"
        f"<details><summary>Machines</summary><p>{text(_names(one.machines))}</p></details></article>"
    )


def _spread(name: str, spread: Spread) -> list[str]:
    factor, unit = reading(spread.unit, spread.median)
    at = "/".join(spread.largest_at)
    return [
        text(name),
        text(quantity(spread.median, spread.unit)),
        text(f"{spread.low / factor:.3g} to {spread.high / factor:.3g} {unit}".rstrip()),
        text(f"{quantity(spread.largest, spread.unit)} at {at}"),
    ]


def _groups(found: FleetSummary) -> str:
    rows = [
        [
            str(len(group.machines)),
            text(listed(title(effect) for effect in group.effects) or "nothing"),
            text(_names(group.machines)),
        ]
        for group in found.groups[:MOST_GROUPS]
    ]
    more = _more(len(found.groups), MOST_GROUPS)
    table = tabulated(["machines", "their models leave out", "which"], rows, numbers=[0])
    return f'<h2>Machines alike</h2><section class="card">{table}{more}</section>' if rows else ""


def _failures(found: FleetSummary, ignored: Sequence[str]) -> str:
    rows = [
        [text(f"{row['machine']}/{row['axis']}"), text(row["status"]), text(row["error"] or "")]
        for row in found.failed
    ]
    rows += [
        [text(f"{row['machine']}/{row['axis']}"), "without one file", text(f"{one['file']}: {one['reason']}")]
        for row in found.with_bad_files
        for one in row["bad_files"]
    ]
    if not rows and not ignored:
        return ""
    table = tabulated(["axis", "what", "why"], rows[:MOST_ROWS]) if rows else ""
    aside = ""
    if ignored:
        aside = f"Left aside, as of no axis or no Parquet ({len(ignored)}): {_names(ignored)}."
    return (
        f'<h2>What was not diagnosed</h2><section class="card">{table}{_more(len(rows), MOST_ROWS)}'
        f'<p class="note">{text(aside)}</p></section>'
    )


def _axes(found: FleetSummary, out: Path) -> str:
    rows = [_axis(row, out) for row in found.rows[:MOST_ROWS] if row["status"] == DIAGNOSED]
    head = ["axis", "verdict", "what", "force error, held out: nominal", "with effects"]
    table = tabulated(head, rows, numbers=[3, 4])
    more = _more(len(found.rows), MOST_ROWS)
    return f'<h2>Axes</h2><section class="card">{table}{more}</section>' if rows else ""


def _axis(row: Row, out: Path) -> list[str]:
    place = folder(row["machine"], row["axis"])
    name = text(f"{row['machine']}/{row['axis']}")
    for kept in ("report.html", "verdict.json"):
        if (out / place / kept).is_file():
            # the folder's own % signs are part of its name
            name = f'<a href="{text(place.replace("%", "%25"))}/{kept}">{name}</a>'
            break
    effects = listed(
        f"{title(one['effect'])} ({percent(one['confidence'] or 0.0)})" for one in row["effects"]
    )
    levels = [row["force_before_n"], row["force_after_n"]]
    return [
        name,
        text(row["verdict"]),
        text(effects),
        *("" if level is None else text(quantity(level, "N")) for level in levels),
    ]


def _names(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _more(count: int, most: int) -> str:
    return f'<p class="note">{count - most} more are in results.parquet.</p>' if count > most else ""


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"

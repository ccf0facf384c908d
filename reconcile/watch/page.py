"""`watch.html`: whether and when the machine changed, its state before and after, and every indicator."""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from kernels.readable_units import display_unit
from reconcile.report.html_page import HtmlPage, answer, bullets, grid, note, section
from reconcile.report.words import CHANNEL_NAMES, display_name, percent, quantity
from reconcile.watch.change_detection import MIN_RECORDINGS
from reconcile.watch.figures import change_profile, indicator_figures
from reconcile.watch.history import WatchHistory
from servo_ctrl.report.html_file import escape, table

NO_NEW_EFFECT = {
    "parameters": "only values have moved, no physics is new",
    "consistent": "the model still fits",
}
"""Text by verdict of the second diagnosis, where it names no new effect."""


def write_page(history: WatchHistory, path: Path) -> None:
    """Write the page atomically. Raises OSError."""
    page = HtmlPage()
    parts = [_summary_card(history)]
    parts += [_change_section(change, page) for change in reversed(history.document["changes"])]
    for axis in history.axes():
        cards = (page.card(f"{axis}-{figure.name}", figure) for figure in indicator_figures(history, axis))
        parts.append(f"<h2>Axis {escape(axis)}: all indicators</h2>{grid(cards)}")
    unusable = history.document["unusable"]
    if unusable:
        parts.append(section("Not used", bullets(entry["why"] for entry in unusable)))
    changed = bool(history.document["changes"])
    page.write(path, f"watch, {'changed' if changed else 'no change'}", "".join(parts))


def _summary_card(history: WatchHistory) -> str:
    recordings, changes = history.document["recordings"], history.document["changes"]
    count = len(recordings) + len(history.document["forgotten"])
    if changes:
        last = changes[-1]
        sentence, advice = f"The machine has changed: {last['sentence']}.", _diagnosis_text(last)
    elif count < MIN_RECORDINGS:
        sentence = "Too few recordings to say anything yet."
        advice = "From the eighth recording of an axis on, each one is compared with those before it."
    else:
        sentence, advice = "Nothing has changed.", "Each recording agrees with those before it."
    run_length = history.document["recordings_between_false_alarms"]
    period = f", {_start_time(recordings[0])} to {_start_time(recordings[-1])}" if recordings else ""
    false_alarms = note(f"At most one false alarm in {run_length:g} recordings.")
    return answer(f"{count} recordings{period}", sentence, f"<p>{escape(advice)}</p>", false_alarms)


def _start_time(recording: Mapping[str, Any]) -> str:
    return datetime.fromtimestamp(recording["started_s"], UTC).strftime("%Y-%m-%d %H:%M")


def _diagnosis_text(change: Mapping[str, Any]) -> str:
    """Return the result of the diagnosis of the change in a sentence."""
    named = change["named"]
    if named is None:
        return "Two diagnoses would name the physics; --no-diagnose has turned them off."
    if named["verdict"] == "none":
        return f"What it is could not be determined: {named['why']}."
    if named["findings"]:
        physics = "; ".join(
            f"{display_name(finding['effect'])}: {finding['explanation']}" for finding in named["findings"]
        )
    else:
        physics = NO_NEW_EFFECT.get(named["verdict"], "no physics that was not there before")
    return f"Against a model of the recordings before: {physics}."


def _change_section(change: Mapping[str, Any], page: HtmlPage) -> str:
    head = ["what", "in", "before", "after (95 %)", "standard errors"]
    moved = table(head, [_moved_cells(one) for one in change["moved"]])
    began, later = change["began"], change["alarm"]["recordings_later"]
    onset = (
        f"Alarm at {change['alarm']['recording']}, by {later} recording{'s' * (later != 1)} that differ. "
        f"Began after {began['after']}, 95 % within {began['interval95'][0]} to {began['interval95'][1]}. "
        f"Growing rather than a step: {percent(change['ramp_probability'])}. "
        f"The temperature {change['temperature']}."
    )
    where = f"<h3>Where</h3>{bullets(map(_location, change['where']))}" if change["where"] else ""
    described = section(
        f"Change {change['id']}",
        f"<h3>{escape(change['sentence'])}</h3><p>{escape(onset)}</p><p>{escape(_diagnosis_text(change))}</p>",
        moved,
        where,
    )
    cards = (
        page.card(f"{change['id']}-{number}", change_profile(profile))
        for number, profile in enumerate(change["profiles"])
    )
    return described + grid(cards)


def _moved_cells(moved: Mapping[str, Any]) -> list[str]:
    """Return the cells of an indicator that changed."""
    low, high = (quantity(bound, moved["unit"]) for bound in moved["after_ci95"])
    return [
        escape(moved["words"]),
        escape(CHANNEL_NAMES[moved["sense"]]),
        escape(quantity(moved["before"], moved["unit"])),
        escape(f"{quantity(moved['after'], moved['unit'])} ({low} to {high})"),
        f"{abs(moved['t']):.1f}",
    ]


def _location(located: Mapping[str, Any]) -> str:
    coordinate = {"constant": "everywhere", "direction": "with the direction of motion"}.get(
        located["coordinate"], f"over the {display_name(located['coordinate'])}"
    )
    low, high = located["range"]
    where = f": {located['label']}" if located["label"] else ""
    if not where and high > low:
        factor, unit = display_unit(located["unit"], max(abs(low), abs(high)))
        where = f": {low / factor:.3g} to {high / factor:.3g} {unit}"
    peak = quantity(located["peak"], "N" if located["sensor"] == "force" else "m")
    channel, share = CHANNEL_NAMES[located["sensor"]], percent(located["share"])
    return f"{channel}, {coordinate}{where}, up to {peak}; {share} of the change"

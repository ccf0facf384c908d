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
from reconcile.watch.memory import Memory
from servo_ctrl.report.html_file import escape, table

NO_NEW_EFFECT = {
    "parameters": "only values have moved, no physics is new",
    "consistent": "the model still fits",
}
"""Text by verdict of the second diagnosis, where it names no new effect."""


def write_page(memory: Memory, path: Path) -> None:
    """Write the page atomically. Raises OSError."""
    page = HtmlPage()
    parts = [_answer(memory)]
    parts += [_change(change, page) for change in reversed(memory.document["changes"])]
    for axis in memory.axes():
        cards = (page.card(f"{axis}-{figure.name}", figure) for figure in indicator_figures(memory, axis))
        parts.append(f"<h2>Axis {escape(axis)}: all indicators</h2>{grid(cards)}")
    unusable = memory.document["unusable"]
    if unusable:
        parts.append(section("Not used", bullets(one["why"] for one in unusable)))
    changed = bool(memory.document["changes"])
    page.write(path, f"watch, {'changed' if changed else 'no change'}", "".join(parts))


def _answer(memory: Memory) -> str:
    recordings, changes = memory.document["recordings"], memory.document["changes"]
    count = len(recordings) + len(memory.document["forgotten"])
    if changes:
        last = changes[-1]
        sentence, advice = f"The machine has changed: {last['sentence']}.", _diagnosis(last)
    elif count < MIN_RECORDINGS:
        sentence = "Too few recordings to say anything yet."
        advice = "From the eighth recording of an axis on, each one is compared with those before it."
    else:
        sentence, advice = "Nothing has changed.", "Each recording agrees with those before it."
    run_length = memory.document["recordings_between_false_alarms"]
    period = f", {_when(recordings[0])} to {_when(recordings[-1])}" if recordings else ""
    false_alarms = note(f"At most one false alarm in {run_length:g} recordings.")
    return answer(f"{count} recordings{period}", sentence, f"<p>{escape(advice)}</p>", false_alarms)


def _when(recording: Mapping[str, Any]) -> str:
    return datetime.fromtimestamp(recording["started_s"], UTC).strftime("%Y-%m-%d %H:%M")


def _diagnosis(change: Mapping[str, Any]) -> str:
    """Return the result of the diagnosis of the change in a sentence."""
    named = change["named"]
    if named is None:
        return "Two diagnoses would name the physics; they were not asked for."
    if named["verdict"] == "none":
        return f"What it is could not be determined: {named['why']}."
    if named["findings"]:
        found = "; ".join(f"{display_name(one['effect'])}: {one['explanation']}" for one in named["findings"])
    else:
        found = NO_NEW_EFFECT.get(named["verdict"], "no physics that was not there before")
    return f"Against a model of the recordings before: {found}."


def _change(change: Mapping[str, Any], page: HtmlPage) -> str:
    head = ["what", "in", "before", "after (95 %)", "standard errors"]
    moved = table(head, [_moved(one) for one in change["moved"]])
    began, later = change["began"], change["alarm"]["recordings_later"]
    when = (
        f"Alarm at {change['alarm']['recording']}, by {later} recording{'s' * (later != 1)} that differ. "
        f"Began after {began['after']}, 95 % within {began['interval95'][0]} to {began['interval95'][1]}. "
        f"Growing rather than a step: {percent(change['ramp_probability'])}. "
        f"The temperature {change['temperature']}."
    )
    where = f"<h3>Where</h3>{bullets(map(_location, change['where']))}" if change["where"] else ""
    described = section(
        f"Change {change['id']}",
        f"<h3>{escape(change['sentence'])}</h3><p>{escape(when)}</p><p>{escape(_diagnosis(change))}</p>",
        moved,
        where,
    )
    cards = (
        page.card(f"{change['id']}-{number}", change_profile(profile))
        for number, profile in enumerate(change["profiles"])
    )
    return described + grid(cards)


def _moved(one: Mapping[str, Any]) -> list[str]:
    """Return the cells of an indicator that changed."""
    low, high = (quantity(bound, one["unit"]) for bound in one["after_ci95"])
    return [
        escape(one["words"]),
        escape(CHANNEL_NAMES[one["sense"]]),
        escape(quantity(one["before"], one["unit"])),
        escape(f"{quantity(one['after'], one['unit'])} ({low} to {high})"),
        f"{abs(one['t']):.1f}",
    ]


def _location(one: Mapping[str, Any]) -> str:
    name = {"constant": "everywhere", "direction": "with the direction of motion"}.get(
        one["coordinate"], f"over the {display_name(one['coordinate'])}"
    )
    low, high = one["range"]
    where = f": {one['label']}" if one["label"] else ""
    if not where and high > low:
        factor, unit = display_unit(one["unit"], max(abs(low), abs(high)))
        where = f": {low / factor:.3g} to {high / factor:.3g} {unit}"
    peak = quantity(one["peak"], "N" if one["sensor"] == "force" else "m")
    channel, share = CHANNEL_NAMES[one["sensor"]], percent(one["share"])
    return f"{channel}, {name}{where}, up to {peak}; {share} of the change"

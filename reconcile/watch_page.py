"""`watch.html`: every indicator over the recordings; what changed, when, and how it was before and after."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from reconcile.report import card, document
from reconcile.report_figures import Figure
from reconcile.report_sections import text
from reconcile.report_traces import LOGARITHMIC, layout
from reconcile.report_words import SENSES, percent, quantity, reading, title
from reconcile.watch_kinds import LEVEL
from reconcile.watch_memory import sequences, words_of
from servo_ctrl.report.packed import packed
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reconcile.watch_memory import Memory

SIDES = {"before": "before the change", "after": "after it"}


def write_page(memory: Memory, path: Path) -> None:
    """Write the page. Raises OSError; leaves nothing half written."""
    content = page(memory)
    write_whole(path, lambda temporary: temporary.write_text(content, encoding="utf-8"))


def page(memory: Memory) -> str:
    """The whole page."""
    drawn: dict[str, Any] = {}
    parts = [_answer(memory)]
    parts += [_change(change, drawn) for change in reversed(memory.document["changes"])]
    for axis in memory.axes():
        cards = "".join(
            card(f"{axis}-{figure.name}", figure, drawn, classes="card")
            for figure in _indicators(memory, axis)
        )
        parts.append(f'<h2>Axis {text(axis)}: all indicators</h2><div class="plots">{cards}</div>')
    unusable = memory.document["unusable"]
    if unusable:
        items = "".join(f"<li>{text(one['why'])}</li>" for one in unusable)
        parts.append(f'<h2>Not used</h2><section class="card"><ul>{items}</ul></section>')
    changed = bool(memory.document["changes"])
    return document(f"watch, {'changed' if changed else 'no change'}", "".join(parts), drawn)


def _answer(memory: Memory) -> str:
    recordings, changes = memory.document["recordings"], memory.document["changes"]
    number = len(recordings) + len(memory.document["forgotten"])
    if changes:
        last = changes[-1]
        said, advice = f"The machine has changed: {last['sentence']}.", _named(last)
    elif number < 8:
        said = "Too few recordings to say anything yet."
        advice = "From the eighth recording of an axis on, each one is compared with those before it."
    else:
        said, advice = "Nothing has changed.", "Each recording agrees with those before it."
    run = memory.document["recordings_between_false_alarms"]
    ends = f", {_when(recordings[0])} to {_when(recordings[-1])}" if recordings else ""
    return (
        f'<section class="card answer"><span class="word">{number} recordings{text(ends)}</span>'
        f"<h1>{text(said)}</h1><p>{text(advice)}</p>"
        f'<p class="note">At most one false alarm in {run:g} recordings.</p></section>'
    )


def _when(entry: Mapping[str, Any]) -> str:
    return datetime.fromtimestamp(entry["started_s"], UTC).strftime("%Y-%m-%d %H:%M")


def _named(change: Mapping[str, Any]) -> str:
    named = change["named"]
    if named is None:
        return "Two diagnoses would name the physics; they were not asked for."
    if named["verdict"] == "none":
        return f"What it is could not be told: {named['why']}."
    if not named["findings"]:
        words = {
            "parameters": "only values have moved, no physics is new",
            "consistent": "the model still fits",
        }
        said = words.get(named["verdict"], "no physics that was not there before")
        return f"Against a model of the recordings before: {said}."
    said = "; ".join(f"{title(one['effect'])}: {one['explanation']}" for one in named["findings"])
    return f"Against a model of the recordings before: {said}."


def _change(change: Mapping[str, Any], drawn: dict[str, Any]) -> str:
    rows = []
    for one in change["moved"]:
        low, high = (quantity(bound, one["unit"]) for bound in one["after_ci95"])
        cells = [
            text(one["words"]),
            text(SENSES[one["sense"]]),
            text(quantity(one["before"], one["unit"])),
            text(f"{quantity(one['after'], one['unit'])} ({low} to {high})"),
            f"{abs(one['t']):.1f}",
        ]
        rows.append("".join(f"<td>{cell}</td>" for cell in cells))
    head = "".join(f"<th>{one}</th>" for one in ("what", "in", "before", "after (95 %)", "standard errors"))
    table = "".join(f"<tr>{row}</tr>" for row in rows)
    places = "".join(f"<li>{text(_place(one))}</li>" for one in change["where"])
    began, later = change["began"], change["alarm"]["recordings_later"]
    when = (
        f"Alarm at {change['alarm']['recording']}, by {later} recording{'s' * (later != 1)} that differ. "
        f"Began after {began['after']}, 95 % within {began['interval95'][0]} to {began['interval95'][1]}. "
        f"Growing rather than a step: {percent(change['ramp_probability'])}. "
        f"The temperature {change['temperature']}."
    )
    cards = "".join(
        card(f"{change['id']}-{number}", figure, drawn, classes="card")
        for number, figure in enumerate(map(_profile, change["profiles"]))
    )
    where = f"<h3>Where</h3><ul>{places}</ul>" if places else ""
    return (
        f"<h2>Change {text(change['id'])}</h2>"
        f'<section class="card"><h3>{text(change["sentence"])}</h3>'
        f"<p>{text(when)}</p><p>{text(_named(change))}</p>"
        f'<div class="scroll"><table><tr>{head}</tr>{table}</table></div>{where}</section>'
        f'<div class="plots">{cards}</div>'
    )


def _place(one: Mapping[str, Any]) -> str:
    name = {"constant": "everywhere", "direction": "with the direction of motion"}.get(
        one["coordinate"], f"over the {title(one['coordinate'])}"
    )
    low, high = one["range"]
    where = f": {one['label']}" if one["label"] else ""
    if not where and high > low:
        factor, unit = reading(one["unit"], max(abs(low), abs(high)))
        where = f": {low / factor:.3g} to {high / factor:.3g} {unit}"
    unit = "N" if one["sensor"] == "force" else "m"
    share = percent(one["share"])
    return (
        f"{SENSES[one['sensor']]}, {name}{where}, up to {quantity(one['peak'], unit)}; {share} of the change"
    )


def _profile(one: Mapping[str, Any]) -> Figure:
    sizes = [abs(v) for side in SIDES for v in one[side]["mean"] if v is not None]
    factor, unit = reading("N" if one["sense"] == "force" else "m", max(sizes, default=0.0))
    x_factor, x_unit = reading(one["unit"], max((abs(v) for v in one["centres"]), default=0.0))
    x: Any = one["labels"] or [v / x_factor for v in one["centres"]]
    data = []
    for side, name in SIDES.items():
        mean = [None if v is None else v / factor for v in one[side]["mean"]]
        error = [0.0 if v is None else 2.0 * v / factor for v in one[side]["error"]]
        data.append(
            {
                "type": "scatter",
                "mode": "markers" if one["labels"] else "lines+markers",
                "name": name,
                "x": x,
                "y": mean,
                "line": {"color": f"--{_role(side)}", "width": 1.4},
                "marker": {"color": f"--{_role(side)}", "size": 9 if one["labels"] else 6},
                "error_y": {"array": error, "color": f"--{_role(side)}", "thickness": 1, "width": 2},
            }
        )
    name = title(one["coordinate"])
    turned = " times direction" if one["by_direction"] else ""
    drawing = layout(f"{name} ({x_unit})" if x_unit else name, f"mean{turned} ({unit})")
    if one["logarithmic"]:
        drawing["xaxis"].update(LOGARITHMIC)
    note = f"{SENSES[one['sense']]} that the model of the recordings before leaves, with twice its error."
    return Figure("", f"Over the {name}", note, data, drawing)


def _role(side: str) -> str:
    return {"before": "after", "after": "before"}[side]  # the change is what should stand out


def _indicators(memory: Memory, axis: str) -> Sequence[Figure]:
    entries = memory.of_axis(axis)
    names = [entry["name"] for entry in entries]
    changes = [change for change in memory.document["changes"] if change["axis"] == axis]
    first = [(one["sense"], one["indicator"]) for change in changes for one in change["moved"]]
    known = sequences(entries, axis)
    found = []
    for sense, name in dict.fromkeys([*(key for key in first if key in known), *known]):
        sequence, places = known[sense, name]
        words, unit = words_of(sense, name)
        values, errors = sequence.values, sequence.errors
        low, high = values - 1.96 * errors, values + 1.96 * errors
        if name == LEVEL:
            values, low, high = np.exp(values), np.exp(low), np.exp(high)
        factor, unit = reading(unit, float(np.abs(values).max()))
        at = np.array(places, dtype=np.float64) + 1.0
        trace = {
            "type": "scatter",
            "mode": "markers",
            "name": words,
            "x": packed(at),
            "y": packed(values / factor),
            "text": [names[place] for place in places],
            "marker": {"color": "--after", "size": 6},
            "error_y": {
                "array": packed((high - values) / factor),
                "arrayminus": packed((values - low) / factor),
                "color": "--after",
                "thickness": 1,
                "width": 2,
            },
        }
        drawing = layout("recording", f"{words} ({unit})" if unit else words)
        drawing["shapes"] = [shape for change in changes for shape in _marks(change, names, [sense, name])]
        drawing["showlegend"] = False
        note = "With its interval of 95 % from within the recording."
        if (sense, name) in first:
            note += " Grey: when the change began (95 %); dotted: the alarm."
        model = [entries[place]["axes"][axis]["senses"][sense][name]["model"] for place in places]
        if model[-1] is not None and math.isfinite(model[-1]):
            note += f" The model file says {quantity(model[-1], words_of(sense, name)[1])}."
        found.append(Figure(f"{sense}-{name}", f"{words}, {SENSES[sense]}", note, [trace], drawing))
    return found


def _marks(change: Mapping[str, Any], names: Sequence[str], key: list[str]) -> list[dict[str, Any]]:
    """When it began, and the alarm; only on what moved."""
    if key not in [[one["sense"], one["indicator"]] for one in change["moved"]]:
        return []
    low, high, alarm = (
        names.index(name) + 1 if name in names else None
        for name in (*change["began"]["interval95"], change["alarm"]["recording"])
    )
    shapes = []
    upright: dict[str, Any] = {"xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper", "layer": "below"}
    if low is not None and high is not None:
        band = {"x0": low - 0.5, "x1": high + 0.5, "fillcolor": "--floor-band", "line": {"width": 0}}
        shapes.append({"type": "rect", **upright, **band})
    if alarm is not None:
        pen = {"color": "--before", "width": 1.4, "dash": "dot"}
        shapes.append({"type": "line", **upright, "x0": alarm, "x1": alarm, "line": pen})
    return shapes

"""Describes a change of a machine for watch.json: onset, form, indicators that changed, and a sentence."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from reconcile.report.words import join_words, quantity
from reconcile.watch.change_detection import change_size, onset
from reconcile.watch.indicators import RESIDUAL_LEVEL
from reconcile.watch.memory import indicator_words, sequences

Key = tuple[str, str]

CLEAR_FORM = 0.9
"""Least probability with which a change is called a step, or a ramp."""
MIN_MOVED_T = 4.0
"""Least change of another indicator to be reported too, in standard errors."""
FOLLOWED_RECORDINGS = 30
"""Recordings after an alarm that refine the change; growth beyond them is reported as another change."""
DIAGNOSED_AFTER = (2, 8)
"""Numbers of recordings after an alarm at which the diagnosis is repeated."""


def change_of(
    axis: str, number: int, first: Key, entries: Sequence[dict[str, Any]], since: str
) -> dict[str, Any]:
    """Return a new change at the last of `entries`; `first` is the indicator with the clearest alarm."""
    last = entries[-1]
    change: dict[str, Any] = {
        "id": f"{axis}-{number}",
        "axis": axis,
        "alarm": {"recording": last["name"], "time_s": last["started_s"]},
        "reference": since or entries[0]["name"],
        "clearest": list(first),
        "open": True,
        "published": False,
    }
    _estimate(change, list(entries))
    return change


class ChangeUpdate(NamedTuple):
    """What to do after a later recording has refined a reported change."""

    report: bool
    """Onset or form has changed."""
    diagnose: bool
    """Enough new recordings have arrived to repeat the diagnosis."""


def updated(change: dict[str, Any], entries: list[dict[str, Any]]) -> ChangeUpdate:
    """Refine a change by later recordings; `entries` are all recordings since its reference."""
    names = [entry["name"] for entry in entries]
    if change["reference"] not in names or change["alarm"]["recording"] not in names:
        change["open"] = False  # the memory no longer holds those recordings
        return ChangeUpdate(report=False, diagnose=False)
    before = change["form"], change["began"]
    later = len(names) - 1 - names.index(change["alarm"]["recording"])
    _estimate(change, entries)
    change["open"] = later < FOLLOWED_RECORDINGS
    return ChangeUpdate(report=(change["form"], change["began"]) != before, diagnose=later in DIAGNOSED_AFTER)


def is_continuation(change: dict[str, Any], raised: Iterable[Key]) -> bool:
    """Return whether alarms belong to a known change that may still grow."""
    moved = {(one["sense"], one["indicator"]) for one in change["moved"]}
    return bool(change["open"]) and change["form"] != "step" and moved.issuperset(raised)


def _estimate(change: dict[str, Any], entries: list[dict[str, Any]]) -> None:
    """Estimate onset, form and sizes from all recordings since the reference."""
    axis, clearest = change["axis"], tuple(change["clearest"])
    known = sequences(entries, axis)
    sequence, places = known[clearest]
    when = onset(sequence)
    first, low, high = (entries[places[k]] for k in (when.first, when.low, when.high))
    before = entries[places[when.first] - 1]
    change["began"] = {
        "recording": first["name"],
        "time_s": first["started_s"],
        "after": before["name"],
        "interval95": [low["name"], high["name"]],
        "interval95_time_s": [low["started_s"], high["started_s"]],
    }
    change["ramp_probability"] = when.ramp
    ramp = when.ramp > 0.5
    clear = max(when.ramp, 1.0 - when.ramp) > CLEAR_FORM
    change["form"] = "step or ramp" if not clear else "ramp" if ramp else "step"
    alarm = [entry["name"] for entry in entries].index(change["alarm"]["recording"])
    change["alarm"]["recordings_later"] = max(alarm - places[when.first] + 1, 0)
    moved = [_moved(key, known, places[when.first], clearest, ramp=ramp) for key in known]
    change["moved"] = [one for one in moved if one is not None]
    change["moved"].sort(key=lambda one: ((one["sense"], one["indicator"]) != clearest, -abs(one["t"])))
    temperatures_k = [entry["axes"][axis]["temperature_k"] for entry in entries]
    change["temperature"] = (
        "was recorded and taken off"
        if None not in temperatures_k
        else "was not recorded: a thermal cause is not excluded"
    )
    change["sentence"] = sentence(change)


def _moved(
    key: Key, known: dict[Key, Any], place: int, clearest: tuple[str, ...], *, ramp: bool
) -> dict[str, Any] | None:
    sequence, places = known[key]
    first = int(np.searchsorted(places, place))
    if not 0 < first < len(places):
        return None
    before, size, error = change_size(sequence, first, ramp=ramp)
    t = size / error
    if key != clearest and (abs(t) < MIN_MOVED_T or abs(size) < sequence.min_change):
        return None
    channel, name = key
    words, unit = indicator_words(channel, name)
    after, low, high = before + size, size - 1.96 * error, size + 1.96 * error
    bounds = [before + low, before + high]
    if name == RESIDUAL_LEVEL:
        before, after, bounds = math.exp(before), math.exp(after), [math.exp(one) for one in bounds]
    return {
        "sense": channel,
        "indicator": name,
        "words": words,
        "unit": unit,
        "before": before,
        "after": after,
        "after_ci95": bounds,
        "t": t,
    }


def sentence(change: dict[str, Any]) -> str:
    """Return a sentence about a change that an engineer can check."""
    began = change["began"]
    how = {"step": "at once", "ramp": "more and more", "step or ramp": "at once or by and by"}[change["form"]]
    low, high = began["interval95"]
    within = f" (95 %: {low} to {high})" if low != high else ""
    moved = join_words(map(_moved_text, change["moved"][:3]))
    return f"axis {change['axis']}, since {began['recording']}{within}, {how}: {moved}"


def _moved_text(one: dict[str, Any]) -> str:
    direction = "rose" if abs(one["after"]) > abs(one["before"]) else "fell"
    before, after = (quantity(one[side], one["unit"]) for side in ("before", "after"))
    return f"{one['words']} {direction} from {before} to {after}"

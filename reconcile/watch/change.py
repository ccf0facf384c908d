"""Describes a change of a machine for watch.json: onset, form, indicators that changed, and a sentence."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from reconcile.report.words import join_words, quantity
from reconcile.watch.change_detection import change_size, onset
from reconcile.watch.history import IndicatorKey, RecordedSeries, indicator_label, indicator_series
from reconcile.watch.indicators import RESIDUAL_LEVEL

CLEAR_FORM_PROBABILITY = 0.9
"""Least probability with which a change is called a step, or a ramp; chosen."""
MIN_MOVED_T = 4.0
"""Least change of another indicator to be reported too, in standard errors; chosen."""
FOLLOWED_RECORDINGS = 30
"""Recordings after an alarm that refine the change; growth beyond them is reported as another change."""
DIAGNOSED_AFTER = (2, 8)
"""Numbers of recordings after an alarm at which the diagnosis is repeated; chosen."""
FORM_WORDS = {"step": "at once", "ramp": "more and more", "step or ramp": "at once or by and by"}
"""Words for the form of a change."""
NORMAL_95 = 1.96
"""Half width of a 95 % interval in standard errors."""


def change_of(
    axis: str, number: int, clearest: IndicatorKey, entries: Sequence[dict[str, Any]], since: str
) -> dict[str, Any]:
    """Return a new change at the last of `entries`; `clearest`: the indicator with the clearest alarm.

    `since`: name of the recording after which the entries begin; empty: the first of them.
    """
    last = entries[-1]
    change: dict[str, Any] = {
        "id": f"{axis}-{number}",
        "axis": axis,
        "alarm": {"recording": last["name"], "time_s": last["started_s"]},
        "reference": since or entries[0]["name"],
        "clearest": list(clearest),
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


def refine(change: dict[str, Any], entries: list[dict[str, Any]]) -> ChangeUpdate:
    """Refine a change in place by later recordings; `entries` are all recordings since its reference."""
    names = [entry["name"] for entry in entries]
    if change["reference"] not in names or change["alarm"]["recording"] not in names:
        change["open"] = False  # the history no longer holds those recordings
        return ChangeUpdate(report=False, diagnose=False)
    previous = change["form"], change["began"]
    later = len(names) - 1 - names.index(change["alarm"]["recording"])
    _estimate(change, entries)
    change["open"] = later < FOLLOWED_RECORDINGS
    is_different = (change["form"], change["began"]) != previous
    return ChangeUpdate(report=is_different, diagnose=later in DIAGNOSED_AFTER)


def moved_keys(change: Mapping[str, Any]) -> list[IndicatorKey]:
    """Return the indicators that a change has moved."""
    return [IndicatorKey(moved["sense"], moved["indicator"]) for moved in change["moved"]]


def is_continuation(change: Mapping[str, Any], raised: Iterable[IndicatorKey]) -> bool:
    """Return whether alarms belong to a known change that may still grow."""
    return bool(change["open"]) and change["form"] != "step" and {*moved_keys(change)}.issuperset(raised)


def _estimate(change: dict[str, Any], entries: list[dict[str, Any]]) -> None:
    """Estimate onset, form and sizes from all recordings since the reference."""
    axis, clearest = change["axis"], IndicatorKey(*change["clearest"])
    by_key = indicator_series(entries, axis)
    series, places = by_key[clearest]
    began = onset(series)
    first, low, high = (entries[places[k]] for k in (began.first, began.low, began.high))
    last_before = entries[places[began.first] - 1]
    change["began"] = {
        "recording": first["name"],
        "time_s": first["started_s"],
        "after": last_before["name"],
        "interval95": [low["name"], high["name"]],
        "interval95_time_s": [low["started_s"], high["started_s"]],
    }
    change["ramp_probability"] = began.ramp_probability
    is_ramp = began.ramp_probability > 0.5
    is_clear = max(began.ramp_probability, 1.0 - began.ramp_probability) > CLEAR_FORM_PROBABILITY
    change["form"] = "step or ramp" if not is_clear else "ramp" if is_ramp else "step"
    alarm = [entry["name"] for entry in entries].index(change["alarm"]["recording"])
    change["alarm"]["recordings_later"] = max(alarm - places[began.first] + 1, 0)
    moved = [
        _moved_indicator(key, by_key[key], places[began.first], clearest, is_ramp=is_ramp) for key in by_key
    ]
    change["moved"] = [one for one in moved if one is not None]
    change["moved"].sort(key=lambda one: ((one["sense"], one["indicator"]) != clearest, -abs(one["t"])))
    temperatures_k = [entry["axes"][axis]["temperature_k"] for entry in entries]
    change["temperature"] = (
        "was recorded and taken off"
        if None not in temperatures_k
        else "was not recorded: a thermal cause is not excluded"
    )
    change["sentence"] = sentence(change)


def _moved_indicator(
    key: IndicatorKey, recorded: RecordedSeries, first_entry: int, clearest: IndicatorKey, *, is_ramp: bool
) -> dict[str, Any] | None:
    """Return the change of an indicator from `first_entry` on; None if it is not reported."""
    first = int(np.searchsorted(recorded.places, first_entry))
    if not 0 < first < len(recorded.places):
        return None
    before, size, error = change_size(recorded.series, first, is_ramp=is_ramp)
    t = size / error
    if key != clearest and (abs(t) < MIN_MOVED_T or abs(size) < recorded.series.min_change):
        return None
    label = indicator_label(key)
    after, low, high = before + size, size - NORMAL_95 * error, size + NORMAL_95 * error
    bounds = [before + low, before + high]
    if key.indicator == RESIDUAL_LEVEL:
        before, after, bounds = math.exp(before), math.exp(after), [math.exp(bound) for bound in bounds]
    return {
        "sense": key.channel,
        "indicator": key.indicator,
        "words": label.text,
        "unit": label.unit,
        "before": before,
        "after": after,
        "after_ci95": bounds,
        "t": t,
    }


def sentence(change: dict[str, Any]) -> str:
    """Return a sentence about a change that an engineer can check."""
    began = change["began"]
    form = FORM_WORDS[change["form"]]
    low, high = began["interval95"]
    interval = f" (95 %: {low} to {high})" if low != high else ""
    moved = join_words(map(_moved_text, change["moved"][:3]))
    return f"axis {change['axis']}, since {began['recording']}{interval}, {form}: {moved}"


def _moved_text(moved: dict[str, Any]) -> str:
    direction = "rose" if abs(moved["after"]) > abs(moved["before"]) else "fell"
    before, after = (quantity(moved[side], moved["unit"]) for side in ("before", "after"))
    return f"{moved['words']} {direction} from {before} to {after}"

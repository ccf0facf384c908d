"""A change of a machine as watch.json has it: when it began, how it went, what moved, in one sentence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.report_words import listed, quantity
from reconcile.watch_kinds import LEVEL
from reconcile.watch_memory import sequences, words_of
from reconcile.watch_sequence import moved, onset

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Key = tuple[str, str]

CLEAR = 0.9
"""Probability of a form to be called so."""
STANDS_OUT = 4.0
"""Standard errors of what moved too."""
FOLLOWED = 30
"""Recordings after an alarm by which it is known better; what grows for longer is told again then."""
NAMED_AGAIN = (2, 8)
"""Recordings after an alarm with which the diagnosis is made anew."""


def change_of(
    axis: str, number: int, first: Key, entries: Sequence[dict[str, Any]], since: str
) -> dict[str, Any]:
    """A new one, at the last of `entries`; `first`: the indicator that says so most clearly."""
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


class News(NamedTuple):
    """What a later recording did to what is said of a change."""

    said: bool
    """When or how it went is another now."""
    name: bool
    """There is more now to name it by."""


def updated(change: dict[str, Any], entries: list[dict[str, Any]]) -> News:
    """What later recordings tell of it; `entries`: all since its reference."""
    names = [entry["name"] for entry in entries]
    if change["reference"] not in names or change["alarm"]["recording"] not in names:
        change["open"] = False  # forgotten meanwhile
        return News(said=False, name=False)
    said = change["form"], change["began"]
    later = len(names) - 1 - names.index(change["alarm"]["recording"])
    _estimate(change, entries)
    change["open"] = later < FOLLOWED
    return News(said=(change["form"], change["began"]) != said, name=later in NAMED_AGAIN)


def goes_on(change: dict[str, Any], raised: Iterable[Key]) -> bool:
    """Whether alarms are what is known already: of a change that still grows, or may."""
    moved = {(one["sense"], one["indicator"]) for one in change["moved"]}
    return bool(change["open"]) and change["form"] != "step" and moved.issuperset(raised)


def _estimate(change: dict[str, Any], entries: list[dict[str, Any]]) -> None:
    """When, how and how much, from all recordings since the reference."""
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
    change["form"] = "ramp" if when.ramp > CLEAR else "step" if when.ramp < 1.0 - CLEAR else "step or ramp"
    ramp = when.ramp > 0.5
    alarm = [entry["name"] for entry in entries].index(change["alarm"]["recording"])
    change["alarm"]["recordings_later"] = max(alarm - places[when.first] + 1, 0)
    change["moved"] = [
        one
        for key in known
        if (one := _moved(key, known, places[when.first], clearest, ramp=ramp)) is not None
    ]
    change["moved"].sort(key=lambda one: ((one["sense"], one["indicator"]) != clearest, -abs(one["t"])))
    warm = [entry["axes"][axis]["temperature_k"] for entry in entries]
    change["temperature"] = (
        "was recorded and taken off" if None not in warm else "was not recorded: warmth is not excluded"
    )
    change["sentence"] = sentence(change)


def _moved(
    key: Key,
    known: dict[Key, Any],
    place: int,
    clearest: tuple[str, ...],
    *,
    ramp: bool,
) -> dict[str, Any] | None:
    sequence, places = known[key]
    first = int(np.searchsorted(places, place))
    if not 0 < first < len(places):
        return None
    before, size, error = moved(sequence, first, ramp=ramp)
    t = size / error
    if key != clearest and (abs(t) < STANDS_OUT or abs(size) < sequence.least):
        return None
    sense, name = key
    words, unit = words_of(sense, name)
    after, low, high = before + size, size - 1.96 * error, size + 1.96 * error
    bounds = [before + low, before + high]
    if name == LEVEL:
        before, after, bounds = math.exp(before), math.exp(after), [math.exp(one) for one in bounds]
    return {
        "sense": sense,
        "indicator": name,
        "words": words,
        "unit": unit,
        "before": before,
        "after": after,
        "after_ci95": bounds,
        "t": t,
    }


def sentence(change: dict[str, Any]) -> str:
    """What an engineer can check."""
    began = change["began"]
    how = {"step": "at once", "ramp": "more and more", "step or ramp": "at once or by and by"}[change["form"]]
    low, high = began["interval95"]
    within = f" (95 %: {low} to {high})" if low != high else ""
    told = listed(_told(one) for one in change["moved"][:3])
    return f"axis {change['axis']}, since {began['recording']}{within}, {how}: {told}"


def _told(one: dict[str, Any]) -> str:
    way = "rose" if abs(one["after"]) > abs(one["before"]) else "fell"
    before, after = (quantity(one[side], one["unit"]) for side in ("before", "after"))
    return f"{one['words']} {way} from {before} to {after}"

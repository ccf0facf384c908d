"""Figures of a watch: indicators over the recordings, and residual profiles before and after a change."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from kernels.readable_units import display_unit
from reconcile.report.traces import LOGARITHMIC, Figure, error_bars, interval_band, layout, upright
from reconcile.report.words import CHANNEL_NAMES, display_name, quantity
from reconcile.watch.change import NORMAL_95, moved_keys
from reconcile.watch.history import WatchHistory, indicator_label, indicator_series
from reconcile.watch.indicators import RESIDUAL_LEVEL
from servo_ctrl.report.html_file import packed

SIDES = {"before": "before the change", "after": "after it"}
COLOURS = {"before": "--after", "after": "--before"}
"""Colour by side; the page draws `--before`, there an incomplete model, in the most visible colour."""


def change_profile(profile: Mapping[str, Any]) -> Figure:
    """Draw a profile of watch.json: the mean residual over a coordinate before and after the change."""
    means = [abs(value) for side in SIDES for value in profile[side]["mean"] if value is not None]
    factor, unit = display_unit("N" if profile["sense"] == "force" else "m", max(means, default=0.0))
    furthest = max((abs(value) for value in profile["centres"]), default=0.0)
    x_factor, x_unit = display_unit(profile["unit"], furthest)
    labels = profile["labels"]
    data = []
    for side, name in SIDES.items():
        error = [0.0 if value is None else 2.0 * value / factor for value in profile[side]["error"]]
        data.append(
            {
                "type": "scatter",
                "mode": "markers" if labels else "lines+markers",
                "name": name,
                "x": labels or [value / x_factor for value in profile["centres"]],
                "y": [None if value is None else value / factor for value in profile[side]["mean"]],
                "line": {"color": COLOURS[side], "width": 1.4},
                "marker": {"color": COLOURS[side], "size": 9 if labels else 6},
                "error_y": error_bars(COLOURS[side], array=error),
            }
        )
    name = display_name(profile["coordinate"])
    signed = " times direction" if profile["by_direction"] else ""
    figure_layout = layout(f"{name} ({x_unit})" if x_unit else name, f"mean{signed} ({unit})")
    if profile["logarithmic"]:
        figure_layout["xaxis"].update(LOGARITHMIC)
    channel = CHANNEL_NAMES[profile["sense"]]
    note = f"{channel} that the model of the recordings before leaves, with twice its error."
    return Figure("", f"Over the {name}", note, data, figure_layout)


def indicator_figures(history: WatchHistory, axis: str) -> Iterator[Figure]:
    """Draw every indicator of an axis over its recordings, the changed ones first."""
    entries = history.of_axis(axis)
    recordings = [entry["name"] for entry in entries]
    changes = [change for change in history.document["changes"] if change["axis"] == axis]
    moved = [key for change in changes for key in moved_keys(change)]
    by_key = indicator_series(entries, axis)
    for key in dict.fromkeys([*(key for key in moved if key in by_key), *by_key]):
        series, places = by_key[key]
        label, si_unit = indicator_label(key)
        values, errors = series.values, series.errors
        low, high = values - NORMAL_95 * errors, values + NORMAL_95 * errors
        if key.indicator == RESIDUAL_LEVEL:
            values, low, high = np.exp(values), np.exp(low), np.exp(high)
        factor, unit = display_unit(si_unit, float(np.abs(values).max()))
        bars = {"array": packed((high - values) / factor), "arrayminus": packed((values - low) / factor)}
        trace = {
            "type": "scatter",
            "mode": "markers",
            "name": label,
            "x": packed(np.array(places, dtype=np.float64) + 1.0),
            "y": packed(values / factor),
            "text": [recordings[place] for place in places],
            "marker": {"color": "--after", "size": 6},
            "error_y": error_bars("--after", **bars),
        }
        figure_layout = layout("recording", f"{label} ({unit})" if unit else label)
        figure_layout["shapes"] = [
            shape
            for change in changes
            if key in moved_keys(change)
            for shape in _onset_and_alarm(change, recordings)
        ]
        figure_layout["showlegend"] = False
        note = "With its interval of 95 % from within the recording."
        if key in moved:
            note += " Grey: when the change began (95 %); dotted: the alarm."
        nominal = entries[places[-1]]["axes"][axis]["senses"][key.channel][key.indicator]["model"]
        if nominal is not None and math.isfinite(nominal):
            note += f" The model file says {quantity(nominal, si_unit)}."
        heading = f"{label}, {CHANNEL_NAMES[key.channel]}"
        yield Figure(f"{key.channel}-{key.indicator}", heading, note, [trace], figure_layout)


def _onset_and_alarm(change: Mapping[str, Any], recordings: Sequence[str]) -> list[dict[str, Any]]:
    """Return the marks of a change, where its recordings are drawn."""
    low, high, alarm = (
        recordings.index(name) + 1 if name in recordings else None
        for name in (*change["began"]["interval95"], change["alarm"]["recording"])
    )
    shapes = []
    if low is not None and high is not None:
        shapes.append(interval_band(low - 0.5, high + 0.5, "--floor-band"))
    if alarm is not None:
        shapes.append(upright(alarm, colour="--before", width=1.4))
    return shapes

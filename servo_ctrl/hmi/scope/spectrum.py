"""The amplitude spectrum of the channels that the scope shows, over the picture or between its cursors."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.shell.plots import Theme, curve, figure, plot_layout

FEWEST_ROWS = 16
"""Bounds the rows of a spectrum from below; chosen."""
MAX_POINTS = 1000
"""Bounds the points of a curve; chosen. Of a bucket of frequencies the largest amplitude is drawn."""
MOST_MISSING = 0.1
"""Share of rows without a value above which a spectrum would be made up; chosen."""


def amplitude_spectrum(values: Array, period_s: float) -> tuple[Array, Array]:
    """Return frequencies (n,) in Hz above 0 and peak amplitudes (n,) of values (m,) less their mean.

    By the FFT with a Hann window: a sine of amplitude A has a line of height A. Both are empty for too few
    values; single missing ones (NaN) are interpolated.
    """
    there = np.isfinite(values)
    if len(values) < FEWEST_ROWS or there.mean() < 1.0 - MOST_MISSING:
        return np.zeros(0), np.zeros(0)
    number = np.arange(len(values))
    whole = np.interp(number, number[there], values[there])
    window = np.hanning(len(whole))
    lines = np.abs(np.fft.rfft((whole - whole.mean()) * window)) * 2.0 / window.sum()
    rate_hz: Array = np.fft.rfftfreq(len(whole), period_s).astype(np.float64)
    return rate_hz[1:], np.asarray(lines[1:], dtype=np.float64)


def spectrum_figure(
    values: Array, channels: Sequence[ShownChannel], period_s: float, theme: Theme
) -> dict[str, Any]:
    """Return the spectra of rows (n, channels), each in its channel's unit, over a logarithmic frequency."""
    data = []
    for number, channel in enumerate(channels):
        rate_hz, amplitude = _thinned(*amplitude_spectrum(values[:, channel.place], period_s))
        name = f"{channel.title} ({channel.unit.unit})"
        shown = (amplitude * channel.unit.factor).tolist()
        data.append(curve(name, rate_hz.tolist(), shown, line={"color": theme.curve(number), "width": 1.2}))
    layout = plot_layout(tr("frequency (Hz)"), tr("amplitude"), theme)
    layout["xaxis"]["type"] = layout["yaxis"]["type"] = "log"
    layout["yaxis"]["exponentformat"] = "power"  # a prefix would stand beside that of the unit
    return figure(data, layout, revision=" ".join(channel.name for channel in channels))


def _thinned(rate_hz: Array, amplitude: Array) -> tuple[Array, Array]:
    """Return at most MAX_POINTS points: the greatest of each bucket, where it is."""
    if len(rate_hz) <= MAX_POINTS:
        return rate_hz, amplitude
    edges = np.unique(np.geomspace(1, len(rate_hz) + 1, MAX_POINTS + 1).astype(np.int64)) - 1
    best = [first + int(np.argmax(amplitude[first:last])) for first, last in pairwise(edges)]
    return rate_hz[best], amplitude[best]

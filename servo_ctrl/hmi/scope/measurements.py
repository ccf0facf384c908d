"""Measured values of the channels over the picture, or between both cursors, at full rate."""

from collections.abc import Mapping, Sequence

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.languages.texts import translated, word
from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.live_content import TextTable
from servo_ctrl.hmi.shell.units import NO_VALUE

HEAD = (word("minimum"), word("maximum"), word("peak to peak"), word("mean"), word("RMS"), word("frequency"))
FEWEST_CROSSINGS = 3
"""Rising crossings of the mean that a frequency needs; chosen."""


class MeasurementTable:
    """A line for each channel."""

    def __init__(self) -> None:
        self._table = TextTable("scope-measured", ("", *translated(HEAD), ""), figures=True)

    def refresh(
        self,
        rows: CapturedRows,
        origin: int,
        channels: Sequence[ShownChannel],
        cursors: Mapping[str, float],
        period_s: float,
    ) -> None:
        """Measure the rows; `cursors`: their times from `origin` by name, seconds."""
        values = between(rows, origin, cursors, period_s)
        self._table.show([line_of(channel, values[:, channel.place], period_s) for channel in channels])


def between(rows: CapturedRows, origin: int, cursors: Mapping[str, float], period_s: float) -> Array:
    """Return the rows between both cursors, those at the cursors too; all of them where one is missing."""
    if len(cursors) < 2:
        return rows.values
    first, last = sorted(origin + round(at_s / period_s) - rows.first for at_s in cursors.values())
    return rows.values[max(first, 0) : max(last + 1, 0)]


def line_of(channel: ShownChannel, values: Array, period_s: float) -> list[str]:
    """Return name, values in the channel's unit, frequency and unit; cycles without a value are omitted."""
    there = values[np.isfinite(values)]
    if not len(there):
        return [channel.title, *([NO_VALUE] * 6), channel.unit.unit]
    least, greatest = float(there.min()), float(there.max())
    mean, rms = float(there.mean()), float(np.sqrt(np.mean(there**2)))
    shown = (least, greatest, greatest - least, mean, rms)
    rate_hz = frequency_hz(values, period_s)
    rate = f"{rate_hz:.4g} Hz" if rate_hz > 0.0 else NO_VALUE
    return [channel.title, *(channel.unit.text(value) for value in shown), rate, channel.unit.unit]


def frequency_hz(values: Array, period_s: float) -> float:
    """Return the frequency by rising crossings of the mean, hysteresis 10 % of peak to peak; 0: too few."""
    there = np.where(np.isfinite(values), values, np.nanmean(values)) if len(values) else values
    if not len(there) or there.max() == there.min():
        return 0.0
    mean, band = there.mean(), 0.1 * (there.max() - there.min())
    side = np.where(there > mean + band, 1, np.where(there < mean - band, -1, 0))
    places = np.flatnonzero(side)
    rising = places[1:][(side[places[1:]] == 1) & (side[places[:-1]] == -1)]
    if len(rising) < FEWEST_CROSSINGS:
        return 0.0
    return float((len(rising) - 1) / ((rising[-1] - rising[0]) * period_s))

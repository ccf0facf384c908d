"""Whether a channel was filtered: its spectrum falls off where that of a raw sensor stays flat."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SEGMENT = 512
HIGH, MIDDLE = (0.35, 0.45), (0.1, 0.2)
"""Bands, in parts of the sample rate."""
FALLEN = 0.1
"""Power in the high band over that in the middle one: below it there is a filter."""
COHERENT = 0.8
HALF_POWER = 0.7


class RollOff(NamedTuple):
    """A filter: its corner, and how far the noise falls off above (dB)."""

    corner_hz: float
    fall_db: float


def noise_roll_off(values: Array, step: float, period_s: float) -> RollOff | None:
    """A low pass in a channel (n,) by its own noise; one on a grid was not filtered after its sensor."""
    if step > 0.0 or len(values) < 4 * SEGMENT:
        return None
    frequency = np.fft.rfftfreq(SEGMENT)[1:]
    # of the changes, and back to the values: a motion's low frequencies leak less
    power = np.median(np.abs(_spectra(np.diff(values))) ** 2, axis=0)[1:]
    power /= 2.0 - 2.0 * np.cos(2.0 * np.pi * frequency)
    high, middle = (
        float(np.median(power[(frequency > low) & (frequency < top)])) for low, top in (HIGH, MIDDLE)
    )
    if not (middle > 0.0 and high < FALLEN * middle):
        return None
    # a second-order filter of this corner would give that fall between the two bands
    f_high, f_middle = float(np.mean(HIGH)), float(np.mean(MIDDLE))
    ratio = max(high / middle, 1e-12)
    fourth = (f_middle**4 - ratio * f_high**4) / (ratio - 1.0)
    corner = max(fourth, MIDDLE[0] ** 4) ** 0.25
    return RollOff(corner / period_s, float(10.0 * np.log10(ratio)))


def transfer_roll_off(first: Array, second: Array, period_s: float) -> RollOff | None:
    """A low pass between two channels (n,), as far as they go together; `second` is the filtered one."""
    if len(first) < 4 * SEGMENT:
        return None
    frequency = np.fft.rfftfreq(SEGMENT, period_s)
    a, b = _spectra(np.diff(first)), _spectra(np.diff(second))
    cross = np.mean(np.conj(a) * b, axis=0)
    own, other = np.mean(np.abs(a) ** 2, axis=0), np.mean(np.abs(b) ** 2, axis=0)
    gain = np.abs(cross) / np.maximum(own, 1e-300)
    likeness = np.abs(cross) ** 2 / np.maximum(own * other, 1e-300)
    together = likeness > COHERENT
    together[0] = False
    low = together & (frequency < 4.0 * frequency[1])
    if not low.any():
        return None
    gain = gain / float(np.median(gain[low]))
    fallen = together & (gain < HALF_POWER)
    # not a notch, a resonance or a single bin: three in a row, and nothing above comes back
    for index in np.flatnonzero(fallen[:-2] & fallen[1:-1] & fallen[2:]):
        above = together & (frequency >= frequency[index])
        if np.all(gain[above] < 1.0):
            deepest = float(gain[above].min())
            return RollOff(float(frequency[index]), float(20.0 * np.log10(max(deepest, 1e-6))))
        break
    return None


def _spectra(values: Array) -> NDArray[np.complex128]:
    """Of windows that overlap by half (windows, frequencies)."""
    windows = sliding_window_view(values, SEGMENT)[:: SEGMENT // 2]
    spectra: NDArray[np.complex128] = np.fft.rfft(windows * np.hanning(SEGMENT), axis=1)
    return spectra

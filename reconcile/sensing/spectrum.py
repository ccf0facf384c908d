"""Detects a low pass in a channel, whose spectrum falls off where that of a raw sensor is flat."""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from kernels.arrays import Array

SEGMENT = 512
"""Samples of a window of a spectrum."""
HIGH_BAND, MIDDLE_BAND = (0.35, 0.45), (0.1, 0.2)
"""Bands, as shares of the sample rate."""
LARGEST_POWER_RATIO = 0.1
"""Largest power in the high band relative to the middle one for a channel to count as filtered."""
LEAST_COHERENCE = 0.8
"""Least coherence at which the gain between two channels is used."""
CORNER_GAIN = 0.7
"""Gain below which a frequency counts as attenuated: half power."""


class RollOff(NamedTuple):
    """A low pass: its corner, and the attenuation above (dB)."""

    corner_hz: float
    fall_db: float


def noise_roll_off(values: Array, step: float, period_s: float) -> RollOff | None:
    """Detect a low pass by the noise of a channel (n,); None where it is quantised, hence not filtered."""
    if step > 0.0 or len(values) < 4 * SEGMENT:
        return None
    frequency = np.fft.rfftfreq(SEGMENT)[1:]
    # spectrum of the differences, divided by their gain: the low frequencies of the motion leak less
    power = np.median(np.abs(_spectra(np.diff(values))) ** 2, axis=0)[1:]
    power /= 2.0 - 2.0 * np.cos(2.0 * np.pi * frequency)
    high, middle = (
        float(np.median(power[(frequency > low) & (frequency < top)]))
        for low, top in (HIGH_BAND, MIDDLE_BAND)
    )
    if not (middle > 0.0 and high < LARGEST_POWER_RATIO * middle):
        return None
    # a second-order filter of this corner would give that fall between the two bands
    f_high, f_middle = float(np.mean(HIGH_BAND)), float(np.mean(MIDDLE_BAND))
    ratio = max(high / middle, 1e-12)
    fourth = (f_middle**4 - ratio * f_high**4) / (ratio - 1.0)
    corner = max(fourth, MIDDLE_BAND[0] ** 4) ** 0.25
    return RollOff(corner / period_s, float(10.0 * np.log10(ratio)))


def transfer_roll_off(first: Array, second: Array, period_s: float) -> RollOff | None:
    """Detect a low pass of `second` against `first` (n,) where both are coherent."""
    if len(first) < 4 * SEGMENT:
        return None
    frequency = np.fft.rfftfreq(SEGMENT, period_s)
    a, b = _spectra(np.diff(first)), _spectra(np.diff(second))
    cross = np.mean(np.conj(a) * b, axis=0)
    own, other = np.mean(np.abs(a) ** 2, axis=0), np.mean(np.abs(b) ** 2, axis=0)
    gain = np.abs(cross) / np.maximum(own, 1e-300)
    coherence = np.abs(cross) ** 2 / np.maximum(own * other, 1e-300)
    coherent = coherence > LEAST_COHERENCE
    coherent[0] = False
    low = coherent & (frequency < 4.0 * frequency[1])
    if not low.any():
        return None
    gain = gain / float(np.median(gain[low]))
    attenuated = coherent & (gain < CORNER_GAIN)
    # three attenuated bins in a row and no gain above: no notch, resonance or outlier
    for index in np.flatnonzero(attenuated[:-2] & attenuated[1:-1] & attenuated[2:]):
        above = coherent & (frequency >= frequency[index])
        if np.all(gain[above] < 1.0):
            deepest = float(gain[above].min())
            return RollOff(float(frequency[index]), float(20.0 * np.log10(max(deepest, 1e-6))))
        break
    return None


def _spectra(values: Array) -> NDArray[np.complex128]:
    """Return the spectra (windows, frequencies) of Hann windows that overlap by half."""
    windows = sliding_window_view(values, SEGMENT)[:: SEGMENT // 2]
    spectra: NDArray[np.complex128] = np.fft.rfft(windows * np.hanning(SEGMENT), axis=1)
    return spectra

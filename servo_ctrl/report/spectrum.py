"""Computes the spectral density of an error by Welch's method (1967), in numpy."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from kernels.arrays import Array

WINDOW = 2048
"""Samples of a window; adjacent windows overlap by half."""


class Spectrum(NamedTuple):
    """One-sided spectral density without the mean; (n,) each."""

    frequency_hz: Array
    density_m: Array
    """Metres per square root of a hertz; the integral of its square over frequency is the mean square."""


def spectral_density(error_m: Array, cycle: NDArray[np.int64], period_s: float) -> Spectrum | None:
    """Return the density over the longest part without a gap; None if it is constant or too short."""
    part = error_m[_whole(error_m, cycle)]
    if len(part) < 2 * WINDOW or not np.ptp(part):
        return None
    frequency_hz, density_m2_hz = welch(part, 1.0 / period_s, nperseg=WINDOW)
    return Spectrum(frequency_hz[1:-1], np.sqrt(density_m2_hz[1:-1]))


def _whole(error_m: Array, cycle: NDArray[np.int64]) -> slice:
    """Return the longest sequence of finite samples in consecutive cycles."""
    good = np.isfinite(error_m)
    follows = np.concatenate(([False], good[1:] & good[:-1] & (np.diff(cycle) == 1)))
    starts = np.flatnonzero(good & ~follows)
    ends = np.flatnonzero(good & ~np.append(follows[1:], False))
    if not len(starts):
        return slice(0, 0)
    longest = int(np.argmax(ends - starts))
    return slice(int(starts[longest]), int(ends[longest]) + 1)

"""Spectra of a residual over time (Hz) or over turns of the screw (cycles a turn).

A spectrum over turns is that of the residual times the speed, so that every stretch of travel has the same
weight however long the axis was there (order tracking). Samples are summed on a grid of the abscissa, fine
enough for the highest cycles of a band.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import maximum_filter1d, median_filter

from kernels.arrays import Array, Index
from reconcile.regression.filter_ends import FILTER_HZ

Complex = NDArray[np.complex128]
GRID_PER_CYCLE = 6
"""Grid points in the shortest period."""
ZERO_PADDING = 2
"""Length of the transform over that of the longest recording."""
LEAST_SAMPLE_SHARE = 0.05
"""Least share of samples so slow that the line passes the state filter; chosen."""
MOTION_PEAK_RATIO, MOTION_NEIGHBOURS = 8.0, 101
"""Height of a peak of the motion's own spectrum over the median of so many points around it; chosen."""


class Track(NamedTuple):
    """The signal of one recording over time or over the travel; arrays (m,)."""

    values: Array
    abscissa: Array
    """Time (s) or turns of the screw."""
    weight: Array
    """Speed (turns/s) where the abscissa is in turns, else 1."""
    rate_1_s: Array
    """Speed of the abscissa; times cycles per unit of it, the frequency (Hz) that the state filter sees."""
    block: Index


class Band(NamedTuple):
    """A band of cycles per unit of the abscissa."""

    low: float
    high: float


class Spectrum(NamedTuple):
    """An amplitude spectrum; arrays (points,)."""

    cycles: Array
    amplitude: Array
    """Root mean square over the recordings."""


def octaves(lowest: float, highest: float) -> list[Band]:
    """Bands of a factor of two from `lowest` to `highest`."""
    count = max(math.ceil(math.log2(highest / lowest)), 1) if highest > lowest else 0
    return [Band(lowest * 2.0**i, min(lowest * 2.0 ** (i + 1), highest)) for i in range(count)]


def spectrum(tracks: Sequence[Track], bands: Sequence[Band]) -> Spectrum:
    """The amplitude spectrum of the tracks in `bands`.

    Each amplitude is multiplied by the root of the share of samples that are slow enough to show it, so that
    noise has the same height at all cycles.
    """
    longest = longest_length(tracks)
    cycles, amplitudes = [np.empty(0)], [np.empty(0)]
    for band in bands if longest > 0.0 else ():
        transforms = band_transforms(tracks, band, longest, folds=1)
        if not transforms.shows_enough_of(tracks):
            continue
        sums, weights, counts = transforms.sums, transforms.weights, transforms.counts
        by_fold = np.where(weights > 0.0, 2.0 * np.abs(sums) / np.maximum(weights, 1e-300), 0.0)
        slow_share = counts[:, 0] / np.array([[max(len(track.values), 1)] for track in tracks])
        cycles.append(transforms.cycles)
        amplitudes.append(np.sqrt((slow_share * by_fold[:, 0] ** 2).mean(axis=0)))
    return Spectrum(np.concatenate(cycles), np.concatenate(amplitudes))


def motion_frequencies_hz(speed: Array, period_s: float) -> Array:
    """Frequencies (Hz) of the motion itself: effects that repeat with it show over another coordinate."""
    size = next_fast_len(len(speed) * ZERO_PADDING)
    is_peak = np.zeros(size // 2 + 1, dtype=np.bool_)
    for signal in (speed, np.sign(speed)):
        height = np.abs(rfft(signal - signal.mean(), size))
        is_peak |= height > MOTION_PEAK_RATIO * median_filter(height, MOTION_NEIGHBOURS, mode="nearest")
    is_near_peak = maximum_filter1d(is_peak.astype(np.int8), 2 * ZERO_PADDING + 1) > 0
    return np.flatnonzero(is_near_peak) / (size * period_s)


def longest_length(tracks: Sequence[Track]) -> float:
    """Length of the longest track; 0 without any sample."""
    return max((float(np.ptp(track.abscissa)) for track in tracks if len(track.abscissa)), default=0.0)


class BandTransforms(NamedTuple):
    """Fourier transforms of the tracks in one band, by recording and fold."""

    sums: Complex
    """(recordings, folds, cycles)."""
    weights: Array
    """Sum of the weights, (recordings, folds, 1)."""
    counts: Array
    """Samples slow enough to pass the state filter, (recordings, folds, 1)."""
    cycles: Array

    def shows_enough_of(self, tracks: Sequence[Track]) -> bool:
        """Whether enough of the samples pass the state filter."""
        samples = sum(len(track.values) for track in tracks)
        return bool(self.counts.sum() >= LEAST_SAMPLE_SHARE * samples)


def band_transforms(tracks: Sequence[Track], band: Band, longest: float, folds: int) -> BandTransforms:
    """Transform the tracks in a band, each fold of blocks by itself; `longest`: of all tracks."""
    step = 1.0 / (GRID_PER_CYCLE * band.high)
    size = next_fast_len(math.ceil(longest / step * ZERO_PADDING) + 1)
    first, end = math.floor(band.low * size * step), math.ceil(band.high * size * step)
    sums = np.zeros((len(tracks), folds, end - first), dtype=np.complex128)
    weights, counts = np.zeros((len(tracks), folds, 1)), np.zeros((len(tracks), folds, 1))
    for number, track in enumerate(tracks):
        if not len(track.abscissa):  # no sample is in use
            continue
        slow = track.rate_1_s * band.low < FILTER_HZ  # the state filter removes higher frequencies
        grid_point = np.rint((track.abscissa[slow] - track.abscissa.min()) / step).astype(np.int64)
        fold, weight = track.block[slow] % folds, track.weight[slow]
        weighted = weight * track.values[slow]
        for k in range(folds):
            in_fold = fold == k
            if in_fold.any():
                grid = np.bincount(grid_point[in_fold], weighted[in_fold], size)
                sums[number, k] = rfft(grid.astype(np.float32))[first:end]
                weights[number, k], counts[number, k] = weight[in_fold].sum(), in_fold.sum()
    return BandTransforms(sums, weights, counts, np.arange(first, end) / (size * step))

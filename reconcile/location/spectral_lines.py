"""Spectral lines of a residual, over time (Hz) or over turns of the screw (cycles a turn).

A spectrum over turns is that of the residual times the speed, so that every stretch of travel has the same
weight however long the axis was there. A line is chosen on three folds of blocks and validated on the fourth,
in turn, because the best of thousands of lines explains noise in the blocks that it was chosen on. Each
recording has phases of its own, because encoders may be re-zeroed between recordings.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import maximum_filter1d, median_filter

from kernels.arrays import Array, Index
from reconcile.location.explained_share import significance
from reconcile.regression.regression_data import FILTER_HZ

Complex = NDArray[np.complex128]
FOLDS = 4
GRID_PER_CYCLE = 6
"""Grid points in the shortest period."""
FEWEST_CYCLES = 2.5
"""Least number of periods in the longest recording."""
ZERO_PADDING = 2
"""Length of the transform over that of the longest recording."""
MOST_LINES = 3
LEAST_SAMPLE_SHARE = 0.05
"""Least share of samples so slow that the line passes the state filter."""
LEAST_STANDARD_ERRORS = 4.0
"""Least mean gain over the blocks, in its standard errors; high, because thousands of lines are tried."""
MOTION_PEAK_RATIO = 8.0
"""Height of a peak of the motion's own spectrum over the median of its 101 neighbours."""


class Track(NamedTuple):
    """The signal of one recording over a place; arrays (m,)."""

    values: Array
    place: Array
    """Time (s) or screw turns."""
    weight: Array
    """Speed (turns/s) where `place` is in turns, else 1."""
    rate: Array
    """Times cycles per place: the frequency (Hz) at which a line passes."""
    block: Index


class Line(NamedTuple):
    """A line: `cycles` per place, amplitude, and the share of all recordings' variance that it explains."""

    cycles: float
    width: float
    """Resolution: 1 over the longest recording."""
    amplitude: float
    share: float


def lines(tracks: Sequence[Track], bands: Sequence[tuple[float, float]], skip: Sequence[Array]) -> list[Line]:
    """Find the lines, the strongest first. `bands`: cycles per place; `skip`: by band, cycles left out."""
    total = sum(float(track.values @ track.values) for track in tracks)
    longest = max(float(np.ptp(track.place)) if len(track.place) else 0.0 for track in tracks)
    residual_tracks = list(tracks)
    found: list[Line] = []
    while len(found) < MOST_LINES and total > 0.0 and longest > 0.0:
        cycles_tried = _best_by_fold(residual_tracks, bands, skip, longest, [line.cycles for line in found])
        if not cycles_tried:
            break
        gains = _cross_validated_gains(residual_tracks, cycles_tried)
        if significance(gains) < LEAST_STANDARD_ERRORS:
            break
        cycles = _refine(residual_tracks, max(set(cycles_tried), key=cycles_tried.count), 0.25 / longest)
        residual_tracks, amplitude = _subtract_line(residual_tracks, cycles)
        found.append(Line(cycles, 1.0 / longest, amplitude, float(gains.sum()) / total))
    return found


def octaves(lowest: float, highest: float) -> list[tuple[float, float]]:
    """Bands of a factor of two from `lowest` to `highest`."""
    count = max(math.ceil(math.log2(highest / lowest)), 1) if highest > lowest else 0
    return [(lowest * 2.0**i, min(lowest * 2.0 ** (i + 1), highest)) for i in range(count)]


def spectrum(tracks: Sequence[Track], bands: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    """Cycles per place, and the amplitude of each (root mean square over the recordings).

    Each is multiplied by the root of the share of samples that are slow enough to show it, so that noise has
    the same height at all cycles.
    """
    longest = max((float(np.ptp(track.place)) for track in tracks if len(track.place)), default=0.0)
    cycles_tried, heights = [np.empty(0)], [np.empty(0)]
    for low, high in bands:
        if longest <= 0.0:
            break
        sums, weights, counts, cycles = _transforms(tracks, low, high, longest, folds=1)
        if counts.sum() < LEAST_SAMPLE_SHARE * sum(len(track.values) for track in tracks):
            continue
        level = np.where(weights > 0.0, 2.0 * np.abs(sums) / np.maximum(weights, 1e-300), 0.0)
        cycles_tried.append(cycles)
        part = counts[:, 0] / np.array([[max(len(track.values), 1)] for track in tracks])
        heights.append(np.sqrt((part * level[:, 0] ** 2).mean(axis=0)))
    return np.concatenate(cycles_tried), np.concatenate(heights)


def motion_frequencies_hz(speed: Array, period_s: float) -> Array:
    """Frequencies (Hz) of the motion itself: effects that repeat with it show over another coordinate."""
    size = next_fast_len(len(speed) * ZERO_PADDING)
    in_motion = np.zeros(size // 2 + 1, dtype=np.bool_)
    for of in (speed, np.sign(speed)):
        height = np.abs(rfft(of - of.mean(), size))
        in_motion |= height > MOTION_PEAK_RATIO * median_filter(height, 101, mode="nearest")
    near = maximum_filter1d(in_motion.astype(np.int8), 2 * ZERO_PADDING + 1) > 0
    return np.flatnonzero(near) / (size * period_s)


def _transforms(
    tracks: Sequence[Track], low: float, high: float, longest: float, folds: int
) -> tuple[Complex, Array, Array, Array]:
    """Sums (recordings, folds, cycles), weights and sample counts (recordings, folds, 1), cycles."""
    step = 1.0 / (GRID_PER_CYCLE * high)
    size = next_fast_len(math.ceil(longest / step * ZERO_PADDING) + 1)
    first, last = math.floor(low * size * step), math.ceil(high * size * step)
    sums = np.zeros((len(tracks), folds, last - first), dtype=np.complex128)
    weights, counts = np.zeros((len(tracks), folds, 1)), np.zeros((len(tracks), folds, 1))
    for r, track in enumerate(tracks):
        if not len(track.place):  # all of it was set aside
            continue
        slow_enough = track.rate * low < FILTER_HZ  # the state filter removes what passes faster
        where = np.rint((track.place[slow_enough] - track.place.min()) / step).astype(np.int64)
        fold, weight = track.block[slow_enough] % folds, track.weight[slow_enough]
        weighted = weight * track.values[slow_enough]
        for k in range(folds):
            own = fold == k
            if own.any():
                grid = np.bincount(where[own], weighted[own], size)
                sums[r, k] = rfft(grid.astype(np.float32))[first:last]
                weights[r, k], counts[r, k] = weight[own].sum(), own.sum()
    return sums, weights, counts, np.arange(first, last) / (size * step)


def _best_by_fold(
    tracks: Sequence[Track],
    bands: Sequence[tuple[float, float]],
    skip: Sequence[Array],
    longest: float,
    found_before: Sequence[float],
) -> list[float]:
    """The line that explains most of the other folds, by fold."""
    best = [(0.0, 0.0)] * FOLDS
    for (low, high), excluded in zip(bands, skip, strict=True):
        if high * longest < FEWEST_CYCLES:
            continue
        sums, weights, counts, cycles_tried = _transforms(
            tracks, max(low, FEWEST_CYCLES / longest), high, longest, FOLDS
        )
        if counts.sum() < LEAST_SAMPLE_SHARE * sum(len(track.values) for track in tracks):
            continue
        allowed = np.ones(len(cycles_tried), dtype=np.bool_)
        for cycles in (*excluded, *found_before):
            allowed &= np.abs(cycles_tried - cycles) > 1.0 / longest
        for k in range(FOLDS):
            others = sums.sum(axis=1) - sums[:, k]
            weight, count = (of.sum(axis=1) - of[:, k] for of in (weights, counts))
            explained = 2.0 * count * (np.abs(others) / np.maximum(weight, 1e-300)) ** 2
            power = np.where(allowed, explained.sum(axis=0), 0.0)
            if len(power) and power.max() > best[k][0]:
                best[k] = (float(power.max()), float(cycles_tried[int(power.argmax())]))
    return [cycles for power, cycles in best if power > 0.0]


def _cross_validated_gains(tracks: Sequence[Track], cycles_tried: Sequence[float]) -> Array:
    """Reduction of each block's squares by the line chosen without its fold, over all recordings."""
    gains = []
    for track in tracks:
        fits = {cycles: _normal_equations(track, cycles) for cycles in set(cycles_tried)}
        for k, cycles in enumerate(cycles_tried):
            gram, right = fits[cycles]
            own = np.arange(len(right)) % FOLDS == k
            theta = _amplitudes(gram[~own].sum(axis=0), right[~own].sum(axis=0))
            gains.append(2.0 * right[own] @ theta - gram[own] @ theta @ theta)
    return np.concatenate(gains)


def _refine(tracks: Sequence[Track], cycles: float, step: float) -> float:
    """Vertex of the parabola through the explained squares at `cycles` and at `step` to either side."""
    powers = []
    for near in (cycles - step, cycles, cycles + step):
        sums = [[of.sum(axis=0) for of in _normal_equations(track, near)] for track in tracks]
        powers.append(sum(float(right @ _amplitudes(gram, right)) for gram, right in sums))
    bend = powers[0] - 2.0 * powers[1] + powers[2]
    if bend >= 0.0:
        return cycles
    return cycles + step * float(np.clip(0.5 * (powers[0] - powers[2]) / bend, -1.0, 1.0))


def _normal_equations(track: Track, cycles: float) -> tuple[Array, Array]:
    """Normal equations of a cosine and a sine by block: (blocks, 2, 2) and (blocks, 2)."""
    c, s = _cosine_and_sine(track, cycles)
    cc, cs, ss, cv, sv = (
        np.bincount(track.block, of) for of in (c * c, c * s, s * s, c * track.values, s * track.values)
    )
    gram = np.stack((cc, cs, cs, ss), axis=1, dtype=np.float64).reshape(-1, 2, 2)
    return gram, np.stack((cv, sv), axis=1)


def _cosine_and_sine(track: Track, cycles: float) -> tuple[Array, Array]:
    """Cosine and sine (m,); 0 where they pass faster than the state filter."""
    angle, slow = 2.0 * math.pi * cycles * track.place, track.rate * cycles < FILTER_HZ
    return np.cos(angle) * slow, np.sin(angle) * slow


def _amplitudes(gram: Array, right: Array) -> Array:
    return np.linalg.solve(gram + np.eye(2) * (1e-9 * np.trace(gram) + 1e-300), right)


def _subtract_line(tracks: Sequence[Track], cycles: float) -> tuple[list[Track], float]:
    """The tracks less the line, and its amplitude (root mean square over the recordings)."""
    residual_tracks, amplitudes = [], []
    for track in tracks:
        gram, right = _normal_equations(track, cycles)
        theta = _amplitudes(gram.sum(axis=0), right.sum(axis=0))
        c, s = _cosine_and_sine(track, cycles)
        fitted = theta[0] * c + theta[1] * s
        residual_tracks.append(track._replace(values=track.values - fitted))
        amplitudes.append(math.hypot(*theta))
    return residual_tracks, math.sqrt(float(np.mean(np.square(amplitudes))))

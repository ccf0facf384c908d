"""Lines of a difference: what repeats so often a second, a turn, a pole pair or a grating period.

The spectrum over a way is taken of the force or deviation times the speed, so that every stretch of the way
counts alike however long the axis was there. A line is chosen on three quarters of the blocks and judged on
the last, in turn: what wins by chance among thousands of lines explains nothing there. Each recording has
phases of its own, for encoders are zeroed anew.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import maximum_filter1d, median_filter

from reconcile.locate_share import significance
from reconcile.scenes import FILTER_HZ

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Complex = NDArray[np.complex128]
    Index = NDArray[np.int64]

FOLDS = 4
FINE = 6
"""Places of the grid in the shortest wave."""
FEWEST_WAVES = 2.5
"""A line must repeat so often in the longest recording."""
OVERSAMPLED = 2
MOST_LINES = 3
SEEN = 0.05
"""Share of the samples that must be slow enough for a wave to be seen."""
SURE = 4.0
"""Mean gain of a line over the blocks, in standard errors: the lines are many."""
OF_THE_MOTION = 8.0
"""Times the median about it: a frequency that the motion itself has."""


class Track(NamedTuple):
    """What lines of one recording are found from; all (m,)."""

    values: Array
    place: Array
    """Seconds, or turns."""
    weight: Array
    """Speed where `place` is a way, else 1."""
    rate: Array
    """Places a second: how fast a wave goes by."""
    block: Index


class Line(NamedTuple):
    """One line: `wave` a place, its amplitude, and the share it explains of all recordings."""

    wave: float
    width: float
    """Of the resolution."""
    amplitude: float
    share: float


def lines(tracks: Sequence[Track], bands: Sequence[tuple[float, float]], skip: Sequence[Array]) -> list[Line]:
    """The strongest first. `bands`: ranges of waves a place; `skip`: by band, waves not looked at."""
    total = sum(float(track.values @ track.values) for track in tracks)
    reach = max(float(np.ptp(track.place)) if len(track.place) else 0.0 for track in tracks)
    left = list(tracks)
    found: list[Line] = []
    while len(found) < MOST_LINES and total > 0.0 and reach > 0.0:
        waves = _chosen(left, bands, skip, reach, [line.wave for line in found])
        if not waves:
            break
        gains = _gains(left, waves)
        if significance(gains) < SURE:
            break
        wave = _refined(left, max(set(waves), key=waves.count), 0.25 / reach)
        left, amplitude = _without(left, wave)
        found.append(Line(wave, 1.0 / reach, amplitude, float(gains.sum()) / total))
    return found


def octaves(lowest: float, highest: float) -> list[tuple[float, float]]:
    """Bands of a factor two, from one to the other."""
    count = max(math.ceil(math.log2(highest / lowest)), 1) if highest > lowest else 0
    return [(lowest * 2.0**i, min(lowest * 2.0 ** (i + 1), highest)) for i in range(count)]


def spectrum(tracks: Sequence[Track], bands: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    """Amplitudes (root of their mean square over the recordings) over waves a place.

    Each is weighted with the root of the part of the samples that are slow enough to show it: what it is
    worth in the whole, and noise is alike over all waves.
    """
    reach = max((float(np.ptp(track.place)) for track in tracks if len(track.place)), default=0.0)
    waves, heights = [np.empty(0)], [np.empty(0)]
    for low, high in bands:
        if reach <= 0.0:
            break
        sums, weights, counts, wave = _transforms(tracks, low, high, reach, folds=1)
        if counts.sum() < SEEN * sum(len(track.values) for track in tracks):
            continue
        level = np.where(weights > 0.0, 2.0 * np.abs(sums) / np.maximum(weights, 1e-300), 0.0)
        waves.append(wave)
        part = counts[:, 0] / np.array([[max(len(track.values), 1)] for track in tracks])
        heights.append(np.sqrt((part * level[:, 0] ** 2).mean(axis=0)))
    return np.concatenate(waves), np.concatenate(heights)


def of_the_motion(speed: Array, period_s: float) -> Array:
    """Frequencies (Hz) that the motion has itself: what repeats with it is told better elsewhere."""
    size = next_fast_len(len(speed) * OVERSAMPLED)
    busy = np.zeros(size // 2 + 1, dtype=np.bool_)
    for of in (speed, np.sign(speed)):
        height = np.abs(rfft(of - of.mean(), size))
        busy |= height > OF_THE_MOTION * median_filter(height, 101, mode="nearest")
    near = maximum_filter1d(busy.astype(np.int8), 2 * OVERSAMPLED + 1) > 0
    return np.flatnonzero(near) / (size * period_s)


def _transforms(
    tracks: Sequence[Track], low: float, high: float, reach: float, folds: int
) -> tuple[Complex, Array, Array, Array]:
    """Sums (recordings, folds, waves), weights and numbers of samples (recordings, folds, 1), waves."""
    step = 1.0 / (FINE * high)
    size = next_fast_len(math.ceil(reach / step * OVERSAMPLED) + 1)
    first, last = math.floor(low * size * step), math.ceil(high * size * step)
    sums = np.zeros((len(tracks), folds, last - first), dtype=np.complex128)
    weights, counts = np.zeros((len(tracks), folds, 1)), np.zeros((len(tracks), folds, 1))
    for r, track in enumerate(tracks):
        seen = track.rate * low < FILTER_HZ  # what goes by faster, the filter has taken away
        where = np.rint((track.place[seen] - track.place.min()) / step).astype(np.int64)
        fold, weight = track.block[seen] % folds, track.weight[seen]
        weighted = weight * track.values[seen]
        for k in range(folds):
            own = fold == k
            if own.any():
                grid = np.bincount(where[own], weighted[own], size)
                sums[r, k] = rfft(grid.astype(np.float32))[first:last]
                weights[r, k], counts[r, k] = weight[own].sum(), own.sum()
    return sums, weights, counts, np.arange(first, last) / (size * step)


def _chosen(
    tracks: Sequence[Track],
    bands: Sequence[tuple[float, float]],
    skip: Sequence[Array],
    reach: float,
    known: Sequence[float],
) -> list[float]:
    """By fold, the line that explains most of the other folds."""
    best = [(0.0, 0.0)] * FOLDS
    for (low, high), barred in zip(bands, skip, strict=True):
        if high * reach < FEWEST_WAVES:
            continue
        sums, weights, counts, waves = _transforms(tracks, max(low, FEWEST_WAVES / reach), high, reach, FOLDS)
        if counts.sum() < SEEN * sum(len(track.values) for track in tracks):
            continue
        free = np.ones(len(waves), dtype=np.bool_)
        for wave in (*barred, *known):
            free &= np.abs(waves - wave) > 1.0 / reach
        for k in range(FOLDS):
            others = sums.sum(axis=1) - sums[:, k]
            weight, count = (of.sum(axis=1) - of[:, k] for of in (weights, counts))
            explained = 2.0 * count * (np.abs(others) / np.maximum(weight, 1e-300)) ** 2
            power = np.where(free, explained.sum(axis=0), 0.0)
            if len(power) and power.max() > best[k][0]:
                best[k] = (float(power.max()), float(waves[int(power.argmax())]))
    return [wave for power, wave in best if power > 0.0]


def _gains(tracks: Sequence[Track], waves: Sequence[float]) -> Array:
    """What the lines chosen without a fold take off the squares of its blocks, over all recordings."""
    gains = []
    for track in tracks:
        fits = {wave: _sums(track, wave) for wave in set(waves)}
        for k, wave in enumerate(waves):
            gram, right = fits[wave]
            own = np.arange(len(right)) % FOLDS == k
            theta = _solved(gram[~own].sum(axis=0), right[~own].sum(axis=0))
            gains.append(2.0 * right[own] @ theta - gram[own] @ theta @ theta)
    return np.concatenate(gains)


def _refined(tracks: Sequence[Track], wave: float, step: float) -> float:
    """The top of the parabola through what a wave and its neighbours explain."""
    powers = []
    for near in (wave - step, wave, wave + step):
        sums = [_sums(track, near) for track in tracks]
        right = [of.sum(axis=0) for _, of in sums]
        powers.append(
            sum(float(r @ _solved(g.sum(axis=0), r)) for (g, _), r in zip(sums, right, strict=True))
        )
    bend = powers[0] - 2.0 * powers[1] + powers[2]
    return (
        wave + step * float(np.clip(0.5 * (powers[0] - powers[2]) / bend, -1.0, 1.0)) if bend < 0.0 else wave
    )


def _sums(track: Track, wave: float) -> tuple[Array, Array]:
    """Normal equations by block of a cosine and a sine."""
    c, s = _waves(track, wave)
    cc, cs, ss, cv, sv = (
        np.bincount(track.block, of) for of in (c * c, c * s, s * s, c * track.values, s * track.values)
    )
    gram = np.stack((cc, cs, cs, ss), axis=1, dtype=np.float64).reshape(-1, 2, 2)
    return gram, np.stack((cv, sv), axis=1)


def _waves(track: Track, wave: float) -> tuple[Array, Array]:
    """Cosine and sine; nothing where they go by so fast that the filter takes them away."""
    angle, slow = 2.0 * math.pi * wave * track.place, track.rate * wave < FILTER_HZ
    return np.cos(angle) * slow, np.sin(angle) * slow


def _solved(gram: Array, right: Array) -> Array:
    return np.linalg.solve(gram + np.eye(2) * (1e-9 * np.trace(gram) + 1e-300), right)


def _without(tracks: Sequence[Track], wave: float) -> tuple[list[Track], float]:
    """The tracks less the line, and its amplitude (root of its mean square over the recordings)."""
    left, amplitudes = [], []
    for track in tracks:
        gram, right = _sums(track, wave)
        theta = _solved(gram.sum(axis=0), right.sum(axis=0))
        c, s = _waves(track, wave)
        fitted = theta[0] * c + theta[1] * s
        left.append(track._replace(values=track.values - fitted))
        amplitudes.append(math.hypot(*theta))
    return left, math.sqrt(float(np.mean(np.square(amplitudes))))

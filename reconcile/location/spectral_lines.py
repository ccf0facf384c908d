"""Spectral lines of a residual, over time (Hz) or over turns of the screw (cycles a turn).

A line is chosen on three folds of blocks and validated on the fourth,
in turn, because the best of thousands of lines explains noise in the blocks that it was chosen on. Each
recording has its own phase of a line, because encoders may be re-zeroed between recordings.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.location.explained_share import mean_over_error
from reconcile.location.spectra import Band, Track, band_transforms, longest_length
from reconcile.regression.filter_ends import FILTER_HZ

FOLDS = 4
FEWEST_CYCLES = 2.5
"""Least number of periods in the longest recording; chosen."""
MOST_LINES = 3
"""Lines of a residual: bounds the time; chosen."""
LEAST_T = 4.0
"""Least mean gain over the blocks, in its standard errors; high, because thousands of lines are tried."""
REFINEMENT_STEP = 0.25
"""Distance of the points of a parabola through the peak of a line, in resolutions."""


class SpectralLine(NamedTuple):
    """A line of a spectrum, in cycles per unit of the abscissa."""

    cycles: float
    width: float
    """Resolution: 1 over the longest recording."""
    amplitude: float
    share: float
    """Of the variance of all recordings, cross-validated."""


def find_lines(
    tracks: Sequence[Track], bands: Sequence[Band], excluded: Sequence[Array]
) -> list[SpectralLine]:
    """Find the lines, the strongest first; `excluded`: by band, cycles at which none is sought."""
    total_squares = sum(float(track.values @ track.values) for track in tracks)
    longest = longest_length(tracks)
    residual_tracks = list(tracks)
    lines: list[SpectralLine] = []
    while len(lines) < MOST_LINES and total_squares > 0.0 and longest > 0.0:
        cycles_by_fold = _best_by_fold(
            residual_tracks, bands, excluded, longest, [line.cycles for line in lines]
        )
        if not cycles_by_fold:
            break
        gains = _cross_validated_gains(residual_tracks, cycles_by_fold)
        if mean_over_error(gains) < LEAST_T:
            break
        most_frequent = max(set(cycles_by_fold), key=cycles_by_fold.count)
        cycles = _refined_cycles(residual_tracks, most_frequent, REFINEMENT_STEP / longest)
        amplitude = _amplitude(residual_tracks, cycles)
        residual_tracks = [_without_line(track, cycles) for track in residual_tracks]
        lines.append(SpectralLine(cycles, 1.0 / longest, amplitude, float(gains.sum()) / total_squares))
    return lines


def _best_by_fold(
    tracks: Sequence[Track],
    bands: Sequence[Band],
    excluded: Sequence[Array],
    longest: float,
    previous: Sequence[float],
) -> list[float]:
    """Cycles of the line that explains most of the other folds, by fold; without a line, fewer.

    `previous`: cycles of the lines that were subtracted before.
    """
    best_power, best_cycles = [0.0] * FOLDS, [0.0] * FOLDS
    for band, excluded_cycles in zip(bands, excluded, strict=True):
        if band.high * longest < FEWEST_CYCLES:
            continue
        observable = band._replace(low=max(band.low, FEWEST_CYCLES / longest))
        transforms = band_transforms(tracks, observable, longest, FOLDS)
        if not transforms.shows_enough_of(tracks):
            continue
        sums, weights, counts, cycles = transforms
        is_allowed = np.ones(len(cycles), dtype=np.bool_)
        for near in (*excluded_cycles, *previous):
            is_allowed &= np.abs(cycles - near) > 1.0 / longest
        for k in range(FOLDS):
            of_others = sums.sum(axis=1) - sums[:, k]
            weight, count = (of.sum(axis=1) - of[:, k] for of in (weights, counts))
            explained = 2.0 * count * (np.abs(of_others) / np.maximum(weight, 1e-300)) ** 2
            power = np.where(is_allowed, explained.sum(axis=0), 0.0)
            if len(power) and power.max() > best_power[k]:
                best_power[k], best_cycles[k] = float(power.max()), float(cycles[int(power.argmax())])
    return [cycles for power, cycles in zip(best_power, best_cycles, strict=True) if power > 0.0]


def _cross_validated_gains(tracks: Sequence[Track], cycles_by_fold: Sequence[float]) -> Array:
    """Reduction of each block's squares by the line chosen without its fold, over all recordings."""
    gains = []
    for track in tracks:
        equations = {cycles: _normal_equations(track, cycles) for cycles in set(cycles_by_fold)}
        for k, cycles in enumerate(cycles_by_fold):
            gram, right_side = equations[cycles]
            held_out = np.arange(len(right_side)) % FOLDS == k
            theta = _solve(gram[~held_out].sum(axis=0), right_side[~held_out].sum(axis=0))
            gains.append(2.0 * right_side[held_out] @ theta - gram[held_out] @ theta @ theta)
    return np.concatenate(gains)


def _refined_cycles(tracks: Sequence[Track], cycles: float, step: float) -> float:
    """Vertex of the parabola through the explained squares at `cycles` and at `step` to either side."""
    powers = []
    for near in (cycles - step, cycles, cycles + step):
        totals = [_normal_equations(track, near).total() for track in tracks]
        powers.append(sum(float(right_side @ _solve(gram, right_side)) for gram, right_side in totals))
    curvature = powers[0] - 2.0 * powers[1] + powers[2]
    if curvature >= 0.0:
        return cycles
    return cycles + step * float(np.clip(0.5 * (powers[0] - powers[2]) / curvature, -1.0, 1.0))


class _LineEquations(NamedTuple):
    """Normal equations of a cosine and a sine, by block or in total."""

    gram: Array
    """(blocks, 2, 2)."""
    right_side: Array
    """(blocks, 2)."""

    def total(self) -> "_LineEquations":
        """Those of all blocks, (2, 2) and (2,)."""
        return _LineEquations(self.gram.sum(axis=0), self.right_side.sum(axis=0))


def _normal_equations(track: Track, cycles: float) -> _LineEquations:
    c, s = _cosine_and_sine(track, cycles)
    cc, cs, ss, cv, sv = (
        np.bincount(track.block, of) for of in (c * c, c * s, s * s, c * track.values, s * track.values)
    )
    gram = np.stack((cc, cs, cs, ss), axis=1, dtype=np.float64).reshape(-1, 2, 2)
    return _LineEquations(gram, np.stack((cv, sv), axis=1))


def _cosine_and_sine(track: Track, cycles: float) -> tuple[Array, Array]:
    """Cosine and sine (m,); 0 where their frequency is above that of the state filter."""
    angle, slow = 2.0 * math.pi * cycles * track.abscissa, track.rate_1_s * cycles < FILTER_HZ
    return np.cos(angle) * slow, np.sin(angle) * slow


def _solve(gram: Array, right_side: Array) -> Array:
    """Amplitudes of cosine and sine (2,), with a ridge for tracks that determine neither."""
    return np.linalg.solve(gram + np.eye(2) * (1e-9 * np.trace(gram) + 1e-300), right_side)


def _amplitude(tracks: Sequence[Track], cycles: float) -> float:
    """Amplitude of a line, root mean square over the recordings."""
    amplitudes = [math.hypot(*_solve(*_normal_equations(track, cycles).total())) for track in tracks]
    return math.sqrt(float(np.mean(np.square(amplitudes))))


def _without_line(track: Track, cycles: float) -> Track:
    theta = _solve(*_normal_equations(track, cycles).total())
    c, s = _cosine_and_sine(track, cycles)
    return track._replace(values=track.values - (theta[0] * c + theta[1] * s))

"""Checks of one channel: quantisation step, noise, and values that are held, clipped or frozen."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, rms

LARGEST_GRID_ERROR = 0.05
"""Largest RMS distance from multiples of the step, in steps, of quantised values; it is 0.29 for others."""
LARGEST_DRIFT = 0.2
"""The same of all levels from the first; digits of a file make it larger. Chosen."""
NEAR_STEPS = 20.0
"""Distance up to which a first step is precise enough to count the steps in it, and the factor by which the
reach grows with each finer one."""
WINDOW_SAMPLES = 64
"""Length of the windows over which noise and holds are computed."""
LEAST_CHANGE_STEPS = 4.0
"""Least median change in quantisation steps; slower channels repeat values without being held."""
LEAST_REPEATED_SHARE = 0.3
"""Least share of repeated values in a window of a held channel."""
LONGEST_HOLD_SAMPLES = 50
"""Longer runs of one value are standstills, not holds."""
FEWEST_CLIPPED = 10
"""Least number of samples at a clipped extreme."""
LEAST_CLIPPED_RUN = 3.0
"""Least mean number of consecutive samples at a clipped extreme."""
CLIPPED_RATIO = 5.0
"""Least ratio of samples at a clipped extreme to those in the band beside it; a sine's peak has 2.4."""
BAND_SHARE = 0.005
"""Width of that band, share of the range of the channel."""


class Clip(NamedTuple):
    """A clipped extreme."""

    level: float
    samples: int
    first: int
    """Index of the first such sample."""
    last: int


def quantum(values: Array) -> float:
    """Return the quantisation step of values (n,); 0 where they are not quantised."""
    levels = np.unique(values)
    if len(levels) < 4:
        return 0.0
    distance = np.diff(levels)
    # differences below the floating-point resolution are rounding
    resolvable = 1e-9 * float(np.ptp(levels)) + 8.0 * float(np.spacing(np.abs(levels).max()))
    distance = distance[distance > resolvable]
    if len(distance) < 3:
        return 0.0
    step = float(np.percentile(distance, 1.0, method="lower"))
    for _ in range(3):
        multiples = np.maximum(np.rint(distance / step), 1.0)
        near = multiples <= NEAR_STEPS  # farther away an error of the step could reach one whole step
        step = float(np.sum(distance[near] * multiples[near]) / np.sum(multiples[near] ** 2))
    if _off_grid(distance[near] / step) >= LARGEST_GRID_ERROR or near.sum() < 3:
        return 0.0
    # an axis at constant speed has even distances too, but its levels drift off any grid
    return step if _distance_from_grid(levels, step) < LARGEST_DRIFT else 0.0


def is_on_grid(values: Array, step: float) -> bool:
    """Return whether values (n,) are all multiples of a given step apart."""
    return _off_grid((values - values[0]) / step) < LARGEST_GRID_ERROR


def _off_grid(places: Array) -> float:
    """Return the RMS distance of places (n,), in steps, from whole numbers."""
    return rms(places - np.rint(places))


def _distance_from_grid(levels: Array, step: float) -> float:
    """Return the RMS distance of sorted levels (n,) from multiples of the step, fitted to them, in steps."""
    places, reach = levels - levels[0], NEAR_STEPS
    while True:
        near = places <= reach * step
        counts = np.rint(places[near] / step)
        step = float(places[near] @ counts / max(counts @ counts, 1.0)) or step
        if near.all():
            return _off_grid(places / step)
        reach *= NEAR_STEPS


def noise(values: Array, step: float) -> float:
    """Return the RMS white noise of values (n,), from the fourth difference, which removes smooth motion.

    The median over windows excludes reversals and standstills; at least the quantisation noise.
    """
    fourth = np.diff(values, 4)
    windows = fourth[: len(fourth) // WINDOW_SAMPLES * WINDOW_SAMPLES].reshape(-1, WINDOW_SAMPLES)
    # the binomial coefficients of the fourth difference, squared, add up to 70
    rms = float(np.median(np.sqrt(np.mean(windows**2, axis=1)))) / math.sqrt(70.0) if len(windows) else 0.0
    return max(rms, step / math.sqrt(12.0))


def hold_samples(values: Array, step: float) -> float:
    """Return for how many samples on average values (n,) are held although the channel changes; 1 without.

    Such a channel is sampled more slowly than it is recorded.
    """
    change = np.diff(values)
    count = len(change) // WINDOW_SAMPLES
    windows = change[: count * WINDOW_SAMPLES].reshape(count, WINDOW_SAMPLES)
    size = np.abs(windows)
    new = size > 0.0
    changes = new.sum(axis=1)
    usable = changes >= WINDOW_SAMPLES // LONGEST_HOLD_SAMPLES + 1
    if not usable.any():
        return 1.0
    # sorted, a window's zeros come first: index of the median of its non-zero changes
    middle = WINDOW_SAMPLES - changes + changes // 2
    median_change = np.sort(size, axis=1)[np.arange(count), np.minimum(middle, WINDOW_SAMPLES - 1)]
    # changes that are small against those of the other windows are noise at standstill
    least_change = max(LEAST_CHANGE_STEPS * step, 0.05 * float(np.percentile(median_change[usable], 90.0)))
    usable &= median_change >= least_change
    steady = _longest_runs(~new[usable]) < LONGEST_HOLD_SAMPLES
    if steady.sum() < 3:
        return 1.0
    repeated = 1.0 - new[usable][steady].mean(axis=1)
    is_held = repeated > LEAST_REPEATED_SHARE
    return float(1.0 / (1.0 - np.median(repeated[is_held]))) if is_held.mean() >= 0.5 else 1.0


def clips(values: Array, step: float) -> list[Clip]:
    """Return the clipped extremes of values (n,), where the channel stays for several samples at a time."""
    found = []
    band = max(step, BAND_SHARE * float(np.ptp(values)))
    for sign in (1.0, -1.0):
        level = float(sign * np.max(sign * values))
        at_level = np.abs(values - level) <= 1e-9 * abs(level)
        count = int(at_level.sum())
        other = int(np.count_nonzero(sign * (level - values) <= band)) - count
        runs = int(np.count_nonzero(np.diff(at_level.astype(np.int8), prepend=0) == 1))
        enough = count >= FEWEST_CLIPPED and count >= LEAST_CLIPPED_RUN * runs
        if level != 0.0 and enough and count > CLIPPED_RATIO * max(other, 1):
            rows = np.flatnonzero(at_level)
            found.append(Clip(level, count, int(rows[0]), int(rows[-1])))
    return found


def frozen(values: Array, other: Array, at_least: float) -> tuple[int, int, float] | None:
    """Return the stretch in which `values` (n,) are constant while `other` changes most.

    (first, last, change), or None where the change is at most `at_least`.
    """
    change = np.flatnonzero(np.diff(values) != 0.0) + 1
    edges = np.concatenate([[0], change, [len(values)]])
    long = np.flatnonzero(np.diff(edges) > WINDOW_SAMPLES)
    worst: tuple[int, int, float] | None = None
    for start, stop in zip(edges[long], edges[long + 1], strict=True):
        travel = float(np.ptp(other[start:stop]))
        if travel > at_least and (worst is None or travel > worst[2]):
            worst = (int(start), int(stop) - 1, travel)
    return worst


def _longest_runs(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the length of the longest run of true values in each row of (rows, n)."""
    place = np.arange(1, flags.shape[1] + 1)
    before = np.maximum.accumulate(np.where(flags, 0, place), axis=1)
    longest: NDArray[np.intp] = np.max(place - before, axis=1)
    return longest

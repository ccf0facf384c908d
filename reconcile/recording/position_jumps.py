"""Impossible positions: spikes of one sample, and jumps (a re-zeroed encoder, a wrapping counter)."""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from kernels.arrays import Array

DEFECT_RATIO = 20.0
"""Least change of the step size of a defect, relative to the 99th percentile of all."""
BLOCK = 65_536
"""Samples of a block, which bounds the memory."""
LEAST_WRAP_COUNTS = 100.0
"""Least size of a wrap, in counts; less may be noise at standstill."""


class Jumps(NamedTuple):
    """Indices of the samples and sizes (m) of spikes and jumps."""

    spikes: NDArray[np.intp]
    spike_m: Array
    jumps: NDArray[np.intp]
    """The first sample after each jump."""
    jump_m: Array


def find_jumps(position_m: Array, number: NDArray[np.intp], most_missing: int) -> Jumps:
    """Find spikes and jumps of positions (n,), each the `number`-th sample; NaN is skipped.

    Steps over gaps of more than `most_missing` samples are ignored.
    """
    rows = np.flatnonzero(np.isfinite(position_m))
    known_m = position_m[rows]
    if len(known_m) < 10:
        none = np.zeros(0, dtype=np.intp)
        return Jumps(none, np.zeros(0), none, np.zeros(0))
    sample_distance = np.diff(number[rows])
    step_m = np.where(sample_distance > most_missing + 1, 0.0, np.diff(known_m) / sample_distance)
    change_m = np.abs(np.diff(step_m))
    limit_m = DEFECT_RATIO * float(np.percentile(change_m, 99.0)) + float(np.percentile(np.abs(step_m), 99.0))
    # the step of a sample less those around it, which contain the motion
    around_m = _median_around(step_m)
    excess_m = np.where(sample_distance > most_missing + 1, 0.0, step_m - around_m)
    large = (np.abs(excess_m) > limit_m) | _wraps(known_m, step_m)
    is_spike = large[:-1] & large[1:] & (excess_m[:-1] * excess_m[1:] < 0.0)
    is_spike &= np.abs(excess_m[:-1] + excess_m[1:]) < 0.2 * np.abs(excess_m[:-1])
    spikes = np.flatnonzero(is_spike)
    large[spikes] = False
    large[spikes + 1] = False
    jumps = np.flatnonzero(large)
    return Jumps(rows[spikes + 1], excess_m[spikes], rows[jumps + 1], excess_m[jumps])


def _median_around(values: Array) -> Array:
    """Return the median of the three values to either side of each (n,), cyclic, by blocks to save memory."""
    windows = sliding_window_view(np.pad(values, 3, mode="wrap"), 7)
    blocks = [windows[first : first + BLOCK] for first in range(0, len(values), BLOCK)]
    return np.concatenate([np.median(block[:, [0, 1, 2, 4, 5, 6]], axis=1) for block in blocks])


def _wraps(known_m: Array, step_m: Array) -> NDArray[np.bool_]:
    """Return the steps of a counter that wraps often, where the usual step is not a measure of a defect."""
    size_m = np.abs(step_m)
    smallest_m = float(size_m[size_m > 0.0].min(initial=np.inf))
    return (size_m > 0.5 * float(np.ptp(known_m))) & (size_m > LEAST_WRAP_COUNTS * smallest_m)

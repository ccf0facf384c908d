"""Positions that cannot have been: spikes of one sample, jumps (a re-zeroed encoder, a wrapping counter)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MANY_TIMES = 20.0
"""A defect is so many times larger than what 99 % of the samples show."""


class Jumps(NamedTuple):
    """Indices into the samples, and how far each went."""

    spikes: NDArray[np.intp]
    spike_m: Array
    jumps: NDArray[np.intp]
    """The first sample after each jump."""
    jump_m: Array


def find_jumps(position_m: Array) -> Jumps:
    """Of positions (n,), n > 10, evenly sampled; missing ones (NaN) are passed over."""
    rows = np.flatnonzero(np.isfinite(position_m))
    known_m = position_m[rows]
    if len(known_m) < 10:
        nothing = np.zeros(0, dtype=np.intp)
        return Jumps(nothing, np.zeros(0), nothing, np.zeros(0))
    step_m = np.diff(known_m)
    change_m = np.abs(np.diff(step_m))
    limit_m = MANY_TIMES * float(np.percentile(change_m, 99.0)) + float(np.percentile(np.abs(step_m), 99.0))
    # the step of a sample against those around it, which carry the motion
    around_m = np.median([np.roll(step_m, shift) for shift in (-3, -2, -1, 1, 2, 3)], axis=0)
    excess_m = step_m - around_m
    large = np.abs(excess_m) > limit_m
    there_and_back = large[:-1] & large[1:] & (excess_m[:-1] * excess_m[1:] < 0.0)
    there_and_back &= np.abs(excess_m[:-1] + excess_m[1:]) < 0.2 * np.abs(excess_m[:-1])
    spikes = np.flatnonzero(there_and_back)
    large[spikes] = False
    large[spikes + 1] = False
    jumps = np.flatnonzero(large)
    return Jumps(rows[spikes + 1], excess_m[spikes], rows[jumps + 1], excess_m[jumps])

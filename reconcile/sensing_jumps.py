"""Positions that cannot have been: spikes of one sample, jumps (a re-zeroed encoder, a wrapping counter)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MANY_TIMES = 20.0
"""A defect is so many times larger than what 99 % of the samples show."""
FAR = 100.0
"""Counts; less may be the noise of an axis at rest."""


class Jumps(NamedTuple):
    """Indices into the samples, and how far each went."""

    spikes: NDArray[np.intp]
    spike_m: Array
    jumps: NDArray[np.intp]
    """The first sample after each jump."""
    jump_m: Array


def find_jumps(position_m: Array, number: NDArray[np.intp], across: int) -> Jumps:
    """Of positions (n,), each the `number`-th sample; missing ones (NaN) are passed over.

    Nothing is said of what happened while more than `across` samples are missing.
    """
    rows = np.flatnonzero(np.isfinite(position_m))
    known_m = position_m[rows]
    if len(known_m) < 10:
        nothing = np.zeros(0, dtype=np.intp)
        return Jumps(nothing, np.zeros(0), nothing, np.zeros(0))
    apart = np.diff(number[rows])
    step_m = np.where(apart > across + 1, 0.0, np.diff(known_m) / apart)
    change_m = np.abs(np.diff(step_m))
    limit_m = MANY_TIMES * float(np.percentile(change_m, 99.0)) + float(np.percentile(np.abs(step_m), 99.0))
    # the step of a sample against those around it, which carry the motion
    around_m = np.median([np.roll(step_m, shift) for shift in (-3, -2, -1, 1, 2, 3)], axis=0)
    excess_m = np.where(apart > across + 1, 0.0, step_m - around_m)
    large = (np.abs(excess_m) > limit_m) | _of_the_whole_range(known_m, step_m)
    there_and_back = large[:-1] & large[1:] & (excess_m[:-1] * excess_m[1:] < 0.0)
    there_and_back &= np.abs(excess_m[:-1] + excess_m[1:]) < 0.2 * np.abs(excess_m[:-1])
    spikes = np.flatnonzero(there_and_back)
    large[spikes] = False
    large[spikes + 1] = False
    jumps = np.flatnonzero(large)
    return Jumps(rows[spikes + 1], excess_m[spikes], rows[jumps + 1], excess_m[jumps])


def _of_the_whole_range(known_m: Array, step_m: Array) -> NDArray[np.bool_]:
    """A counter that wraps all the time: what is usual in it is no measure."""
    size_m = np.abs(step_m)
    smallest_m = float(size_m[size_m > 0.0].min(initial=np.inf))
    return (size_m > 0.5 * float(np.ptp(known_m))) & (size_m > FAR * smallest_m)

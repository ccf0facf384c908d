"""The time column: order, sample time, gaps, jitter; and resampling to an even grid.

Uneven time stamps have one of two causes: the sensors were read at those instants, or they were read evenly
and stamped late (a log of the bus). The positions decide, because they are smoother over the true instants.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from kernels.arrays import Array, rms
from reconcile.errors import ReconcileError

Indices = NDArray[np.intp]

SLOWEST_S, FASTEST_S = 0.05, 1e-5
"""Range of usable sample times, s."""
SLOW_RATE_HZ = 180.0
"""Rate below which the samples are too far apart for the state filter: three of its bandwidths."""
SLOW_CORNER_SHARE = 0.06
"""Corner of the filter there, as a share of the rate: that of the filter at 1 kHz. A second difference has an
error of 3 % there and of 30 % at a fifth of the rate, which looks like a force.
"""
FILLED = 5
"""Longest gap that is interpolated, samples; longer ones split the recording."""
LATEST_STAMP_SAMPLES = 20
"""Longest delay of a time stamp, samples; longer ones are gaps."""
LARGEST_JITTER = 0.5
"""Standard deviation of the jitter, in sample times, above which a recording is refused."""
NOTED_JITTER = 0.02
"""The same, above which the jitter is reported."""
ROUGHNESS_RATIO = 0.8
"""Roughness over the stamps relative to an even grid, below which the stamps are the instants."""


class Stamps(NamedTuple):
    """Sample time, sample numbers and gaps; `number` (n,) is the index of each row on an even grid."""

    period_s: float
    number: Indices
    gaps: Indices
    """Rows before which samples are missing."""

    def missing(self, row: int) -> int:
        """Return the number of missing samples just before `row`."""
        return int(self.number[row] - self.number[row - 1] - 1)


class Grid(NamedTuple):
    """An even time grid for consecutive rows."""

    time_s: Array
    """(m,) in the time of the file."""
    stamps_s: Array
    """(n,) times of the rows on the grid."""
    jitter: float
    """Standard deviation of the stamps against the grid, in sample times."""
    resampled: bool
    """The stamps are the instants of the samples, so channels are interpolated."""


def read_time_column(time_s: Array, source: str, first_row: int) -> Stamps:
    """Check order and sample time, and find gaps. Raises ReconcileError naming the row."""
    if len(time_s) < 3:
        raise ReconcileError(source, "time", f"has {len(time_s)} rows; no motion is to be seen in that")
    wrong_rows = np.flatnonzero(~np.isfinite(time_s))
    if len(wrong_rows):
        where = f"time, row {wrong_rows[0] + first_row}"
        raise ReconcileError(source, where, "is missing or no finite number")
    steps_s = np.diff(time_s)
    wrong_rows = np.flatnonzero(steps_s <= 0.0)
    if len(wrong_rows):
        row = int(wrong_rows[0])
        before, after = time_s[row], time_s[row + 1]
        reason = f"does not increase ({before:.9g} s, then {after:.9g} s; {len(wrong_rows)} times in all)"
        remedy = "sort the rows, drop the doubled ones, or cut the file where the clock was set"
        raise ReconcileError(source, f"time, row {row + 1 + first_row}", reason, remedy)
    period_s = float(np.median(steps_s))
    if not FASTEST_S <= period_s <= SLOWEST_S:
        reason = f"the sample time is {period_s:.6g} s; between {FASTEST_S:g} and {SLOWEST_S:g} s is of use"
        remedy = "if the unit is another one, say so: --map time=NAME*1e-3 (ms) or *1e-6 (us)"
        raise ReconcileError(source, "time", reason, remedy)
    regular = np.abs(steps_s - period_s) < 0.9 * period_s
    if regular.mean() < 0.8:  # written on change, or at irregular times
        _raise_uneven(steps_s, source, 0.0)
    lateness_samples = time_s / period_s - np.arange(len(time_s))
    # minimum over the following samples: later stamps recover from a delay, but never from a lost sample
    window = 2 * LATEST_STAMP_SAMPLES + 1
    lateness = minimum_filter1d(lateness_samples, window, origin=-LATEST_STAMP_SAMPLES, mode="nearest")
    lost = np.maximum(np.rint(np.diff(lateness)), 0.0).astype(np.intp)
    number = np.arange(len(time_s)) + np.concatenate([[0], np.cumsum(lost)])
    return Stamps(period_s, number, np.flatnonzero(lost) + 1)


def grid(time_s: Array, number: Indices, position_m: Array, source: str) -> Grid:
    """Fit the even grid to stamps (n,) of rows without a long gap. Raises ReconcileError."""
    number = number - number[0]
    period_s, start_s = np.polyfit(number, time_s, 1)
    even_s = start_s + period_s * number
    late_s = time_s - even_s
    jitter = float(np.std(np.diff(late_s)) / np.sqrt(2.0) / period_s)
    if jitter > LARGEST_JITTER:
        _raise_uneven(np.diff(time_s), source, time_s[0])
    resampled = _stamps_are_instants(late_s, number, position_m, period_s)
    count = int(number[-1]) + 1
    stamps_s = time_s if resampled else even_s
    return Grid(start_s + period_s * np.arange(count), stamps_s, jitter, resampled)


def on_grid(even_grid: Grid, values: Array, *, smooth: bool) -> Array:
    """Interpolate a channel on the grid, NaN included: by a cubic spline if `smooth`, else linearly."""
    present = np.isfinite(values)
    if not even_grid.resampled and len(values) == len(even_grid.time_s) and present.all():
        return values
    stamps_s, values = even_grid.stamps_s[present], values[present]
    grid_s = np.clip(even_grid.time_s, stamps_s[0], stamps_s[-1])
    if not smooth or len(values) < 4:
        return np.interp(grid_s, stamps_s, values)
    filled: Array = CubicSpline(stamps_s, values)(grid_s)
    return filled


def _stamps_are_instants(late_s: Array, number: Indices, position_m: Array, period_s: float) -> bool:
    """Return whether the positions are smoother over the stamps than over the even grid."""
    if np.ptp(late_s) < 1e-4 * period_s or len(late_s) < 100:
        return False
    without_gap = (np.diff(number, 4, prepend=number[:4]) == 0) & np.isfinite(position_m)
    known_m = np.where(np.isfinite(position_m), position_m, 0.0)
    velocity_m_s = uniform_filter1d(np.gradient(known_m, period_s), 15)
    roughness = [
        np.diff(y, 4, prepend=y[:4])[without_gap] for y in (known_m, known_m - velocity_m_s * late_s)
    ]
    as_even, as_stamped = (rms(y) for y in roughness)
    return as_stamped < ROUGHNESS_RATIO * as_even


def _raise_uneven(steps_s: Array, source: str, start_s: float) -> None:
    low, high = np.percentile(steps_s, [1.0, 99.0]) * 1e3
    reason = f"the samples are uneven: {low:.3g} to {high:.3g} ms apart"
    remedy = "record at a fixed rate; if only the stamps are wrong, say the rate: --map period=SECONDS"
    raise ReconcileError(source, f"time, from {start_s:.3f} s on", reason, remedy)

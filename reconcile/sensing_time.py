"""Checks of the time column: order, sample time, gaps, jitter; and the way onto an even grid.

Uneven stamps mean one of two things: the sensors were read at those instants, or they were read evenly and
stamped late (a log of the bus). Which, the positions tell: the right instants make them smoother.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from reconcile.errors import ReconcileError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Indices = NDArray[np.intp]

SLOWEST_S, FASTEST_S = 0.05, 1e-5
FILLED = 5
"""So many missing samples in a row are filled in; more split the recording."""
LATE_SAMPLES = 20
"""A stamp that is late for longer is a gap."""
UNEVEN = 0.5
"""Standard deviation of the jitter in sample times from which on a recording is refused."""
NOTABLE = 0.02
SMOOTHER = 0.8


class Stamps(NamedTuple):
    """The time column understood. `number` (n,): which sample of an even grid each row is."""

    period_s: float
    number: Indices
    gaps: Indices
    """Rows before which samples are missing."""

    def missing(self, row: int) -> int:
        """Samples missing just before `row`."""
        return int(self.number[row] - self.number[row - 1] - 1)


class Grid(NamedTuple):
    """An even time grid for rows that lie together."""

    time_s: Array
    """(m,) in the time of the file."""
    stamps_s: Array
    """(n,) where the rows lie on it."""
    jitter: float
    """Standard deviation of the stamps against the grid, in sample times."""
    resampled: bool
    """The stamps were the instants of the samples; channels are interpolated."""


def understand(time_s: Array, source: str, first_row: int) -> Stamps:
    """Order, sample time and gaps. Raises ReconcileError naming the row."""
    if len(time_s) < 3:
        raise ReconcileError(source, "time", f"has {len(time_s)} rows; no motion is to be seen in that")
    wrong = np.flatnonzero(~np.isfinite(time_s))
    if len(wrong):
        raise ReconcileError(source, f"time, row {wrong[0] + first_row}", "is missing or no finite number")
    steps_s = np.diff(time_s)
    wrong = np.flatnonzero(steps_s <= 0.0)
    if len(wrong):
        row = int(wrong[0])
        before, after = time_s[row], time_s[row + 1]
        raise ReconcileError(
            source,
            f"time, row {row + 1 + first_row}",
            f"does not increase ({before:.9g} s, then {after:.9g} s; {len(wrong)} times in all)",
            "sort the rows, drop the doubled ones, or cut the file where the clock was set",
        )
    period_s = float(np.median(steps_s))
    if not FASTEST_S <= period_s <= SLOWEST_S:
        raise ReconcileError(
            source,
            "time",
            f"the sample time is {period_s:.6g} s; between {FASTEST_S:g} and {SLOWEST_S:g} s is of use",
            "if the unit is another one, say so: --map time=NAME*1e-3 (ms) or *1e-6 (us)",
        )
    _refuse_uneven(steps_s, period_s, source)
    late = time_s / period_s - np.arange(len(time_s))
    # the least lateness of the samples to come: a late stamp is made up for, a missing sample never is
    window = 2 * LATE_SAMPLES + 1
    lateness = minimum_filter1d(late, window, origin=-LATE_SAMPLES, mode="nearest")
    lost = np.maximum(np.rint(np.diff(lateness)), 0.0).astype(np.intp)
    number = np.arange(len(time_s)) + np.concatenate([[0], np.cumsum(lost)])
    return Stamps(period_s, number, np.flatnonzero(lost) + 1)


def grid(time_s: Array, number: Indices, position_m: Array, source: str) -> Grid:
    """The even grid through the stamps (n,) of rows without a long gap. Raises ReconcileError."""
    number = number - number[0]
    period_s, start_s = np.polyfit(number, time_s, 1)
    even_s = start_s + period_s * number
    late_s = time_s - even_s
    jitter = float(np.std(np.diff(late_s)) / np.sqrt(2.0) / period_s)
    if jitter > UNEVEN:
        _raise_uneven(np.diff(time_s), source, time_s[0])
    resampled = _instants_are_true(late_s, number, position_m, period_s)
    count = int(number[-1]) + 1
    stamps_s = time_s if resampled else even_s
    return Grid(start_s + period_s * np.arange(count), stamps_s, jitter, resampled)


def on_grid(lattice: Grid, values: Array, *, smooth: bool) -> Array:
    """A channel on the grid; missing values (NaN) are filled in, by a cubic spline where it is `smooth`."""
    present = np.isfinite(values)
    if not lattice.resampled and len(values) == len(lattice.time_s) and present.all():
        return values
    stamps_s, values = lattice.stamps_s[present], values[present]
    wanted_s = np.clip(lattice.time_s, stamps_s[0], stamps_s[-1])
    if not smooth or len(values) < 4:
        return np.interp(wanted_s, stamps_s, values)
    filled: Array = CubicSpline(stamps_s, values)(wanted_s)
    return filled


def _instants_are_true(late_s: Array, number: Indices, position_m: Array, period_s: float) -> bool:
    """Whether the positions are smoother when each is taken to be of the instant that its stamp says."""
    if np.ptp(late_s) < 1e-4 * period_s or len(late_s) < 100:
        return False
    steady = (np.diff(number, 4, prepend=number[:4]) == 0) & np.isfinite(position_m)
    known_m = np.where(np.isfinite(position_m), position_m, 0.0)
    velocity_m_s = uniform_filter1d(np.gradient(known_m, period_s), 15)
    rough = [np.diff(y, 4, prepend=y[:4])[steady] for y in (known_m, known_m - velocity_m_s * late_s)]
    as_even, as_stamped = (float(np.sqrt(np.mean(y**2))) for y in rough)
    return as_stamped < SMOOTHER * as_even


def _refuse_uneven(steps_s: Array, period_s: float, source: str) -> None:
    """Rows that were written on change, or whenever the logger had time."""
    regular = np.abs(steps_s - period_s) < 0.9 * period_s
    if regular.mean() < 0.8:
        _raise_uneven(steps_s, source, 0.0)


def _raise_uneven(steps_s: Array, source: str, start_s: float) -> None:
    low, high = np.percentile(steps_s, [1.0, 99.0]) * 1e3
    raise ReconcileError(
        source,
        f"time, from {start_s:.3f} s on",
        f"the samples are uneven: {low:.3g} to {high:.3g} ms apart",
        "record at a fixed rate; if the rate was fixed and only the stamps are wrong: --map period=SECONDS",
    )

"""One channel by itself: its quantisation step, its noise, values that are held, clipped or frozen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

OFF_GRID = 0.05
"""RMS distance from whole multiples of the step, in steps, that still is a grid; without one it is 0.29."""
WINDOW = 64
HELD_STEPS = 4.0
"""A channel that changes by fewer counts at a time may repeat its values by itself."""
HELD_SHARE = 0.3
LONGEST_HOLD = 50
CLIPPED_AT_LEAST = 10
CLIPPED_RUN = 3.0
CLIPPED_RATIO = 5.0
"""So many times more samples lie on an extreme than in the band beside it; the top of a sine has 2.4."""
BAND = 0.005


class Hold(NamedTuple):
    """Values that are repeated while the channel changes."""

    samples: float
    """Mean number of samples that a value is held for; 1 where each is new."""
    share: float
    """Of the windows in which it can be told."""


class Clip(NamedTuple):
    """An extreme at which a channel stays."""

    level: float
    samples: int
    first: int
    """Index of the first such sample."""
    last: int


def quantum(values: Array) -> float:
    """The step between the values that occur (n,); 0 where they lie on no grid."""
    levels = np.unique(values)
    if len(levels) < 4:
        return 0.0
    distance = np.diff(levels)
    # closer together than the arithmetic of the file can tell: the same value
    resolvable = 1e-9 * float(np.ptp(levels)) + 8.0 * float(np.spacing(np.abs(levels).max()))
    distance = distance[distance > resolvable]
    if len(distance) < 3:
        return 0.0
    step = float(np.percentile(distance, 1.0, method="lower"))
    for _ in range(3):
        multiples = np.maximum(np.rint(distance / step), 1.0)
        near = multiples <= 20.0  # farther ones would turn a small error of the step into a whole one
        step = float(np.sum(distance[near] * multiples[near]) / np.sum(multiples[near] ** 2))
    multiples = distance[near] / step
    off = float(np.sqrt(np.mean((multiples - np.rint(multiples)) ** 2)))
    return step if off < OFF_GRID and near.sum() >= 3 else 0.0


def noise(values: Array, step: float) -> float:
    """RMS of the white noise (n,): the fourth difference leaves nothing of a smooth motion.

    The median over windows, so that a reversal or a rest does not count; not below that of the step.
    """
    fourth = np.diff(values, 4)
    windows = fourth[: len(fourth) // WINDOW * WINDOW].reshape(-1, WINDOW)
    # the binomial coefficients of the fourth difference, squared, add up to 70
    rms = float(np.median(np.sqrt(np.mean(windows**2, axis=1)))) / math.sqrt(70.0) if len(windows) else 0.0
    return max(rms, step / math.sqrt(12.0))


def hold(values: Array, step: float) -> Hold:
    """Whether a slower channel was sampled: values (n,) that repeat although the channel leaps."""
    change = np.diff(values)
    count = len(change) // WINDOW
    windows = change[: count * WINDOW].reshape(count, WINDOW)
    size = np.abs(windows)
    new = size > 0.0
    changes = new.sum(axis=1)
    usable = changes >= WINDOW // LONGEST_HOLD + 1
    if not usable.any():
        return Hold(1.0, 0.0)
    # sorted, the zeros of a window come first: the middle of those that are none
    middle = WINDOW - changes + changes // 2
    median_change = np.sort(size, axis=1)[np.arange(count), np.minimum(middle, WINDOW - 1)]
    # leaps that are small against the channel's own leaps elsewhere are noise about a rest
    clear = max(HELD_STEPS * step, 0.05 * float(np.percentile(median_change[usable], 90.0)))
    usable &= median_change >= clear
    steady = _longest_runs(~new[usable]) < LONGEST_HOLD
    if steady.sum() < 3:
        return Hold(1.0, 0.0)
    repeated = 1.0 - new[usable][steady].mean(axis=1)
    held = repeated > HELD_SHARE
    if held.mean() < 0.5:
        return Hold(1.0, float(held.mean()))
    return Hold(float(1.0 / (1.0 - np.median(repeated[held]))), float(held.mean()))


def clips(values: Array, step: float) -> list[Clip]:
    """Extremes (n,) at which the channel stays for several samples at a time, again and again or for long."""
    found = []
    band = max(step, BAND * float(np.ptp(values)))
    for sign in (1.0, -1.0):
        level = float(sign * np.max(sign * values))
        at = np.abs(values - level) <= 1e-9 * abs(level)
        count = int(at.sum())
        beside = int(np.count_nonzero(sign * (level - values) <= band)) - count
        runs = int(np.count_nonzero(np.diff(at.astype(np.int8), prepend=0) == 1))
        enough = count >= CLIPPED_AT_LEAST and count >= CLIPPED_RUN * runs
        if level != 0.0 and enough and count > CLIPPED_RATIO * max(beside, 1):
            rows = np.flatnonzero(at)
            found.append(Clip(level, count, int(rows[0]), int(rows[-1])))
    return found


def frozen(values: Array, beside: Array, at_least: float) -> tuple[int, int, float] | None:
    """The stretch over which `values` (n,) stand still while `beside` goes on farthest.

    (first, last, how far), or None where that is less than `at_least`.
    """
    change = np.flatnonzero(np.diff(values) != 0.0) + 1
    edges = np.concatenate([[0], change, [len(values)]])
    long = np.flatnonzero(np.diff(edges) > WINDOW)
    worst: tuple[int, int, float] | None = None
    for start, stop in zip(edges[long], edges[long + 1], strict=True):
        way = float(np.ptp(beside[start:stop]))
        if way > at_least and (worst is None or way > worst[2]):
            worst = (int(start), int(stop) - 1, way)
    return worst


def _longest_runs(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Length of the longest run of true values in each row (rows, n)."""
    place = np.arange(1, flags.shape[1] + 1)
    before = np.maximum.accumulate(np.where(flags, 0, place), axis=1)
    longest: NDArray[np.intp] = np.max(place - before, axis=1)
    return longest

"""Paths of a fast stage: scans by jerk-limited moves, stitched fields, and steps of many sizes."""

import numpy as np
from scipy.signal import convolve

from tests.campaigns.blind.families.interface import Array


def limited(
    ends: Array, speeds: Array, rests: Array, acceleration: float, jerk: float, period_s: float
) -> Array:
    """Return rest-to-rest moves with limited acceleration and jerk (n, 3), by box filters."""
    pieces, at = [np.zeros((round(0.25 / period_s), 3))], 0.0
    for end, speed, rest_s in zip(ends.tolist(), speeds.tolist(), rests.tolist(), strict=True):
        way = end - at
        boxes = [
            max(round(t / period_s), 1) for t in (abs(way) / speed, speed / acceleration, acceleration / jerk)
        ]
        profile = np.full(boxes[0], 1.0 / boxes[0])
        for box in boxes[1:]:
            profile = convolve(profile, np.full(box, 1.0 / box))
        v = np.concatenate((profile * way / period_s, np.zeros(max(round(rest_s / period_s), 1))))
        x = at + np.cumsum(v) * period_s
        pieces.append(np.column_stack((x, v, np.gradient(v, period_s))))
        at = float(x[-1])
    return np.concatenate(pieces)


def scans(rng: np.random.Generator, travel: float, fastest: float, count: int) -> tuple[Array, Array, Array]:
    """Return ends, speeds and rests of rows of an inspection, each swath at a speed from slow to fast."""
    half = rng.uniform(0.3, 0.48) * travel
    speeds = np.repeat(fastest * 10.0 ** rng.uniform(-1.5, 0.0, (count + 1) // 2), 2)[:count]
    sides = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    ends = sides * np.minimum(half, speeds * 0.8)
    return ends, speeds, rng.uniform(0.03, 0.2, count)


def fields(rng: np.random.Generator, travel: float, fastest: float, count: int) -> tuple[Array, Array, Array]:
    """Return steps from field to field across the travel and back, resting an exposure each."""
    step = travel * rng.uniform(0.04, 0.12)
    along = np.cumsum(np.full(count, step))
    fold = travel * 0.9
    ends = np.abs((along + 0.5 * fold) % (2.0 * fold) - fold) - 0.5 * fold
    return (
        ends,
        np.full(count, fastest * rng.uniform(0.3, 0.9)),
        rng.uniform(0.05, 0.15) * 20.0 ** rng.uniform(0, 1, count),
    )


def steps(rng: np.random.Generator, travel: float, fastest: float, count: int) -> tuple[Array, Array, Array]:
    """Return moves of sizes over three decades, with rests over two."""
    sizes = travel * 0.8 * 10.0 ** rng.uniform(-2.5, 0.0, count)
    ends = np.empty(count)
    at = 0.0
    for k, size in enumerate(sizes.tolist()):
        at = (
            at + size
            if at + size < 0.48 * travel and (rng.random() < 0.5 or at - size < -0.48 * travel)
            else at - size
        )
        ends[k] = at = max(at, -0.48 * travel)
    return ends, fastest * 10.0 ** rng.uniform(-0.7, 0.0, count), 0.02 * 60.0 ** rng.uniform(0.0, 1.0, count)

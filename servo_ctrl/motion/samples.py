"""Plays recorded position set points, with an optional force offset (a disturbance or a feedforward).

Velocity and acceleration are central differences of the recorded positions.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import Motion, Profile

_ON_THE_GRID = 1e-6
"""An instant closer than this share of a period counts as the sample; above rounding errors; chosen."""


class Samples(NamedTuple):
    """n >= 2 samples at the SYNC period; arrays are (n, axes). Axes that are NaN hold their position."""

    label: str
    position_m: Array
    force_offset_n: Array


def plan_samples(samples: Samples, start_m: Array, period_s: float) -> Profile:
    """Plan the samples in order; the first is the set point one period after the start."""
    position_m = np.where(np.isnan(samples.position_m), start_m, samples.position_m)
    velocity_m_s = np.gradient(position_m, period_s, axis=0)
    motion = Motion(
        position_m, velocity_m_s, np.gradient(velocity_m_s, period_s, axis=0), samples.force_offset_n
    )

    with_start = zip(_rest(start_m), motion, strict=True)
    from_rest = Motion(*(np.concatenate(pair) for pair in with_start))

    def at(time_s: Array) -> Motion:
        row = np.clip(time_s / period_s, 0.0, len(position_m))
        whole = np.rint(row)
        if (np.abs(row - whole) < _ON_THE_GRID).all():
            index = np.maximum(whole.astype(np.int64), 1)
            return Motion(*(values[index] for values in from_rest))
        return _between(from_rest, row, period_s)

    return Profile(len(position_m) * period_s, position_m[-1], at)


def _rest(start_m: Array) -> Motion:
    """Return the set points at rest before the first sample, (1, axes)."""
    rest = np.zeros((1, len(start_m)))
    return Motion(start_m[np.newaxis], rest, rest, rest)


def _between(samples: Motion, row: Array, period_s: float) -> Motion:
    """Interpolate by cubics through samples and their velocities, the force offset linearly."""
    first = np.minimum(row.astype(np.int64), len(samples.position_m) - 2)
    u = (row - first)[:, np.newaxis]
    x0, x1 = samples.position_m[first], samples.position_m[first + 1]
    v0, v1 = samples.velocity_m_s[first] * period_s, samples.velocity_m_s[first + 1] * period_s
    bend, twist = 3.0 * (x1 - x0) - 2.0 * v0 - v1, v0 + v1 - 2.0 * (x1 - x0)
    force = samples.force_offset_n
    return Motion(
        x0 + u * (v0 + u * (bend + u * twist)),
        (v0 + u * (2.0 * bend + 3.0 * u * twist)) / period_s,
        (2.0 * bend + 6.0 * u * twist) / period_s**2,
        (1.0 - u) * force[first] + u * force[first + 1],
    )

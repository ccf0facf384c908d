"""A recorded reference, sample by sample, with an optional force offset (a disturbance, or a feedforward).

Velocity and acceleration are not recorded: they are central differences of the positions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.motion.profile import Motion, Profile

if TYPE_CHECKING:
    from servo_ctrl.motion.profile import Array


class Samples(NamedTuple):
    """n >= 2 samples at the SYNC period; arrays are (n, axes). Axes that are NaN rest where they are."""

    label: str
    position_m: Array
    force_offset_n: Array


def plan_samples(samples: Samples, start_m: Array, period_s: float) -> Profile:
    """The samples in their order: the first is commanded one period after the motion starts."""
    position_m = np.where(np.isnan(samples.position_m), start_m, samples.position_m)
    velocity_m_s = np.gradient(position_m, period_s, axis=0)
    motion = Motion(
        position_m, velocity_m_s, np.gradient(velocity_m_s, period_s, axis=0), samples.force_offset_n
    )

    def at(time_s: Array) -> Motion:
        row = np.clip(np.rint(time_s / period_s).astype(np.int64) - 1, 0, len(position_m) - 1)
        return Motion(*(values[row] for values in motion))

    return Profile(len(position_m) * period_s, position_m[-1], (0.0, 0.0), at)

"""Within what an axis may be moved: a machine's limits, or what its recordings show that it does."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.motion.profile import MotionLimits

if TYPE_CHECKING:
    from reconcile.model_file import NominalAxis
    from reconcile.next_experiment_recorded import Recorded
    from servo_ctrl.config.model import MachineConfig

USED = 0.9
"""Of the travel, the speed, the acceleration and the jerk that a machine allows."""
PUSHED = 0.7
"""Of its force."""
JERK_S = 0.02
"""Time in which an acceleration builds up, where no machine file says how fast it may."""
MM = 1e-3


class Limits(NamedTuple):
    """Of one axis, SI."""

    lowest_m: float
    highest_m: float
    velocity_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    home_m: float
    """Where a program begins, and ends."""

    @property
    def travel_m(self) -> float:
        """From end to end."""
        return self.highest_m - self.lowest_m

    @property
    def middle_m(self) -> float:
        """Of the travel."""
        return 0.5 * (self.lowest_m + self.highest_m)

    def for_planning(self) -> MotionLimits:
        """As servo_ctrl plans and checks with."""
        return MotionLimits(
            np.array([self.lowest_m]),
            np.array([self.highest_m]),
            np.array([self.velocity_m_s]),
            np.array([self.acceleration_m_s2]),
            np.array([self.jerk_m_s3]),
            np.array([np.inf]),
        )


def limits_seen(seen: Recorded) -> Limits:
    """What was done may be done again."""
    return Limits(
        seen.lowest_m,
        seen.highest_m,
        seen.fastest_m_s,
        seen.hardest_m_s2,
        seen.hardest_m_s2 / JERK_S,
        min(max(seen.begun_m, seen.lowest_m), seen.highest_m),
    )


def limits_of(machine: MachineConfig, axis: str, model: NominalAxis) -> Limits:
    """What controller.toml allows, with a margin; so hard that the force suffices, by the `model`."""
    of = machine.axes[axis].limits
    low_m, high_m = (end * MM for end in of.position_mm)
    margin_m = 0.5 * (1.0 - USED) * (high_m - low_m)
    velocity_m_s = USED * of.velocity_mm_s * MM
    acceleration_m_s2 = USED * of.acceleration_mm_s2 * MM
    if model.mass_kg > 0.0:
        left_n = PUSHED * of.force_n - model.coulomb_n - model.viscous_n_s_m * velocity_m_s
        acceleration_m_s2 = min(acceleration_m_s2, max(left_n, 0.1 * of.force_n) / model.mass_kg)
    low_m, high_m = low_m + margin_m, high_m - margin_m
    home_m = min(max(0.0, low_m), high_m)  # the zero of the homing
    return Limits(low_m, high_m, velocity_m_s, acceleration_m_s2, USED * of.jerk_mm_s3 * MM, home_m)

"""Limits of a planned motion: those of the machine with a margin, or those of the recorded motions."""

from typing import NamedTuple

import numpy as np

from reconcile.design.recorded_axis import RecordedAxis
from reconcile.formats.nominal_axis import NominalAxis
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.motion.profile import MotionLimits

USABLE_SHARE = 0.9
"""Share of the limits of travel, speed, acceleration and jerk in use; the rest is a margin for overshoot."""
USABLE_FORCE_SHARE = 0.7
"""Share of the force limit in use; the rest is for the control of unmodelled forces."""
ACCELERATION_RISE_S = 0.02
"""Time in which the acceleration builds up if no machine file limits the jerk."""
MM = 1e-3


class AxisLimits(NamedTuple):
    """Limits of one axis, SI."""

    min_position_m: float
    max_position_m: float
    velocity_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    home_m: float
    """Position at which a program begins and ends."""

    @property
    def travel_m(self) -> float:
        """The length of the travel."""
        return self.max_position_m - self.min_position_m

    @property
    def middle_m(self) -> float:
        """The middle of the travel."""
        return 0.5 * (self.min_position_m + self.max_position_m)

    def for_planning(self) -> MotionLimits:
        """Return the limits in the form of the planner of servo_ctrl."""
        return MotionLimits(
            position_min_m=np.array([self.min_position_m]),
            position_max_m=np.array([self.max_position_m]),
            velocity_m_s=np.array([self.velocity_m_s]),
            acceleration_m_s2=np.array([self.acceleration_m_s2]),
            jerk_m_s3=np.array([self.jerk_m_s3]),
            force_n=np.array([np.inf]),
        )


def limits_from_recordings(recorded: RecordedAxis) -> AxisLimits:
    """Return the limits that the recorded motions reached."""
    home_m = min(max(recorded.initial_position_m, recorded.min_position_m), recorded.max_position_m)
    return AxisLimits(
        min_position_m=recorded.min_position_m,
        max_position_m=recorded.max_position_m,
        velocity_m_s=recorded.max_velocity_m_s,
        acceleration_m_s2=recorded.max_acceleration_m_s2,
        jerk_m_s3=recorded.max_acceleration_m_s2 / ACCELERATION_RISE_S,
        home_m=home_m,
    )


def limits_from_machine(machine: MachineConfig, axis: str, model: NominalAxis) -> AxisLimits:
    """Return the limits of controller.toml less a margin; `model` bounds the acceleration by the force."""
    of = machine.axes[axis].limits
    low_m, high_m = (end * MM for end in of.position_mm)
    margin_m = 0.5 * (1.0 - USABLE_SHARE) * (high_m - low_m)
    velocity_m_s = USABLE_SHARE * of.velocity_mm_s * MM
    acceleration_m_s2 = USABLE_SHARE * of.acceleration_mm_s2 * MM
    if model.mass_kg > 0.0:
        left_n = USABLE_FORCE_SHARE * of.force_n - model.coulomb_n - model.viscous_n_s_m * velocity_m_s
        acceleration_m_s2 = min(acceleration_m_s2, max(left_n, 0.1 * of.force_n) / model.mass_kg)
    low_m, high_m = low_m + margin_m, high_m - margin_m
    home_m = min(max(0.0, low_m), high_m)  # the zero of homing, if it is within
    return AxisLimits(
        min_position_m=low_m,
        max_position_m=high_m,
        velocity_m_s=velocity_m_s,
        acceleration_m_s2=acceleration_m_s2,
        jerk_m_s3=USABLE_SHARE * of.jerk_mm_s3 * MM,
        home_m=home_m,
    )

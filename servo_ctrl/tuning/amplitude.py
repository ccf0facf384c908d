"""Amplitude of the excitation: as much as the speed of the travel, the limits and the backlash allow."""

from servo_ctrl.config.model import AxisConfig
from servo_ctrl.excitation.measuring_motion import LARGEST_FORCE_SHARE, Plan
from servo_ctrl.tuning.measurement import AxisReaction
from servo_ctrl.units import MM

PROBE_SHARE = 0.01
"""Peak of the first, weak excitation, as a share of the force limit. Chosen, as are the numbers below."""
SPEED_SHARE = 0.15
"""Largest change of speed, as a share of the travel's speed: neither axis nor backlash may reverse."""
TOTAL_SHARE = 0.5
"""Largest total force, as a share of the force limit."""
ERROR_SHARE = 0.2
"""Largest deviation, as a share of the following error that ends a run."""


def probe_n(axis: AxisConfig) -> float:
    """Peak of the first, weak excitation, N."""
    return PROBE_SHARE * axis.limits.force_n


def amplitude_n(axis: AxisConfig, plan: Plan, reaction: AxisReaction) -> float:
    """Peak of the excitation for the measurement, N, from the reaction to a weaker one."""
    limits = axis.limits
    factors = [
        SPEED_SHARE * plan.speed_m_s / max(reaction.speed_m_s, 1e-12),
        ERROR_SHARE * limits.following_error_mm * MM / max(reaction.position_m, 1e-12),
        TOTAL_SHARE * limits.force_n / max(reaction.force_n, 1e-12),
        LARGEST_FORCE_SHARE * limits.force_n / plan.amplitude_n,
    ]
    return plan.amplitude_n * min(factors)

"""How strongly an axis is excited: as much as its speed, its limits and its play allow."""

from servo_ctrl.config.model import AxisConfig
from servo_ctrl.tuning.measurement import AxisReaction, Plan
from servo_ctrl.units import MM

PROBE_SHARE = 0.01
"""Of the force limit: the first, weak excitation. Chosen, as the numbers below."""
SPEED_SHARE = 0.15
"""Of the speed of the travel, by which the excitation may change it: neither axis nor play may reverse."""
FORCE_SHARE, WHOLE_SHARE = 0.15, 0.5
"""Of the force limit: what is added, and the whole force."""
ERROR_SHARE = 0.2
"""Of the following error that ends a run."""


def probe_n(axis: AxisConfig) -> float:
    """Peak of the first excitation, N."""
    return PROBE_SHARE * axis.limits.force_n


def amplitude_n(axis: AxisConfig, plan: Plan, seen: AxisReaction) -> float:
    """Peak of the excitation for the measurement, N, by the reaction to a weaker one."""
    limits = axis.limits
    factors = [
        SPEED_SHARE * plan.speed_m_s / max(seen.speed_m_s, 1e-12),
        ERROR_SHARE * limits.following_error_mm * MM / max(seen.position_m, 1e-12),
        WHOLE_SHARE * limits.force_n / max(seen.force_n, 1e-12),
        FORCE_SHARE * limits.force_n / plan.amplitude_n,
    ]
    return plan.amplitude_n * min(factors)

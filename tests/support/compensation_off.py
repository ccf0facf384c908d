"""Neutral parameters of the compensations, and a proportional position loop."""

from servo_ctrl.control import position_loop
from servo_ctrl.control.compensation import (
    backlash,
    disturbance_observer,
    fuzzy_pd,
    learned_waveform,
    notch,
    sampled_dual_loop,
    screw_error,
    trapezoidal_pulse,
)

NO_NOTCH = notch.NEUTRAL
NO_PULSE = trapezoidal_pulse.NEUTRAL
NO_OBSERVER = disturbance_observer.NEUTRAL
NO_WAVEFORM = learned_waveform.NEUTRAL
NO_FUZZY = fuzzy_pd.NEUTRAL
NO_LEADING = (screw_error.NEUTRAL, backlash.NEUTRAL, sampled_dual_loop.NEUTRAL)


def p_loop(kp_1_s: float, scale_feedback: bool) -> position_loop.Params:
    """A proportional position loop."""
    return position_loop.Params(float(kp_1_s), 0.0, 0.0, 1.0, scale_feedback)

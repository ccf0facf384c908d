"""What an axis without compensations has in their place, and a proportional position loop."""

import numpy as np

from servo_ctrl.control.params import (
    BacklashTakeUp,
    DisturbanceObserver,
    FrictionPulse,
    FuzzyPd,
    PositionLoop,
    SampledDualLoop,
    ScrewError,
)

NO_PULSE = FrictionPulse(enabled=False, rise_s=0.01, amplitude_max_m_s=0.0, learned=np.zeros((6, 1)))
NO_OBSERVER = DisturbanceObserver(enabled=False, mass_kg=0.0, viscous_n_s_m=0.0, filter_blend=1.0)
NO_FUZZY = FuzzyPd(False, 1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, np.zeros((2, 2)))
NO_LEADING = (
    ScrewError(enabled=False, table=np.zeros((2, 1))),
    BacklashTakeUp(enabled=False, lost_motion_m=0.0, acceleration_m_s2=1.0, jerk_m_s3=1.0),
    SampledDualLoop(False, 1.0, 0.0, 0, 0.0, True, 1.0, 1.0),
)


def p_loop(kp_1_s: float, scale_feedback: bool) -> PositionLoop:
    """A proportional position loop."""
    return PositionLoop(float(kp_1_s), 0.0, 0.0, 1.0, scale_feedback)

"""Pulse and observer as an axis without them has them."""

import numpy as np

from servo_ctrl.control.types import DisturbanceObserver, FrictionPulse

NO_PULSE = FrictionPulse(enabled=False, rise_s=0.01, amplitude_max_m_s=0.0, learned=np.zeros((6, 1)))
NO_OBSERVER = DisturbanceObserver(enabled=False, mass_kg=0.0, viscous_n_s_m=0.0, filter_blend=1.0)

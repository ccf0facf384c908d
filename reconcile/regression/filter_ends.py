"""Bandwidth of the regression's filter, and the samples at either end of a recording that filters falsify."""

import math

import numpy as np
from numpy.typing import NDArray

from reconcile.recording.kinematics import gaussian_width_s
from reconcile.regression.state_filter import StateFilter

EDGE_WIDTHS = 3.0
"""Standard deviations of a Gaussian low pass up to which an end of the recording is in it."""
LARGEST_EDGE_SHARE = 0.1
"""Share of a recording that is left out at either end for it, at most. Chosen: short ones need the rest."""
FILTER_HZ = 60.0
"""Bandwidth of the state filter, that of the published figures on EMPS."""
CORNER_RAD_S = 2.0 * math.pi * FILTER_HZ
"""The same; its inverse is the time constant."""
END_S = 0.02
"""Time at the end that is left out, s: the motion that follows it is unknown."""


def ends(samples: int, period_s: float, corner_hz: float | None) -> NDArray[np.bool_]:
    """Samples (n,) at either end that filters falsify; `corner_hz`: of the low pass, None without one."""
    falsified = np.zeros(samples, dtype=np.bool_)
    reach_s = EDGE_WIDTHS * gaussian_width_s(corner_hz) if corner_hz else 0.0
    reach_s = min(reach_s, LARGEST_EDGE_SHARE * samples * period_s)
    falsified[: StateFilter(period_s, FILTER_HZ).settled + math.ceil(reach_s / period_s)] = True
    falsified[-math.ceil(max(END_S, reach_s) / period_s) :] = True
    return falsified

"""Resolution of a recording: in distance, what the state filter still sees around a reversal; in force."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import minimum_filter1d

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.sensing.channel import quantum

REVERSAL_SPREAD_S = 4e-3
"""Time over which the filters spread a reversal, s."""
SLOW_QUANTILE = 0.2
"""Quantile of the reversals by travel; the slow ones resolve shortest distances."""
SETTLED_S = 0.03
"""Memory of the state filter at 60 Hz, s: 11 time constants."""


def settled_travel_m(data: RegressionData) -> Array:
    """Distance since the last reversal or standstill, m (n,); 0 as long as the filter remembers it."""
    m = data.motion
    distance_m = np.where(
        m.moving, np.minimum(m.distance_since_reversal_m, m.distance_since_standstill_m), 0.0
    )
    length = max(round(SETTLED_S / data.period_s), 1)
    found: Array = minimum_filter1d(distance_m, length + 1, origin=length // 2)
    return found


def force_step_n(data: RegressionData) -> float:
    """Step of the measured force, N; 0 where it has none."""
    return quantum(data.force_n if data.recorded_force_n is None else data.recorded_force_n)


def reversal_travel_m(datasets: Sequence[RegressionData]) -> float:
    """Shortest distance over which friction is distinguishable from a step at the reversal, m."""
    travels_m = []
    for data in datasets:
        m = data.motion
        turns = np.flatnonzero(np.diff(m.last_direction) != 0.0)
        later = turns + max(round(REVERSAL_SPREAD_S / data.period_s), 1)
        recorded = later < len(m.position_m)
        travels_m.append(np.abs(m.position_m[later[recorded]] - m.position_m[turns[recorded]]))
    every_m = np.concatenate(travels_m) if travels_m else np.zeros(0)
    return float(np.quantile(every_m, SLOW_QUANTILE)) if len(every_m) else 0.0

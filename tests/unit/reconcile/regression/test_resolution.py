"""Travel resolved by motions, on reversals and strokes of known travel."""

import numpy as np
import pytest
from formula_residuals import data

from reconcile.catalogue.kinds import RegressionData
from reconcile.recording.kinematics import kinematics
from reconcile.regression.resolution import REVERSAL_SPREAD_S, SETTLED_S, reversal_travel_m, settled_travel_m

T = 1e-3
SPEED_M_S = 0.02


def moving_by(position_m: np.ndarray) -> RegressionData:
    """The formula's recording with this motion, on a fine grid."""
    motion = kinematics(np.round(position_m / 1e-9) * 1e-9, T)
    return data()._replace(motion=motion, time_s=np.arange(len(position_m)) * T, period_s=T)


def test_travel_in_the_time_that_a_reversal_takes_is_half_a_t_squared() -> None:
    """Strokes whose reversals have one acceleration each: the slowest fifth of them decides."""
    t = np.arange(20_000) * T
    hz, amplitude_m = 0.5, 0.01
    acceleration_m_s2 = amplitude_m * (2.0 * np.pi * hz) ** 2
    found = reversal_travel_m([moving_by(amplitude_m * np.sin(2.0 * np.pi * hz * t))])
    assert found == pytest.approx(0.5 * acceleration_m_s2 * REVERSAL_SPREAD_S**2, rel=0.35)


def test_motion_that_never_turns_resolves_nothing_by_its_reversals() -> None:
    assert reversal_travel_m([moving_by(SPEED_M_S * np.arange(3000) * T)]) == 0.0
    assert reversal_travel_m([]) == 0.0


def test_the_filters_remember_what_the_travel_was_before() -> None:
    """At constant speed from rest on: the travel of 30 ms ago, and nothing at rest."""
    t = np.arange(3000) * T
    recording = moving_by(SPEED_M_S * np.maximum(t - 1.0, 0.0))
    settled_m = settled_travel_m(recording)
    late = slice(1500, 2900)
    travel_m = recording.motion.distance_since_standstill_m
    assert settled_m[late] == pytest.approx(travel_m[late] - SPEED_M_S * SETTLED_S, abs=2e-5)
    assert not settled_m[:1000].any()

"""Figures of step and sine against closed forms of linear systems and of play."""

import math

import numpy as np
import pytest
from scipy import signal

from studies.xia_fuzzy_pd.figures import sine_figures, step_figures, table_speed

T = 1e-3
REST, HOLD = 20, 1000
STEP_UP_AND_DOWN = np.concatenate((np.zeros(REST), np.full(HOLD, 2e-3), np.zeros(HOLD)))
AMPLITUDE_M, FREQUENCY_HZ = 4e-3, 0.5
TIME_S = np.arange(0.0, 8.0, T)
SINE = AMPLITUDE_M * np.sin(2.0 * math.pi * FREQUENCY_HZ * TIME_S)


def through(
    numerator: list[float], denominator: list[float], command_m: np.ndarray, *, held: bool = True
) -> np.ndarray:
    time_s = np.arange(len(command_m)) * T
    return signal.lsim((numerator, denominator), command_m, time_s, interp=not held)[1]


def test_a_second_order_lag_overshoots_according_to_its_damping() -> None:
    damping, speed = 0.5, 60.0
    found = step_figures(
        STEP_UP_AND_DOWN, through([speed**2], [1.0, 2.0 * damping * speed, speed**2], STEP_UP_AND_DOWN), T
    )
    expected = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert found.overshoot_pct == pytest.approx(expected * 100.0, rel=1e-3)


def test_a_first_order_lag_never_overshoots_and_settles_in_the_logarithm_of_the_band() -> None:
    lag_s = 0.03
    found = step_figures(STEP_UP_AND_DOWN, through([1.0], [lag_s, 1.0], STEP_UP_AND_DOWN), T)
    assert found.overshoot_pct == 0.0
    assert found.settling_s == pytest.approx(lag_s * math.log(50.0), abs=1.5 * T)


def test_the_worse_of_the_two_steps_counts() -> None:
    scale = STEP_UP_AND_DOWN.copy()
    scale[REST + HOLD + 300 : REST + HOLD + 304] = -0.1e-3
    found = step_figures(STEP_UP_AND_DOWN, scale, T)
    assert found.overshoot_pct == pytest.approx(5.0)
    assert found.settling_s == pytest.approx(0.304, abs=1.5 * T)


def test_a_table_that_stays_outside_of_the_band_does_not_settle() -> None:
    found = step_figures(STEP_UP_AND_DOWN, 0.97 * STEP_UP_AND_DOWN, T)
    assert math.isnan(found.settling_s)


def test_a_steep_ramp_is_one_step() -> None:
    ramp = np.concatenate((np.zeros(REST), np.linspace(0.0, 1e-3, 11), np.full(HOLD, 1e-3)))
    found = step_figures(ramp, ramp, T)
    assert found.settling_s == pytest.approx(0.01, abs=1.5 * T)  # measured from where the command begins


def test_the_error_of_a_lag_is_that_of_its_frequency_response() -> None:
    lag_s = 0.05
    found = sine_figures(SINE, through([1.0], [lag_s, 1.0], SINE, held=False), T)
    turn = 2.0 * math.pi * FREQUENCY_HZ * lag_s
    amplitude_um = AMPLITUDE_M * turn / math.sqrt(1.0 + turn**2) * 1e6
    assert found.peak_um == pytest.approx(amplitude_um, rel=2e-3)
    assert found.rms_um == pytest.approx(amplitude_um / math.sqrt(2.0), rel=2e-3)


def test_play_stands_as_long_as_the_command_takes_to_cross_it() -> None:
    play_m = 100e-6
    table, position = [], 0.0
    for command in SINE:
        position = min(max(position, command - play_m / 2.0), command + play_m / 2.0)
        table.append(position)
    found = sine_figures(SINE, np.array(table), T)
    speed = 2.0 * math.pi * FREQUENCY_HZ
    crossing_s = math.acos(1.0 - play_m / AMPLITUDE_M) / speed
    # on its way in the table counts as standing from 1 % of the largest speed on, seen over 10 ms
    assert found.dead_time_s == pytest.approx(crossing_s, abs=0.01)
    more = sine_figures(SINE, through([1.0], [0.01, 1.0], SINE, held=False), T)
    assert more.dead_time_s == pytest.approx(2.0 * math.asin(0.01) / speed, abs=2.0 * T)


def test_the_speed_of_a_ramp_is_its_slope_whatever_the_counts() -> None:
    counts = np.round(0.0123 * np.arange(400) * T / 1e-7) * 1e-7
    assert table_speed(counts, T)[10:-10] == pytest.approx(0.0123, abs=1.1e-5)


def test_a_run_without_a_step_or_with_too_few_reversals_is_refused() -> None:
    with pytest.raises(ValueError, match="no step"):
        step_figures(np.zeros(100), np.zeros(100), T)
    with pytest.raises(ValueError, match="reversals"):
        sine_figures(SINE[:3000], SINE[:3000], T)

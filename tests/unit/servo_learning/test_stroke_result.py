"""From samples to errors after the reversals, and refused strokes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_axes import SETTINGS

from servo_ctrl.learning.stroke_result import (
    ERROR_RESOLUTION_M,
    evaluation_m,
    first_samples,
    interval_s,
    stroke_result,
    trace_samples,
    window_s,
)
from servo_ctrl.learning.types import NO_PULSE, Stroke, StrokeResult

STROKE = Stroke("check", 0.12, NO_PULSE)
TURN_S = 2.0 * math.pi * math.sqrt(SETTINGS.radius_m / STROKE.acceleration_m_s2)


def sine(period_s: float, *, approach: bool = False) -> np.ndarray:
    """Rest, perhaps a move from above, one cycle, rest; m."""
    turn = np.arange(0.0, TURN_S, period_s)
    cycle = SETTINGS.radius_m * np.sin(2.0 * math.pi * turn / TURN_S)
    start = 0.02 if approach else 0.0
    move = np.linspace(start, 0.0, 300) if approach else np.zeros(0)
    return np.concatenate((np.full(50, start), move, np.zeros(20), cycle, np.zeros(50)))


@pytest.mark.parametrize("period_s", [0.25e-3, 1e-3, 2e-3])
@pytest.mark.parametrize("approach", [False, True])
def test_lag_behind_the_new_direction_is_positive_after_both_reversals(
    period_s: float, *, approach: bool
) -> None:
    command_m = sine(period_s, approach=approach)
    quarter = len(command_m) - 50 - len(np.arange(0.0, TURN_S, period_s))
    time_s = (np.arange(len(command_m)) - quarter) * period_s
    position_m = command_m.copy()
    after_top = (time_s > 0.25 * TURN_S) & (time_s < 0.75 * TURN_S)  # moving down: behind is above
    after_bottom = time_s > 0.75 * TURN_S
    position_m[after_top] += 3e-6
    position_m[after_bottom] -= 2e-6
    result = stroke_result(command_m, position_m, STROKE, SETTINGS, period_s)
    assert result.period_s == period_s
    assert result.error_m.shape == (2, trace_samples(STROKE, SETTINGS, period_s))
    assert result.error_m[0, 2:] == pytest.approx(3e-6, abs=1e-12)
    assert result.error_m[1, 2:] == pytest.approx(2e-6, abs=1e-12)


def test_a_trace_ends_after_800_ms_or_before_the_next_reversal_comes_near() -> None:
    assert trace_samples(STROKE, SETTINGS, 1e-3) == 800
    short = SETTINGS._replace(radius_m=0.002)
    half_cycle_s = math.pi * math.sqrt(0.002 / 0.12)
    assert trace_samples(STROKE, short, 1e-3) == int(0.4 * half_cycle_s / 1e-3)


def test_errors_are_whole_nanometres() -> None:
    command_m = sine(1e-3)
    noise_m = np.random.default_rng(3).normal(0.0, 1e-6, len(command_m))
    error_m = stroke_result(command_m, command_m + noise_m, STROKE, SETTINGS, 1e-3).error_m
    assert (error_m == np.round(error_m / ERROR_RESOLUTION_M) * ERROR_RESOLUTION_M).all()
    assert not np.signbit(error_m[error_m == 0.0]).any()


@pytest.mark.parametrize("samples", [0, 1, 100, 1400, 3200, 3700])
def test_a_stroke_that_ends_early_is_refused(samples: int) -> None:
    command_m = sine(1e-3)[:samples]
    with pytest.raises(ValueError, match="ends before 2 reversals are whole"):
        stroke_result(command_m, command_m, STROKE, SETTINGS, 1e-3)


def test_a_reversal_of_the_approach_does_not_stand_for_one_that_is_missing() -> None:
    command_m = sine(1e-3, approach=True)
    until = 50 + 300 + 20 + int(0.25 * TURN_S / 1e-3) + 900
    with pytest.raises(ValueError, match=r"reversals are .* s apart"):
        stroke_result(command_m[:until], command_m[:until], STROKE, SETTINGS, 1e-3)


def test_a_missing_position_sample_is_refused_only_where_it_is_needed() -> None:
    command_m = sine(1e-3)
    position_m = command_m.copy()
    position_m[10] = math.nan
    assert np.isfinite(stroke_result(command_m, position_m, STROKE, SETTINGS, 1e-3).error_m).all()
    position_m[70 + int(0.75 * TURN_S / 1e-3) + 40] = math.inf
    with pytest.raises(ValueError, match="position sample is missing"):
        stroke_result(command_m, position_m, STROKE, SETTINGS, 1e-3)


@settings(deadline=None)
@given(st.integers(0, 4000))
def test_a_missing_command_is_refused_wherever_it_is(at: int) -> None:
    command_m = sine(1e-3)
    command_m[at] = math.nan
    with pytest.raises(ValueError, match="position command is missing"):
        stroke_result(command_m, np.zeros_like(command_m), STROKE, SETTINGS, 1e-3)


def test_evaluation_is_the_mean_absolute_error_of_the_window_as_far_as_it_was_kept() -> None:
    result = StrokeResult(np.array([[1.0, -3.0, 5.0], [0.0, 2.0, 9.0]]), 0.5)
    assert evaluation_m(result, 1.0) == pytest.approx((1 + 3 + 0 + 2) / 4)
    assert evaluation_m(result, 99.0) == pytest.approx(20 / 6)
    assert first_samples(result, 0.0).shape == (2, 1)


def test_the_interval_is_from_the_reversal_to_the_peak() -> None:
    error_m = np.zeros((2, 300))
    error_m[0, 100], error_m[1, 120] = 5e-6, -7e-6
    assert interval_s(StrokeResult(error_m, 1e-3)) == pytest.approx(0.11)
    assert interval_s(StrokeResult(np.zeros((2, 300)), 1e-3)) == 0.0


def test_a_stroke_is_judged_over_a_multiple_of_its_pulse_but_no_less_than_production() -> None:
    assert window_s(SETTINGS, 0.2) == pytest.approx(0.4)
    assert window_s(SETTINGS, 0.01) == SETTINGS.window_s

"""The low pass of a motion is as wide as its encoder allows, however the motion begins."""

import math

import numpy as np
import pytest

from reconcile.recording.kinematics import (
    LOW_PASS_CORNERS_HZ,
    finest_corner_hz,
    kinematics,
    smoothed_position,
)

T, COUNT_M = 1e-3, 1e-8


def test_an_axis_that_starts_abruptly_has_no_coarse_encoder() -> None:
    """From rest to 40 mm/s: every step between samples is of hundreds of counts."""
    time_s = np.arange(1000) * T
    moving_s = np.maximum(time_s - 0.1, 0.0)
    position_m = np.rint(0.04 * (moving_s - 0.01 * -np.expm1(-moving_s / 0.01)) / COUNT_M) * COUNT_M
    steps_m = np.abs(np.diff(position_m))
    assert steps_m[steps_m > 0.0].min() > 100.0 * COUNT_M
    assert finest_corner_hz(position_m, T) == LOW_PASS_CORNERS_HZ[0]
    assert kinematics(position_m, T).velocity_threshold_m_s < 1e-5


@pytest.mark.parametrize("count_m", [2e-6, 2e-5])
def test_a_coarse_encoder_is_told_by_its_counts(count_m: float) -> None:
    """At 25 mm/s a sample passes twelve counts of the finer, and one or two of the coarser."""
    position_m = 0.004 * np.sin(2.0 * math.pi * np.arange(4000) * T)
    rounded_m = np.rint(position_m / count_m) * count_m
    assert finest_corner_hz(rounded_m, T) < LOW_PASS_CORNERS_HZ[0]
    assert finest_corner_hz(position_m, T) == LOW_PASS_CORNERS_HZ[0]


def test_a_steady_motion_goes_on_beyond_the_ends_of_its_low_pass() -> None:
    position_m = 0.04 * np.arange(300) * T
    assert smoothed_position(position_m, T, 45.0) == pytest.approx(position_m, abs=1e-12)

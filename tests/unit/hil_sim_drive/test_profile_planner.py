"""The trapezoidal planner against its definition: ends at the target, within its limits, without jumps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_sim.drive.profile import plan

numbers = st.floats(-1e6, 1e6, allow_nan=False)
positive = st.floats(10.0, 1e6)


def test_long_move_from_rest_by_hand() -> None:
    """100 at speed 10, acceleration 5, braking 10: 2 s + 1 s of ramps cover 10 + 5, cruise 85 takes 8.5 s."""
    profile = plan(0.0, 0.0, 100.0, 10.0, 5.0, 10.0)
    assert profile.duration_s == pytest.approx(2.0 + 8.5 + 1.0)
    assert profile.at(2.0) == pytest.approx((10.0, 10.0))
    assert profile.at(10.5) == pytest.approx((95.0, 10.0))


def test_short_move_is_a_triangle() -> None:
    """Distance 20 with a = d = 5: peak sqrt(5 * 20) = 10 after 2 s."""
    profile = plan(0.0, 0.0, -20.0, 1000.0, 5.0, 5.0)
    assert profile.duration_s == pytest.approx(4.0)
    assert profile.at(2.0) == pytest.approx((-10.0, -10.0))


def test_overrun_comes_back() -> None:
    """10 counts/s towards a target 1 away, braking 5: stops at 10, then returns 9."""
    profile = plan(0.0, 10.0, 1.0, 100.0, 5.0, 5.0)
    assert profile.at(2.0) == pytest.approx((10.0, 0.0))
    assert profile.duration_s == pytest.approx(2.0 + 2.0 * math.sqrt(9.0 / 5.0))
    assert profile.at(100.0) == (1.0, 0.0)


def test_speed_zero_stays_where_braking_ends() -> None:
    assert plan(0.0, 10.0, 1000.0, 0.0, 5.0, 5.0).target == pytest.approx(10.0)


@given(numbers, st.floats(-1e5, 1e5), numbers, positive, positive, positive)
@settings(max_examples=300, deadline=None)
def test_any_profile_is_continuous_limited_and_ends_at_its_target(
    position: float, velocity: float, target: float, speed: float, acceleration: float, deceleration: float
) -> None:
    profile = plan(position, velocity, target, speed, acceleration, deceleration)
    duration = profile.duration_s
    times = np.linspace(0.0, duration, 400)
    states = np.array([profile.at(time) for time in times[:-1]])
    largest = max(speed, abs(velocity))
    steepest = max(acceleration, deceleration)
    step = duration / 399
    assert np.all(np.abs(states[:, 1]) <= largest * (1 + 1e-9) + 1e-6)
    assert np.all(np.abs(np.diff(states[:, 1])) <= steepest * step * (1 + 1e-6) + 1e-6)
    assert np.all(np.abs(np.diff(states[:, 0])) <= largest * step * (1 + 1e-6) + 1e-3)
    assert states[-1, 0] == pytest.approx(target, abs=largest * step + 1e-3)
    assert profile.at(duration) == (target, 0.0)

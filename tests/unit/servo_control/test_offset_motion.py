"""A shift of the motor's set point against the planners of `servo_ctrl.motion`, and within its bounds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.control.offset_motion import advanced, offset_m, over, rest_to_rest, shifted
from servo_ctrl.motion import s_curve, trapezoidal

T = 1e-3
UNBOUNDED = 1e9
PLACES = st.floats(-1e-4, 1e-4)
ACCELERATIONS = st.floats(1e-3, 10.0)
JERKS = st.floats(0.1, 1e4)


def places(from_m: float, to_m: float, smooth: bool, acceleration: float, jerk: float) -> np.ndarray:
    """Where it is at every tick, rest before and after included."""
    motion, found = rest_to_rest(from_m, to_m, smooth, acceleration, jerk), [from_m] * 3
    for _ in range(100_000):
        found.append(offset_m(motion))
        if over(motion):
            break
        motion = advanced(motion, T)
    return np.array(found + [offset_m(motion)] * 3)


@pytest.mark.parametrize(
    ("way_m", "acceleration", "jerk"), [(1e-4, 0.1, 5.0), (5e-6, 0.002, 50.0), (2e-5, 1.0, 2.0)]
)
def test_offset_motion_is_the_planners_profile_without_a_speed_limit(
    way_m: float, acceleration: float, jerk: float
) -> None:
    found = places(1e-5, 1e-5 - way_m, True, acceleration, jerk)[3:-3]
    smooth = s_curve.s_curve(way_m, UNBOUNDED, acceleration, jerk)
    expected = smooth.travelled(np.minimum(np.arange(len(found)) * T, smooth.duration_s))[0]
    np.testing.assert_allclose(found, 1e-5 - expected, rtol=0.0, atol=1e-9 * way_m)
    found = places(1e-5, 1e-5 - way_m, False, acceleration, jerk)[3:-3]
    rough = trapezoidal.trapezoid(way_m, UNBOUNDED, acceleration)
    expected = rough.travelled(np.minimum(np.arange(len(found)) * T, rough.duration_s))[0]
    np.testing.assert_allclose(found, 1e-5 - expected, rtol=0.0, atol=1e-9 * way_m)


@settings(deadline=None, max_examples=60)
@given(PLACES, PLACES, st.booleans(), ACCELERATIONS, JERKS)
def test_offset_motion_arrives_exactly_without_overshoot_within_its_bounds(
    from_m: float, to_m: float, smooth: bool, acceleration: float, jerk: float
) -> None:
    found = places(from_m, to_m, smooth, acceleration, jerk)
    assert found[-1] == to_m
    way_m = to_m - from_m
    rounding = 1e-18  # of places that are below a millimetre
    assert (np.diff(found) * np.sign(way_m) >= -rounding).all()
    assert np.abs(np.diff(found, 2)).max() <= acceleration * T**2 * (1.0 + 1e-6) + 4.0 * rounding
    if smooth:
        assert np.abs(np.diff(found, 3)).max() <= jerk * T**3 * (1.0 + 1e-6) + 8.0 * rounding


@pytest.mark.parametrize("smooth", [True, False])
def test_zero_distance_is_no_motion(smooth: bool) -> None:
    motion = rest_to_rest(3e-6, 3e-6, smooth, 1.0, 1.0)
    assert over(motion)
    assert offset_m(motion) == 3e-6


def test_a_shifted_offset_motion_continues_with_the_shift() -> None:
    motion = advanced(rest_to_rest(0.0, 1e-5, True, 0.5, 50.0), 3.0 * T)
    beside = shifted(motion, 2e-6)
    for _ in range(50):
        assert offset_m(beside) == pytest.approx(offset_m(motion) + 2e-6, rel=1e-12)
        assert over(beside) == over(motion)
        motion, beside = advanced(motion, T), advanced(beside, T)
    assert over(motion)

"""Cross-coupled contour control against geometry: lines, circles, standstill, bounds, bad values."""

import math

import numpy as np
import pytest

from servo_ctrl.control.contour_control import NEAR, Pair, Params, State, at_rest, coupled

P = Params(kp_1_s=40.0, ki_1_s2=0.0, limit_m_s=1.0, full_speed_m_s=1e-3, period_s=1e-3)
REST = Pair(0.0, 0.0)
ANGLES = np.linspace(-3.0, 3.0, 7).tolist()


def along(angle_rad: float, speed_m_s: float) -> Pair:
    return Pair(speed_m_s * math.cos(angle_rad), speed_m_s * math.sin(angle_rad))


@pytest.mark.parametrize("angle_rad", ANGLES)
def test_on_a_line_it_is_the_distance_from_the_line_along_its_normal(angle_rad: float) -> None:
    error = Pair(3e-6, -7e-6)
    state, contour_m = coupled(P, at_rest(), error, along(angle_rad, 0.05), REST)
    wanted_m = -error.first * math.sin(angle_rad) + error.second * math.cos(angle_rad)
    assert contour_m == pytest.approx(wanted_m, rel=1e-12, abs=1e-20)
    offset = state.offset_m_s
    assert offset.first == pytest.approx(-40.0 * wanted_m * math.sin(angle_rad), rel=1e-12, abs=1e-18)
    assert offset.second == pytest.approx(40.0 * wanted_m * math.cos(angle_rad), rel=1e-12, abs=1e-18)


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("angle_rad", ANGLES)
def test_on_a_circle_it_is_the_radial_error_and_points_to_the_centre(angle_rad: float, turn: float) -> None:
    radius_m, feed_m_s = 0.025, 0.05
    outwards = along(angle_rad, 1.0)
    velocity = along(angle_rad + turn * math.pi / 2.0, feed_m_s)
    inwards = Pair(*(-(feed_m_s**2) / radius_m * part for part in outwards))
    error = Pair(-400e-6, 300e-6)  # large enough for the second order, e^2 / 2 R = 5 um, and the third
    state, contour_m = coupled(P, at_rest(), error, velocity, inwards)
    table_m = np.array([radius_m * a - e for a, e in zip(outwards, error, strict=True)])
    deviation_m = float(np.hypot(*table_m)) - radius_m
    assert contour_m == pytest.approx(turn * deviation_m, rel=1e-9)  # positive: the path is to the left
    np.testing.assert_allclose(
        state.offset_m_s, -40.0 * deviation_m * table_m / np.hypot(*table_m), rtol=1e-9, atol=1e-15
    )


def test_koren_and_lo_s_series_agrees_to_the_second_order() -> None:
    radius_m, angle_rad, error = 0.025, 0.4, Pair(-400e-6, 10e-6)
    inwards = along(angle_rad + math.pi / 2.0, 0.05**2 / radius_m)
    _, contour_m = coupled(P, at_rest(), error, along(angle_rad, 0.05), inwards)
    gain_x = math.sin(angle_rad) - error.first / (2.0 * radius_m)
    gain_y = math.cos(angle_rad) + error.second / (2.0 * radius_m)
    series_m = -error.first * gain_x + error.second * gain_y
    beside_m = -error.first * math.sin(angle_rad) + error.second * math.cos(angle_rad)
    assert abs(contour_m - series_m) < beside_m**2 / radius_m  # they leave out -(n e)^2 / 2 R


def test_a_lag_along_the_line_is_none_of_its_business() -> None:
    state, contour_m = coupled(P, at_rest(), Pair(30e-6, 40e-6), Pair(0.03, 0.04), REST)
    assert abs(contour_m) < 1e-20
    assert max(map(abs, state.offset_m_s)) < 1e-18


def test_it_is_the_same_when_the_axes_go_back() -> None:
    error, velocity = Pair(2e-6, -5e-6), Pair(0.02, 0.03)
    there, _ = coupled(P, at_rest(), error, velocity, REST)
    back, _ = coupled(P, at_rest(), error, Pair(-0.02, -0.03), REST)
    np.testing.assert_allclose(there.offset_m_s, back.offset_m_s, rtol=1e-12)


def test_at_standstill_nothing_is_coupled_and_below_full_speed_it_fades() -> None:
    error, with_integral = Pair(2e-6, -5e-6), State(1e-3, Pair(1e-4, 1e-4))
    assert coupled(P, with_integral, error, Pair(0.0, 0.0), REST) == (at_rest(), 0.0)
    full, _ = coupled(P, at_rest(), error, Pair(1e-3, 0.0), REST)
    half, _ = coupled(P, at_rest(), error, Pair(5e-4, 0.0), REST)
    fast, _ = coupled(P, at_rest(), error, Pair(0.1, 0.0), REST)
    assert half.offset_m_s.second == pytest.approx(0.5 * full.offset_m_s.second)
    assert fast.offset_m_s == full.offset_m_s


def test_with_gain_0_the_offsets_are_0() -> None:
    rng, state = np.random.default_rng(5), at_rest()
    for error, velocity, acceleration in rng.normal(0.0, 1e-2, (100, 3, 2)).tolist():
        state, contour_m = coupled(
            P._replace(kp_1_s=0.0), state, Pair(*error), Pair(*velocity), Pair(*acceleration)
        )
        assert contour_m != 0.0
        assert state == at_rest()


def test_offset_and_integral_stay_within_their_limit() -> None:
    p = P._replace(ki_1_s2=1e4, limit_m_s=2e-3)
    rng, state, largest = np.random.default_rng(6), at_rest(), 0.0
    for error, velocity, acceleration in rng.normal(0.0, 1.0, (500, 3, 2)).tolist():
        state, _ = coupled(p, state, Pair(*error), Pair(*velocity), Pair(*acceleration))
        assert abs(state.integral_m_s) <= p.limit_m_s
        largest = max(largest, math.hypot(*state.offset_m_s))
    assert largest == pytest.approx(p.limit_m_s, rel=1e-9)


def test_the_integral_takes_a_lasting_error_up_and_gives_it_back_at_once() -> None:
    p, state = P._replace(kp_1_s=0.0, ki_1_s2=100.0, limit_m_s=1e-4), at_rest()
    for _ in range(500):
        state, _ = coupled(p, state, Pair(0.0, 10e-6), Pair(0.05, 0.0), REST)
    assert state.integral_m_s == pytest.approx(p.limit_m_s, rel=0.02)
    after, _ = coupled(p, state, Pair(0.0, -10e-6), Pair(0.05, 0.0), REST)
    assert after.integral_m_s == pytest.approx(state.integral_m_s - 1e-6)


@pytest.mark.parametrize("place", range(6))
def test_a_value_that_is_missing_keeps_the_offsets(place: int) -> None:
    values = [1e-6, 2e-6, 0.01, 0.02, 0.1, 0.2]
    values[place] = math.nan
    before = State(1e-5, Pair(1e-4, -1e-4))
    error, velocity, acceleration = (Pair(*values[k : k + 2]) for k in (0, 2, 4))
    state, contour_m = coupled(P, before, error, velocity, acceleration)
    assert state == before
    assert math.isnan(contour_m)


def test_the_curvature_of_a_crawling_command_is_bounded_by_the_error() -> None:
    error = Pair(0.0, 1e-5)
    _, contour_m = coupled(P, at_rest(), error, Pair(1e-9, 0.0), Pair(0.0, 5.0))
    radius_m = 1e-5 / NEAR
    assert contour_m == pytest.approx(1e-5 + radius_m - radius_m, rel=1e-9)
    _, beside_m = coupled(P, at_rest(), Pair(1e-5, 0.0), Pair(1e-9, 0.0), Pair(0.0, 5.0))
    assert beside_m == pytest.approx(math.hypot(1e-5, radius_m) - radius_m, rel=1e-9)

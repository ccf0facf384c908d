"""Every kind of motion: exact ends, continuous, within its limits, and true to its own derivatives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from servo_ctrl.motion.circle import Circle, plan_circle
from servo_ctrl.motion.circle import turning_of as circle_turning
from servo_ctrl.motion.move import Move, along_line, plan_move
from servo_ctrl.motion.profile import Motion, MotionLimits, Profile, standstill
from servo_ctrl.motion.s_curve import s_curve
from servo_ctrl.motion.samples import Samples, plan_samples
from servo_ctrl.motion.sine import Sine, plan_sine, speed_for_reverse_acceleration
from servo_ctrl.motion.smooth_turning import Turning, turned, usual_ramp_s
from servo_ctrl.motion.trapezoidal import ThereAndBack, plan_there_and_back, trapezoid

ORIGIN = np.zeros(2)
distances = st.floats(1e-6, 0.5)
speeds = st.floats(1e-3, 1.0)
accelerations = st.floats(1e-2, 20.0)
jerks = st.floats(1.0, 1e4)


def sampled(profile: Profile, count: int = 4001) -> tuple[NDArray[np.float64], Motion]:
    time_s = np.linspace(0.0, profile.duration_s, count)
    return time_s, profile.at(time_s)


def assert_derivatives_agree(profile: Profile, *, jerk_bounded: bool = True) -> None:
    """Trapezoidal sums of the analytic derivatives lead from each sample to the next."""
    time_s, motion = sampled(profile, 20_001)
    dt = np.diff(time_s)[:, np.newaxis]
    x, v, a, _ = motion
    top_v, top_a = np.abs(v).max(), np.abs(a).max()
    np.testing.assert_allclose(
        np.diff(x, axis=0), dt * (v[1:] + v[:-1]) / 2, atol=2e-3 * dt[0, 0] * top_v + 1e-15
    )
    # where the acceleration jumps, one step of the sum may be off by half the jump
    slack = 2e-3 if jerk_bounded else 1.01
    np.testing.assert_allclose(
        np.diff(v, axis=0), dt * (a[1:] + a[:-1]) / 2, atol=slack * dt[0, 0] * top_a + 1e-12
    )


def rests_at_both_ends(motion: Motion) -> bool:
    ends = [0, -1]
    return bool((motion.velocity_m_s[ends] == 0.0).all() and (motion.position_m[0] == 0.0).all())


@given(distances, distances, speeds, accelerations, jerks)
@settings(deadline=None)
def test_s_curve_keeps_its_limits_and_ends_exactly(
    dx: float, dy: float, speed: float, acceleration: float, jerk: float
) -> None:
    end_m = np.array([dx, -dy])
    profile = along_line(ORIGIN, end_m, s_curve(math.dist(ORIGIN, end_m), speed, acceleration, jerk))
    time_s, motion = sampled(profile)
    assert rests_at_both_ends(motion)
    assert (motion.position_m[-1] == end_m).all()
    path_v = np.hypot(*motion.velocity_m_s.T)
    path_a = np.hypot(*motion.acceleration_m_s2.T)
    assert path_v.max() <= speed * (1 + 1e-9)
    assert path_a.max() <= acceleration * (1 + 1e-9)
    # jerk within its limit is what makes the acceleration continuous
    jerks_seen = np.hypot(*np.diff(motion.acceleration_m_s2, axis=0).T) / np.diff(time_s)
    assert jerks_seen.max() <= jerk * (1 + 1e-6)


@given(distances, speeds, accelerations, jerks)
def test_s_curve_is_the_fastest_that_some_limit_allows(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    plan = s_curve(distance, speed, acceleration, jerk)
    used = (
        plan.speed_m_s / speed,
        plan.speed_m_s / plan.jerk_s / acceleration,
        plan.speed_m_s / plan.jerk_s**2 / jerk,
    )
    assert max(used) == pytest.approx(1.0, rel=1e-9)
    assert plan.speed_m_s * (2 * plan.jerk_s + plan.cruise_s) == pytest.approx(distance, rel=1e-9)


def test_s_curve_against_hand_calculation() -> None:
    # j = 1000, v = 0.1: tj = sqrt(0.1 / 1000) = 10 ms, a = 10; 0.1 m take 0.1 / 0.1 + 2 tj = 1.02 s
    profile = along_line(np.zeros(1), np.array([0.1]), s_curve(0.1, 0.1, 20.0, 1000.0))
    assert profile.duration_s == pytest.approx(1.02)
    motion = profile.at(np.array([0.010, 0.020, 0.510, 1.010]))
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], [10.0, 0.0, 0.0, -10.0], atol=1e-9)
    np.testing.assert_allclose(motion.velocity_m_s[:, 0], [0.05, 0.1, 0.1, 0.05])
    np.testing.assert_allclose(
        motion.position_m[:, 0], [1000 * 0.01**3 / 6, 0.001, 0.05, 0.1 - 1000 * 0.01**3 / 6]
    )


@given(distances, speeds, accelerations)
def test_trapezoid_keeps_its_limits_and_ends_exactly(
    distance: float, speed: float, acceleration: float
) -> None:
    end_m = np.array([distance, 0.0])
    profile = along_line(ORIGIN, end_m, trapezoid(distance, speed, acceleration))
    _, motion = sampled(profile)
    assert rests_at_both_ends(motion)
    assert (motion.position_m[-1] == end_m).all()
    assert np.abs(motion.velocity_m_s).max() <= speed * (1 + 1e-9)
    assert np.abs(motion.acceleration_m_s2).max() <= acceleration * (1 + 1e-9)
    plan = trapezoid(distance, speed, acceleration)
    assert plan.speed_m_s * (plan.ramp_s + plan.cruise_s) == pytest.approx(distance, rel=1e-9)


@pytest.mark.parametrize(
    ("acceleration", "velocity", "distance", "one_way_s"),
    [
        (0.01, 0.01, 0.03, 4.0),
        (0.02, 0.02, 0.03, 2.5),
        (0.02, 0.03, 0.05, 1.5 + 5 / 3),
        (0.03, 0.03, 0.08, 11 / 3),
    ],
    ids=["S1", "S2", "S3", "S4"],
)
def test_s_shapes_take_the_time_of_their_published_figures(
    acceleration: float, velocity: float, distance: float, one_way_s: float
) -> None:
    # one way: v / a + d / v
    step = ThereAndBack("S", 1, distance, velocity, acceleration, 1)
    profile = plan_there_and_back(step, ORIGIN)
    assert profile.duration_s == pytest.approx(2 * one_way_s)
    _, motion = sampled(profile)
    assert motion.position_m[:, 1].max() == pytest.approx(distance)
    assert np.abs(motion.velocity_m_s[:, 1]).max() == pytest.approx(velocity)
    assert not motion.position_m[:, 0].any()
    around = profile.at(one_way_s + np.array([-0.1, -1e-6, 1e-6, 0.1]))
    np.testing.assert_allclose(around.acceleration_m_s2[:, 1], -acceleration)
    np.testing.assert_allclose(around.velocity_m_s[[0, 3], 1], [0.1 * acceleration, -0.1 * acceleration])


def test_there_and_back_repeats_reverse_at_both_ends_without_a_dwell() -> None:
    profile = plan_there_and_back(ThereAndBack("S", 0, -0.03, 0.02, 0.02, 3), ORIGIN)
    assert_derivatives_agree(profile, jerk_bounded=False)
    _, motion = sampled(profile, 30_001)
    assert motion.position_m[-1, 0] == 0.0
    assert motion.position_m[:, 0].min() == pytest.approx(-0.03)
    inner = motion.velocity_m_s[1:-1, 0]
    assert np.count_nonzero(np.diff(np.sign(inner[inner != 0.0]))) == 5


def test_circle_is_round_at_constant_feed_with_the_reverse_acceleration_of_its_feed() -> None:
    # F = 3000 mm/min = 50 mm/s on R = 25 mm: w = 2 rad/s, a = F^2 / R = 0.1 m/s^2
    start = np.array([0.025, 0.0])
    circle = Circle("c", (0, 1), 0.025, 0.05, 1.3, counterclockwise=True, ramp_s=0.5)
    profile = plan_circle(circle, start)
    assert profile.duration_s == pytest.approx(2.6 * math.pi / 2.0 + 0.5)
    time_s, motion = sampled(profile)
    np.testing.assert_allclose(np.hypot(*motion.position_m.T), 0.025, rtol=1e-12)
    steady = (time_s >= profile.steady_s[0]) & (time_s <= profile.steady_s[1])
    np.testing.assert_allclose(np.hypot(*motion.velocity_m_s[steady].T), 0.05, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*motion.acceleration_m_s2[steady].T), 0.1, rtol=1e-12)
    assert (steady[1:] & steady[:-1]).sum() * np.diff(time_s)[0] * 2.0 > 2 * math.pi  # one whole turn
    assert motion.position_m[5, 1] > 0.0


@given(st.floats(1e-3, 0.1), st.floats(1e-3, 0.3), st.floats(0.6, 4.0), st.booleans())
@settings(deadline=None, max_examples=30)
def test_circle_starts_and_ends_at_rest_and_is_continuous(
    radius: float, feed: float, turns: float, counterclockwise: bool
) -> None:
    circle = Circle("c", (1, 0), radius, feed, turns, counterclockwise, usual_ramp_s(feed / radius))
    profile = plan_circle(circle, ORIGIN)
    _, motion = sampled(profile)
    assert circle_turning(circle).fits
    assert rests_at_both_ends(motion)
    np.testing.assert_allclose(motion.acceleration_m_s2[[0, -1]], 0.0, atol=1e-12)
    assert (profile.end_m == motion.position_m[-1]).all()
    assert_derivatives_agree(profile)


def test_sine_reverses_with_the_commanded_acceleration() -> None:
    # A = 25 mm, a = 10 mm/s^2: w = sqrt(10 / 25) rad/s
    speed = speed_for_reverse_acceleration(0.025, 0.010)
    assert speed == pytest.approx(math.sqrt(0.4))
    profile = plan_sine(Sine("s", 0, 0.025, speed, 2.0, usual_ramp_s(speed)), ORIGIN)
    time_s, motion = sampled(profile, 50_001)
    x, a = motion.position_m[:, 0], motion.acceleration_m_s2[:, 0]
    reversals = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    assert len(reversals) == 4
    np.testing.assert_allclose(np.abs(x[reversals]), 0.025, rtol=1e-6)
    np.testing.assert_allclose(np.abs(a[reversals]), 0.010, rtol=1e-6)
    assert ((time_s[reversals] > profile.steady_s[0]) & (time_s[reversals] < profile.steady_s[1])).all()
    assert_derivatives_agree(profile)
    assert rests_at_both_ends(motion)


@given(st.floats(0.01, 50.0), st.floats(0.5, 10.0))
def test_the_default_ramp_needs_no_more_acceleration_than_the_motion(speed: float, turns: float) -> None:
    turning = Turning(speed, usual_ramp_s(speed), 2 * math.pi * turns)
    assert turning.fits
    angle, rate, acceleration = turned(turning, np.linspace(0.0, turning.duration_s, 2001))
    assert np.abs(acceleration).max() <= speed**2
    assert rate.max() <= speed * (1 + 1e-12)
    assert angle[-1] == turning.total_rad
    assert (np.diff(angle) >= 0.0).all()


def test_samples_are_replayed_as_recorded_and_unnamed_axes_stay() -> None:
    recorded = np.column_stack((np.array([1.0, 2.0, 4.0, 7.0]) * 1e-6, np.full(4, np.nan)))
    offsets = np.column_stack(([0.0, 5.0, 5.0, 0.0], np.zeros(4)))
    profile = plan_samples(Samples("r", recorded, offsets), np.array([0.0, 0.3]), 1e-3)
    motion = profile.at(np.array([1, 2, 3, 4]) * 1e-3)
    assert (motion.position_m[:, 0] == recorded[:, 0]).all()
    assert (motion.position_m[:, 1] == 0.3).all()
    assert (motion.force_offset_n == offsets).all()
    np.testing.assert_allclose(motion.velocity_m_s[:, 0], [1e-3, 1.5e-3, 2.5e-3, 3e-3])
    assert not motion.velocity_m_s[:, 1].any()


def test_dwell_stays_at_its_position() -> None:
    profile = standstill(np.array([0.1, 0.2]), 2.0)
    _, motion = sampled(profile, 10)
    assert (motion.position_m == [0.1, 0.2]).all()
    assert not np.concatenate(motion[1:]).any()


@pytest.mark.parametrize("trapezoidal", [False, True])
def test_a_move_to_where_the_axes_are_takes_no_time(trapezoidal: bool) -> None:
    move = Move("m", (0.1, math.nan), 1.0, math.inf, trapezoidal)
    limits = MotionLimits(*(np.full(2, limit) for limit in (-1.0, 1.0, 1.0, 1.0, 1.0, 1.0)))
    profile = plan_move(move, np.array([0.1, 0.2]), limits, 1e-3)
    assert profile.duration_s == 0.0

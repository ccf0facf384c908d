"""Learned points as functions of the reverse acceleration, and as the control law's table."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.control.compensation.trapezoidal_pulse import shape_at
from servo_ctrl.learning.pulse_functions import (
    amplitudes_m_s,
    constant_table,
    durations_s,
    interpolation_points,
    pulse_at,
    scaled_to,
    table,
)
from servo_ctrl.learning.types import Learned, Pulse

POINTS = (
    ((0.002, 0.18), (0.008, 0.11), (0.03, 0.07), (0.12, 0.04)),
    ((0.002, 0.0002), (0.008, 0.0004), (0.03, 0.0008), (0.12, 0.0018)),
)
PAPER = Learned("paper", *POINTS, 0.004, (), 5e-6, 1e-6, 100, 1e4)
FAST = PAPER._replace(
    learner="fast",
    spread_m_s2=0.0,
    trailing=((0.002, 0.15, 0.1, 1e-4), (0.02, 0.06, 0.05, 2e-4), (0.12, 0.03, 0.05, 4e-4)),
)
ACCELERATION = st.floats(1e-4, 1.0)


@settings(deadline=None)
@given(ACCELERATION)
def test_with_the_papers_learner_durations_are_joined_by_lines_and_amplitudes_by_the_network(
    a: float,
) -> None:
    at = np.array([a])
    inside = min(max(a, 0.002), 0.12)
    assert durations_s(PAPER, at)[0] == pytest.approx(np.interp(a, *np.array(POINTS[0]).T))
    weights = [math.exp(-((inside - point) ** 2) / (2.0 * 0.004**2)) for point, _ in POINTS[1]]
    mean = sum(w * value for w, (_, value) in zip(weights, POINTS[1], strict=True)) / sum(weights)
    assert amplitudes_m_s(PAPER, at)[0] == pytest.approx(mean)


@settings(deadline=None)
@given(st.floats(0.0, 1.0))
def test_with_the_fast_learner_both_are_powers_between_two_points(share: float) -> None:
    for (a, value), (b, other) in zip(POINTS[1], POINTS[1][1:], strict=False):
        between = a ** (1.0 - share) * b**share
        expected = value ** (1.0 - share) * other**share
        assert amplitudes_m_s(FAST, np.array([between]))[0] == pytest.approx(expected)


@pytest.mark.parametrize("learned", [PAPER, FAST])
def test_the_table_contains_the_learned_points(learned: Learned) -> None:
    for a, duration in learned.durations:
        assert pulse_at(learned, a).duration_s == pytest.approx(duration)
    for a, *trailing in learned.trailing:
        assert pulse_at(learned, a)[2:] == pytest.approx(tuple(trailing))


@pytest.mark.parametrize("learned", [PAPER, FAST])
def test_outside_the_learned_range_the_nearest_end_value_applies(learned: Learned) -> None:
    assert pulse_at(learned, 1e-6) == pulse_at(learned, 0.002)
    assert pulse_at(learned, 50.0) == pulse_at(learned, 0.12)


@settings(deadline=None)
@given(ACCELERATION)
def test_the_control_law_reads_the_same_pulse(a: float) -> None:
    assert tuple(shape_at(table(FAST), a)) == pytest.approx(tuple(pulse_at(FAST, a)), rel=1e-6)


@pytest.mark.parametrize("learned", [PAPER, FAST])
def test_the_table_is_the_functions_at_columns_no_more_than_two_percent_apart(learned: Learned) -> None:
    rows = table(learned)
    assert rows[1] == pytest.approx(durations_s(learned, rows[0]))
    assert rows[2] == pytest.approx(amplitudes_m_s(learned, rows[0]))
    assert (rows[0, 1:] / rows[0, :-1]).max() <= 1.02
    assert (rows[0, 0], rows[0, -1]) == (0.002, 0.12)


@pytest.mark.parametrize("learned", [PAPER, FAST])
def test_the_table_rises_and_its_pulses_are_positive(learned: Learned) -> None:
    rows = table(learned)
    assert rows.shape[0] == 6
    assert (np.diff(rows[0]) > 0.0).all()
    assert np.isfinite(rows).all()
    assert (rows[1:3] > 0.0).all()
    assert not (rows[3:].any() and not learned.trailing)


def test_functions_of_one_point_are_constant() -> None:
    learned = FAST._replace(durations=((0.03, 0.07),), amplitudes=((0.03, 0.001),), trailing=())
    assert pulse_at(learned, 0.002) == pulse_at(learned, 0.5) == pytest.approx(Pulse(0.07, 0.001))


def test_a_second_trapezoid_carried_to_a_quarter_of_the_acceleration_takes_twice_as_long() -> None:
    assert scaled_to((0.12, 0.03, 0.05, 4e-4), 0.03) == pytest.approx((0.03, 0.06, 0.1, 2e-4))


def test_where_there_is_no_second_trapezoid_its_amplitude_fades_and_its_shape_stays() -> None:
    points = interpolation_points([(0.01, 0.0, 0.0, 0.0), (0.04, 0.06, 0.05, 2e-4), (0.16, 0.03, 0.03, 3e-4)])
    assert points[0] == pytest.approx((0.01, 0.12, 0.1, 0.0))
    assert points[1:] == [(0.04, 0.06, 0.05, 2e-4), (0.16, 0.03, 0.03, 3e-4)]
    assert interpolation_points([(0.01, 0.0, 0.0, 0.0)]) == [(0.01, 0.0, 0.0, 0.0)]
    assert interpolation_points([]) == []


def test_where_the_second_trapezoid_changes_sign_each_side_extends_to_the_middle() -> None:
    left, right = (0.01, 0.08, 0.06, 2e-4), (0.04, 0.1, 0.05, -3e-4)
    learned = FAST._replace(trailing=(left, right))
    below, above = pulse_at(learned, 0.0199999), pulse_at(learned, 0.0200001)
    assert below[2:] == pytest.approx(scaled_to(left, 0.02)[1:], rel=1e-3)
    assert above[2:] == pytest.approx(scaled_to(right, 0.02)[1:], rel=1e-3)


def test_one_pulse_as_a_table_holds_at_every_reversal() -> None:
    pulse = Pulse(0.1, 1e-3, 0.05, 0.04, -2e-4)
    for a in (0.0, 1e-3, 10.0):
        assert tuple(shape_at(constant_table(pulse), a)) == tuple(pulse)

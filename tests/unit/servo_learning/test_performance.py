"""Indicators against hand calculation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from path_deviation import path_deviation

from servo_ctrl.learning.performance import (
    FittedCircle,
    circle_deviation,
    combined,
    commanded_circle,
    evaluation_m,
    indicators,
    reversals,
    window_samples,
)


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ([0, 1, 2, 3], []),
        ([0, 1, 2, 1, 0], [3]),
        ([0, 1, 1, 1, 0], [4]),  # a rest in between: the new direction begins at 4
        ([0, 1, 1, 1, 2], []),  # a rest is not a reversal
        ([0, 0, -1, 0, -1], [3, 4]),
        ([5, 5, 5], []),
        ([5], []),
    ],
)
def test_a_reversal_is_the_first_sample_of_the_new_direction(
    command: list[float], expected: list[int]
) -> None:
    assert reversals(np.array(command, dtype=np.float64)).tolist() == expected


def test_a_circle_reverses_each_axis_twice_a_turn() -> None:
    angle = np.linspace(0.1, 0.1 + 2 * math.pi, 1000)
    for position, at in (
        (np.cos(angle), [math.pi, 2 * math.pi]),
        (np.sin(angle), [math.pi / 2, 3 * math.pi / 2]),
    ):
        found = angle[reversals(position)]
        step = angle[1] - angle[0]
        assert ((found > at) & (found <= np.array(at) + 2 * step)).all()


def test_indicators_equal_a_hand_calculation() -> None:
    command = np.array([0.0, 1.0, 2.0, 1.0, 0.0, -1.0, 0.0, 1.0])
    error = np.array([9.0, 9.0, 9.0, 3.0, -4.0, 9.0, -1.0, 7.0])
    contour = np.array([8.0, 8.0, 8.0, -2.0, 1.0, 8.0, 0.5, 0.0])
    first, second = indicators(command, command - error, contour, 2)
    assert (first.reversal, first.direction) == (3, -1)
    assert (first.error_peak_m, first.error_mean_m, first.contour_peak_m) == (4.0, 3.5, 2.0)
    assert first.error_rms_m == pytest.approx(math.sqrt(12.5))
    assert (second.reversal, second.direction) == (6, 1)
    assert (second.error_peak_m, second.error_mean_m, second.contour_peak_m) == (7.0, 4.0, 0.5)
    assert first.error_mean_m == evaluation_m(error[3:5])

    both = combined([first, second])
    assert (both.error_peak_m, both.error_mean_m, both.contour_peak_m) == (7.0, 3.75, 2.0)
    assert both.error_rms_m == pytest.approx(math.sqrt((9 + 16 + 1 + 49) / 4))


def test_a_window_that_is_cut_off_does_not_count() -> None:
    command = np.array([0.0, 1.0, 0.0, -1.0])
    zeros = np.zeros(4)
    assert len(indicators(command, command, zeros, 2)) == 1
    assert indicators(command, command, zeros, 3) == []


def test_a_sample_that_is_missing_shows_as_no_number() -> None:
    command = np.array([0.0, 1.0, 0.0, -1.0])
    scale = np.array([0.0, 1.0, math.nan, -1.0])
    (entry,) = indicators(command, scale, np.zeros(4), 2)
    assert math.isnan(entry.error_peak_m)
    assert math.isnan(entry.error_mean_m)


def test_combining_no_indicators_is_an_error() -> None:
    with pytest.raises(ValueError, match="no reversal"):
        combined([])


@pytest.mark.parametrize(("window_s", "samples"), [(0.2, 200), (0.0004, 1), (0.0026, 3)])
def test_the_monitoring_time_in_samples(window_s: float, samples: int) -> None:
    assert window_samples(window_s, 1e-3) == samples


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(1e-3, 0.1), st.floats(0.5, 2 * math.pi))
def test_the_commanded_circle_is_found_from_its_positions(
    x0: float, y0: float, radius: float, arc: float
) -> None:
    angle = np.linspace(0.3, 0.3 + arc, 500)
    circle = commanded_circle(x0 + radius * np.cos(angle), y0 + radius * np.sin(angle))
    assert circle.centre_m == pytest.approx((x0, y0), abs=1e-9)
    assert circle.radius_m == pytest.approx(radius, abs=1e-9)


def test_positions_on_a_line_are_on_no_circle() -> None:
    x = np.linspace(0.0, 0.1, 50)
    with pytest.raises(ValueError, match="no circle"):
        commanded_circle(x, 2 * x)


def test_circle_deviation_is_the_radial_error() -> None:
    circle = FittedCircle((0.01, 0.02), 0.025)
    angle = np.array([0.0, 1.0, 2.0])
    radius = 0.025 + np.array([5e-6, -3e-6, 0.0])
    found = circle_deviation(circle, 0.01 + radius * np.cos(angle), 0.02 + radius * np.sin(angle))
    np.testing.assert_allclose(found, [5e-6, -3e-6, 0.0], atol=1e-16)


def test_path_deviation_of_a_circle_is_its_radial_error_turned_round() -> None:
    # counterclockwise, left is towards the centre
    angle = np.linspace(0.0, 2 * math.pi, 20_001)
    unit = np.column_stack((np.cos(angle), np.sin(angle)))
    outwards = 5e-6 * np.sin(3 * angle)
    lag = np.column_stack((unit[:, 1], -unit[:, 0])) * 2e-6
    actual = (0.025 + outwards)[:, np.newaxis] * unit + lag
    radial = circle_deviation(FittedCircle((0.0, 0.0), 0.025), actual[:, 0], actual[:, 1])
    found = path_deviation(0.025 * unit, actual)
    np.testing.assert_allclose(found[1:], -radial[1:], atol=2e-9)


def test_path_deviation_ignores_what_lies_along_the_path_and_keeps_its_direction_at_rest() -> None:
    command = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0], [2.0, 0.0]])
    error = np.array([[0.0, 0.5], [0.3, 0.2], [-0.3, -0.2], [0.7, 0.1], [0.0, 0.0]])
    np.testing.assert_allclose(path_deviation(command, command + error), [0.5, 0.2, -0.2, 0.1, 0.0])


def test_path_deviation_without_any_motion_is_the_length_of_the_error() -> None:
    command = np.ones((3, 2))
    np.testing.assert_allclose(path_deviation(command, command + np.array([3.0, 4.0])), 5.0)

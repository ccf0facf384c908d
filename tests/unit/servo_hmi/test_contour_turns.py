"""Turns of a circle in rows, against circles whose centre, radius, feed and error are known."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from path_deviation import path_deviation

from kernels.arrays import Array
from servo_ctrl.hmi.charts.frames import normal_error, path_points
from servo_ctrl.hmi.contour.options import joined, magnification, polar_points, quadrant_points
from servo_ctrl.hmi.contour.turns import PlaneRows, compensation_in, glitches_m, newest_turn, since_reversal
from servo_ctrl.plots.contour_traces import ContourTrace
from servo_ctrl.recording.min_max import thinned

CENTRE_M = (0.12, -0.03)
FEED_M_S = 0.05


def circle_rows(
    turns: float, radial_m: Callable[[Array], Array], direction: int = 1, segment: float = 4.0
) -> PlaneRows:
    """A circle of R = 20 mm at constant speed, the table off by `radial_m` of the angle."""
    radius_m = 0.02
    count = round(turns * 2.0 * math.pi * radius_m / FEED_M_S * 1e3)
    angle = direction * np.arange(count) * FEED_M_S * 1e-3 / radius_m
    unit = np.column_stack((np.cos(angle), np.sin(angle)))
    tangent = direction * np.column_stack((-np.sin(angle), np.cos(angle)))
    return PlaneRows(
        cycle=np.arange(count) + 700.0,
        segment=np.full(count, segment),
        command_m=radius_m * unit + CENTRE_M,
        velocity_m_s=FEED_M_S * tangent,
        actual_m=(radius_m + radial_m(angle))[:, np.newaxis] * unit + CENTRE_M,
        pulse_m_s=np.zeros((count, 2)),
        disturbance_n=np.zeros((count, 2)),
    )


def put_together(*parts: PlaneRows) -> PlaneRows:
    rows = PlaneRows(*(np.concatenate(same) for same in zip(*parts, strict=True)))
    return rows._replace(cycle=np.arange(len(rows.cycle)) + 700.0)


@pytest.mark.parametrize("direction", [1, -1])
def test_the_circle_is_found_and_the_error_by_its_angle(direction: int) -> None:
    rows = circle_rows(1.4, lambda angle: 3e-6 * np.cos(2.0 * angle), direction)
    turn = newest_turn(rows, 0)
    assert turn is not None
    assert turn.direction == direction
    assert turn.circle.centre_m == pytest.approx(CENTRE_M, abs=1e-12)
    assert turn.circle.radius_m == pytest.approx(0.02, abs=1e-12)
    assert turn.feed_m_s == pytest.approx(FEED_M_S)
    assert turn.last_cycle == rows.cycle[-1]
    assert abs(turn.trace.angle_rad[-1] - turn.trace.angle_rad[0]) == pytest.approx(2.0 * math.pi, abs=3e-3)
    expected = 3e-6 * np.cos(2.0 * turn.trace.angle_rad)
    np.testing.assert_allclose(turn.trace.radial_error_m, expected, atol=1e-12)


def test_the_fitted_circle_shows_offset_and_radius_of_the_actual_path() -> None:
    rows = circle_rows(1.1, lambda angle: np.full(len(angle), 2e-6))
    rows = rows._replace(actual_m=rows.actual_m + np.array((5e-6, -4e-6)))
    turn = newest_turn(rows, 0)
    assert turn is not None
    assert turn.fitted.centre_m == pytest.approx((CENTRE_M[0] + 5e-6, CENTRE_M[1] - 4e-6), abs=1e-10)
    assert turn.fitted.radius_m == pytest.approx(0.020002, abs=1e-10)
    assert np.abs(turn.fitted_trace.radial_error_m).max() < 1e-9
    assert np.abs(turn.trace.radial_error_m).max() > 6e-6


def test_less_than_a_turn_a_line_and_a_gap_are_no_turn() -> None:
    def exact(angle: Array) -> Array:
        return np.zeros(len(angle))

    whole = circle_rows(1.5, exact)
    assert newest_turn(circle_rows(0.9, exact), 0) is None
    assert newest_turn(whole, int(whole.cycle[-1]) - 1000) is None
    gap = whole._replace(cycle=whole.cycle + (np.arange(len(whole.cycle)) > len(whole.cycle) // 2))
    assert newest_turn(gap, 0) is None
    line = whole._replace(
        command_m=np.outer(np.arange(len(whole.cycle)), (5e-5, 0.0)),
        velocity_m_s=whole.velocity_m_s * 0 + 0.035,
    )
    assert newest_turn(line, 0) is None
    assert newest_turn(PlaneRows(*(part[:0] for part in whole)), 0) is None


def test_rest_before_and_after_a_circle_changes_nothing() -> None:
    circle = circle_rows(1.3, lambda angle: 1e-6 * np.sin(angle))
    rest = PlaneRows(*(np.repeat(part[-1:], 300, axis=0) for part in circle))
    rest = rest._replace(velocity_m_s=np.zeros((300, 2)), segment=np.full(300, 5.0))
    alone, among = newest_turn(circle, 0), newest_turn(put_together(rest, circle, rest), 0)
    assert alone is not None
    assert among is not None
    np.testing.assert_array_equal(among.trace.radial_error_m, alone.trace.radial_error_m)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_glitch_has_its_height_at_its_reversal_and_its_sign(direction: int) -> None:
    heights = (4e-6, -3e-6, 2e-6, 5e-6)

    def bumps(angle: Array) -> Array:
        trace = ContourTrace("", angle, np.zeros(len(angle)))
        parts = []
        for place, height in enumerate(heights):
            behind = np.degrees(since_reversal(trace.angle_rad, place))
            parts.append(height * np.exp(-(((behind - 6.0) / 1.5) ** 2)))  # 6 degrees behind it, 1e-7 at it
        return np.sum(parts, axis=0) + 7e-6  # an error of size is not a glitch

    turn = newest_turn(circle_rows(1.2, bumps, direction), 0)
    assert turn is not None
    assert glitches_m(turn.trace) == pytest.approx(heights, rel=3e-3)  # a sample is 0.14 degrees


def test_the_compensation_is_what_acted_on_the_axes() -> None:
    nothing, something = np.zeros((5, 2)), np.eye(5, 2)
    assert compensation_in(nothing, nothing) == "without"
    assert compensation_in(something, nothing) == "pulse"
    assert compensation_in(nothing, something) == "observer"
    assert compensation_in(something, something) == "both"
    assert compensation_in(nothing * np.nan, nothing) == "without"


POINTS = st.lists(st.tuples(*[st.integers(-50, 50)] * 4), min_size=1, max_size=60).map(
    lambda rows: np.array(rows, dtype=np.float64)
)


@given(POINTS)
def test_the_length_of_the_normal_error_is_the_path_deviation(rows: Array) -> None:
    length = np.hypot(*normal_error(rows[:, :2], rows[:, 2:]).T)
    moved = np.flatnonzero(np.hypot(*np.diff(rows[:, :2], axis=0).T)) + 1
    if len(moved):  # before the first motion there is no normal here, and the first one's there
        deviation = np.abs(path_deviation(rows[:, :2], rows[:, 2:]))
        np.testing.assert_allclose(length[moved[0] :], deviation[moved[0] :], atol=1e-9)


@given(POINTS, st.integers(1, 9), st.integers(0, 8))
def test_a_path_keeps_of_each_bucket_the_row_that_is_farthest_off(
    rows: Array, bucket: int, lead: int
) -> None:
    lead %= bucket
    drawn = np.frombuffer(path_points(rows, bucket, lead, 2.0)).reshape(4, -1)
    off = normal_error(rows[:, :2], rows[:, 2:])
    size = np.hypot(*off.T)
    number = (np.arange(len(rows)) + lead) // bucket
    assert drawn.shape[1] == number[-1] + 1
    for place in range(drawn.shape[1]):
        inside = np.flatnonzero(number == place)
        best = inside[np.argmax(size[inside])]
        np.testing.assert_allclose(drawn[:2, place], rows[best, :2])
        np.testing.assert_allclose(drawn[2:, place], rows[best, :2] + 2.0 * off[best])


def test_the_polar_picture_keeps_the_highest_peak_and_is_closed() -> None:
    def spike(angle: Array) -> Array:
        error = np.zeros(len(angle))
        error[-1000] = 9e-6
        return error

    turn = newest_turn(circle_rows(1.2, spike), 0)
    assert turn is not None
    shown = magnification([turn.trace], turn.circle.radius_m, 0.0)
    assert shown.division_m == pytest.approx(5e-6)
    assert shown.factor == pytest.approx(0.02 / 4.0 / 5e-6)
    points = polar_points(turn.trace, turn, shown.factor)
    assert np.hypot(*points).max() == pytest.approx(0.02 + shown.factor * 9e-6)
    np.testing.assert_array_equal(points[:, 0], points[:, -1])
    assert points.shape[1] <= 1441
    assert magnification([turn.trace], 0.02, 1000.0) == pytest.approx(
        (1000.0, 5e-6)
    )  # a division is a quarter of R


def test_a_quadrant_begins_before_its_reversal_and_every_angle_rises() -> None:
    turn = newest_turn(circle_rows(1.2, lambda angle: 1e-6 * np.sin(angle), -1), 0)
    assert turn is not None
    for place in range(4):
        degrees, error_m = quadrant_points(turn.trace, place)
        assert (np.diff(degrees) > 0.0).all()
        assert degrees[0] == pytest.approx(-10.0, abs=0.3)
        assert degrees[-1] == pytest.approx(25.0, abs=0.3)
        angle = math.pi / 2 * place - np.radians(degrees)  # clockwise
        np.testing.assert_allclose(error_m, 1e-6 * np.sin(angle), atol=1e-11)


def test_parts_of_different_lengths_make_one_payload() -> None:
    payload, points = joined([np.ones((2, 3)), np.zeros((2, 1))])
    table = np.frombuffer(payload).reshape(4, points)
    np.testing.assert_array_equal(table[3], [0.0, np.nan, np.nan])
    assert thinned(np.arange(3.0), np.arange(3.0), 100)[0].tolist() == [0.0, 1.0, 2.0]

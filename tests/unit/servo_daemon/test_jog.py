"""Jogging: for any requests within all limits, and at standstill without renewal."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.jog import Jog, JogLimits, stoppable_m_s

T = 1e-3
LIMITS = (JogLimits(-0.01, 0.015, 0.2, 2.0), JogLimits(-0.1, 0.1, 0.1, 5.0))
RENEWAL = 250


def run(jog: Jog, cycles: int) -> np.ndarray:
    """Rows (n, 2, fields), until the jog ends."""
    rows = []
    for cycle in range(cycles):
        row = jog.advance(cycle)
        if row is None:
            break
        rows.append(row)
    return np.array(rows).reshape(len(rows), 2, REFERENCE_FIELDS)


def made(start_m: tuple[float, float] = (0.0, 0.0), renewal: int = RENEWAL) -> Jog:
    return Jog(start_m, LIMITS, T, renewal)


def test_axis_that_is_not_renewed_comes_to_rest() -> None:
    jog = made()
    jog.request_velocity(1, 0.05)
    rows = run(jog, 10_000)
    velocity = rows[:, 1, 1]
    ramp = 0.05 / 5.0 / T
    assert velocity.max() == 0.05
    assert len(rows) == RENEWAL + ramp
    assert velocity[-1] == 0.0
    assert jog.ended
    # v (t - v/a): the time it was asked for, with a ramp at either end
    assert rows[-1, 1, 0] == pytest.approx(0.05 * RENEWAL * T, abs=1e-12)
    assert not rows[:, 0, 1:].any(), "the other axis stays"


def test_renewed_axis_goes_on_and_zero_stops_it() -> None:
    jog = made()
    for _ in range(8):
        jog.request_velocity(1, -0.02)
        run(jog, 200)
    jog.request_velocity(1, 0.0)
    rows = run(jog, 1000)
    assert len(rows) == pytest.approx(0.02 / 5.0 / T, abs=1)
    assert rows[-1, 1, 0] == pytest.approx(-0.02 * 8 * 0.2, abs=1e-9)


def test_two_axes_jog_at_once_each_with_its_own_timeout() -> None:
    jog = made()
    jog.request_velocity(0, 0.01)
    first = run(jog, 150)
    jog.request_velocity(1, -0.03)
    rows = np.concatenate((first, run(jog, 1000)))
    assert np.flatnonzero(rows[:, 0, 1])[-1] == RENEWAL + 0.01 / 2.0 / T - 2
    assert np.flatnonzero(rows[:, 1, 1])[-1] == 150 + RENEWAL + 0.03 / 5.0 / T - 2


def test_axis_brakes_as_late_as_it_can_before_its_limit_and_stands_on_it() -> None:
    jog = made(renewal=10_000)
    jog.request_velocity(0, 0.2)
    rows = run(jog, 5000)
    assert rows[-1, 0, 0] == pytest.approx(0.015, abs=1e-12)
    assert rows[:, 0, 0].max() <= 0.015 + 1e-15
    # up and down at 2 m/s^2 over 15 mm: no way is faster
    assert len(rows) == pytest.approx(2.0 * np.sqrt(0.015 / 2.0) / T, abs=4)


def test_axis_beyond_its_limit_may_only_come_back() -> None:
    jog = made((0.02, 0.0))
    jog.request_velocity(0, 0.1)
    assert not run(jog, 100)[:, 0, 1].any()
    jog.request_velocity(0, -0.1)
    rows = run(jog, 100)
    assert rows[-1, 0, 0] < 0.0155


asked = st.lists(
    st.tuples(st.integers(0, 120), st.integers(0, 1), st.floats(-0.5, 0.5)), min_size=1, max_size=25
)


@settings(max_examples=60, deadline=None)
@given(asked=asked, start=st.tuples(st.floats(-0.01, 0.015), st.floats(-0.1, 0.1)))
def test_jogging_stays_within_velocity_acceleration_and_travel(
    asked: list[tuple[int, int, float]], start: tuple[float, float]
) -> None:
    jog = made(start, renewal=100)
    parts = [np.array([[[x, 0.0, 0.0, 0.0] for x in start]])]
    for cycles, axis, velocity_m_s in asked:
        jog.request_velocity(axis, velocity_m_s)
        parts.append(run(jog, cycles))
    parts.append(run(jog, 1000))
    rows = np.concatenate([part for part in parts if len(part)])
    assert jog.ended
    for axis, limits in enumerate(LIMITS):
        position, velocity, acceleration = rows[:, axis, 0], rows[:, axis, 1], rows[:, axis, 2]
        assert limits.lowest_m - 1e-12 <= position.min() <= position.max() <= limits.highest_m + 1e-12
        assert np.abs(velocity).max() <= limits.velocity_m_s
        assert np.abs(acceleration).max() <= limits.acceleration_m_s2 * (1.0 + 1e-9)
        assert np.diff(velocity) / T == pytest.approx(acceleration[1:], abs=1e-9)
        # constant acceleration from cycle to cycle: the mean velocity is the velocity of the positions
        assert np.diff(position) / T == pytest.approx(0.5 * (velocity[1:] + velocity[:-1]), abs=1e-9)
        assert velocity[-1] == 0.0


@settings(max_examples=200, deadline=None)
@given(way=st.floats(0.0, 0.5), before=st.floats(-0.2, 0.2), change=st.floats(1e-4, 1e-2))
def test_largest_velocity_from_which_an_axis_still_stops(way: float, before: float, change: float) -> None:
    def needed_m(velocity: float) -> float:
        periods = np.ceil(velocity / change - 1e-9)
        return 0.5 * (before + velocity) * T + 0.5 * velocity * periods * T

    found = stoppable_m_s(way, before, change, T)
    if needed_m(0.0) > way:
        assert found == 0.0
        return
    assert needed_m(found) <= way + 1e-12
    assert needed_m(found + 1e-6 + 1e-6 * found) > way

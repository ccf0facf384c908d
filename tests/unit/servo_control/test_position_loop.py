"""The PID position loop against its transfer function, at its limit and behind a gap."""

import math

import numpy as np
import pytest
from compensation_off import NO_FUZZY
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from servo_ctrl.control import position_loop
from servo_ctrl.control.position_loop import velocity_setpoint

T = 1e-3
START = position_loop.State(0.0, 0.0, 0.0)
WIDE = 1e9


def setpoints(
    p: position_loop.Params,
    errors: np.ndarray,
    added: float = 0.0,
    limit: float = WIDE,
    state: position_loop.State = START,
) -> tuple[np.ndarray, position_loop.State]:
    """Velocity set points for a given course of the error, and the last state."""
    found = []
    for error in errors.tolist():
        wanted, state = velocity_setpoint(p, NO_FUZZY, state, error, added, limit, T)
        found.append(wanted)
    return np.array(found), state


@pytest.mark.parametrize(
    ("kp", "ki", "kd", "blend"), [(40.0, 300.0, 0.05, 0.2), (0.0, 0.0, 1.0, 1.0), (25.0, 0.0, 0.3, 0.5)]
)
def test_pid_equals_the_discrete_transfer_function(kp: float, ki: float, kd: float, blend: float) -> None:
    # v/e = kp + ki T z / (z - 1) + kd (b / T) (z - 1) / (z - 1 + b)
    errors = np.random.default_rng(5).normal(0.0, 1e-4, 400)
    found, _ = setpoints(position_loop.Params(kp, ki, kd, blend, False), errors)
    integral = signal.lfilter([ki * T], [1.0, -1.0], errors)
    change = signal.lfilter([blend / T, -blend / T], [1.0, blend - 1.0], errors)
    expected = kp * errors + integral + kd * change
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_the_change_of_the_error_is_filtered_with_its_time_constant() -> None:
    tau, slope = 4e-3, 0.02
    p = position_loop.Params(0.0, 0.0, 1.0, -math.expm1(-T / tau), False)
    found, _ = setpoints(p, slope * T * np.arange(1, 50))
    np.testing.assert_allclose(found, slope * -np.expm1(-np.arange(1, 50) * T / tau), rtol=1e-9)


def test_behind_a_gap_the_change_of_the_error_goes_on_where_it_was() -> None:
    p = position_loop.Params(0.0, 0.0, 1.0, 0.3, False)
    _, state = setpoints(p, 1e-5 * np.arange(30))
    before = state.change_m_s
    held = state._replace(error_m=math.nan)
    found, state = setpoints(p, np.array([5e-3]), state=held)  # far from the last one
    assert found[0] == state.change_m_s == before
    found, _ = setpoints(p, np.array([5e-3]), state=state)
    assert found[0] == pytest.approx(0.7 * before)


def test_the_integral_takes_no_step_outwards_at_the_limit_and_leaves_it_at_once() -> None:
    p = position_loop.Params(10.0, 500.0, 0.0, 1.0, False)
    found, state = setpoints(p, np.full(5000, 0.02), limit=0.1)  # 0.2 m/s wanted by kp alone
    assert state.integral_m_s == 0.0
    assert (found == 0.2).all()
    found, state = setpoints(p, np.full(3, -1e-4), limit=0.1, state=state)
    assert (found < 0.0).all()
    assert state.integral_m_s == pytest.approx(-3 * 500.0 * T * 1e-4)


def test_a_feedforward_at_the_limit_does_not_wind_the_integral_up() -> None:
    p = position_loop.Params(10.0, 500.0, 0.0, 1.0, False)
    _, state = setpoints(p, np.full(1000, 1e-4), added=0.1, limit=0.1)
    assert state.integral_m_s == 0.0


@settings(deadline=None)
@given(
    st.lists(st.floats(-1e-2, 1e-2), min_size=1, max_size=60),
    st.floats(0.0, 200.0),
    st.floats(0.0, 1e4),
    st.floats(-0.2, 0.2),
)
def test_the_integral_never_grows_beyond_what_the_limit_needs(
    errors: list[float], kp: float, ki: float, added: float
) -> None:
    limit = 0.1
    _, state = setpoints(position_loop.Params(kp, ki, 0.0, 1.0, False), np.array(errors), added, limit)
    assert abs(state.integral_m_s) <= limit + kp * 1e-2 + abs(added) + 1e-12

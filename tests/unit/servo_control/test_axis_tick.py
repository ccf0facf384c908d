"""The control law against closed forms and scipy."""

import math

import numpy as np
import pytest
from compensation_off import NO_FUZZY, NO_LEADING, NO_NOTCH, NO_OBSERVER, NO_PULSE, NO_WAVEFORM, p_loop
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from servo_ctrl.control import position_loop, velocity_loop
from servo_ctrl.control.compensation import disturbance_observer, feedforward
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.presliding_memory import Branch, Turn
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample, Output, Status

T = 1e-3
WIDE = AxisLimits(velocity_m_s=1e9, force_n=1e9, following_error_m=1e9)


def params(
    kp: float = 0.0,
    kv: float = 0.0,
    ki: float = 0.0,
    *,
    blend: float = 1.0,
    vff: float = 0.0,
    mass: float = 0.0,
    limits: AxisLimits = WIDE,
    output: int = 0,
    scale: bool = False,
) -> AxisParams:
    return AxisParams(
        T,
        int(output),
        p_loop(float(kp), scale),
        NO_FUZZY,
        velocity_loop.Params(float(kv), float(ki), 1, float(blend)),
        NO_NOTCH,
        feedforward.Params(float(vff), float(mass)),
        NO_PULSE,
        NO_OBSERVER,
        NO_WAVEFORM,
        *NO_LEADING,
        limits,
    )


def sample(
    x: float = 0.0,
    v: float = 0.0,
    a: float = 0.0,
    motor: float = 0.0,
    scale: float = math.nan,
    offset: float = 0.0,
) -> AxisSample:
    return AxisSample(float(x), float(v), float(a), float(offset), float(motor), float(scale), math.nan)


def test_p_loop_answers_a_step_of_position_as_a_first_order_lag() -> None:
    # velocity-controlled ideal axis: x[k+1] = x[k] + T v*[k]; e[k] = (1 - kp T)^k
    kp, x = 40.0, 0.0
    p, state, errors = params(kp=kp, output=Output.VELOCITY), initial_state(0.0), []
    for _ in range(200):
        state, command = axis_tick(p, state, sample(x=1e-3, motor=x))
        errors.append(command.position_error_m)
        x += T * command.velocity_m_s
    np.testing.assert_allclose(errors, 1e-3 * (1.0 - kp * T) ** np.arange(200), rtol=1e-9)


def test_velocity_feedforward_leaves_no_error_on_an_ideal_velocity_axis() -> None:
    p, state, x = params(kp=40.0, vff=1.0, output=Output.VELOCITY), initial_state(0.0), 0.0
    for k in range(500):
        state, command = axis_tick(p, state, sample(x=0.02 * k * T, v=0.02, motor=x))
        assert abs(command.position_error_m) < 1e-15
        x += T * command.velocity_m_s


def test_feedforward_leaves_no_error_on_an_ideal_double_integrator() -> None:
    # force held over a period: v[k+1] = v[k] + a T, x[k+1] = x[k] + v[k] T + a T^2 / 2 follows a parabola
    # exactly; the velocity loop sees the mean velocity of the last period, so its command is that mean
    mass, acceleration = 60.0, 0.5
    p = params(kp=40.0, kv=2e4, vff=1.0, mass=mass)
    x, v, state = 0.0, 0.0, initial_state(0.0)
    for k in range(1000):
        t = k * T
        mean_velocity = acceleration * (t - 0.5 * T) if k else 0.0
        wanted = sample(x=0.5 * acceleration * t * t, v=mean_velocity, a=acceleration, motor=x)
        state, command = axis_tick(p, state, wanted)
        assert abs(command.position_error_m) < 1e-12
        a = command.force_n / mass
        x, v = x + v * T + 0.5 * a * T * T, v + a * T


def test_pi_velocity_loop_equals_the_discrete_transfer_function() -> None:
    # u/e = kv + ki T z / (z - 1); e is a given velocity error (motor at rest, velocity by feedforward)
    kv, ki = 2e4, 1e6
    error = np.random.default_rng(1).normal(0.0, 1e-3, 400)
    p, state, force = params(kv=kv, ki=ki, vff=1.0), initial_state(0.0), []
    for e in error:
        state, command = axis_tick(p, state, sample(v=e))
        force.append(command.force_n)
    _, expected = signal.dlsim(([kv + ki * T, -kv], [1.0, -1.0], T), error)
    np.testing.assert_allclose(force, expected[:, 0], rtol=1e-9, atol=1e-9)


def test_velocity_filter_is_a_first_order_lag_at_the_samples() -> None:
    tau = 5e-3
    p, state = params(blend=1.0 - math.exp(-T / tau)), initial_state(0.0)
    estimates = []
    for k in range(1, 60):
        state, command = axis_tick(p, state, sample(motor=0.1 * k * T))
        estimates.append(command.motor_velocity_m_s)
    expected = 0.1 * (1.0 - np.exp(-np.arange(1, 60) * T / tau))
    np.testing.assert_allclose(estimates, expected, rtol=1e-9)


@settings(deadline=None)  # the first may have to compile
@given(
    st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=60),
    st.floats(0.0, 1e5),
    st.floats(0.0, 1e8),
    st.floats(1.0, 1e3),
)
def test_neither_force_nor_integral_ever_exceeds_the_limit(
    errors: list[float], kv: float, ki: float, limit: float
) -> None:
    p = params(kv=kv, ki=ki, vff=1.0, limits=AxisLimits(1e9, limit, 1e9))
    state = initial_state(0.0)
    for e in errors:
        state, command = axis_tick(p, state, sample(v=e))
        assert abs(command.force_n) <= limit
        assert abs(state.velocity_loop.integral_n) <= limit


def test_integral_stops_while_the_force_saturates_and_recovers_at_once() -> None:
    limit = 100.0
    p = params(kv=1e4, ki=1e5, vff=1.0, limits=AxisLimits(1e9, limit, 1e9))
    state = initial_state(0.0)
    for _ in range(10_000):  # 10 s of an error that the limit cannot answer
        state, command = axis_tick(p, state, sample(v=1.0))
        assert command.saturated
    assert state.velocity_loop.integral_n == 0.0
    _, command = axis_tick(p, state, sample(v=-0.001))
    assert command.force_n < 0.0
    assert not command.saturated


def test_velocity_setpoint_is_limited() -> None:
    p = params(kp=100.0, output=Output.VELOCITY, limits=AxisLimits(0.2, 1e9, 1e9))
    _, command = axis_tick(p, initial_state(0.0), sample(x=1.0))
    assert command.velocity_m_s == 0.2
    assert command.saturated


@pytest.mark.parametrize("output", [Output.VELOCITY, Output.POSITION])
def test_where_the_amplifier_closes_the_velocity_loop_it_gets_the_mass_as_an_offset(output: Output) -> None:
    p = params(kp=40.0, kv=2e4, ki=1e6, mass=60.0, output=output)
    state, command = axis_tick(p, initial_state(0.0), sample(x=1e-3, a=0.5, offset=7.0))
    assert command.force_n == 0.0
    assert command.force_offset_n == 37.0
    assert command.position_m == 1e-3
    assert command.velocity_m_s == 0.04
    assert state.velocity_loop.integral_n == 0.0


def test_force_offset_passes_behind_the_limit() -> None:
    p = params(kp=1.0, kv=1e6, limits=AxisLimits(1e9, 100.0, 1e9))
    _, command = axis_tick(p, initial_state(0.0), sample(x=1.0, offset=176.0))
    assert command.force_n == 100.0
    assert command.force_offset_n == 176.0


def test_the_position_loop_is_closed_on_the_scale_where_that_is_wanted() -> None:
    on_scale = axis_tick(
        params(kp=10.0, scale=True), initial_state(0.0), sample(x=1.0, motor=0.5, scale=0.25)
    )
    on_motor = axis_tick(params(kp=10.0), initial_state(0.0), sample(x=1.0, motor=0.5, scale=0.25))
    assert on_scale[1].position_error_m == 0.75
    assert on_motor[1].position_error_m == 0.5


@pytest.mark.parametrize(
    ("bad", "status"),
    [
        ({"x": math.nan}, Status.BAD_COMMAND),
        ({"v": math.inf}, Status.BAD_COMMAND),
        ({"a": math.nan}, Status.BAD_COMMAND),
        ({"offset": math.nan}, Status.BAD_COMMAND),
        ({"motor": math.nan}, Status.BAD_MOTOR_SAMPLE),
        ({"scale": math.nan}, Status.BAD_SCALE_SAMPLE),
        ({"motor": math.inf, "scale": math.nan}, Status.BAD_MOTOR_SAMPLE | Status.BAD_SCALE_SAMPLE),
    ],
)
def test_a_bad_sample_gives_a_status_and_keeps_the_last_commands(
    bad: dict[str, float], status: Status
) -> None:
    p = params(kp=40.0, kv=2e4, ki=1e6, scale=True)
    good = {"x": 1e-5, "motor": 0.0, "scale": 0.0}
    state, before = axis_tick(p, initial_state(0.0), sample(**good))
    held, command = axis_tick(p, state, sample(**{**good, **bad}))
    assert Status(command.status) == status
    assert command.force_n == before.force_n
    assert command.velocity_m_s == before.velocity_m_s
    assert math.isfinite(command.position_m)
    assert math.isfinite(command.force_offset_n)
    assert held.velocity_loop.integral_n == state.velocity_loop.integral_n
    passed_on = held._replace(
        observer=disturbance_observer.State(0.0, 0.0, 0.0),
        position_loop=position_loop.State(0.0, 0.0, 0.0),
        waveform=held.waveform._replace(
            branch=Branch(0.0, *[Turn(0.0, 0.0)] * 5)
        ),  # what is forgotten is infinite
    )
    assert "nan" not in repr(passed_on)
    assert "inf" not in repr(passed_on)


def test_an_absent_scale_does_not_matter_to_a_loop_on_the_motor() -> None:
    _, command = axis_tick(params(kp=1.0), initial_state(0.0), sample(scale=math.nan))
    assert command.status == Status.OK


def test_a_gap_in_the_motor_samples_leaves_the_velocity_as_it_was() -> None:
    p, state = params(kv=1.0), initial_state(0.0)
    for k in range(1, 20):
        missing = k in {10, 11}
        state, command = axis_tick(p, state, sample(motor=math.nan if missing else 0.05 * k * T))
        assert command.motor_velocity_m_s == pytest.approx(0.05, rel=1e-9)


def test_a_following_error_is_reported_and_the_loop_goes_on() -> None:
    p = params(kp=1.0, kv=100.0, limits=AxisLimits(1e9, 1e9, 1e-3))
    _, command = axis_tick(p, initial_state(0.0), sample(x=2e-3))
    assert Status(command.status) == Status.FOLLOWING_ERROR
    assert command.force_n == pytest.approx(0.2)


def test_an_axis_cannot_start_at_a_non_finite_position() -> None:
    with pytest.raises(ValueError, match="cannot start"):
        initial_state(math.nan)
